//! Cycles and the data that pairing compares.

use gestus_motion::{body::row_at, corpus::Cycle};

/// A cycle of the database, with the data that pairing compares.
#[derive(Debug, Clone)]
pub struct CycleData<'a> {
    /// Number of its class.
    pub class: usize,
    /// Number of its clip.
    pub clip: usize,
    /// Take of its clip.
    pub take: &'a str,
    /// Its index in the clip.
    pub index: usize,
    /// Its timeline, in frames of the clip.
    pub cycle: &'a Cycle,
    /// Dofs of the whole clip, shape `[frames][D]`.
    pub dofs: &'a [Vec<f64>],
}

/// Action and style of a class.
pub type ClassName = (usize, usize);

/// Dofs of a cycle at a phase, interpolated.
pub(super) fn at(cycle: &CycleData<'_>, phase: f64) -> Vec<f64> {
    row_at(cycle.dofs, cycle.cycle.position(phase))
}

/// Squared distance of two rows of numbers.
pub(super) fn distance2(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}
