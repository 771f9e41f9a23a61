//! Byte ranges of the section of statistical transfer: means and spreads of joint rotations.
//!
//! ```text
//! header   16 bytes
//! tables   each: 16 bytes, root [3][2] f32, feet [2][1 + D] f32, joints [J][5] f32
//! ```

use core::ops::Range;

/// Length of the header.
pub const HEADER: usize = 16;
/// Style that is assumed of an unlabelled input, u16.
pub const FROM: Range<usize> = 0..2;
/// Number of tables, u16.
pub const TABLES: Range<usize> = 2..4;
/// Zero.
pub const RESERVED: Range<usize> = 4..16;
/// In a table: its style, u16.
pub const STYLE: Range<usize> = 0..2;
/// In a table: its action, u16; [`NONE`](super::NONE): all.
pub const ACTION: Range<usize> = 2..4;
/// In a table: zero.
pub const TABLE_RESERVED: Range<usize> = 4..16;
/// Mean and standard deviation of height, forward and left velocity.
pub const ROOT: usize = 16;
/// For the left, then the right foot: boundary and projection of the dofs.
pub const FEET: usize = ROOT + 24;
/// Length of a joint: mean rotation, quaternion, and standard deviation, radians.
pub const JOINT: usize = 20;

/// Where the joints are in a table.
pub const fn joints(dofs: usize) -> usize {
    FEET + 8 * (1 + dofs)
}

/// Length of a table.
pub const fn length(joints: usize) -> usize {
    self::joints(super::dofs(joints)) + JOINT * joints
}
