//! From the predictions to what is put out: as lively as the style, and as smooth as the neighbors.
//!
//! Both are corrections. They are not fed back: the stream of predictions follows the equations of Xia 2015 alone.
//!
//! **Liveliness.** What of the input lies outside the neighbors' interval, `Δx`, is most of what makes one cycle differ
//! from the next. The prediction keeps ρ of it (Xia 2015, eq. 7), whether the style is livelier than the input or calmer.
//! The output keeps a part that follows the style:
//!
//! ```text
//! part = min(1, ρ l √(far(style) / far(input)))       l: Config::liveliness; the root from 1/2 to 2
//! ```
//!
//! with `far` the squared distance of a class's own clips from each other, as the builder has measured it
//! ([`Familiar`](crate::blob::Familiar)), and the mean of it in a mix of styles.
//!
//! **Settling.** From frame to frame neighbors come and go. Each brings the posture of its own output clip, and the
//! prediction jumps by the difference. The output moves as the outputs of the neighbors move, in which the posture of a
//! clip cancels out, and settles on the prediction in time:
//!
//! ```text
//! v  = mean (y[t] - y[t-1]) + part (x[t] - x[t-1] - mean (x[t] - x[t-1]))         means over the neighbors
//! y' = y + e^(-Δt / τ) (y'[t-1] + v - y)                                          τ: Config::settle_s, by class
//! ```
//!
//! Gaits take a quarter of that time: their cycles are alike, and longer settling smooths them. Repetitions of gestures
//! differ, and neighbors that change make them jump.
//!
//! A plain low pass would lag behind the motion; this one does not, since `v` leads it.
//!
//! Cost: some 40 operations a dof and frame, and a look at the labels of all classes for each class kept.

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

/// Least and greatest ratio of the variabilities of two styles.
const RATIOS: [f32; 2] = [0.5, 2.0];
/// Further from the prediction than this the last output says nothing (m, rad, m/s, rad/s).
const APART: f32 = 100.0;

/// The part of what lies outside the neighbors' interval that the output keeps: the input in `class`, the output in `mix`.
pub(super) fn part_kept(database: &Database<'_>, config: &Config, class: usize, mix: Mix<'_>) -> f32 {
    if config.liveliness <= 0.0 {
        return config.rho;
    }
    let far = |class: usize| database.familiar(class).map_or(0.0, |familiar| familiar.far);
    let (action, own) = (database.class(class).action, far(class));
    let others = (0..database.counts().classes).map(|other| (database.class(other), other));
    let style = others
        .filter(|(other, _)| other.action == action)
        .map(|(other, number)| (mix.weight(usize::from(other.style)), number))
        .filter(|(weight, _)| *weight > 0.0)
        .map(|(weight, number)| weight * far(number))
        .sum::<f32>();
    // 0 where the builder could not tell.
    let ratio = if own > 0.0 && style > 0.0 { clamp(sqrt(style / own), RATIOS[0], RATIOS[1]) } else { 1.0 };
    clamp(config.rho * config.liveliness * ratio, 0.0, 1.0)
}

/// Part of [`Config::settle_s`] that gaits take.
const GAIT_PART: f32 = 0.25;

/// How long the output of these classes settles, seconds.
fn settling_s(database: &Database<'_>, config: &Config, classes: &[Share]) -> f32 {
    let part = |share: &Share| if database.is_gait(usize::from(share.class)) { GAIT_PART } else { 1.0 };
    config.settle_s * classes.iter().map(|share| share.proportion * part(share)).sum::<f32>()
}

/// The output before strength.
#[derive(Debug, Clone)]
pub(super) struct Settled<const J: usize>(Dofs<J>);

impl<const J: usize> Settled<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = Self([[0.0; 4]; J]);

    /// Before a first frame: the output is what the neighbors say came before.
    pub fn begin(&mut self, y_prev: &Dofs<J>) {
        self.0 = *y_prev;
    }

    /// The dofs, to which the change of each class is added by its proportion.
    pub fn dofs(&mut self) -> &mut [f32] {
        self.0.as_flattened_mut()
    }

    /// Once all changes are added: settles on the prediction and its corrections, which are then the way from the prediction
    /// to the output.
    #[inline(never)]
    pub fn settle(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>) {
        let Context { frame: Frame { database, config, settings, .. }, signals, report, .. } = context;
        let seconds = 1.0 / database.rate_hz();
        let time = settling_s(database, config, &report.classes);
        let left = if time > 0.0 { exp(-seconds / time) } else { 0.0 };
        let predicted = signals.predicted.as_flattened();
        let slots = signals.correction.as_flattened_mut().iter_mut().zip(self.0.as_flattened_mut());
        for (d, ((correction, settled), &predicted)) in
            slots.zip(predicted).enumerate().take(database.counts().dofs)
        {
            let wanted = predicted + *correction;
            let apart = *settled - wanted;
            // Not of NaN either.
            *settled = if abs(apart) < APART { wanted + left * apart } else { wanted };
            *correction = if d == dof::YAW && config.yaw == Yaw::Input {
                0.0
            } else {
                settings.strength_of(database.group_of_dof(d)) * (*settled - predicted)
            };
        }
        signals.is_corrected = true;
    }
}
