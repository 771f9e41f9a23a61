//! One number for a stream of poses: equal where every bit is.

use crate::{
    Pose,
    blob::crc::crc32c,
    math::quaternion::{Quaternion, Vector},
};

/// CRC-32C over the bits of every pose and time step, in order.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Digest(u32);

impl Digest {
    /// The digest of no pose.
    pub const fn new() -> Self {
        Self(0)
    }

    /// Continues from a digest's `value`, for callers that store the number between two poses.
    pub const fn resume(value: u32) -> Self {
        Self(value)
    }

    /// Takes in the first `joints` joints of a pose and its time step.
    pub fn add<const J: usize>(&mut self, pose: &Pose<J>, joints: usize, step_s: f32) {
        self.add_joints(pose.position, pose.rotations.get(..joints).unwrap_or(&pose.rotations), step_s);
    }

    /// Takes in a pose's root position, joint rotations and time step.
    pub fn add_joints(&mut self, position: Vector, rotations: &[Quaternion], step_s: f32) {
        for &value in position.iter().chain(rotations.as_flattened()) {
            self.number(value);
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
