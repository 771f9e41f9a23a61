//! From the mix to the prediction: the change of the input settles, so that it does not jump.
//!
//! The change c = y - x is pulled to that of the tables as an output of the mixture is to its prediction
//! ([`settling`](crate::methods::settling)), but no motion of neighbors leads it:
//!
//! ```text
//! c' = c + (a + b - a b) (c'[t-1] - c) + a b (c'[t-1] - c'[t-2])
//! ```
//!
//! It takes longer where a stream begins or leaps, after a [`Jump`], as when an arm falls before the wave is over, and where
//! the body is far from every class, as between two actions.
//!
//! Only rotations keep their velocity, stored as i16, because a stylizer of tables by phase alone has 8 KB. Height and speeds
//! start at once.

use crate::{
    blob::layout::dof,
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

    /// Settles `signals.predicted`. `elsewhere` is 1 if the stream begins or leaps, the body is far from every class, or
    /// elsewhere in the clip of the nearest than the last frame led to, and less if it is elsewhere in a cycle.
    #[inline(never)]
    pub fn settle(
        &mut self,
        frame: Frame<'_, '_>,
        signals: &mut Signals<J>,
        shares: &Shares,
        elsewhere: f32,
    ) {
        let Frame { database, config, first, .. } = frame;
        let seconds = 1.0 / database.rate_hz();
        let is_gait = |class| database.phase_tables(class).is_cyclic;
        let gesture = |class| (!is_gait(class)).then(|| database.class(class).action);
        let jump = self.jump.follow(first, seconds, shares, elsewhere, gesture);
        if first {
            self.steps = [[0; 3]; J];
            return;
        }
        let spring = Spring::new(seconds, RATIO * config.settle_s, jump, shares, is_gait);
        settle(spring, signals, database.counts().dofs, self.steps.as_flattened_mut());
    }
}

/// Settles the first `dofs` of `signals.predicted`. `steps` has those of the rotations.
#[inline]
fn settle<const J: usize>(spring: Spring, signals: &mut Signals<J>, dofs: usize, steps: &mut [i16]) {
    let [x, x_prev, y_prev] = [&signals.x, &signals.x_prev, &signals.y_prev].map(|of| of.as_flattened());
    let last = x_prev.iter().zip(y_prev).map(|(x, y)| y - x);
    let frame = signals.predicted.as_flattened_mut().iter_mut().zip(x).zip(last).take(dofs);
    let mut steps = steps.iter_mut();
    for (d, ((predicted, &x), last)) in frame.enumerate() {
        let is_rotation = d >= dof::JOINTS || (dof::TILT..dof::FORWARD).contains(&d);
        let step = if is_rotation { steps.next() } else { None };
        let velocity = step.as_ref().map_or(0.0, |step| f32::from(**step) * (1.0 / CODES));
        let now = spring.pull([last, last - velocity], *predicted - x, 0.0);
        *predicted = x + now;
        if let Some(step) = step {
            *step = (((now - last) * CODES) as i32).clamp(-32_767, 32_767) as i16;
        }
    }
}
