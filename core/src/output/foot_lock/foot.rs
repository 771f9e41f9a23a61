//! One foot of the lock: in the air, held by heel or toes, stepping, or returning to the prediction.

use crate::{
    blob::Leg,
    body::two_bone_ik::Chain,
    math::{
        clamp, exp, maximum,
        quaternion::Vector,
        smoothstep, sqrt,
        vector::{add, norm, subtract},
    },
};

/// Time constant with which a standing foot approaches the floor, seconds.
const SETTLE_S: f32 = 0.08;
/// Greatest speed of that approach, m/s.
const SETTLE_SPEED: f32 = 0.25;
/// Part of its length to which the lock may stretch a leg.
const MAX_STRETCH_RATIO: f32 = 0.995;
/// How far a foot may sink below the height at which it stands, metres: toes bend, soles are soft.
const MAX_SINK_M: f32 = 0.01;
/// Depth below the floor from which a foot neither stands nor is lifted, metres: the body is elsewhere.
pub(super) const DEEPEST_M: f32 = 0.4;
/// How much lower the other joint has to be before it carries the foot, metres.
const HANDOVER_M: f32 = 0.0005;
/// Greatest speed with which an offset is eased out, m/s. A large offset takes longer than a small one.
const RETURN_SPEED: f32 = 0.25;
/// Speeds of a sliding foot below which it is held entirely, and above which it is not held, m/s. Votes to stand end late: a
/// foot that leaves the floor slides at 1 m/s and more with its heel up, a standing one at up to 0.3 m/s.
const LEAVE_SPEED: [f32; 2] = [0.4, 1.0];
/// Height of the heel over the toes for a flat foot, and for one that may leave, metres.
const HEEL_UP_M: [f32; 2] = [0.02, 0.05];
/// Height of an offset above which its foot was under the floor, metres. Out of it again, the foot comes down as fast as it
/// steps: as slowly as a standing foot, it would keep its leg bent for a second and more.
const LIFTED_M: f32 = 0.1;
/// Speed with which the offset of a leaving foot is eased out, m/s. The foot moves anyway.
const LEAVE_RETURN_SPEED: f32 = 0.5;
/// A held foot whose prediction stands too, but further away than this, steps there, metres.
const ELSEWHERE_M: f32 = 0.05;
/// Speed below which a foot of the prediction stands, m/s. Feet of predicted walks slide faster, and are not stepped.
const ELSEWHERE_SPEED: f32 = 0.1;
/// Seconds for which the prediction has to stand there: a style or an action that changes settles first.
const ELSEWHERE_S: f32 = 0.3;
/// Greatest speed of a step, m/s.
const STEP_SPEED: f32 = 1.0;
/// Height of a step as a part of its length.
const STEP_LIFT: f32 = 0.15;
/// Greatest height of a step, metres.
const STEP_LIFT_M: f32 = 0.03;
/// Distance from its held foot beyond which a body was moved and did not walk, metres. The foot then follows at once.
const TELEPORT_M: f32 = 1.0;
/// Fixed-point scale of a stored direction: the number that stands for 1.
const UP: f32 = 32_767.0;
/// Height over the floor that stands in for the toes of a skeleton without toes, metres.
const NO_TOES_M: f32 = 1e3;

/// The parameters of the foot lock.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Tuning {
    /// Whether feet are held. If false, offsets are eased out, and the root stays where the lock has moved it.
    pub on: bool,
    /// Distance from its prediction at which a held foot steps there, metres.
    pub release_m: f32,
    /// Shortest time in which an offset is eased out, seconds.
    pub ease_s: f32,
}

/// How far held feet slide in the prediction.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Slide {
    /// Sum of their ways along x, metres.
    pub x: f32,
    /// Number of feet.
    pub feet: f32,
    /// Sum of their ways along z, metres.
    pub z: f32,
}

impl Slide {
    /// Adds another foot, or none.
    pub fn add(&mut self, other: Self) {
        *self = Self { x: self.x + other.x, feet: self.feet + other.feet, z: self.z + other.z };
    }
}

/// The state of a foot.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) enum Phase {
    /// In the air; the offset is eased out.
    Free,
    /// Released while standing; it steps to its prediction.
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
    /// Offset that is added to the ankle's position, metres, without the root's lift.
    pub offset: Vector,
    /// While held: the position on the ground, metres (y unused). While free or stepping: the offset at the release.
    held: Vector,
    /// Position on the ground, x and z, metres, of the joint that did not carry the foot in the last frame.
    other: [f32; 2],
    /// Whether the foot is leaving the floor, though it is still held in part.
    pub is_leaving: bool,
    /// Seconds since the release; while held, for which the prediction has stood elsewhere.
    age_s: f32,
    /// The upward direction in the foot's own frame, in the last frame, in fixed point with scale [`UP`].
    up: [i16; 3],
}

impl Foot {
    pub const FREE: Self = Self {
        phase: Phase::Free,
        offset: [0.0; 3],
        held: [0.0; 3],
        other: [0.0; 2],
        is_leaving: false,
        age_s: 0.0,
        up: [0; 3],
    };

    pub fn is_held(&self) -> bool {
        matches!(self.phase, Phase::Heel | Phase::Toe)
    }

    /// Rolls the sole: moves the carrying joint of a standing foot over its point of contact. Called before
    /// [`advance`](Self::advance).
    #[inline(never)]
    pub fn roll(&mut self, leg: &Leg, chain: &Chain) {
        // Integers take half of the memory, and a foot that does not turn does not roll.
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

    /// Advances by a frame: foot-down, hold, roll from heel to toes, foot-up, or ease out.
    ///
    /// `over` are the heights of ankle and toes over those at which they stand, metres. Returns how far a foot that was held
    /// before slides in the prediction; no slide for other feet.
    #[inline]
    pub fn advance(
        &mut self,
        chain: &Chain,
        over: [f32; 2],
        stands: bool,
        step_s: f32,
        tuning: Tuning,
        hip_drop: f32,
    ) -> Slide {
        let (phase, [x, _, z]) = (self.phase, self.offset);
        self.is_leaving = false;
        let mut slid = Slide::default();
        if !self.is_held() {
            self.ease(step_s, tuning.ease_s);
            // A stepping foot has to come down first.
            if self.phase == Phase::Free && stands {
                self.phase = if over[1] <= over[0] { Phase::Toe } else { Phase::Heel };
                // From now on the foot does not drop with the hips.
                self.offset[1] += hip_drop;
                (self.held, self.age_s) = (add(self.carrier(chain), self.offset), 0.0);
            }
        } else if stands {
            let carrier = match self.phase {
                Phase::Toe if over[0] < over[1] - HANDOVER_M => Phase::Heel,
                Phase::Heel if over[1] < over[0] - HANDOVER_M => Phase::Toe,
                phase => phase,
            };
            if carrier != self.phase {
                self.phase = carrier;
                self.held = [self.other[0], 0.0, self.other[1]];
            }
        } else {
            self.release(Phase::Free, hip_drop);
            self.ease(step_s, tuning.ease_s);
        }
        if self.is_held() {
            self.update_offset(chain, over, step_s);
            let moved = Slide { x: self.offset[0] - x, feet: 1.0, z: self.offset[2] - z };
            if self.phase == phase {
                slid = moved;
            }
            let height = if self.phase == Phase::Toe { over[1] } else { over[0] };
            let way = -height - self.offset[1];
            let settle = way * (1.0 - exp(-step_s / SETTLE_S));
            let down = if way < -LIFTED_M { STEP_SPEED } else { SETTLE_SPEED };
            self.offset[1] += clamp(settle, -down * step_s, SETTLE_SPEED * step_s);
            self.offset[1] += depth_correction(over, self.offset[1]);
            let off2 = self.offset[0] * self.offset[0] + self.offset[2] * self.offset[2];
            // Beyond any step: the body was moved.
            if off2 > TELEPORT_M * TELEPORT_M {
                *self = Self::FREE;
            } else if off2 > tuning.release_m * tuning.release_m {
                self.release(Phase::Step, hip_drop);
            } else {
                let slowest = ELSEWHERE_SPEED * step_s;
                let stands = moved.x * moved.x + moved.z * moved.z < slowest * slowest;
                let elsewhere = stands && off2 > ELSEWHERE_M * ELSEWHERE_M;
                self.age_s = if elsewhere { self.age_s + step_s } else { 0.0 };
            }
        }
        let other = if self.phase == Phase::Toe { chain.ankle } else { chain.toe };
        self.other = [other[0] + self.offset[0], other[2] + self.offset[2]];
        slid
    }

    /// Updates the offset of a held foot on the ground. A foot that slides as a leaving foot does follows the prediction to
    /// that degree, and its offset is eased out.
    #[inline]
    fn update_offset(&mut self, chain: &Chain, over: [f32; 2], step_s: f32) {
        let (carrier, [x, _, z]) = (self.carrier(chain), self.offset);
        [self.offset[0], _, self.offset[2]] = subtract(self.held, carrier);
        let (slide_x, slide_z) = (self.offset[0] - x, self.offset[2] - z);
        let (slide2, still) = (slide_x * slide_x + slide_z * slide_z, LEAVE_SPEED[0] * step_s);
        if slide2 <= still * still {
            return;
        }
        let held = held_fraction(sqrt(slide2) / step_s, over);
        if held >= 1.0 {
            return;
        }
        self.is_leaving = true;
        let back = (1.0 - held) * LEAVE_RETURN_SPEED * step_s;
        let way = sqrt(x * x + z * z);
        let left = if way > back { 1.0 - back / way } else { 0.0 };
        self.offset[0] = x * left + held * slide_x;
        self.offset[2] = z * left + held * slide_z;
        self.held = add(carrier, self.offset);
    }

    /// Lets a held foot step to where its prediction has stood for a while. Returns whether it steps.
    pub fn follow(&mut self, hip_drop: f32) -> bool {
        let steps = self.is_held() && self.age_s > ELSEWHERE_S;
        if steps {
            self.release(Phase::Step, hip_drop);
        }
        steps
    }

    /// Predicted position of the joint that carries the foot.
    fn carrier(&self, chain: &Chain) -> Vector {
        if self.phase == Phase::Toe { chain.toe } else { chain.ankle }
    }

    /// Releases the foot. From now on it drops with the hips, and the offset compensates for that at once.
    fn release(&mut self, phase: Phase, hip_drop: f32) {
        self.offset[1] -= hip_drop;
        (self.phase, self.held, self.age_s) = (phase, self.offset, 0.0);
    }

    /// Eases the offset out by one frame.
    fn ease(&mut self, step_s: f32, ease_s: f32) {
        self.age_s += step_s;
        // A smoothstep is steepest in its middle, 1.5 times its mean slope.
        let way = norm(self.held);
        let is_fast = self.phase == Phase::Step || self.held[1] > LIFTED_M;
        let speed = if is_fast { STEP_SPEED } else { RETURN_SPEED };
        let least = 1.5 * way / speed;
        let whole = maximum(least, ease_s);
        let t = clamp(self.age_s / whole, 0.0, 1.0);
        let left = 1.0 - smoothstep(t);
        self.offset = self.held.map(|v| v * left);
        if self.phase == Phase::Step {
            self.offset[1] += clamp(STEP_LIFT * way, 0.0, STEP_LIFT_M) * 4.0 * left * (1.0 - left);
            if t >= 1.0 {
                (self.phase, self.held) = (Phase::Free, [0.0; 3]);
            }
        }
    }
}

/// The part of its slide that the lock takes from a foot that should stand, 0 to 1. The foot slides at `speed` in the
/// prediction, m/s; `over` are the heights of ankle and toes over those at which they stand, metres.
pub fn held_fraction(speed: f32, over: [f32; 2]) -> f32 {
    let part = |value: f32, [from, to]: [f32; 2]| clamp((value - from) / (to - from), 0.0, 1.0);
    1.0 - part(speed, LEAVE_SPEED) * part(over[0] - over[1], HEEL_UP_M)
}

/// Heights of ankle and toes over those at which they stand on a floor of height `floor`, metres.
#[inline(never)]
pub(super) fn heights_over_floor(leg: &Leg, chain: &Chain, floor: f32) -> [f32; 2] {
    let ankle = chain.ankle[1] - leg.heights[0] - floor;
    // Without toes the ankle always carries the foot.
    let toe = if leg.toe.is_some() { chain.toe[1] - leg.heights[1] - floor } else { NO_TOES_M };
    [ankle, toe]
}

/// Height of a foot over the floor of the database, metres.
pub(crate) fn lowest(leg: &Leg, chain: &Chain) -> f32 {
    lower_of(heights_over_floor(leg, chain, 0.0))
}

/// How much further a foot has to be lifted, metres. It is `over` the floor, and has been `lifted` already.
pub(super) fn depth_correction(over: [f32; 2], lifted: f32) -> f32 {
    let deep = -MAX_SINK_M - lower_of(over) - lifted;
    if deep > 0.0 && deep < DEEPEST_M { deep } else { 0.0 }
}

/// The lower of the heights of ankle and toes, metres.
pub(super) fn lower_of(over: [f32; 2]) -> f32 {
    if over[1] <= over[0] { over[1] } else { over[0] }
}

/// Greatest distance from the hip joint to which the lock may move the ankle, metres: almost the whole leg, or the distance
/// that it has already.
#[inline(never)]
pub(super) fn reach(chain: &Chain) -> f32 {
    let (most, is) = (MAX_STRETCH_RATIO * chain.length(), norm(subtract(chain.ankle, chain.hip)));
    maximum(most, is)
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
            (3.0, [0.02, NO_TOES_M], 1.0),
        ] {
            assert!((held_fraction(speed, over) - part).abs() < 1e-6, "{speed} m/s, {over:?}");
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
