//! Settling: how fast an output follows its prediction, so that it does not jump when other neighbors or classes take part.
//!
//! Repetitions of gestures differ, so a change of neighbors, or of the place in the clip, makes them jump. Cycles of a gait
//! are alike, and longer settling would smooth them: they take a quarter of the time. Classes differ, though, and where
//! several of them share the weight, as in input whose style is not in the database, the output jumps with their
//! proportions p:
//!
//! ```text
//! ratio = min(1, Σ p r + 1 - max p)                    r: 1/4 of a gait, otherwise 1
//! τ     = time ratio
//! y'    = y + e^(-Δt / τ) (y'_led - y)                 y: the prediction; y'_led: where the output of the frame before leads
//! ```
//!
//! Its velocity changes at once, which shows when an arm falls after a wave. Where gestures take part, the output keeps its
//! velocity too, as a damped spring does that is pulled to the prediction. Its two time constants sum to τ:
//!
//! ```text
//! τ  = time (ratio + 3/2 jump)                         jump: 1 after a [`Jump`], 0 after 0.3 s
//! s  = 1/2 Σ p over the classes that are not gaits     0 of gaits, 1/2 of gestures
//! a  = e^(-Δt / ((1 - s) τ)),  b = e^(-Δt / (s τ))
//! y' = y + (a + b - a b) (y'_led - y) + a b (w - v)    w: last step of the output, y'[t-1] - y'[t-2]; v: the one that leads
//! ```

use crate::{
    math::{abs, clamp, decay, maximum},
    methods::weights::Share,
};

/// Part of the time that applies to a gait which has all the weight.
const GAIT_RATIO: f32 = 0.25;
/// Distance from the prediction at which the last output is discarded (m, rad, m/s, rad/s).
const MAX_DEVIATION: f32 = 100.0;

/// Additional time after a jump, as a multiple of the time.
const JUMP_RATIO: f32 = 1.5;
/// Time after which a jump no longer adds to the time, seconds.
const JUMP_S: f32 = 0.3;
/// Proportion from which on a class that is not the nearest jumps as much as the nearest.
const FULL_JUMP_SHARE: f32 = 1.0 / 3.0;
/// Proportion above which a class is clearly the nearest.
const MIN_CLEAR_SHARE: f32 = 0.6;

/// A spring that pulls outputs to their predictions, as it acts in one frame. [`NONE`](Self::NONE) puts out the prediction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spring {
    /// Part of the distance from the prediction that is left: `a + b - a b`.
    distance: f32,
    /// Part of the velocity beyond the one that leads that is left: `a b`.
    velocity: f32,
}

impl Spring {
    /// A spring that leaves nothing of the past.
    pub const NONE: Self = Self { distance: 0.0, velocity: 0.0 };

    /// The spring in a frame of `seconds`. `time` is in seconds, for classes that are not gaits; `shares` begins with the
    /// largest; `jump` is 1 where the body has jumped, and falls to 0.
    pub fn new(
        seconds: f32,
        time: f32,
        jump: f32,
        shares: &[Share],
        is_gait: impl Fn(usize) -> bool + Copy,
    ) -> Self {
        let time = time * (time_ratio(shares, is_gait) + JUMP_RATIO * jump);
        let gestures = shares.iter().filter(|share| !is_gait(usize::from(share.class)));
        let second = clamp(0.5 * gestures.map(|share| share.proportion).sum::<f32>(), 0.0, 0.5);
        let [a, b] = [(1.0 - second) * time, second * time].map(|time| decay(seconds, time));
        Self { distance: a + b - a * b, velocity: a * b }
    }

    /// The same for an output whose last step is the one that leads.
    pub fn at_rest(self) -> Self {
        Self { velocity: 0.0, ..self }
    }

    /// What a correction of the prediction and the step that leads are multiplied with before they are added to an output.
    /// Both are linear, so those of several classes can be added up, each by its `proportion`.
    pub fn parts(self, proportion: f32) -> [f32; 2] {
        [proportion * (1.0 - self.distance), proportion * (self.distance - self.velocity)]
    }

    /// The output after the `last` two, the latest one first. `added` is the sum of corrections and steps by their
    /// [`parts`](Self::parts). Deviations that no motion has, and those that are no numbers, are dropped.
    #[inline]
    pub fn pull(self, last: [f32; 2], prediction: f32, added: f32) -> f32 {
        let deviation = last[0] - prediction;
        if !is_of_motion(deviation) {
            return prediction;
        }
        let led = prediction + self.distance * deviation + added;
        // Gaits keep no velocity.
        if self.velocity <= 0.0 {
            return led;
        }
        let step = last[0] - last[1];
        if is_of_motion(step) { led + self.velocity * step } else { led }
    }
}

/// How long ago the body jumped. A jump is a frame in which the body is elsewhere in a class's clip than the frames before led
/// to, another class takes part (by its proportion), or another action becomes clearly the nearest, unless both are gaits.
#[derive(Debug, Clone)]
pub(super) struct Jump {
    /// 1 in the frame of a jump, then falls to 0.
    left: f32,
    /// The class that was clearly the nearest the last time.
    nearest: u16,
}

impl Jump {
    /// Before the first frame.
    pub const NEW: Self = Self { left: 0.0, nearest: 0 };

    /// Advances by a frame of `seconds` and returns the `jump` for [`Spring::new`]. `elsewhere` is 1 if the body is elsewhere
    /// in the clip, 0 if it is where it was expected; `gesture` is the action of a class, `None` for gaits.
    pub fn follow(
        &mut self,
        first: bool,
        seconds: f32,
        shares: &[Share],
        elsewhere: f32,
        gesture: impl Fn(usize) -> Option<u16>,
    ) -> f32 {
        let last = self.nearest;
        // Classes that share the weight take turns as the nearest, without a jump.
        let clear = shares.first().filter(|share| first || share.proportion > MIN_CLEAR_SHARE);
        self.nearest = clear.map_or(last, |share| share.class);
        let is_another = gesture(usize::from(last)) != gesture(usize::from(self.nearest));
        let later = if first { 0.0 } else { after_jump(self.left, seconds) };
        let now = if is_another && !first { 1.0 } else { elsewhere };
        self.left = maximum(now, later);
        self.left
    }

    /// Notes a jump in a class with this proportion that is seen too late for the spring of its frame. What hardly takes part
    /// hardly moves the output.
    pub fn notice(&mut self, proportion: f32) {
        self.left = maximum(self.left, clamp(proportion / FULL_JUMP_SHARE, 0.0, 1.0));
    }
}

/// The `jump` of a [`Spring`] a frame of `seconds` later.
fn after_jump(jump: f32, seconds: f32) -> f32 {
    clamp(jump - seconds / JUMP_S, 0.0, 1.0)
}

/// Part of the time that applies to a mixture of these classes.
fn time_ratio(shares: &[Share], is_gait: impl Fn(usize) -> bool) -> f32 {
    let part = |share: &Share| if is_gait(usize::from(share.class)) { GAIT_RATIO } else { 1.0 };
    let others = 1.0 - shares.first().map_or(1.0, |share| share.proportion);
    clamp(others + shares.iter().map(|share| share.proportion * part(share)).sum::<f32>(), 0.0, 1.0)
}

/// False for a difference that no motion has, and for NaN.
#[inline]
fn is_of_motion(difference: f32) -> bool {
    abs(difference) < MAX_DEVIATION
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaits_settle_fast_where_one_class_has_the_weight() {
        let share = |class, proportion| Share { class, proportion };
        // Classes 0 and 1 are gaits.
        let ratio = |shares: &[Share]| time_ratio(shares, |class| class < 2);
        assert_eq!(ratio(&[share(0, 1.0)]), 0.25);
        assert_eq!(ratio(&[share(2, 1.0)]), 1.0);
        assert_eq!(ratio(&[share(0, 0.5), share(1, 0.5)]), 0.75);
        assert_eq!(ratio(&[share(0, 0.75), share(2, 0.25)]), 0.6875);
        assert_eq!(ratio(&[share(0, 0.5), share(2, 0.5)]), 1.0);
        assert_eq!(ratio(&[]), 0.0);
    }

    const GAIT: [Share; 1] = [Share { class: 0, proportion: 1.0 }];
    const GESTURE: [Share; 1] = [Share { class: 2, proportion: 1.0 }];

    /// Outputs after 0, 1, … frames that are led to stay where they are, but pulled to 1. The time is a tenth of a second.
    fn step_response(shares: &[Share], mut jump: f32) -> Vec<f32> {
        let (mut last, mut outputs) = ([0.0; 2], vec![0.0]);
        for _ in 0..60 {
            let spring = Spring::new(1.0 / 30.0, 0.1, jump, shares, |class| class < 2);
            // Half of the target is a correction.
            let now = spring.pull(last, 0.5, spring.parts(0.5)[0]);
            (last, jump) = ([now, last[0]], after_jump(jump, 1.0 / 30.0));
            outputs.push(now);
        }
        outputs
    }

    #[test]
    fn a_gait_sets_off_at_once_and_a_gesture_as_a_spring() {
        let gait = step_response(&GAIT, 0.0);
        for (t, output) in gait.iter().enumerate() {
            let expected = 1.0 - (-4.0 / 3.0 * t as f64).exp();
            assert!((f64::from(*output) - expected).abs() < 1e-6, "frame {t}: {output}");
        }
        // Two equal time constants of 0.05 s each, discretely: 1 - (1 + (1 - a) t) a^t.
        let a = (-2.0 / 3.0_f64).exp();
        for (t, output) in step_response(&GESTURE, 0.0).iter().enumerate() {
            let expected = 1.0 - (1.0 + (1.0 - a) * t as f64) * a.powi(t as i32);
            assert!((f64::from(*output) - expected).abs() < 1e-5, "frame {t}: {output}, not {expected}");
        }
    }

    #[test]
    fn what_has_jumped_settles_slowly_and_arrives() {
        let [plain, jumped] = [0.0, 1.0].map(|jump| step_response(&GESTURE, jump));
        assert!(jumped[1] < 0.3 * plain[1], "{} of {}", jumped[1], plain[1]);
        let rises = |outputs: &[f32]| outputs.windows(2).all(|pair| pair[0] <= pair[1] + 1e-6);
        assert!(rises(&plain) && rises(&jumped), "it does not overshoot");
        assert!(jumped[15] > 0.95, "after half a second: {}", jumped[15]);
        assert!((after_jump(1.0, 0.1) - 2.0 / 3.0).abs() < 1e-6);
        assert_eq!(after_jump(1.0, 0.3), 0.0);
    }

    #[test]
    fn another_gesture_is_a_jump_and_another_gait_is_none() {
        // Classes 0 and 1 are gaits, 2 and 3 one gesture in two styles, 4 another gesture.
        let gesture = |class| [None, None, Some(7), Some(7), Some(8)][class];
        let mut jump = Jump { left: 1.0, nearest: 4 };
        let mut follow = |first, class, proportion, elsewhere| {
            jump.follow(first, 0.1, &[Share { class, proportion }], elsewhere, gesture)
        };
        assert_eq!(follow(true, 0, 0.5, 0.0), 0.0, "a stream begins");
        assert_eq!(follow(false, 1, 0.9, 0.0), 0.0, "another gait");
        assert_eq!(follow(false, 2, 0.6, 0.0), 0.0, "a gesture that is not clear");
        assert_eq!(follow(false, 2, 0.7, 0.0), 1.0, "a gesture after a gait");
        assert!((follow(false, 3, 0.7, 0.0) - 2.0 / 3.0).abs() < 1e-6, "another style of it");
        assert_eq!(follow(false, 3, 0.7, 0.5), 0.5, "half a jump");
        assert_eq!(follow(false, 3, 0.7, 1.0), 1.0, "elsewhere in its clip");
        assert!(follow(false, 3, 0.7, 0.5) > 0.6, "half a jump after a whole one");
        assert!(follow(false, 4, 0.5, 0.0) < 1.0, "another one that is not clear");
        assert_eq!(follow(false, 4, 1.0, 0.0), 1.0, "another one");
        assert!(follow(false, 4, 1.0, 0.0) < 1.0, "the same again");
        assert_eq!(follow(false, 0, 1.0, 0.0), 1.0, "a gait after a gesture");
        assert_eq!(follow(true, 4, 1.0, 1.0), 1.0, "a stream that begins with a jump");
    }

    #[test]
    fn a_class_that_hardly_takes_part_hardly_jumps() {
        let after = |left, proportion| {
            let mut jump = Jump { left, nearest: 0 };
            jump.notice(proportion);
            jump.left
        };
        assert!((after(0.0, 0.1) - 0.3).abs() < 1e-6);
        assert_eq!(after(0.0, 0.4), 1.0, "no more than a whole jump");
        assert_eq!(after(0.5, 0.1), 0.5, "less than what is left of another");
    }

    #[test]
    fn what_is_led_right_stays_on_the_prediction() {
        let spring = Spring::new(1.0 / 30.0, 0.1, 1.0, &GESTURE, |_| false);
        for t in 1..10 {
            let [before, last, now] = [t - 1, t, t + 1].map(|t| 0.3 * t as f32);
            let output = spring.pull([last, before], now, 0.3 * spring.parts(1.0)[1]);
            assert!((output - now).abs() < 1e-6, "frame {t}: {output}");
            let begun = spring.at_rest();
            let output = begun.pull([last, 7.0], now, 0.3 * begun.parts(1.0)[1]);
            assert!((output - now).abs() < 1e-6, "its last step is not known");
        }
    }

    #[test]
    fn no_time_settles_at_once() {
        for (shares, jump) in [(GAIT, 0.0), (GESTURE, 1.0)] {
            let spring = Spring::new(1.0 / 30.0, 0.0, jump, &shares, |class| class < 2);
            let [correction, lead] = spring.parts(1.0);
            assert_eq!(spring.pull([3.0, 2.0], 1.0, 0.5 * correction + 9.0 * lead), 1.5);
        }
    }

    #[test]
    fn an_output_that_no_motion_has_is_dropped() {
        for led in [f32::NAN, f32::INFINITY, 101.5, -99.5] {
            let spring = Spring { distance: 0.5, velocity: 0.25 };
            assert_eq!(spring.pull([led, led], 1.0, 0.5), 1.0, "{led}");
            assert_eq!(spring.pull([3.0, 2.0 * led], 1.0, 0.5), 2.5, "a step from twice {led}");
        }
    }
}
