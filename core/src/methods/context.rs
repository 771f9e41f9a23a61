//! What every method of translation is given of a frame, and where it puts its answer: the methods know this and no
//! stylizer, the stylizer knows the methods.

use crate::{Config, blob::Database, body::pose::Dofs, stylizer::style_mix::Settings};

/// What stays the same through a frame.
#[derive(Clone, Copy)]
pub(crate) struct Frame<'a, 'db> {
    pub database: &'a Database<'db>,
    pub config: &'a Config,
    pub settings: &'a Settings,
    /// No frame before this one.
    pub first: bool,
}

/// What a method of translation sees of the stream, and where it puts its answer.
#[derive(Debug, Clone)]
pub(crate) struct Signals<const J: usize> {
    /// `x[t]`, the input.
    pub x: Dofs<J>,
    /// `x[t-1]`.
    pub x_prev: Dofs<J>,
    /// `y[t-1]`: the last prediction, before strength.
    pub y_prev: Dofs<J>,
    /// `y[t]`.
    pub predicted: Dofs<J>,
    /// What is added to the prediction on the way out, after strength, and not fed back. Taken once.
    pub correction: Dofs<J>,
    /// Something is to be added.
    pub is_corrected: bool,
    /// The dofs put out, after strength; until then room for what one class predicts.
    pub output: Dofs<J>,
}

impl<const J: usize> Signals<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = {
        let zero = [[0.0; 4]; J];
        Self {
            x: zero,
            x_prev: zero,
            y_prev: zero,
            predicted: zero,
            correction: zero,
            is_corrected: false,
            output: zero,
        }
    };
}
