//! A look inside a step, for those who check it: `gestus translate --trace`, and tests.
//!
//! Every method does nothing by default, and a step that nobody looks into costs nothing.

use crate::{knn::Neighbor, pose::Dofs, query::Feature};

/// Sees what a step computes, in the order in which it does.
pub trait Observer<const J: usize> {
    /// The query.
    fn query(&mut self, _feature: &Feature) {}
    /// The neighbors of a class, nearest first, and their mean squared distance.
    fn searched(&mut self, _class: usize, _neighbors: &[Neighbor], _mean_distance2: f32) {}
    /// The neighbors of a kept class in the order in which the timing weighs them, and their weights.
    fn timed(&mut self, _class: usize, _rows: &[u16], _weights: &[f32]) {}
    /// The variables of the frame, and what was predicted (after yaw and strength).
    fn predicted(&mut self, _x: &Dofs<J>, _x_prev: &Dofs<J>, _y_prev: &Dofs<J>, _predicted: &Dofs<J>) {}
}

impl<const J: usize> Observer<J> for () {}
