//! Byte ranges of an entry of the section table (16 bytes).

use core::ops::Range;

/// Length of an entry.
pub const LENGTH: usize = 16;
/// Section number, u16.
pub const ID: Range<usize> = 0..2;
/// Zero.
pub const RESERVED: Range<usize> = 2..4;
/// Offset from the start of the blob, u32.
pub const OFFSET: Range<usize> = 4..8;
/// Length in bytes without padding, u32.
pub const BYTES: Range<usize> = 8..12;
/// CRC-32C of the section's bytes.
pub const CRC: Range<usize> = 12..16;
