//! A crowd: many characters on one database.

use super::Stylizer;
use crate::{Pose, Report};

/// Steps each character once: `stylizers[i]` takes `inputs[i]`, writes `outputs[i]`, and reports in `reports[i]`. Returns
/// how many were stepped, which is the length of the shortest slice.
///
/// The bits are those of [`Stylizer::step`], whatever the order and the division: a host with threads gives each a part
/// of the slices. Characters share the database and nothing else; each has its own style, labels and strengths.
pub fn step_many<const J: usize, const K: usize, const C: usize>(
    stylizers: &mut [Stylizer<'_, J, K, C>],
    inputs: &[Pose<J>],
    outputs: &mut [Pose<J>],
    reports: &mut [Report],
) -> usize {
    let characters = stylizers.iter_mut().zip(inputs).zip(outputs).zip(reports);
    characters.map(|(((stylizer, input), output), report)| *report = stylizer.step(input, output)).count()
}
