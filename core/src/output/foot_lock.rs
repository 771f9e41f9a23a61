//! Feet that stand stay where they are.
//!
//! A regression moves the feet of its output a few centimetres while they should stand. Here, behind the prediction and
//! without a look ahead, each foot that stands ([`crate::methods::mixture::contact_votes`]) is held by the joint that carries it, heel (ankle) or
//! toes, whichever is lower:
//!
//! 1. At foot-down the place where the foot has come down is remembered; nothing moves yet. From then on the foot's
//!    **offset** is what takes it back there. When the weight goes from heel to toes, the toes are held where they were.
//! 2. The root follows its feet: what standing feet slide on and on, forward and sideways, is the root's speed that does
//!    not agree with its legs. It is learnt over a few steps and taken off the root, all of it in a stream's first frames;
//!    the legs take the rest. Where a held foot is out of a leg's reach, the root stays behind.
//! 3. Heights go to the floor: the root takes what all standing feet have in common, slowly (a critically damped
//!    spring), and comes down where a leg would be stretched beyond its length; the legs take the rest.
//! 4. At foot-up the offset is eased out by a smoothstep; a foot that comes down meanwhile is held where it then is. A foot
//!    that has come further than `release_m` from where the prediction has it does not slide there but **steps**: it is
//!    lifted a little, stands on nothing meanwhile, and is held again when it has come down.
//! 5. No foot goes through the floor, in the air or held: what is lower than 1 cm under where it stands is lifted.
//! 6. Each leg meets its target by [`crate::body::two_bone_ik`].
//!
//! The prediction fed back stays as it was: this is on the way out alone.
//! Source: paper 000, section 6; Kovar, Schreiner and Gleicher 2002 ("Footskate cleanup"), in a causal form.
//! Cost: 5,500 instructions a frame on a Cortex-M4F, 8,000 at most.

use crate::{
    blob::{Database, Leg},
    body::{pose::Pose, two_bone_ik::Chain},
    math::{
        clamp, exp,
        quaternion::{IDENTITY, Vector, rotate},
        sqrt,
        vector::{add, norm, subtract},
    },
};

/// Time constant of the root's own correction of its speed, seconds of standing, and the most that it comes to, m/s.
const LEARN_S: f32 = 0.25;
const DRIFT_SPEED: f32 = 0.8;
/// Rate of the spring that moves the root's height, 1/s.
const ROOT_RATE: f32 = 6.0;
/// Time constant of a standing foot's way to the floor, seconds, and the most that it goes, m/s.
const SETTLE_S: f32 = 0.08;
const SETTLE_SPEED: f32 = 0.25;
/// The most that the root comes down for a stretched leg, metres.
const STOOP_M: f32 = 0.04;
/// Time constant of its way up again, seconds.
const STOOP_S: f32 = 0.15;
/// How fast it comes down at most, m/s.
const STOOP_SPEED: f32 = 0.5;
/// How fast feet that are held take it along on the ground at most, m/s.
const PULL_SPEED: f32 = 2.0;
/// How fast the floor under a foot follows what the caller says, m/s.
const FLOOR_SPEED: f32 = 0.8;
/// Part of its length that a leg is stretched to by a lock.
const STRETCH: f32 = 0.995;
/// A foot may be this much lower than where it stands: toes bend, soles are soft. Metres.
const SOFT_M: f32 = 0.01;
/// A foot whose prediction is this high over the floor does not stand, whatever its neighbors say. Metres.
const UP_M: f32 = 0.06;
/// By how much the other joint has to be lower before it carries the foot, metres.
const HANDOVER_M: f32 = 0.0005;
/// How fast an offset is eased out at most, m/s: a large one takes longer than a small one.
const RETURN_SPEED: f32 = 0.3;
/// How fast a foot steps at most, m/s.
const STEP_SPEED: f32 = 1.0;
/// How high it steps, as a part of its way, and at most, metres.
const STEP_LIFT: f32 = 0.15;
const STEP_LIFT_M: f32 = 0.03;
/// A body that is further from its foot than this has not gone there: the foot is there at once, metres.
const TELEPORT_M: f32 = 1.0;
/// The height over the floor of toes that are not there.
const NEVER_M: f32 = 1e3;

/// What a foot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
enum Phase {
    /// In the air: the offset is eased out.
    Free,
    /// Let go while it stands: it steps to where the prediction has it.
    Step,
    /// Held by the ankle.
    Heel,
    /// Held by the toes.
    Toe,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Foot {
    phase: Phase,
    /// What is added to the ankle's place, metres, the root's lift apart.
    offset: Vector,
    /// Held: the place on the ground (y unused). Free or stepping: the offset when it was let go.
    held: Vector,
    /// Where the joint that does not carry the foot was on the ground in the last frame.
    other: [f32; 2],
    /// Seconds since it was let go.
    age_s: f32,
}

impl Foot {
    const FREE: Self =
        Self { phase: Phase::Free, offset: [0.0; 3], held: [0.0; 3], other: [0.0; 2], age_s: 0.0 };

    fn is_held(&self) -> bool {
        matches!(self.phase, Phase::Heel | Phase::Toe)
    }
}

/// How feet are locked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tuning {
    /// Whether feet are held at all; where not, what has been done is eased out, but for the way that the root has gone.
    pub on: bool,
    /// A foot that is held further than this from where the prediction has it steps there, metres.
    pub release_m: f32,
    /// How long an offset is eased out at least, seconds.
    pub ease_s: f32,
}

/// The locks of both feet: all that is kept between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Lock {
    feet: [Foot; 2],
    /// How much higher the root is than predicted, metres, and how fast that grows, m/s.
    lift: f32,
    rise: f32,
    /// How far the root has come down for a stretched leg, metres, 0 or less.
    stoop: f32,
    /// What is added to the root's speed, forward and left, m/s.
    drift_speed: [f32; 2],
    /// What that has come to, x and z, metres.
    drift: [f32; 2],
    /// For how long the root's speed has been learnt, seconds, [`LEARN_S`] at most.
    learnt_s: f32,
    /// The floor under each foot as the caller says it, metres, and as the feet are led to it.
    wanted_floor: [f32; 2],
    floor: [f32; 2],
}

impl Lock {
    /// No foot held, the floor at height 0.
    pub const fn new() -> Self {
        Self {
            feet: [Foot::FREE; 2],
            lift: 0.0,
            rise: 0.0,
            stoop: 0.0,
            drift_speed: [0.0; 2],
            drift: [0.0; 2],
            learnt_s: 0.0,
            wanted_floor: [0.0; 2],
            floor: [0.0; 2],
        }
    }

    /// Forgets the stream; the floor stays.
    pub fn reset(&mut self) {
        *self = Self { wanted_floor: self.wanted_floor, floor: self.wanted_floor, ..Self::new() };
    }

    /// Heights of the floor under the left and the right foot, metres.
    pub fn set_floor(&mut self, heights: [f32; 2]) {
        self.wanted_floor = heights;
    }

    /// Which feet are held.
    pub fn held(&self) -> [bool; 2] {
        self.feet.map(|f| f.is_held())
    }

    /// How far the feet are from where the prediction has them, metres.
    #[inline(never)]
    pub fn offsets(&self) -> [f32; 2] {
        self.feet.map(|f| norm(f.offset))
    }

    /// Whether a pose would be changed by what is left of held feet.
    pub fn is_engaged(&self) -> bool {
        let moved = |foot: &Foot| foot.is_held() || foot.offset != [0.0; 3];
        let root = [self.lift, self.rise, self.stoop, self.drift[0], self.drift[1]];
        self.feet.iter().any(moved) || root.iter().any(|v| *v != 0.0)
    }

    /// Holds the feet of `pose` that stand; `step_s` is the time since the last pose. Feet that are clearly in the air
    /// or step are taken out of `contacts`. Without legs in the database nothing happens.
    #[inline(never)]
    pub fn hold<const J: usize>(
        &mut self,
        database: &Database<'_>,
        contacts: &mut [bool; 2],
        step_s: f32,
        tuning: Tuning,
        pose: &mut Pose<J>,
    ) {
        let Some(legs) = database.legs() else { return };
        let ahead =
            heading(rotate(pose.rotations.first().copied().unwrap_or(IDENTITY), database.hips_line()));
        self.drift_root(ahead, step_s, pose);
        // Not by `map`, whose copies would take half of this function's stack.
        let [left, right] = &legs;
        let chains = [Chain::of(database, left, pose), Chain::of(database, right, pose)];
        for (floor, wanted) in self.floor.iter_mut().zip(self.wanted_floor) {
            *floor += clamp(wanted - *floor, -FLOOR_SPEED * step_s, FLOOR_SPEED * step_s);
        }
        for ((stands, &floor), (leg, chain)) in
            contacts.iter_mut().zip(&self.floor).zip(legs.iter().zip(&chains))
        {
            *stands = *stands && lower(over_floor(leg, chain, floor - self.lift)) < UP_M;
        }
        let stands = contacts.map(|stands| stands && tuning.on);
        self.lift_root(&legs, &chains, stands, step_s, tuning.on);
        let mut slid = [0.0; 3];
        let feet = self.feet.iter_mut().zip(self.floor.iter().zip(stands));
        for ((foot, (&floor, stands)), (leg, chain)) in feet.zip(legs.iter().zip(&chains)) {
            let over = over_floor(leg, chain, floor - self.lift);
            slid = add(slid, foot.advance(chain, over, stands, step_s, tuning, self.stoop));
        }
        for (stands, foot) in contacts.iter_mut().zip(&self.feet) {
            *stands = *stands && foot.phase != Phase::Step;
        }
        let way = self.learn_drift(slid, ahead, step_s, tuning.on);
        self.move_root(way, &mut pose.position);
        if self.stoop_root(&chains, step_s) {
            let way = self.out_of_reach(&chains, step_s);
            self.move_root(way, &mut pose.position);
        }
        let feet = self.feet.iter().zip(&self.floor);
        for ((leg, chain), (foot, &floor)) in legs.iter().zip(&chains).zip(feet) {
            // The ankle's, before the root goes up or down.
            let mut target = add(chain.ankle, foot.offset);
            if foot.is_held() {
                // A foot that is held does not come down with the root.
                target[1] -= self.stoop;
            } else if tuning.on {
                let over = over_floor(leg, chain, floor - self.lift);
                target[1] += too_deep(over, foot.offset[1] + self.stoop);
            }
            // Nothing to do is done to the bit.
            if norm(subtract(target, chain.ankle)) > 1e-6 {
                chain.place(leg, target, reach(chain), pose);
            }
        }
        pose.position[1] += self.lift + self.stoop;
    }

    /// Moves the root by what has been learnt of its speed.
    fn drift_root<const J: usize>(&mut self, [fx, fz]: [f32; 2], step_s: f32, pose: &mut Pose<J>) {
        let [forward, left] = self.drift_speed;
        // Left of (x, z) is (z, -x): facing +Z it is +X.
        self.drift[0] += (forward * fx + left * fz) * step_s;
        self.drift[1] += (forward * fz - left * fx) * step_s;
        pose.position[0] += self.drift[0];
        pose.position[2] += self.drift[1];
    }

    /// What held feet slide in the prediction, the sum of their ways x and z and in between how many they are, says how
    /// fast the root goes astray. Returns how far it is to go for it at once, x and z.
    fn learn_drift(&mut self, [x, count, z]: Vector, [fx, fz]: [f32; 2], step_s: f32, on: bool) -> [f32; 2] {
        if !on || self.feet.iter().any(|foot| foot.phase == Phase::Step) {
            // What was learnt has taken a foot too far.
            let left = exp(-step_s / LEARN_S);
            (self.drift_speed, self.learnt_s) = (self.drift_speed.map(|v| v * left), 0.0);
            return [0.0; 2];
        }
        if count == 0.0 {
            return [0.0; 2];
        }
        let most = PULL_SPEED * step_s;
        let [x, z] = [x, z].map(|way| clamp(way / count, -most, most));
        for (speed, slid) in self.drift_speed.iter_mut().zip([x * fx + z * fz, x * fz - z * fx]) {
            // A way of a frame, over the frame's time, times the frame's time over the constant.
            *speed = clamp(*speed + slid / LEARN_S, -DRIFT_SPEED, DRIFT_SPEED);
        }
        // All of the first frame's, half of the second's: nothing better is known of a start.
        self.learnt_s = clamp(self.learnt_s + step_s, 1e-3, LEARN_S);
        let part = clamp(step_s / self.learnt_s, 0.0, 1.0);
        [x * part, z * part]
    }

    /// Moves the root on the ground, x and z; held feet stay.
    fn move_root(&mut self, [x, z]: [f32; 2], root: &mut Vector) {
        self.drift = [self.drift[0] + x, self.drift[1] + z];
        *root = add(*root, [x, 0.0, z]);
        for foot in self.feet.iter_mut().filter(|foot| foot.is_held()) {
            foot.offset = subtract(foot.offset, [x, 0.0, z]);
        }
    }

    /// The root takes the height that the standing feet have in common.
    fn lift_root(&mut self, legs: &[Leg; 2], chains: &[Chain; 2], stands: [bool; 2], step_s: f32, on: bool) {
        let (mut sum, mut count) = (0.0, 0.0);
        for (((leg, chain), &floor), stands) in legs.iter().zip(chains).zip(&self.floor).zip(stands) {
            if stands {
                sum -= lower(over_floor(leg, chain, floor));
                count += 1.0;
            }
        }
        // Nobody on the ground: the root goes on as it is.
        let aloft = if on { self.lift } else { 0.0 };
        let wanted = if count > 0.0 { sum / count } else { aloft };
        // Stable at any rate of frames: a step of the spring is at most half a radian.
        let rate = clamp(ROOT_RATE, 0.0, 0.5 / clamp(step_s, 1e-3, 10.0));
        self.rise += step_s * (rate * rate * (wanted - self.lift) - 2.0 * rate * self.rise);
        self.lift += step_s * self.rise;
    }

    /// The root comes down, at once, where a held foot stretches its leg; and goes up again slowly. True where that is
    /// not enough.
    fn stoop_root(&mut self, chains: &[Chain; 2], step_s: f32) -> bool {
        let mut need = 0.0;
        for (foot, chain) in self.feet.iter().zip(chains).filter(|(foot, _)| foot.is_held()) {
            let way = subtract(add(chain.ankle, foot.offset), chain.hip);
            let reach = reach(chain);
            // How far the ankle may be below the hip joint at this distance on the ground.
            let below = sqrt(reach * reach - way[0] * way[0] - way[2] * way[2]);
            let down = way[1] + below;
            need = if down < need { down } else { need };
        }
        let goes = clamp(need, self.stoop - STOOP_SPEED * step_s, 0.0);
        let goes = if goes < -STOOP_M { -STOOP_M } else { goes };
        let risen = self.stoop * exp(-step_s / STOOP_S);
        self.stoop = if goes < risen { goes } else { risen };
        need < self.stoop
    }

    /// How far the root is to go on the ground, x and z, to have the feet that are held within reach: what a leg is too
    /// short by when the root has come down.
    fn out_of_reach(&self, chains: &[Chain; 2], step_s: f32) -> [f32; 2] {
        let mut way = [0.0; 2];
        for (foot, chain) in self.feet.iter().zip(chains).filter(|(foot, _)| foot.is_held()) {
            let hip = add(chain.hip, [way[0], self.stoop, way[1]]);
            let [x, y, z] = subtract(add(chain.ankle, foot.offset), hip);
            let (reach, distance) = (reach(chain), sqrt(x * x + z * z));
            let over = distance - sqrt(reach * reach - y * y);
            if over > 0.0 {
                let part = clamp(over, 0.0, PULL_SPEED * step_s) / distance;
                way = [way[0] + x * part, way[1] + z * part];
            }
        }
        way
    }
}

impl Default for Lock {
    fn default() -> Self {
        Self::new()
    }
}

impl Foot {
    /// A frame on: down, held, from heel to toes, up, or eased out. `over` are the heights of ankle and toes over the
    /// floor that they would stand on. Returns how far a foot that was held before slides in the prediction, x and z,
    /// and 1 in between; zeros of others.
    #[inline]
    fn advance(
        &mut self,
        chain: &Chain,
        over: [f32; 2],
        stands: bool,
        step_s: f32,
        tuning: Tuning,
        stoop: f32,
    ) -> Vector {
        let (phase, [x, _, z]) = (self.phase, self.offset);
        let mut slid = [0.0; 3];
        if !self.is_held() {
            self.ease(step_s, tuning.ease_s);
            // One that steps comes down first.
            if self.phase == Phase::Free && stands {
                self.phase = if over[1] <= over[0] { Phase::Toe } else { Phase::Heel };
                // From now on the root comes down without it.
                self.offset[1] += stoop;
                self.held = add(self.carrier(chain), self.offset);
            }
        } else if stands {
            let lower = match self.phase {
                Phase::Toe if over[0] < over[1] - HANDOVER_M => Phase::Heel,
                Phase::Heel if over[1] < over[0] - HANDOVER_M => Phase::Toe,
                phase => phase,
            };
            if lower != self.phase {
                self.phase = lower;
                self.held = [self.other[0], 0.0, self.other[1]];
            }
        } else {
            self.release(Phase::Free, stoop);
            self.ease(step_s, tuning.ease_s);
        }
        if self.is_held() {
            let carrier = self.carrier(chain);
            self.offset[0] = self.held[0] - carrier[0];
            self.offset[2] = self.held[2] - carrier[2];
            if self.phase == phase {
                slid = [self.offset[0] - x, 1.0, self.offset[2] - z];
            }
            let height = if self.phase == Phase::Toe { over[1] } else { over[0] };
            let settle = (-height - self.offset[1]) * (1.0 - exp(-step_s / SETTLE_S));
            self.offset[1] += clamp(settle, -SETTLE_SPEED * step_s, SETTLE_SPEED * step_s);
            self.offset[1] += too_deep(over, self.offset[1]);
            let off2 = self.offset[0] * self.offset[0] + self.offset[2] * self.offset[2];
            // No release is further than that.
            if off2 > TELEPORT_M * TELEPORT_M {
                *self = Self::FREE;
            } else if off2 > tuning.release_m * tuning.release_m {
                self.release(Phase::Step, stoop);
            }
        }
        let other = if self.phase == Phase::Toe { chain.ankle } else { chain.toe };
        self.other = [other[0] + self.offset[0], other[2] + self.offset[2]];
        slid
    }

    /// Where the joint that carries the foot is predicted.
    fn carrier(&self, chain: &Chain) -> Vector {
        if self.phase == Phase::Toe { chain.toe } else { chain.ankle }
    }

    /// Lets go: from now on the foot comes down with the root, which must not be seen.
    fn release(&mut self, phase: Phase, stoop: f32) {
        self.offset[1] -= stoop;
        (self.phase, self.held, self.age_s) = (phase, self.offset, 0.0);
    }

    /// Eases the offset out.
    fn ease(&mut self, step_s: f32, ease_s: f32) {
        self.age_s += step_s;
        // A smoothstep is steepest in its middle, 1.5 times its mean slope.
        let way = norm(self.held);
        let speed = if self.phase == Phase::Step { STEP_SPEED } else { RETURN_SPEED };
        let least = 1.5 * way / speed;
        let whole = if least > ease_s { least } else { ease_s };
        let t = clamp(self.age_s / whole, 0.0, 1.0);
        let left = 1.0 - t * t * (3.0 - 2.0 * t);
        self.offset = self.held.map(|v| v * left);
        if self.phase == Phase::Step {
            self.offset[1] += clamp(STEP_LIFT * way, 0.0, STEP_LIFT_M) * 4.0 * left * (1.0 - left);
            if t >= 1.0 {
                (self.phase, self.held) = (Phase::Free, [0.0; 3]);
            }
        }
    }
}

/// Direction ahead on the ground, x and z, of a body whose hips line points there.
fn heading(line: Vector) -> [f32; 2] {
    let length = sqrt(line[0] * line[0] + line[2] * line[2]);
    if length > 1e-3 { [-line[2] / length, line[0] / length] } else { [0.0, 1.0] }
}

/// Heights of ankle and toes over where they stand on a floor of that height, metres.
#[inline(never)]
fn over_floor(leg: &Leg, chain: &Chain, floor: f32) -> [f32; 2] {
    let ankle = chain.ankle[1] - leg.heights[0] - floor;
    // Without toes the ankle carries the foot all the time.
    let toe = if leg.toe.is_some() { chain.toe[1] - leg.heights[1] - floor } else { NEVER_M };
    [ankle, toe]
}

/// Height of a foot over the floor of the database, metres.
pub(crate) fn lowest(leg: &Leg, chain: &Chain) -> f32 {
    lower(over_floor(leg, chain, 0.0))
}

/// How much higher a foot has to be, which is so far over where it stands and is lifted already.
fn too_deep(over: [f32; 2], lifted: f32) -> f32 {
    let deep = -SOFT_M - lower(over) - lifted;
    if deep > 0.0 { deep } else { 0.0 }
}

fn lower(over: [f32; 2]) -> f32 {
    if over[1] <= over[0] { over[1] } else { over[0] }
}

/// How far from the hip joint a lock may take the ankle: almost the whole leg, or as far as it is.
#[inline(never)]
fn reach(chain: &Chain) -> f32 {
    let (most, is) = (STRETCH * chain.length(), norm(subtract(chain.ankle, chain.hip)));
    if most > is { most } else { is }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: f32 = 1.0 / 120.0;

    #[test]
    fn a_step_goes_up_and_comes_down_where_the_prediction_is() {
        for (way, highest) in [(0.04, 0.006), (0.2, 0.03), (0.4, 0.03)] {
            let mut foot = Foot { phase: Phase::Toe, offset: [way, 0.0, 0.0], ..Foot::FREE };
            foot.release(Phase::Step, 0.0);
            let (mut most, mut frames, mut before) = (0.0f32, 0, foot.offset);
            while foot.phase == Phase::Step {
                foot.ease(FRAME, 0.1);
                let moved = norm(subtract(foot.offset, before));
                assert!(foot.offset[0] <= before[0] && moved < 1.2 * STEP_SPEED * FRAME, "{way}: {moved}");
                (most, frames, before) = (most.max(foot.offset[1]), frames + 1, foot.offset);
            }
            assert!((0.8 * highest..=highest).contains(&most), "{way}: {most} m high");
            assert!(frames <= (1.5 * way / STEP_SPEED / FRAME) as usize + 12, "{way}: {frames} frames");
            // And stays there.
            foot.ease(FRAME, 0.1);
            assert_eq!((foot.phase, foot.offset), (Phase::Free, [0.0; 3]));
        }
    }
}
