//! How long the output's step takes: the time between two poses in the output style.
//!
//! Prediction is by interpolation over the neighbors already found, with Gaussian weights on a distance of its
//! own: the input's pose and change, and the output's pose and change just synthesized (Xia 2015, section 5.1,
//! "Timing prediction"). It looks at few dofs, those that the database names. The kernel's width follows the
//! neighbors: a multiple of their mean squared distance.
//!
//! What to do with the step is the caller's policy: [`crate::config::Timing`].

use crate::{
    blob::{Database, layout::MAX_TIMING},
    math::{exp, sqrt},
    methods::mixture::variables::{Factor, X, X_PREV, Y, Y_PREV, parts_per_unit},
};

/// Parts of a weighed difference: the weights are such that a difference of a standard deviation counts as 1.
const UNITS: f32 = 16_384.0;

/// A dof of the timing metric, and the input's value of it, in parts as those of examples are.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Entry {
    dof: u16,
    /// Weight of differences of the dof.
    pose: Factor,
    /// Weight of differences of its change.
    change: Factor,
    /// Parts in one unit of the dof.
    parts: f32,
    /// The input's dof and its change from the frame before.
    input: [i32; 2],
}

/// What the timing prediction remembers of one neighbor.
#[derive(Debug, Clone, Copy)]
struct Memory {
    /// The part of the squared distance that is known before the output is.
    input_distance2: u64,
    step_s: f32,
    /// Output dof and its change, for each entry of the timing metric.
    output: [[i32; 2]; MAX_TIMING],
}

/// The neighbors of one class, as the timing prediction sees them.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Steps<const K: usize> {
    metric: [Entry; MAX_TIMING],
    entries: usize,
    memories: [Memory; K],
    weights: [f32; K],
    count: usize,
}

impl<const K: usize> Steps<K> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    const NEW: Self = {
        let nothing = Entry { dof: 0, pose: Factor::ZERO, change: Factor::ZERO, parts: 0.0, input: [0; 2] };
        let empty = Memory { input_distance2: 0, step_s: 0.0, output: [[0; 2]; MAX_TIMING] };
        Self { metric: [nothing; MAX_TIMING], entries: 0, memories: [empty; K], weights: [0.0; K], count: 0 }
    };

    /// No neighbors.
    pub const fn new() -> Self {
        Self::NEW
    }

    /// What neighbors are compared with: the input's dofs and those of the frame before.
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

    /// Forgets the neighbors.
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Takes in a neighbor; `variables` as in [`Example`](super::variables::Example).
    pub fn add(&mut self, variables: &[[i32; 4]], step_s: f32) {
        let Some(memory) = self.memories.get_mut(self.count) else { return };
        self.count += 1;
        memory.set(self.metric.get(..self.entries).unwrap_or(&[]), variables, step_s);
    }

    /// The step of the class in seconds, given its synthesized output and the output before; `width` is the kernel's,
    /// in mean squared distances. 0 of no neighbors.
    pub fn predict(&mut self, y: &[f32], y_prev: &[f32], width: f32) -> f32 {
        let metric = self.metric.get(..self.entries).unwrap_or(&[]);
        let memories = self.memories.get(..self.count).unwrap_or(&[]);
        interpolate(metric, memories, &mut self.weights, [y, y_prev], width)
    }

    /// The neighbors' weights in the last prediction, in the order in which they were added; they sum to 1.
    pub fn weights(&self) -> &[f32] {
        self.weights.get(..self.count).unwrap_or(&[])
    }
}

/// The step, and in `weights` the weight of each neighbor. Of no capacity: it is compiled with the core, for speed,
/// however its caller is.
#[inline(never)]
fn interpolate(
    metric: &[Entry],
    memories: &[Memory],
    weights: &mut [f32],
    [y, y_prev]: [&[f32]; 2],
    width: f32,
) -> f32 {
    let mut query = [[0; 2]; MAX_TIMING];
    for (slot, entry) in query.iter_mut().zip(metric) {
        *slot = entry.pose_and_change(y, y_prev);
    }
    let weights = weights.get_mut(..memories.len()).unwrap_or(&mut []);
    let (mut sum, mut least) = (0, u64::MAX);
    for (weight, memory) in weights.iter_mut().zip(memories) {
        let entries = metric.iter().zip(query.iter().zip(&memory.output));
        let output: u64 = entries.map(|(entry, (&query, &output))| entry.distance2(query, output)).sum();
        let distance2 = memory.input_distance2 + output;
        *weight = distance2 as f32;
        sum += distance2;
        least = least.min(distance2);
    }
    if memories.is_empty() {
        return 0.0;
    }
    let (least, scale) = (least as f32, 2.0 * width * sum as f32 / memories.len() as f32);
    let slope = -1.0 / if scale > 1e-20 { scale } else { 1e-20 };
    let (mut total, mut step) = (0.0, 0.0);
    for (weight, memory) in weights.iter_mut().zip(memories) {
        // Relative to the nearest: the largest weight is 1 and the sum never vanishes.
        *weight = exp((*weight - least) * slope);
        total += *weight;
        step += *weight * memory.step_s;
    }
    let inverse = 1.0 / total;
    for weight in weights {
        *weight *= inverse;
    }
    step * inverse
}

impl Memory {
    /// Takes in a neighbor.
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
    /// A stream's dof and its change from the frame before, in parts; held within 32 bits.
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
