//! What every method of translation is given of a frame, and where it puts its answer: the methods know this and no
//! stylizer, the stylizer knows the methods.

use crate::{Config, blob::Database, pose::Dofs, settings::Settings};

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
    /// `y[t-1]`: the last prediction, before strength. The mixture puts what it feeds back in its place.
    pub y_prev: Dofs<J>,
    /// `y[t]`.
    pub predicted: Dofs<J>,
    /// By how much faster than predicted the body is to be moved over the ground, ahead and to the left, m/s. Taken once.
    pub standing: [f32; 2],
    /// The dofs put out, after strength; until then room for what one class predicts.
    pub output: Dofs<J>,
}

impl<const J: usize> Signals<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = {
        let zero = [[0.0; 4]; J];
        Self { x: zero, x_prev: zero, y_prev: zero, predicted: zero, standing: [0.0; 2], output: zero }
    };
}
