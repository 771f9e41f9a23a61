//! The bytes of a retargeting map, by name. The builder writes with these constants, [`Map`](super::Map) reads
//! with them; `docs/FORMAT.md` explains.
//!
//! ```text
//! 0         96                 + 16 N              + 16 J             + 40 J          + 40 N          + 8 L
//! | header  | source skeleton  | target skeleton   | records in       | records out   | limbs         |
//! | counts, | parent, offset   | parent, offset    | one a target     | one a source  | joints of arms|
//! | scale   | of N joints      | of J joints       | joint            | joint         | and legs      |
//! ```

use core::ops::Range;

/// First bytes of every map.
pub const MAGIC: [u8; 8] = *b"GESTMAP\n";
/// Version of the format that this core reads.
pub const VERSION: u16 = 1;
/// Most joints of the incoming skeleton.
pub const MAX_SOURCES: usize = 128;
/// Most limbs.
pub const MAX_LIMBS: usize = 4;

/// Byte ranges of the header (96 bytes).
pub mod header {
    use super::Range;
    /// Length of the header.
    pub const LENGTH: usize = 96;
    /// [`MAGIC`](super::MAGIC).
    pub const MAGIC: Range<usize> = 0..8;
    /// Format version, u16.
    pub const VERSION: Range<usize> = 8..10;
    /// Joints of the incoming skeleton, N, u16.
    pub const SOURCES: Range<usize> = 10..12;
    /// Joints of the database's skeleton, J, u16.
    pub const TARGETS: Range<usize> = 12..14;
    /// Limbs, L, u16.
    pub const LIMBS: Range<usize> = 14..16;
    /// Length of the whole map in bytes, u32.
    pub const TOTAL: Range<usize> = 16..20;
    /// CRC-32C of the map, with these four bytes zero.
    pub const CRC: Range<usize> = 20..24;
    /// CRC-32C of the offsets and parents of the database's skeleton, u32: which database it is for.
    pub const SKELETON: Range<usize> = 24..28;
    /// Leg length of the database over that of the incoming body, f32.
    pub const SCALE: Range<usize> = 28..32;
    /// Height of the incoming body's ankles when its feet are on the floor, metres, f32.
    pub const SOURCE_ANKLE: Range<usize> = 32..36;
    /// Height of the database's ankles when the feet are on the floor, metres, f32.
    pub const TARGET_ANKLE: Range<usize> = 36..40;
    /// Rotation from the incoming world to one with Y up, quaternion, 4 f32.
    pub const WORLD: Range<usize> = 40..56;
    /// Midpoint of the hip joints in the incoming root's frame, metres, 3 f32.
    pub const SOURCE_HIPS: Range<usize> = 56..68;
    /// Midpoint of the hip joints in the database root's frame, metres, 3 f32.
    pub const TARGET_HIPS: Range<usize> = 68..80;
    /// Zero.
    pub const RESERVED: Range<usize> = 80..96;
}

/// Byte ranges of a joint of either skeleton (16 bytes).
pub mod joint {
    use super::Range;
    /// Length of a joint.
    pub const LENGTH: usize = 16;
    /// Index of the parent, u8; 255 for joint 0.
    pub const PARENT: usize = 0;
    /// Segment of a limb, u8: 0 none, 1 + 2 limb for its upper bone, 2 + 2 limb for its lower bone.
    pub const SEGMENT: usize = 1;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Position in the parent's frame, metres, 3 f32.
    pub const OFFSET: Range<usize> = 4..16;
}

/// Byte ranges of a record: where a joint's orientation comes from (40 bytes).
pub mod record {
    use super::Range;
    /// Length of a record.
    pub const LENGTH: usize = 40;
    /// [`STAY`] or [`FOLLOW`], u8.
    pub const KIND: usize = 0;
    /// Joints of the other skeleton that it follows, two u8.
    pub const FROM: Range<usize> = 1..3;
    /// Zero.
    pub const RESERVED: usize = 3;
    /// Share of the second joint, 0 to 1, f32.
    pub const WEIGHT: Range<usize> = 4..8;
    /// Rotation from each of these joints' frames to that of the record's joint, two quaternions, 8 f32. [`STAY`]: the
    /// first is the joint's constant local rotation.
    pub const TURNS: Range<usize> = 8..40;
    /// The joint has no counterpart: its local rotation stays.
    pub const STAY: u8 = 0;
    /// The joint's orientation follows the other skeleton's.
    pub const FOLLOW: u8 = 1;
}

/// Byte ranges of a limb (8 bytes).
pub mod limb {
    use super::Range;
    /// Length of a limb.
    pub const LENGTH: usize = 8;
    /// Its joints in the incoming skeleton: hip, knee, ankle or shoulder, elbow, wrist, three u8.
    pub const SOURCE: Range<usize> = 0..3;
    /// [`LEG`] or [`ARM`], u8.
    pub const KIND: usize = 3;
    /// The same joints of the database's skeleton, three u8.
    pub const TARGET: Range<usize> = 4..7;
    /// Zero.
    pub const RESERVED: Range<usize> = 7..8;
    /// Its end goes to a position in world space.
    pub const LEG: u8 = 0;
    /// Its end goes to a position relative to its beginning.
    pub const ARM: u8 = 1;
}

/// Length of a map.
pub const fn total(sources: usize, targets: usize, limbs: usize) -> usize {
    header::LENGTH + (sources + targets) * (joint::LENGTH + record::LENGTH) + limbs * limb::LENGTH
}
