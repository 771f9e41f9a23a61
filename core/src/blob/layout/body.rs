//! Sections that describe the body: skeleton, dofs and feet.

use core::ops::Range;

/// Index of each root dof; the joints' exponential maps follow, three a joint, joints in order from 1.
pub mod dof {
    /// Height of the root above the floor, metres.
    pub const HEIGHT: usize = 0;
    /// Root orientation without its heading, relative to its mean: an exponential map, radians, three dofs.
    pub const TILT: usize = 1;
    /// Root velocity along the heading of the frame before, metres a second.
    pub const FORWARD: usize = 4;
    /// Root velocity to the left of that heading, metres a second.
    pub const LEFT: usize = 5;
    /// Rate of the heading, radians a second, positive to the left.
    pub const YAW: usize = 6;
    /// First dof of joint 1.
    pub const JOINTS: usize = 7;
}

/// Byte ranges of a joint (32 bytes) and of the trailer behind the joints (16 bytes).
pub mod joint {
    use super::Range;
    /// Length of a joint.
    pub const LENGTH: usize = 32;
    /// Index of the parent, u8; [`ROOT`] for joint 0.
    pub const PARENT: usize = 0;
    /// Joint group, u8.
    pub const GROUP: usize = 1;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Position in the parent's frame, metres, 3 f32.
    pub const OFFSET: Range<usize> = 4..16;
    /// Mean local rotation, quaternion, 4 f32.
    pub const MEAN: Range<usize> = 16..32;
    /// The parent of joint 0.
    pub const ROOT: u8 = 255;
    /// Length of the trailer.
    pub const TRAILER: usize = 16;
    /// In the trailer: the hips line, from right to left, in the root's own frame, unit length, 3 f32.
    pub const HIPS_LINE: Range<usize> = 0..12;
    /// In the trailer: joints of the left and right toes, u8 each (255: none), then zero.
    pub const TOES: Range<usize> = 12..14;
}

/// Byte ranges of a dof (8 bytes). Behind the last dof may follow a [`dof_range`] of each.
pub mod dof_record {
    use super::Range;
    /// Length of a dof.
    pub const LENGTH: usize = 8;
    /// Quantisation step, f32, in the dof's unit.
    pub const STEP: Range<usize> = 0..4;
    /// Standard deviation over the database, f32, in the dof's unit: scale of the normalised ridge.
    pub const SCALE: Range<usize> = 4..8;
}

/// Byte ranges of what a dof's values are in the captured frames (8 bytes).
pub mod dof_range {
    use super::Range;
    /// Length of a range.
    pub const LENGTH: usize = 8;
    /// Least value, f32, in the dof's unit.
    pub const LEAST: Range<usize> = 0..4;
    /// Greatest value, f32, in the dof's unit.
    pub const GREATEST: Range<usize> = 4..8;
}

/// Byte ranges of a leg (16 bytes) in the feet section: left, then right.
pub mod foot {
    use super::Range;
    /// Length of a leg's record.
    pub const LENGTH: usize = 16;
    /// The joint that turns the thigh, u8. Each of the next three joints is a child of the one before.
    pub const HIP: usize = 0;
    /// The knee, u8.
    pub const KNEE: usize = 1;
    /// The ankle, u8.
    pub const ANKLE: usize = 2;
    /// The toes, u8; [`NO_TOE`] where the skeleton has none.
    pub const TOE: usize = 3;
    /// No toes.
    pub const NO_TOE: u8 = 255;
    /// Height of the ankle over the floor where the foot stands on its heel or flat, metres, f32.
    pub const ANKLE_HEIGHT: Range<usize> = 4..8;
    /// Height of the toes over the floor where the foot stands on them or flat, metres, f32; 0 without toes.
    pub const TOE_HEIGHT: Range<usize> = 8..12;
    /// How far over the point that a standing foot rolls about the ankle is, and the toes, 0.1 mm, u16; 0 where the joint
    /// itself stands still.
    pub const ANKLE_ROLL: Range<usize> = 12..14;
    /// See [`ANKLE_ROLL`].
    pub const TOE_ROLL: Range<usize> = 14..16;
    /// Metres of one step of a roll.
    pub const ROLL_STEP_M: f32 = 1e-4;
}
