//! Sections of captured motion: classes, clips, cycles, rows, flags and the timing metric.

use core::ops::Range;

/// Byte ranges of a class (48 bytes).
pub mod class {
    use super::Range;
    /// Length of a class.
    pub const LENGTH: usize = 48;
    /// First row, u32.
    pub const FIRST_ROW: Range<usize> = 0..4;
    /// Number of rows, at most 65,535, u32.
    pub const ROWS: Range<usize> = 4..8;
    /// First cycle, u32.
    pub const FIRST_CYCLE: Range<usize> = 8..12;
    /// Number of cycles, u32.
    pub const CYCLES: Range<usize> = 12..16;
    /// Action, u16.
    pub const ACTION: Range<usize> = 16..18;
    /// Style, u16.
    pub const STYLE: Range<usize> = 18..20;
    /// Most neighbors that a search of this class returns, u16.
    pub const K_CAP: Range<usize> = 20..22;
    /// Rows that the search may return, u16.
    pub const SEARCHABLE: Range<usize> = 22..24;
    /// Entry points of the graph, [`ENTRIES`](super::super::ENTRIES) u16, rows of the class.
    pub const ENTRY_POINTS: Range<usize> = 24..48;
}

/// Byte ranges of a clip (8 bytes).
pub mod clip {
    use super::Range;
    /// Length of a clip.
    pub const LENGTH: usize = 8;
    /// First row, u32.
    pub const FIRST_ROW: Range<usize> = 0..4;
    /// Number of rows, u32.
    pub const ROWS: Range<usize> = 4..8;
}

/// Byte ranges of a cycle (16 bytes).
pub mod cycle {
    use super::Range;
    /// Length of a cycle.
    pub const LENGTH: usize = 16;
    /// The clip it lies in, u32.
    pub const CLIP: Range<usize> = 0..4;
    /// Its first knot, u32.
    pub const FIRST_KNOT: Range<usize> = 4..8;
    /// Number of knots, at least 2, u16.
    pub const KNOTS: Range<usize> = 8..10;
    /// Zero.
    pub const RESERVED: Range<usize> = 10..12;
    /// First row of the cycle, u32: the first knot, rounded up. Cycles of a class ascend in it.
    pub const START: Range<usize> = 12..16;
}

/// Byte ranges of a block's header; the packed rows follow it. Blocks follow each other, on even offsets.
pub mod block {
    use super::Range;
    /// Bytes of a row, u16.
    pub const ROW_BYTES: Range<usize> = 0..2;
    /// First of the bases: one i16 a dof, in quantisation steps. Behind them one bit width a dof, two a byte.
    pub const BASES: usize = 2;
    /// Widest field of a row, bits.
    pub const MAX_WIDTH: usize = 15;
    /// Zero bytes behind the last block, so that a field can be read whole.
    pub const PADDING: usize = 4;

    /// Length of the header of a block with that many dofs.
    pub const fn header(dofs: usize) -> usize {
        BASES + 2 * dofs + dofs.div_ceil(2)
    }
}

/// Bits of a frame's flags.
pub mod flag {
    /// The left foot stands.
    pub const LEFT_CONTACT: u8 = 1;
    /// The right foot stands.
    pub const RIGHT_CONTACT: u8 = 2;
    /// The search may return the frame: it has a frame before it and an output in every style.
    pub const SEARCHABLE: u8 = 4;
    /// The row before it is the frame before it.
    pub const FOLLOWS: u8 = 8;
    /// All bits in use.
    pub const ALL: u8 = 15;
}

/// Byte ranges of a dof of the timing metric (12 bytes).
pub mod timing {
    use super::Range;
    /// Length of an entry.
    pub const LENGTH: usize = 12;
    /// The dof, u16.
    pub const DOF: Range<usize> = 0..2;
    /// Zero.
    pub const RESERVED: Range<usize> = 2..4;
    /// Weight of squared differences of the dof, f32.
    pub const POSE: Range<usize> = 4..8;
    /// Weight of squared differences of its change from frame to frame, f32.
    pub const CHANGE: Range<usize> = 8..12;
}
