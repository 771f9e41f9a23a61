//! One foot of the lock: in the air, held by heel or toes, stepping, or led back to the prediction.

use crate::{
    blob::Leg,
    body::two_bone_ik::Chain,
    math::{
        clamp, exp,
        quaternion::Vector,
        sqrt,
        vector::{add, norm, subtract},
    },
};

/// Time constant of a standing foot's way to the floor, seconds, and the most that it goes, m/s.
const SETTLE_S: f32 = 0.08;
const SETTLE_SPEED: f32 = 0.25;
/// Part of its length that a leg is stretched to by a lock.
const STRETCH: f32 = 0.995;
/// A foot may be this much lower than where it stands: toes bend, soles are soft. Metres.
const SOFT_M: f32 = 0.01;
/// A foot that is further below the floor neither stands nor is lifted: the body is elsewhere, and is left there. Metres.
pub(super) const DEEPEST_M: f32 = 0.4;
/// The other joint carries the foot when it is lower by this much, metres.
const HANDOVER_M: f32 = 0.0005;
/// Highest speed at which an offset is eased out, m/s: a large offset takes longer than a small one.
const RETURN_SPEED: f32 = 0.25;
/// Votes to stand end late: a foot that leaves the floor slides at 1 m/s and more, with its heel up; one that stands at up
/// to 0.3 m/s. Slower than the first speed it is held whole, faster than the second not at all. m/s.
const LEAVE_SPEED: [f32; 2] = [0.4, 1.0];
/// How far the heel is over the toes of a foot that stands flat, and of one that may leave. Metres.
const HEEL_UP_M: [f32; 2] = [0.02, 0.05];
/// Speed at which the offset of a foot that leaves is eased out: it moves anyway. m/s.
const LEAVE_RETURN_SPEED: f32 = 0.5;
/// Highest speed of a step, m/s.
const STEP_SPEED: f32 = 1.0;
/// Height of a step, as a part of its length, and its maximum, metres.
const STEP_LIFT: f32 = 0.15;
const STEP_LIFT_M: f32 = 0.03;
/// A body that is further from its held foot than this was moved, and did not walk: the foot follows at once, metres.
const TELEPORT_M: f32 = 1.0;
/// Parts of a direction's length that it is kept in.
const UP: f32 = 32_767.0;
/// Height over the floor of the toes of a skeleton without toes.
const NEVER_M: f32 = 1e3;

/// How feet are locked.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tuning {
    /// Whether feet are held. If not, offsets are eased out; the root stays where the lock has moved it.
    pub on: bool,
    /// A foot held further than this from its prediction steps there, metres.
    pub release_m: f32,
    /// Shortest time in which an offset is eased out, seconds.
    pub ease_s: f32,
}

/// What a foot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Phase {
    /// In the air: the offset is eased out.
    Free,
    /// Released while it stands: it steps to its prediction.
    Step,
    /// Held by the ankle.
    Heel,
    /// Held by the toes.
    Toe,
}

#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Foot {
    pub phase: Phase,
    /// Added to the ankle's position, metres, without the root's lift.
    pub offset: Vector,
    /// Held: the position on the ground (y unused). Free or stepping: the offset when it was released.
    held: Vector,
    /// Position on the ground, in the last frame, of the joint that does not carry the foot.
    other: [f32; 2],
    /// Whether it is on its way up, though it is still held in part.
    pub leaves: bool,
    /// Seconds since the release.
    age_s: f32,
    /// The direction up in the foot's own frame, in the last frame, in parts of which [`UP`] are 1.
    up: [i16; 3],
}

impl Foot {
    pub const FREE: Self = Self {
        phase: Phase::Free,
        offset: [0.0; 3],
        held: [0.0; 3],
        other: [0.0; 2],
        leaves: false,
        age_s: 0.0,
        up: [0; 3],
    };

    pub fn is_held(&self) -> bool {
        matches!(self.phase, Phase::Heel | Phase::Toe)
    }
}

impl Foot {
    /// A sole rolls: the joint that carries a standing foot moves on over the point that stands. Before
    /// [`advance`](Self::advance).
    #[inline(never)]
    pub fn roll(&mut self, leg: &Leg, chain: &Chain) {
        // Whole numbers take half the memory; and where nothing turns, nothing rolls.
        let before = self.up;
        self.up = chain.up_in_foot().map(|v| (v * UP) as i16);
        let tipped = subtract(before.map(f32::from), self.up.map(f32::from));
        let [ankle, toe] = leg.rolls.map(|roll| chain.rolled(tipped, roll / UP));
        let (carrier, other) = if self.phase == Phase::Toe { (toe, ankle) } else { (ankle, toe) };
        if self.is_held() {
            self.held = add(self.held, carrier);
        }
        self.other = [self.other[0] + other[0], self.other[1] + other[2]];
    }

    /// Advances by a frame: foot-down, hold, roll from heel to toes, foot-up, or ease out. `over` are the heights of ankle
    /// and toes over where they would stand. Returns how far a foot that was held before slides in the prediction: `[x, 1,
    /// z]`; zeros for other feet.
    #[inline]
    pub fn advance(
        &mut self,
        chain: &Chain,
        over: [f32; 2],
        stands: bool,
        step_s: f32,
        tuning: Tuning,
        hip_drop: f32,
    ) -> Vector {
        let (phase, [x, _, z]) = (self.phase, self.offset);
        self.leaves = false;
        let mut slid = [0.0; 3];
        if !self.is_held() {
            self.ease(step_s, tuning.ease_s);
            // A stepping foot has to come down first.
            if self.phase == Phase::Free && stands {
                self.phase = if over[1] <= over[0] { Phase::Toe } else { Phase::Heel };
                // From now on the hips drop without it.
                self.offset[1] += hip_drop;
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
            self.release(Phase::Free, hip_drop);
            self.ease(step_s, tuning.ease_s);
        }
        if self.is_held() {
            self.keep(chain, over, step_s);
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
                self.release(Phase::Step, hip_drop);
            }
        }
        let other = if self.phase == Phase::Toe { chain.ankle } else { chain.toe };
        self.other = [other[0] + self.offset[0], other[2] + self.offset[2]];
        slid
    }

    /// The offset on the ground of a held foot. What slides as a foot that leaves does goes with the prediction, and the
    /// offset is eased out as far.
    #[inline]
    fn keep(&mut self, chain: &Chain, over: [f32; 2], step_s: f32) {
        let (carrier, [x, _, z]) = (self.carrier(chain), self.offset);
        [self.offset[0], _, self.offset[2]] = subtract(self.held, carrier);
        let (slide_x, slide_z) = (self.offset[0] - x, self.offset[2] - z);
        let (slide2, still) = (slide_x * slide_x + slide_z * slide_z, LEAVE_SPEED[0] * step_s);
        if slide2 <= still * still {
            return;
        }
        let kept = kept(sqrt(slide2) / step_s, over);
        if kept >= 1.0 {
            return;
        }
        self.leaves = true;
        let back = (1.0 - kept) * LEAVE_RETURN_SPEED * step_s;
        let way = sqrt(x * x + z * z);
        let left = if way > back { 1.0 - back / way } else { 0.0 };
        self.offset[0] = x * left + kept * slide_x;
        self.offset[2] = z * left + kept * slide_z;
        self.held = add(carrier, self.offset);
    }

    /// Predicted position of the joint that carries the foot.
    fn carrier(&self, chain: &Chain) -> Vector {
        if self.phase == Phase::Toe { chain.toe } else { chain.ankle }
    }

    /// Releases the foot. From now on it drops with the hips; its offset makes up for that at once.
    fn release(&mut self, phase: Phase, hip_drop: f32) {
        self.offset[1] -= hip_drop;
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

/// Part of its slide by which a foot is held that should stand, 1 at most: it slides at `speed` in the prediction, m/s, and
/// its ankle and toes are that far over where they stand, metres.
pub fn kept(speed: f32, over: [f32; 2]) -> f32 {
    let part = |value: f32, [from, to]: [f32; 2]| clamp((value - from) / (to - from), 0.0, 1.0);
    1.0 - part(speed, LEAVE_SPEED) * part(over[0] - over[1], HEEL_UP_M)
}

/// Heights of ankle and toes over where they stand on a floor of that height, metres.
#[inline(never)]
pub(super) fn over_floor(leg: &Leg, chain: &Chain, floor: f32) -> [f32; 2] {
    let ankle = chain.ankle[1] - leg.heights[0] - floor;
    // Without toes the ankle carries the foot all the time.
    let toe = if leg.toe.is_some() { chain.toe[1] - leg.heights[1] - floor } else { NEVER_M };
    [ankle, toe]
}

/// Height of a foot over the floor of the database, metres.
pub(crate) fn lowest(leg: &Leg, chain: &Chain) -> f32 {
    lower(over_floor(leg, chain, 0.0))
}

/// How much a foot that is this far over the floor, and lifted already, has to be lifted more, metres.
pub(super) fn too_deep(over: [f32; 2], lifted: f32) -> f32 {
    let deep = -SOFT_M - lower(over) - lifted;
    if deep > 0.0 && deep < DEEPEST_M { deep } else { 0.0 }
}

pub(super) fn lower(over: [f32; 2]) -> f32 {
    if over[1] <= over[0] { over[1] } else { over[0] }
}

/// How far from the hip joint the lock may move the ankle: almost the whole leg, or as far as it already is.
#[inline(never)]
pub(super) fn reach(chain: &Chain) -> f32 {
    let (most, is) = (STRETCH * chain.length(), norm(subtract(chain.ankle, chain.hip)));
    if most > is { most } else { is }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FRAME: f32 = 1.0 / 120.0;

    #[test]
    fn only_a_fast_foot_with_its_heel_up_leaves() {
        let (flat, tipped) = ([0.0, 0.0], [0.09, 0.0]);
        for (speed, over, part) in [
            (0.3, tipped, 1.0),
            (3.0, flat, 1.0),
            (0.7, tipped, 0.5),
            (1.0, tipped, 0.0),
            (3.0, [0.02, NEVER_M], 1.0),
        ] {
            assert!((kept(speed, over) - part).abs() < 1e-6, "{speed} m/s, {over:?}");
        }
    }

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
