//! Keeps each dof of a joint where the database has seen it, or where the input is.
//!
//! ```text
//! y' = clamp(y, min(least - m, x), max(greatest + m, x))       m: Config::joint_margin
//! ```
//!
//! A method may turn a joint further than any captured frame does: an elbow past straight, of an input whose arm hangs
//! straighter than the database's. The dofs are exponential maps about the joint's mean rotation, so a hinge has its range
//! along its own axis. An input beyond the range is not held back, and neither is anything between it and the range.

use crate::{
    blob::{Database, layout::dof},
    math::{clamp, maximum, minimum},
};

/// Limits the joints of `output`; the root is left as it is. Both slices are `[dofs]`.
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
pub(crate) fn limit(database: &Database<'_>, margin: f32, x: &[f32], output: &mut [f32]) {
    let (Some(x), Some(output)) = (x.get(dof::JOINTS..), output.get_mut(dof::JOINTS..)) else { return };
    let mut ranges = database.dof_ranges();
    let _ = ranges.nth(dof::JOINTS - 1);
    for ((output, &x), [least, greatest]) in output.iter_mut().zip(x).zip(ranges) {
        // Most are within the range. Compared as integers, which takes a fifth of the time on processors without an FPU.
        if order(*output) < order(least) || order(*output) > order(greatest) {
            *output = clamp(*output, minimum(least - margin, x), maximum(greatest + margin, x));
        }
    }
}

/// An integer that is less where the number is less. That of -0 is below that of 0.
#[inline]
fn order(x: f32) -> i32 {
    let bits = x.to_bits() as i32;
    bits ^ ((bits >> 31) as u32 >> 1) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_are_ordered_as_their_numbers() {
        let numbers = [f32::NEG_INFINITY, -2.0, -1.0, -1e-40, -0.0, 0.0, 1e-40, 1.0, 2.0, f32::INFINITY];
        assert!(numbers.map(order).is_sorted());
        assert!(order(-1e-40) < order(0.0) && order(1.0) < order(2.0) && order(-2.0) < order(-1.0));
    }
}
