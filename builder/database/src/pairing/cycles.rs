//! Cycles and the data that pairing compares.

use gestus_core::blob::layout::dof;
use gestus_motion::{
    body::row_at,
    corpus::Cycle,
    statistics::{mean_or_zero, moments},
};

use crate::registration::warp;

/// Length of a content vector.
pub(super) const CONTENT: usize = 3;
/// Weight of each: mean speed, mean yaw rate, spread of the yaw rate.
const WEIGHTS: [f64; CONTENT] = [1.0, 0.5, 1.0];

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

/// Dofs of the pose at uniform phases, one after another: `[phases * D]`. The root's velocities are left out: they tell the
/// speed, not the movement.
pub(super) fn shape(cycle: &CycleData<'_>, phases: usize) -> Vec<f64> {
    (0..phases).flat_map(|p| warp::shape(&at(cycle, p as f64 / phases as f64))).collect()
}

/// Content of each cycle: mean speed, mean yaw rate and standard deviation of the yaw rate. The first two mean the same in
/// every style and are divided by their standard deviations over the database. The last is mostly the swing of the hips,
/// which depends on style: it is standardised within the class.
pub(super) fn standardised_content(cycles: &[CycleData<'_>], members: &[Vec<usize>]) -> Vec<Vec<f64>> {
    let mut content: Vec<Vec<f64>> = cycles
        .iter()
        .map(|c| {
            let (start, end) = c.cycle.span();
            let rows = &c.dofs[start.ceil().max(0.0) as usize..(end.ceil() as usize).clamp(1, c.dofs.len())];
            let speed = mean_or_zero(rows.iter().map(|r| r[dof::FORWARD]));
            let (yaw, spread) = moments(rows.iter().map(|r| r[dof::YAW]), 0.0);
            vec![speed, yaw, spread]
        })
        .collect();
    let everything: Vec<usize> = (0..cycles.len()).collect();
    for (k, weight) in WEIGHTS.into_iter().enumerate() {
        let groups: Vec<&Vec<usize>> = if k <= 1 { vec![&everything] } else { members.iter().collect() };
        for group in groups {
            let (mean, spread) = moments(group.iter().map(|&i| content[i][k]), 1e-9);
            for &i in group {
                content[i][k] = weight * (content[i][k] - mean) / spread;
            }
        }
    }
    content
}
