//! From the predictions to the output: as lively as the style, and as smooth as the neighbors.
//!
//! Both parts are corrections, which are not fed back: the predictions follow the equations of Xia 2015 alone.
//!
//! **Liveliness.** The part `Δx` of the input that lies outside the neighbors' interval is most of what makes one cycle
//! differ from the next. The prediction keeps ρ of it (Xia 2015, eq. 7), whether the style is livelier or calmer than
//! the input. The output keeps a part that follows the style:
//!
//! ```text
//! ρ_out = min(1, ρ l √(far(style) / far(input)))       l: Config::liveliness; the root is held within 1/2 to 2
//! ```
//!
//! `far` is the squared distance between a class's own clips, as the builder has measured it
//! ([`TrustLimits`](crate::blob::TrustLimits)), averaged in a mix of styles.
//!
//! **Settling.** Neighbors change from frame to frame. Each has the posture of its own output clip, so the prediction
//! jumps by the difference. The output follows the mean *change* of the neighbors' outputs, in which the postures
//! cancel out, and settles on the prediction over time:
//!
//! ```text
//! v  = mean (y[t] - y[t-1]) + ρ_out (x[t] - x[t-1] - mean (x[t] - x[t-1]))       means over the neighbors
//! y' = y + e^(-Δt / τ) (y'[t-1] + v - y)                                         τ: below
//! ```
//!
//! A plain low-pass filter would lag behind the motion; this one does not, because v leads it.
//!
//! Repetitions of gestures differ, so a change of neighbors makes them jump. Cycles of a gait are alike, and longer
//! settling would smooth them: they take a quarter of the time. Classes differ, though, and where several of them share the
//! weight, as in input whose style is not in the database, the output jumps with their proportions p:
//!
//! ```text
//! τ = settle_s min(1, Σ p r + 1 - max p)       settle_s: Config::settle_s; r: 1/4 of a gait, otherwise 1
//! ```
//!
//! Cost: some 40 operations a dof and frame, and a pass over the labels of all classes for each class kept.

use crate::{
    Config, Observer,
    blob::{Database, layout::dof},
    body::pose::Dofs,
    config::Yaw,
    math::{abs, clamp, exp, sqrt},
    methods::{
        context::{Context, Frame},
        weights::Share,
    },
    stylizer::style_mix::Mix,
};

/// Least and greatest ratio between the variabilities of two styles.
const RATIOS: [f32; 2] = [0.5, 2.0];
/// Distance from the prediction at which the last output is discarded (m, rad, m/s, rad/s).
const MAX_DEVIATION: f32 = 100.0;

/// ρ of the output: the part of `Δx` that it keeps, for input of `class` and output in `mix`. 0 to 1.
pub(super) fn output_rho(database: &Database<'_>, config: &Config, class: usize, mix: Mix<'_>) -> f32 {
    if config.liveliness <= 0.0 {
        return config.rho;
    }
    let far = |class: usize| database.trust_limits(class).map_or(0.0, |limits| limits.far);
    let (action, input_far) = (database.class(class).action, far(class));
    let others = (0..database.counts().classes).map(|other| (database.class(other), other));
    let style = others
        .filter(|(other, _)| other.action == action)
        .map(|(other, number)| (mix.weight(usize::from(other.style)), number))
        .filter(|(weight, _)| *weight > 0.0)
        .map(|(weight, number)| weight * far(number))
        .sum::<f32>();
    // 0 where the builder could not tell.
    let ratio = if input_far > 0.0 && style > 0.0 {
        clamp(sqrt(style / input_far), RATIOS[0], RATIOS[1])
    } else {
        1.0
    };
    clamp(config.rho * config.liveliness * ratio, 0.0, 1.0)
}

/// Part of [`Config::settle_s`] that applies to a gait which has all the weight.
const GAIT_RATIO: f32 = 0.25;

/// Part of [`Config::settle_s`] that applies to a mixture of these classes. `shares` begins with the largest.
fn settling_ratio(shares: &[Share], is_gait: impl Fn(usize) -> bool) -> f32 {
    let part = |share: &Share| if is_gait(usize::from(share.class)) { GAIT_RATIO } else { 1.0 };
    let others = 1.0 - shares.first().map_or(1.0, |share| share.proportion);
    clamp(others + shares.iter().map(|share| share.proportion * part(share)).sum::<f32>(), 0.0, 1.0)
}

/// The output before strength, `[dofs]`.
#[derive(Debug, Clone)]
pub(super) struct Settled<const J: usize>(Dofs<J>);

impl<const J: usize> Settled<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    pub const NEW: Self = Self([[0.0; 4]; J]);

    /// Begins a stream with the mean last output of the neighbors.
    pub fn begin(&mut self, y_prev: &Dofs<J>) {
        self.0 = *y_prev;
    }

    /// The dofs, to which the change of each class is added by its proportion.
    pub fn dofs(&mut self) -> &mut [f32] {
        self.0.as_flattened_mut()
    }

    /// Settles on the corrected prediction, after the changes of all classes were added. `signals.correction` is then the
    /// difference between output and prediction.
    #[inline(never)]
    pub fn settle(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        let Context { frame: Frame { database, config, settings, .. }, signals, report, .. } = context;
        let seconds = 1.0 / database.rate_hz();
        let time = config.settle_s * settling_ratio(&report.classes, |class| database.is_gait(class));
        let left = if time > 0.0 { exp(-seconds / time) } else { 0.0 };
        let predicted = signals.predicted.as_flattened();
        let slots = signals.correction.as_flattened_mut().iter_mut().zip(self.0.as_flattened_mut());
        for (d, ((correction, settled), &predicted)) in
            slots.zip(predicted).enumerate().take(database.counts().dofs)
        {
            let target = predicted + *correction;
            let deviation = *settled - target;
            // Also false for NaN.
            *settled = if abs(deviation) < MAX_DEVIATION { target + left * deviation } else { target };
            *correction = if d == dof::YAW && config.yaw == Yaw::Input {
                0.0
            } else {
                settings.strength_of(database.group_of_dof(d)) * (*settled - predicted)
            };
        }
        signals.is_corrected = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gaits_settle_fast_where_one_class_has_the_weight() {
        let share = |class, proportion| Share { class, proportion };
        // Classes 0 and 1 are gaits.
        let ratio = |shares: &[Share]| settling_ratio(shares, |class| class < 2);
        assert_eq!(ratio(&[share(0, 1.0)]), 0.25);
        assert_eq!(ratio(&[share(2, 1.0)]), 1.0);
        assert_eq!(ratio(&[share(0, 0.5), share(1, 0.5)]), 0.75);
        assert_eq!(ratio(&[share(0, 0.75), share(2, 0.25)]), 0.6875);
        assert_eq!(ratio(&[share(0, 0.5), share(2, 0.5)]), 1.0);
        assert_eq!(ratio(&[]), 0.0);
    }
}
