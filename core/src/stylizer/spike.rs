//! Finds single wrong frames that are too slow for a leap: a joint leaves, and comes back in the next frame.
//!
//! The wrong frame has been used by then, so the flag comes one frame late. It tells the caller why that output was wrong.

use crate::{
    blob::layout::dof,
    math::{abs, quaternion::Vector},
    output::speed_limit::Fastest,
};

/// Speed out and back of a joint above which a frame counts as wrong, rad/s. 0.16% of the captured frames have such a joint,
/// most of them runs.
const MAX_TURN_RAD_S: f32 = 6.0;
/// Speed out and back of the root's height above which a frame counts as wrong, m/s.
const MAX_RISE_M_S: f32 = 3.0;

/// The numbers that changed fast in the last frame. Bits 0 to 2 are set for those that rose, bits 4 to 6 for those that
/// fell.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Spike<const J: usize> {
    /// The root's height and heading.
    root: u8,
    /// The exponential map of each joint; of joint 0 the root's tilt.
    joints: [u8; J],
}

impl<const J: usize> Spike<J> {
    /// Before the first frame, and after a leap.
    pub const fn new() -> Self {
        Self { root: 0, joints: [0; J] }
    }

    /// Compares the dofs of a frame with those `seconds` before: its fastest joint, and whether one came back at once.
    pub fn observe(&mut self, x: &[f32], x_prev: &[f32], seconds: f32) -> (Fastest, bool) {
        observe(&mut self.root, &mut self.joints, [x, x_prev], seconds)
    }
}

// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn observe(root: &mut u8, joints: &mut [u8], [x, x_prev]: [&[f32]; 2], seconds: f32) -> (Fastest, bool) {
    let turn = MAX_TURN_RAD_S * seconds;
    let at = |x: &[f32], d: usize| x.get(d).copied().unwrap_or(0.0);
    // The place on the ground has its own limit, of its change of speed.
    let rise = at(x, dof::HEIGHT) - at(x_prev, dof::HEIGHT);
    let changes = [rise * (MAX_TURN_RAD_S / MAX_RISE_M_S), at(x, dof::YAW) * seconds, 0.0];
    let mut returned = came_back(root, &changes, turn);
    let fastest = Fastest::of(x, x_prev, |joint, change, change2| {
        if let Some(last) = joints.get_mut(joint) {
            if change2 > turn * turn {
                returned |= came_back(last, change, turn);
            } else {
                *last = 0;
            }
        }
    });
    (fastest, returned)
}

/// Updates the bits of three numbers that have changed. Returns true where one of them was as fast the other way before.
#[inline]
fn came_back(last: &mut u8, change: &Vector, most: f32) -> bool {
    let mut fast = 0;
    for (bit, &change) in [1, 2, 4].into_iter().zip(change) {
        if abs(change) > most {
            fast |= if change > 0.0 { bit } else { bit << 4 };
        }
    }
    let returned = fast & last.rotate_left(4) != 0;
    *last = fast;
    returned
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Whether each of the frames after the first is reported, for one dof that has these values, 30 a second.
    fn reported(d: usize, values: &[f32]) -> Vec<bool> {
        let mut spike = Spike::<3>::new();
        let frame = |value: f32| {
            let mut x = [0.0; 13];
            x[d] = value;
            x
        };
        let pairs = values.windows(2).map(|pair| [frame(pair[0]), frame(pair[1])]);
        pairs.map(|[before, now]| spike.observe(&now, &before, 1.0 / 30.0).1).collect()
    }

    #[test]
    fn a_dof_that_comes_back_at_once_is_reported() {
        for (d, least) in [(dof::HEIGHT, 0.1), (dof::TILT, 0.2), (dof::JOINTS, 0.2), (11, 0.2)] {
            let (over, under) = (1.01 * least, 0.99 * least);
            assert_eq!(reported(d, &[0.0, over, 0.0, 0.0]), [false, true, false], "{d}");
            assert_eq!(reported(d, &[0.0, -over, 0.0, 0.0]), [false, true, false], "{d}");
            assert_eq!(reported(d, &[0.0, under, 0.0]), [false; 2], "{d}");
            // Fast, but no return; and a return after a frame at rest.
            assert_eq!(reported(d, &[0.0, over, 2.0 * over]), [false; 2], "{d}");
            assert_eq!(reported(d, &[0.0, over, over, 0.0]), [false; 3], "{d}");
        }
        // A rate turns its sign; the body's speed has another limit.
        assert_eq!(reported(dof::YAW, &[0.0, 6.1, -6.1, 0.0]), [false, true, false]);
        assert_eq!(reported(dof::FORWARD, &[0.0, 9.0, 0.0]), [false; 2]);
    }
}
