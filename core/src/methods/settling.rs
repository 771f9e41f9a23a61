//! Settling: how fast an output follows its prediction, so that it does not jump when other neighbors or classes take part.
//!
//! Repetitions of gestures differ, so a change of neighbors, or of the place in the clip, makes them jump. Cycles of a gait
//! are alike, and longer settling would smooth them: they take a quarter of the time. Classes differ, though, and where
//! several of them share the weight, as in input whose style is not in the database, the output jumps with their
//! proportions p:
//!
//! ```text
//! τ  = time min(1, Σ p r + 1 - max p)       r: 1/4 of a gait, otherwise 1
//! y' = y + e^(-Δt / τ) (y'_led - y)         y: the prediction; y'_led: where the output of the frame before leads
//! ```

use crate::{
    math::{abs, clamp, exp},
    methods::weights::Share,
};

/// Part of the time that applies to a gait which has all the weight.
const GAIT_RATIO: f32 = 0.25;
/// Distance from the prediction at which the last output is discarded (m, rad, m/s, rad/s).
const MAX_DEVIATION: f32 = 100.0;

/// Part of the distance from the prediction that is left after a frame of `seconds`: 0 to below 1. `time` is in seconds, for
/// classes that are no gaits. `shares` begins with the largest.
pub(super) fn part_left(seconds: f32, time: f32, shares: &[Share], is_gait: impl Fn(usize) -> bool) -> f32 {
    let time = time * time_ratio(shares, is_gait);
    if time > 0.0 { exp(-seconds / time) } else { 0.0 }
}

/// Part of the time that applies to a mixture of these classes.
fn time_ratio(shares: &[Share], is_gait: impl Fn(usize) -> bool) -> f32 {
    let part = |share: &Share| if is_gait(usize::from(share.class)) { GAIT_RATIO } else { 1.0 };
    let others = 1.0 - shares.first().map_or(1.0, |share| share.proportion);
    clamp(others + shares.iter().map(|share| share.proportion * part(share)).sum::<f32>(), 0.0, 1.0)
}

/// The output `led` by that of the frame before, after it has moved towards the `target`. A deviation that no motion has,
/// and one that is no number, is dropped.
#[inline]
pub(super) fn settled(led: f32, target: f32, part_left: f32) -> f32 {
    let deviation = led - target;
    // Also false for NaN.
    if abs(deviation) < MAX_DEVIATION { target + part_left * deviation } else { target }
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

    #[test]
    fn an_output_that_no_motion_has_is_dropped() {
        assert_eq!(settled(3.0, 1.0, 0.5), 2.0);
        for led in [f32::NAN, f32::INFINITY, 101.5, -99.5] {
            assert_eq!(settled(led, 1.0, 0.5), 1.0, "{led}");
        }
    }
}
