//! From the predictions to the output: as lively as the style, and as smooth as the neighbors.
//!
//! Both parts are corrections, which are not fed back: the predictions follow the equations of Xia 2015 alone.
//!
//! **Liveliness.** The part `Δx` of the input that lies outside the neighbors' interval is most of what makes one cycle
//! differ from the next. The prediction keeps ρ of it (Xia 2015, eq. 7), whether the style is livelier or calmer than
//! the input. The output keeps a part that follows the style:
//!
//! ```text
//! ρ_out = min(1, ρ l √(far(style) / far(input)))       l: Config::liveliness; the square root is clamped to 1/2 to 2
//! ```
//!
//! `far` is the squared distance between a class's own clips, as the builder has measured it
//! ([`TrustLimits`](crate::blob::TrustLimits)), averaged in a mix of styles.
//!
//! **Settling.** Neighbors change from frame to frame. Each has the posture of its own output clip, so the prediction
//! jumps by the difference. The output follows the mean *change* of the neighbors' outputs, in which the postures
//! cancel out, and a spring pulls it to the prediction ([`settling`](crate::methods::settling)):
//!
//! ```text
//! v     = mean (y[t] - y[t-1]) + ρ_out (x[t] - x[t-1] - mean (x[t] - x[t-1]))       means over the neighbors
//! y_led = y'[t-1] + v
//! ```
//!
//! A plain low-pass filter would lag behind the motion; this one does not, because v leads it.
//!
//! Cost: some 45 operations a dof and frame, and a pass over the labels of all classes for each class kept.

use crate::{
    Config, Observer,
    blob::{Database, layout::dof},
    body::pose::Dofs,
    config::Yaw,
    math::{clamp, sqrt},
    methods::{
        context::{Context, Frame},
        settling::{Jump, Spring},
    },
    stylizer::style_mix::StyleMix,
};

/// Least and greatest ratio between the variabilities of two styles.
const RATIOS: [f32; 2] = [0.5, 2.0];

/// ρ of the output: the part of `Δx` that it keeps, for input of `class` and output in `mix`. 0 to 1.
pub(super) fn output_rho(database: &Database<'_>, config: &Config, class: usize, mix: StyleMix<'_>) -> f32 {
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

/// The output before strength.
#[derive(Debug, Clone)]
pub(super) struct Settled<const J: usize> {
    /// The last output, `[dofs]`.
    last: Dofs<J>,
    /// The one before it, `[dofs]`.
    before: Dofs<J>,
    jump: Jump,
}

impl<const J: usize> Settled<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    pub const NEW: Self = Self { last: [[0.0; 4]; J], before: [[0.0; 4]; J], jump: Jump::NEW };

    /// Begins a frame, and returns its spring. `has_jumped` is true if the body is at another place of the nearest class's
    /// clip than the last frames led to.
    #[inline(never)]
    pub fn begin(&mut self, context: &Context<'_, '_, J, impl Observer<J>>, has_jumped: bool) -> Spring {
        let Frame { database, config, first, .. } = context.frame;
        let seconds = 1.0 / database.rate_hz();
        if first {
            // A stream begins with the mean last output of the neighbors, and moves as they do.
            self.last = context.signals.y_prev;
        }
        let (is_gait, shares) = (|class| database.is_gait(class), &context.report.classes);
        let gesture = |class| (!is_gait(class)).then(|| database.class(class).action);
        let jump = self.jump.follow(first, seconds, shares, f32::from(u8::from(has_jumped)), gesture);
        let spring = Spring::new(seconds, config.settle_s, jump, shares, is_gait);
        if first { spring.at_rest() } else { spring }
    }

    /// Notes whether the body has jumped in the clip of a class with this proportion. In one that is not the nearest, a jump
    /// counts from the next frame on: the spring of this one is in use.
    pub fn note(&mut self, has_jumped: bool, proportion: f32) {
        if has_jumped {
            self.jump.notice(proportion);
        }
    }

    /// Settles on the prediction, after corrections and changes of all classes were added up in `signals.correction` by the
    /// [`parts`](Spring::parts) of the spring. That is then the difference between output and prediction.
    #[inline(never)]
    pub fn settle(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>, spring: Spring) {
        let Context { frame: Frame { database, config, settings, .. }, signals, .. } = context;
        let predicted = signals.predicted.as_flattened();
        let corrections = signals.correction.as_flattened_mut();
        let outputs = self.last.as_flattened_mut().iter_mut().zip(self.before.as_flattened_mut());
        for (d, ((correction, (last, before)), &predicted)) in
            corrections.iter_mut().zip(outputs).zip(predicted).enumerate().take(database.counts().dofs)
        {
            let now = spring.pull([*last, *before], predicted, *correction);
            (*before, *last) = (*last, now);
            *correction = if d == dof::YAW && config.yaw == Yaw::Input {
                0.0
            } else {
                settings.strength_of(database.group_of_dof(d)) * (now - predicted)
            };
        }
        signals.is_corrected = true;
    }
}
