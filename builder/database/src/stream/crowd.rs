//! A crowd on several threads.

use gestus_core::{Pose, Report, Stylizer};
use rayon::prelude::*;

/// Parts a thread, so that one which is slow does not keep the others waiting.
const PARTS: usize = 4;

/// Steps each character once, as [`gestus_core::step_many`] does and to the same bits, on the threads of the current rayon
/// pool. Characters beyond the shortest slice are left out.
pub fn step_many<const J: usize, const K: usize, const C: usize>(
    stylizers: &mut [Stylizer<'_, J, K, C>],
    inputs: &[Pose<J>],
    outputs: &mut [Pose<J>],
    reports: &mut [Report],
) {
    let part = stylizers.len().div_ceil(PARTS * rayon::current_num_threads()).max(1);
    let parts = (stylizers.par_chunks_mut(part), inputs.par_chunks(part))
        .into_par_iter()
        .zip((outputs.par_chunks_mut(part), reports.par_chunks_mut(part)));
    parts.for_each(|((stylizers, inputs), (outputs, reports))| {
        gestus_core::step_many(stylizers, inputs, outputs, reports);
    });
}
