//! A crowd: many characters on one database.

use super::Stylizer;
use crate::{Pose, Report};

/// Steps each character once: `stylizers[i]` takes `inputs[i]`, writes `outputs[i]`, and reports in `reports[i]`. Returns
/// the number of characters stepped, which is the length of the shortest slice.
///
/// The bits are those of [`Stylizer::step`]. They do not depend on the order, so a host may divide the slices among threads.
/// Characters share only the database; each has its own style, labels and strengths.
pub fn step_many<const J: usize, const K: usize, const C: usize>(
    stylizers: &mut [Stylizer<'_, J, K, C>],
    inputs: &[Pose<J>],
    outputs: &mut [Pose<J>],
    reports: &mut [Report],
) -> usize {
    let characters = stylizers.iter_mut().zip(inputs).zip(outputs).zip(reports);
    characters.map(|(((stylizer, input), output), report)| *report = stylizer.step(input, output)).count()
}
