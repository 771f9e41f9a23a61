//! One number for a stream of poses: equal where every bit is.

use crate::{Pose, blob::crc::crc32c};

/// CRC-32C over the bits of every pose and time step, in order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Digest(u32);

impl Digest {
    /// The digest of no pose.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Takes in the first `joints` joints of a pose and its time step.
    pub fn add<const J: usize>(&mut self, pose: &Pose<J>, joints: usize, step_s: f32) {
        for value in pose.position {
            self.number(value);
        }
        for rotation in pose.rotations.iter().take(joints) {
            for &value in rotation {
                self.number(value);
            }
        }
        self.number(step_s);
    }

    fn number(&mut self, value: f32) {
        self.0 = crc32c(&[&self.0.to_le_bytes(), &value.to_le_bytes()]);
    }

    /// The number.
    pub const fn value(self) -> u32 {
        self.0
    }
}
