//! The byte ranges of a blob. The builder writes with these constants and [`Database`](super::Database) reads with them;
//! `docs/FORMAT.md` describes the format.
//!
//! ```text
//! 0              64                    64 + 16 n          (16-byte boundaries)
//! | header       | section table       | section | section | ...             |
//! | magic, counts| id, offset, len, crc| raw bytes, little-endian, no pointers|
//! ```

pub mod distances;
pub mod effort;
pub mod entry;
pub mod header;
pub mod lti;
pub mod phase;
pub mod query;
pub mod section;
pub mod statistic;
pub mod trust;

mod body;
mod frames;

pub use body::{dof, dof_range, dof_record, foot, joint};
pub use frames::{block, class, clip, cycle, flag, timing};

/// First bytes of every blob.
pub const MAGIC: [u8; 8] = *b"GESTUS\r\n";
/// Version of the format that this core reads.
pub const VERSION: u16 = 2;
/// Every section starts on a multiple of this.
pub const ALIGNMENT: usize = 16;
/// Explicit graph edges of a frame. The frames before and after it are edges too, and not stored.
pub const DEGREE: usize = 8;
/// Entry points of a class's graph.
pub const ENTRIES: usize = 12;
/// No edge, entry point, pair or action.
pub const NONE: u16 = u16::MAX;
/// Most joints a database may have.
pub const MAX_JOINTS: usize = 64;
/// Most frames of a query window.
pub const MAX_WINDOW: usize = 8;
/// Most principal components of a feature.
pub const MAX_FEATURES: usize = 32;
/// Most joint groups of the metric and the style strength.
pub const MAX_GROUPS: usize = 8;
/// Most styles.
pub const MAX_STYLES: usize = 32;
/// Most actions.
pub const MAX_ACTIONS: usize = 256;
/// Most dofs of the timing metric.
pub const MAX_TIMING: usize = 10;
/// Dofs that are not a joint's exponential map: height, forward, left, yaw.
pub const ROOT_DOFS: usize = 4;

/// Most states of one unit of a linear model.
pub const MAX_ORDER: usize = 8;

/// Degrees of freedom of a skeleton with that many joints.
pub const fn dofs(joints: usize) -> usize {
    3 * joints + ROOT_DOFS
}

const _: () = {
    // The counts in the records add up to their lengths.
    assert!(class::ENTRY_POINTS.end - class::ENTRY_POINTS.start == 2 * ENTRIES);
    assert!(header::RESERVED.end == header::LENGTH);
    assert!(dof::JOINTS == ROOT_DOFS + 3);
    assert!(dofs(MAX_JOINTS) <= 4 * MAX_JOINTS);
};
