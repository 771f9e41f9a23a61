//! From the mix to the prediction: the change of the input settles, so that it does not jump.
//!
//! The change c = y - x is pulled to that of the tables as an output of the mixture is to its prediction
//! ([`settling`](crate::methods::settling)), but no motion of neighbors leads it:
//!
//! ```text
//! c' = c + (a + b - a b) (c'[t-1] - c) + a b (c'[t-1] - c'[t-2])
//! ```
//!
//! It takes longer where a stream begins or leaps, and after a [`Jump`], as when an arm falls before the wave is over.
//!
//! Only rotations keep their velocity, in i16, which is all that fits into 8 KB. Height and speeds set off at once.

use crate::{
    blob::layout::dof,
    math::clamp,
    methods::{
        context::{Frame, Signals},
        settling::{Jump, Spring},
        weights::Shares,
    },
};

/// Part of [`Config::settle_s`](crate::Config::settle_s) in which the change of the input settles. Nothing leads it, so it
/// lags behind what the tables say.
const RATIO: f32 = 0.5;
/// Steps of the stored velocities in a radian a frame. 4 radians fit.
const CODES: f32 = 8192.0;

/// What a frame needs to know of the last ones.
#[derive(Debug, Clone)]
pub(super) struct Settled<const J: usize> {
    /// Last steps of the changes: the root's tilt, then the rotations of the joints. In [`CODES`], rounded to zero.
    steps: [[i16; 3]; J],
    jump: Jump,
}

impl<const J: usize> Settled<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    pub const NEW: Self = Self { steps: [[0; 3]; J], jump: Jump::NEW };

    /// Settles `signals.predicted`. `has_jumped` is true if the stream leaps, or the body is elsewhere in the clip of the
    /// nearest class than the last frame led to.
    #[inline(never)]
    pub fn settle(
        &mut self,
        frame: Frame<'_, '_>,
        signals: &mut Signals<J>,
        shares: &Shares,
        has_jumped: bool,
    ) {
        let Frame { database, config, first, .. } = frame;
        let seconds = 1.0 / database.rate_hz();
        let is_gait = |class| database.phase_tables(class).is_cyclic;
        let gesture = |class| (!is_gait(class)).then(|| database.class(class).action);
        let jump = self.jump.follow((first, seconds), shares, has_jumped, gesture);
        if first {
            self.steps = [[0; 3]; J];
            return;
        }
        let spring = Spring::new(seconds, RATIO * config.settle_s, jump, shares, is_gait);
        let [x, x_prev, y_prev] = [&signals.x, &signals.x_prev, &signals.y_prev].map(|of| of.as_flattened());
        let predicted = signals.predicted.as_flattened_mut();
        let mut pull = |d: usize, step: Option<&mut i16>| {
            let at = |of: &[f32]| of.get(d).copied().unwrap_or(0.0);
            let (x, before) = (at(x), at(y_prev) - at(x_prev));
            let Some(predicted) = predicted.get_mut(d) else { return };
            let velocity = step.as_ref().map_or(0.0, |step| f32::from(**step) * (1.0 / CODES));
            let now = spring.pull([before, before - velocity], *predicted - x, 0.0);
            *predicted = x + now;
            if let Some(step) = step {
                *step = clamp((now - before) * CODES, -32_767.0, 32_767.0) as i16;
            }
        };
        for d in [dof::HEIGHT, dof::FORWARD, dof::LEFT, dof::YAW] {
            pull(d, None);
        }
        let rotations = (dof::TILT..dof::FORWARD).chain(dof::JOINTS..database.counts().dofs);
        for (d, step) in rotations.zip(self.steps.as_flattened_mut()) {
            pull(d, Some(step));
        }
    }
}
