//! The bytes of a robot, by name. The builder writes with these constants, [`Robot`](super::Robot) reads with
//! them; `docs/FORMAT.md` explains.
//!
//! ```text
//! 0        64                 + 16 J         + 84 H      + 84 G                    + 20 L
//! | header | database skeleton| hinges       | groups: joints as hinges            | limbs    |
//! | counts | parent, offset   | place, axis, | joint, axes at zero,                | joints,  |
//! | tick   | of J joints      | limits, servo| rotation from joint to link         | tip      |
//! ```

use core::ops::Range;

/// First bytes of every robot.
pub const MAGIC: [u8; 8] = *b"GESTROB\n";
/// Version of the format that this core reads.
pub const VERSION: u16 = 1;
/// Most hinges.
pub const MAX_HINGES: usize = 64;
/// Most limbs.
pub const MAX_LIMBS: usize = 8;
/// Most hinges of a limb.
pub const MAX_LIMB_HINGES: usize = 8;
/// The parent of a hinge that is mounted on the base.
pub const BASE: u8 = 255;

/// Byte ranges of the header (64 bytes).
pub mod header {
    use super::Range;
    /// Length of the header.
    pub const LENGTH: usize = 64;
    /// [`MAGIC`](super::MAGIC).
    pub const MAGIC: Range<usize> = 0..8;
    /// Format version, u16.
    pub const VERSION: Range<usize> = 8..10;
    /// Hinges, H, u16.
    pub const HINGES: Range<usize> = 10..12;
    /// Joints of the database's skeleton, J, u16.
    pub const TARGETS: Range<usize> = 12..14;
    /// Groups, G, u16.
    pub const GROUPS: Range<usize> = 14..16;
    /// Limbs, L, u16.
    pub const LIMBS: Range<usize> = 16..18;
    /// Zero.
    pub const RESERVED_1: Range<usize> = 18..20;
    /// Length in bytes, u32.
    pub const TOTAL: Range<usize> = 20..24;
    /// CRC-32C, with these four bytes zero.
    pub const CRC: Range<usize> = 24..28;
    /// CRC-32C of the database's skeleton, u32: see [`Database::skeleton_fingerprint`](crate::Database::skeleton_fingerprint).
    pub const SKELETON: Range<usize> = 28..32;
    /// Time between two ticks, seconds, f32.
    pub const TICK: Range<usize> = 32..36;
    /// Rotation from the database's root to the robot's base, quaternion, 4 f32.
    pub const BASE: Range<usize> = 36..52;
    /// Zero.
    pub const RESERVED_2: Range<usize> = 52..64;
}

/// Byte ranges of a joint of the database's skeleton (16 bytes).
pub mod joint {
    use super::Range;
    /// Length of a joint.
    pub const LENGTH: usize = 16;
    /// Index of the parent, u8; 255 for joint 0.
    pub const PARENT: usize = 0;
    /// Zero.
    pub const RESERVED: Range<usize> = 1..4;
    /// Position in the parent's frame, metres, 3 f32.
    pub const OFFSET: Range<usize> = 4..16;
}

/// Byte ranges of a hinge (84 bytes). Parents come before their children.
pub mod hinge {
    use super::Range;
    /// Length of a hinge.
    pub const LENGTH: usize = 84;
    /// Index of the hinge before it in the chain, u8, or [`BASE`](super::BASE).
    pub const PARENT: usize = 0;
    /// Zero.
    pub const RESERVED: Range<usize> = 1..4;
    /// Position in the frame behind the parent, metres, 3 f32.
    pub const OFFSET: Range<usize> = 4..16;
    /// Rotation from the frame behind the parent to its own at angle zero, quaternion, 4 f32.
    pub const TURN: Range<usize> = 16..32;
    /// Axis in its own frame, unit vector, 3 f32.
    pub const AXIS: Range<usize> = 32..44;
    /// Least and greatest angle, rad; greatest velocity, acceleration, jerk; 5 f32.
    pub const LIMITS: Range<usize> = 44..64;
    /// Servo: centre, gain, zero, least, greatest; microseconds and radians, 5 f32.
    pub const SERVO: Range<usize> = 64..84;
}

/// Byte ranges of a group: the hinges that take the place of one joint (84 bytes).
pub mod group {
    use super::Range;
    /// Length of a group.
    pub const LENGTH: usize = 84;
    /// First hinge, u8; the others follow it, each mounted on the one before.
    pub const FIRST: usize = 0;
    /// How many, 1 to 3, u8.
    pub const COUNT: usize = 1;
    /// Joint of the database, u8.
    pub const JOINT: usize = 2;
    /// Limb that is corrected once this group is set, u8: its number plus 1, or 0.
    pub const LIMB: usize = 3;
    /// Rotation from the joint's frame to that of the link behind the hinges, quaternion, 4 f32.
    pub const TURN: Range<usize> = 4..20;
    /// Rotation from the frame before the hinges to that behind them at angle zero, quaternion, 4 f32.
    pub const ZERO: Range<usize> = 20..36;
    /// The axes at zero, in the frame before the hinges, 9 f32.
    pub const AXES: Range<usize> = 36..72;
    /// For one or two hinges: the direction that they aim, in the frame behind them, 3 f32.
    pub const POINTED: Range<usize> = 72..84;
}

/// Byte ranges of a limb (20 bytes).
pub mod limb {
    use super::Range;
    /// Length of a limb.
    pub const LENGTH: usize = 20;
    /// Where it begins and ends in the database's skeleton, two joints, u8.
    pub const JOINTS: Range<usize> = 0..2;
    /// First and last hinge, u8; each is mounted on the one before.
    pub const HINGES: Range<usize> = 2..4;
    /// Length of the robot's limb divided by that of the body's, f32.
    pub const SCALE: Range<usize> = 4..8;
    /// Its end, in the frame behind the last hinge, metres, 3 f32.
    pub const TIP: Range<usize> = 8..20;
}

/// Length of a robot.
pub const fn total(joints: usize, hinges: usize, groups: usize, limbs: usize) -> usize {
    header::LENGTH
        + joints * joint::LENGTH
        + hinges * hinge::LENGTH
        + groups * group::LENGTH
        + limbs * limb::LENGTH
}

const _: () = {
    assert!(header::RESERVED_2.end == header::LENGTH);
    assert!(hinge::SERVO.end == hinge::LENGTH);
    assert!(group::POINTED.end == group::LENGTH);
    assert!(limb::TIP.end == limb::LENGTH);
};
