//! Byte ranges of the header (64 bytes).

use core::ops::Range;

/// Length of the header.
pub const LENGTH: usize = 64;
/// [`MAGIC`](super::MAGIC).
pub const MAGIC: Range<usize> = 0..8;
/// Format version, u16.
pub const VERSION: Range<usize> = 8..10;
/// Number of sections, u16.
pub const SECTIONS: Range<usize> = 10..12;
/// Length of the whole blob in bytes, u32.
pub const TOTAL: Range<usize> = 12..16;
/// CRC-32C of header and section table, with these four bytes zero.
pub const CRC: Range<usize> = 16..20;
/// Joints, u16.
pub const JOINTS: Range<usize> = 20..22;
/// Degrees of freedom: 3 joints + 4, u16.
pub const DOFS: Range<usize> = 22..24;
/// Principal components of a feature, u16.
pub const FEATURES: Range<usize> = 24..26;
/// Frames of the query window, u16.
pub const WINDOW: Range<usize> = 26..28;
/// Styles, u16.
pub const STYLES: Range<usize> = 28..30;
/// Actions, u16.
pub const ACTIONS: Range<usize> = 30..32;
/// Classes (combinations of action and style that hold frames), u16.
pub const CLASSES: Range<usize> = 32..34;
/// Joint groups, u16.
pub const GROUPS: Range<usize> = 34..36;
/// Captured frames, u32.
pub const FRAMES: Range<usize> = 36..40;
/// Rows: captured frames and, behind them, prototype frames, u32.
pub const ROWS: Range<usize> = 40..44;
/// Frames a second, f32.
pub const RATE: Range<usize> = 44..48;
/// Rows of a block, u16.
pub const BLOCK_ROWS: Range<usize> = 48..50;
/// Dofs of the timing metric, u16.
pub const TIMING: Range<usize> = 50..52;
/// Gait cycles or whole-clip segments, u32.
pub const CYCLES: Range<usize> = 52..56;
/// Clips, u32.
pub const CLIPS: Range<usize> = 56..60;
/// Zero.
pub const RESERVED: Range<usize> = 60..64;
