//! Predicts how long the output's step takes: the time between two poses in the output style.
//!
//! The steps of the neighbors are interpolated with Gaussian weights on a distance of its own: pose and change of the input,
//! and pose and change of the output just synthesized (Xia 2015, section 5.1, "Timing prediction"). It compares only
//! the dofs that the database names. The width of the kernel is a multiple of the neighbors' mean squared distance.
//!
//! Whether the output uses the step is the caller's choice: [`crate::config::Timing`].

use crate::{
    blob::{Database, layout::MAX_TIMING},
    math::{exp, maximum, sqrt},
    methods::mixture::variables::{Factor, X, X_PREV, Y, Y_PREV, parts_per_unit},
};

/// Fixed-point scale of a weighted difference. A difference of one standard deviation is 1.
const UNITS: f32 = 16_384.0;

/// A dof of the timing metric, and its value in the input, in the fixed point of examples.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Entry {
    dof: u16,
    /// Weight of a difference of the dof.
    pose: Factor,
    /// Weight of a difference of its change from the frame before.
    change: Factor,
    /// Parts in one unit of the dof.
    parts: f32,
    /// The input's dof and its change from the frame before.
    input: [i32; 2],
}

/// A neighbor, as the timing prediction needs it.
#[derive(Debug, Clone, Copy)]
struct NeighborStep {
    /// The part of the squared distance that does not depend on the output, in square units of [`UNITS`].
    input_distance2: u64,
    /// Duration of the neighbor's step, seconds.
    step_s: f32,
    /// Output dof and its change, `[entries of the metric]`, in the fixed point of examples.
    output: [[i32; 2]; MAX_TIMING],
}

/// The neighbors of one class, and the timing metric.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Steps<const K: usize> {
    metric: [Entry; MAX_TIMING],
    entries: usize,
    neighbors: [NeighborStep; K],
    weights: [f32; K],
    count: usize,
}

impl<const K: usize> Steps<K> {
    /// A constant of zeros, which every optimisation level writes in place.
    const NEW: Self = {
        let nothing = Entry { dof: 0, pose: Factor::ZERO, change: Factor::ZERO, parts: 0.0, input: [0; 2] };
        let empty = NeighborStep { input_distance2: 0, step_s: 0.0, output: [[0; 2]; MAX_TIMING] };
        Self { metric: [nothing; MAX_TIMING], entries: 0, neighbors: [empty; K], weights: [0.0; K], count: 0 }
    };

    /// No neighbors.
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Sets what neighbors are compared with: the input's dofs and those of the frame before, `[dofs]`.
    pub fn set_query(&mut self, database: &Database<'_>, x: &[f32], x_prev: &[f32]) {
        self.entries = database.counts().timing.min(MAX_TIMING);
        for (i, entry) in self.metric.iter_mut().enumerate().take(self.entries) {
            let timing = database.timing(i);
            let step = database.step(timing.dof);
            *entry = Entry {
                dof: timing.dof as u16,
                pose: Factor::new(step, UNITS * sqrt(timing.pose)),
                change: Factor::new(step, UNITS * sqrt(timing.change)),
                parts: parts_per_unit(step),
                input: [0; 2],
            };
            entry.input = entry.pose_and_change(x, x_prev);
        }
    }

    /// Removes all neighbors.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a neighbor, whose step takes `step_s` seconds; `variables` as in [`Example`](super::variables::Example).
    pub fn add(&mut self, variables: &[[i32; 4]], step_s: f32) {
        let Some(neighbor) = self.neighbors.get_mut(self.count) else { return };
        self.count += 1;
        neighbor.set(self.metric.get(..self.entries).unwrap_or(&[]), variables, step_s);
    }

    /// Predicts the class's step, seconds, from its synthesized output `y` and the output before it, `[dofs]`. `width`
    /// is the kernel's, as a multiple of the mean squared distance. 0 without neighbors.
    pub fn predict(&mut self, y: &[f32], y_prev: &[f32], width: f32) -> f32 {
        let metric = self.metric.get(..self.entries).unwrap_or(&[]);
        let neighbors = self.neighbors.get(..self.count).unwrap_or(&[]);
        interpolate(metric, neighbors, &mut self.weights, [y, y_prev], width)
    }

    /// The neighbors' weights in the last prediction, in the order in which they were added; they sum to 1.
    pub fn weights(&self) -> &[f32] {
        self.weights.get(..self.count).unwrap_or(&[])
    }
}

/// Returns the step, seconds, and writes the weight of each neighbor to `weights`.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn interpolate(
    metric: &[Entry],
    neighbors: &[NeighborStep],
    weights: &mut [f32],
    [y, y_prev]: [&[f32]; 2],
    width: f32,
) -> f32 {
    let mut query = [[0; 2]; MAX_TIMING];
    for (slot, entry) in query.iter_mut().zip(metric) {
        *slot = entry.pose_and_change(y, y_prev);
    }
    let weights = weights.get_mut(..neighbors.len()).unwrap_or(&mut []);
    let (mut sum, mut nearest) = (0u64, u64::MAX);
    for (weight, neighbor) in weights.iter_mut().zip(neighbors) {
        let entries = metric.iter().zip(query.iter().zip(&neighbor.output));
        let output: u64 = entries.map(|(entry, (&query, &output))| entry.distance2(query, output)).sum();
        let distance2 = neighbor.input_distance2 + output;
        *weight = distance2 as f32;
        // Each fits, whatever the blob's weights are.
        sum = sum.saturating_add(distance2);
        nearest = nearest.min(distance2);
    }
    if neighbors.is_empty() {
        return 0.0;
    }
    let (nearest, scale) = (nearest as f32, 2.0 * width * sum as f32 / neighbors.len() as f32);
    let slope = -1.0 / maximum(scale, 1e-20);
    let (mut total, mut step) = (0.0, 0.0);
    for (weight, neighbor) in weights.iter_mut().zip(neighbors) {
        // Relative to the nearest, so that the largest weight is 1 and the sum is never 0.
        *weight = exp((*weight - nearest) * slope);
        total += *weight;
        step += *weight * neighbor.step_s;
    }
    let inverse = 1.0 / total;
    for weight in weights {
        *weight *= inverse;
    }
    step * inverse
}

impl NeighborStep {
    /// Sets the neighbor from its variables and the duration of its step, seconds.
    #[inline(never)]
    fn set(&mut self, metric: &[Entry], variables: &[[i32; 4]], step_s: f32) {
        self.step_s = step_s;
        self.input_distance2 = 0;
        for (entry, slot) in metric.iter().zip(&mut self.output) {
            let Some(&v) = variables.get(usize::from(entry.dof)) else { continue };
            self.input_distance2 += entry.distance2(entry.input, [v[X], v[X].saturating_sub(v[X_PREV])]);
            *slot = [v[Y], v[Y].saturating_sub(v[Y_PREV])];
        }
    }
}

impl Entry {
    /// A dof of a stream and its change from the frame before, in the fixed point of examples, saturated to 32 bits.
    fn pose_and_change(&self, now: &[f32], before: &[f32]) -> [i32; 2] {
        let at = |values: &[f32]| values.get(usize::from(self.dof)).copied().unwrap_or(0.0) * self.parts;
        [at(now) as i32, (at(now) - at(before)) as i32]
    }

    /// Squared distance, in square units of which [`UNITS`]² make 1.
    #[inline]
    fn distance2(&self, query: [i32; 2], found: [i32; 2]) -> u64 {
        self.pose.squared(query[0].saturating_sub(found[0]))
            + self.change.squared(query[1].saturating_sub(found[1]))
    }
}

impl<const K: usize> Default for Steps<K> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Weights that `open` takes, and neighbors as far away as numbers go: the sum of distances wrapped around.
    #[test]
    fn the_farthest_neighbors_have_a_step() {
        let factor = Factor::new(1.0, UNITS * sqrt(1e9));
        let entry = Entry { dof: 0, pose: factor, change: factor, parts: 1.0, input: [i32::MIN, i32::MAX] };
        let (metric, mut neighbors) = (
            [entry; MAX_TIMING],
            [NeighborStep { step_s: 0.0, input_distance2: 0, output: [[0; 2]; MAX_TIMING] }; 64],
        );
        for neighbor in &mut neighbors {
            neighbor.set(&metric, &[[i32::MAX, i32::MIN, i32::MAX, i32::MIN]], 0.04);
        }
        let mut weights = [0.0; 64];
        let step = interpolate(&metric, &neighbors, &mut weights, [&[-1e30], &[1e30]], 1.0);
        assert!(
            (step - 0.04).abs() < 1e-6 && weights.iter().all(|w| (w - 1.0 / 64.0).abs() < 1e-6),
            "{step}"
        );
    }
}
