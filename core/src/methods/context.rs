//! The interface between the stylizer and a method: what a method gets of a frame, and where it leaves its result.

use super::work::{Load, Work};
use crate::{
    Config, Observer, Pose, Report, blob::Database, body::pose::Dofs, stylizer::style_mix::Settings,
};

/// What stays the same through a frame.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a, 'db> {
    pub database: &'a Database<'db>,
    pub config: &'a Config,
    pub settings: &'a Settings,
    /// True in the first frame of a stream.
    pub first: bool,
}

/// A frame on its way through a method.
pub(crate) struct Context<'a, 'db, const J: usize, O: Observer<J>> {
    pub frame: Frame<'a, 'db>,
    pub input: &'a Pose<J>,
    pub signals: &'a mut Signals<J>,
    pub report: &'a mut Report,
    pub observer: &'a mut O,
}

/// The dofs of the stream, and where a method leaves its prediction.
#[derive(Debug, Clone)]
pub(crate) struct Signals<const J: usize> {
    /// `x[t]`: the input.
    pub x: Dofs<J>,
    /// `x[t-1]`.
    pub x_prev: Dofs<J>,
    /// `y[t-1]`: the last prediction, before strength.
    pub y_prev: Dofs<J>,
    /// `y[t]`: the prediction, before strength.
    pub predicted: Dofs<J>,
    /// Added to the output after strength, and not fed back. Cleared when it is added. Only the mixture uses it.
    #[cfg(feature = "mar")]
    pub correction: Dofs<J>,
    /// True where a correction is to be added.
    #[cfg(feature = "mar")]
    pub is_corrected: bool,
    /// The output, after strength.
    pub output: Dofs<J>,
    /// Scratch memory of a method. Its content does not outlive [`Translate::predict`].
    pub scratch: Dofs<J>,
}

impl<const J: usize> Signals<J> {
    /// A constant of zeros, which every optimisation level writes in place.
    pub const NEW: Self = {
        let zero = [[0.0; 4]; J];
        Self {
            x: zero,
            x_prev: zero,
            y_prev: zero,
            predicted: zero,
            #[cfg(feature = "mar")]
            correction: zero,
            #[cfg(feature = "mar")]
            is_corrected: false,
            output: zero,
            scratch: zero,
        }
    };

    /// Adds the correction to the output, and clears it. Not added if `is_valid` is false, because the prediction was
    /// replaced.
    #[cfg(feature = "mar")]
    #[inline]
    pub fn add_correction(&mut self, is_valid: bool) {
        if core::mem::take(&mut self.is_corrected) {
            add_corrections(self.output.as_flattened_mut(), self.correction.as_flattened_mut(), is_valid);
        }
    }

    #[cfg(not(feature = "mar"))]
    pub fn add_correction(&mut self, _: bool) {}
}

/// Clears the corrections, and adds them if they are valid.
#[cfg(feature = "mar")]
#[inline(never)]
fn add_corrections(output: &mut [f32], corrections: &mut [f32], are_valid: bool) {
    for (output, correction) in output.iter_mut().zip(corrections) {
        let correction = core::mem::take(correction);
        if are_valid {
            *output += correction;
        }
    }
}

/// The requirements of a method on labels and styles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Needs {
    /// Labels have to name an existing class.
    pub labelled_class: bool,
    /// The whole body has one style: no joint group may have its own.
    pub whole_body: bool,
}

/// A method of translation. To add one: implement this, and name it in [`Method`](crate::Method) and
/// [`Engine`](super::engine::Engine); the compiler finds the other places.
pub(crate) trait Translate<const J: usize> {
    /// The state before the first frame. A constant of zeros, which every optimisation level writes in place: it would
    /// not fit a stack.
    const NEW: Self;
    /// Its requirements on labels and styles.
    const NEEDS: Needs;

    /// An upper bound on the work of a step, for any stream.
    fn worst_step(database: &Database<'_>, config: &Config, load: &Load) -> Work;

    /// Predicts every dof into `signals.predicted`, and into the report how likely each foot stands, and the time step
    /// if it is not the input's. On a first frame it also sets what came before: `signals.x_prev`, `signals.y_prev`,
    /// and the root's velocities in `signals.x`.
    fn predict(&mut self, context: &mut Context<'_, '_, J, impl Observer<J>>);

    /// Forgets the frames before this one after a leap: they do not show how the body moves now.
    fn forget_window(&mut self) {}

    /// Forgets the stream.
    fn reset(&mut self);
}
