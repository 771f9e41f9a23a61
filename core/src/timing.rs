//! How long the output's step takes: the time between two poses in the output style.
//!
//! Prediction is by interpolation over the neighbors already found, with Gaussian weights on a distance of its
//! own: the input's pose and change, and the output's pose and change just synthesized (paper 000, section 5.1,
//! "Timing prediction"). It looks at few dofs, those that the database names. The kernel's width follows the
//! neighbors: a multiple of their mean squared distance.
//!
//! What to do with the step is the caller's policy: [`Timing`].

use crate::{
    blob::{Database, layout::MAX_TIMING},
    math::exp,
    regress::Variables,
};

/// Policy for the output's time.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Timing {
    /// Poses carry their predicted time stamps: the output runs on its own timeline. For files.
    #[default]
    Free,
    /// One pose in, one pose out, played at the input's rate. The root still covers the ground of the predicted
    /// step, so that feet stay where the pose has them. For robots.
    Sync,
}

/// What the timing prediction remembers of one neighbor.
#[derive(Debug, Clone, Copy)]
struct Memory {
    /// The part of the squared distance that is known before the output is.
    input_distance2: f32,
    step_s: f32,
    /// Output dof and its change, for each entry of the timing metric.
    output: [[f32; 2]; MAX_TIMING],
}

/// The neighbors of one class, as the timing prediction sees them.
#[derive(Debug, Clone)]
pub struct Steps<const K: usize> {
    memories: [Memory; K],
    weights: [f32; K],
    count: usize,
}

impl<const K: usize> Steps<K> {
    /// No neighbors.
    #[inline(never)]
    pub const fn new() -> Self {
        const EMPTY: Memory = Memory { input_distance2: 0.0, step_s: 0.0, output: [[0.0; 2]; MAX_TIMING] };
        Self { memories: [EMPTY; K], weights: [0.0; K], count: 0 }
    }

    /// Forgets the neighbors.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes in a neighbor; `x` and `x_prev` are the input's dofs.
    pub fn add<const J: usize>(
        &mut self,
        database: &Database<'_>,
        x: &[f32],
        x_prev: &[f32],
        example: &Variables<J>,
        step_s: f32,
    ) {
        let Some(memory) = self.memories.get_mut(self.count) else { return };
        self.count += 1;
        memory.step_s = step_s;
        memory.input_distance2 = 0.0;
        let (ex, exp) = (example.x.as_flattened(), example.x_prev.as_flattened());
        let (ey, eyp) = (example.y.as_flattened(), example.y_prev.as_flattened());
        for (i, slot) in memory.output.iter_mut().enumerate().take(database.counts().timing) {
            let timing = database.timing(i);
            let at = |values: &[f32]| values.get(timing.dof).copied().unwrap_or(0.0);
            let pose = at(x) - at(ex);
            let change = (at(x) - at(x_prev)) - (at(ex) - at(exp));
            memory.input_distance2 += timing.pose * (pose * pose) + timing.change * (change * change);
            *slot = [at(ey), at(ey) - at(eyp)];
        }
    }

    /// The step of the class in seconds, given its synthesized output; `width` is the kernel's, in mean squared
    /// distances. 0 of no neighbors.
    pub fn predict(&mut self, database: &Database<'_>, y: &[f32], y_prev: &[f32], width: f32) -> f32 {
        let count = self.count.min(K);
        let mut mean = 0.0;
        for (weight, memory) in self.weights.iter_mut().zip(&self.memories).take(count) {
            let mut distance2 = memory.input_distance2;
            for (i, &[output, output_change]) in
                memory.output.iter().enumerate().take(database.counts().timing)
            {
                let timing = database.timing(i);
                let at = |values: &[f32]| values.get(timing.dof).copied().unwrap_or(0.0);
                let pose = at(y) - output;
                let change = (at(y) - at(y_prev)) - output_change;
                distance2 += timing.pose * (pose * pose) + timing.change * (change * change);
            }
            *weight = distance2;
            mean += distance2;
        }
        let least = self.weights.iter().take(count).fold(f32::INFINITY, |l, &d| if d < l { d } else { l });
        let scale = 2.0 * width * mean / count.max(1) as f32;
        let scale = if scale > 1e-20 { scale } else { 1e-20 };
        let (mut total, mut step) = (0.0, 0.0);
        for (weight, memory) in self.weights.iter_mut().zip(&self.memories).take(count) {
            // Relative to the nearest: the largest weight is 1 and the sum never vanishes.
            *weight = exp(-(*weight - least) / scale);
            total += *weight;
            step += *weight * memory.step_s;
        }
        if count == 0 {
            return 0.0;
        }
        for weight in self.weights.iter_mut().take(count) {
            *weight /= total;
        }
        step / total
    }

    /// The neighbors' weights in the last prediction, in the order in which they were added; they sum to 1.
    pub fn weights(&self) -> &[f32] {
        self.weights.get(..self.count).unwrap_or(&[])
    }
}

impl<const K: usize> Default for Steps<K> {
    fn default() -> Self {
        Self::new()
    }
}
