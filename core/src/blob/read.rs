//! Little-endian reads that can't fail: what lies outside reads as zero. After `open` nothing lies outside.

use core::ops::Range;

#[inline]
fn bytes<const N: usize>(data: &[u8], at: usize) -> [u8; N] {
    match data.get(at..).and_then(|d| d.first_chunk::<N>()) {
        Some(chunk) => *chunk,
        None => [0; N],
    }
}

/// The u16 at byte `at`.
#[inline]
pub fn u16_at(data: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes(data, at))
}

/// The u32 at byte `at`.
#[inline]
pub fn u32_at(data: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes(data, at))
}

/// The f32 at byte `at`.
#[inline]
pub fn f32_at(data: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes(data, at))
}

/// `N` f32 from byte `at` on.
#[inline]
pub fn floats<const N: usize>(data: &[u8], at: usize) -> [f32; N] {
    core::array::from_fn(|i| f32_at(data, at + 4 * i))
}

/// One record of a table.
#[derive(Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record<'a>(pub &'a [u8]);

impl<'a> Record<'a> {
    /// Record `index` of a table of records of that length; empty (reading as zeros) where there is none.
    #[inline]
    pub fn of(table: &'a [u8], index: usize, length: usize) -> Self {
        let start = index.saturating_mul(length);
        Self(table.get(start..start.saturating_add(length)).unwrap_or(&[]))
    }

    /// The u16 in that range of the record.
    #[inline]
    pub fn u16(self, range: Range<usize>) -> u16 {
        u16_at(self.0, range.start)
    }

    /// The u32 in that range of the record.
    #[inline]
    pub fn u32(self, range: Range<usize>) -> u32 {
        u32_at(self.0, range.start)
    }

    /// The f32 in that range of the record.
    #[inline]
    pub fn f32(self, range: Range<usize>) -> f32 {
        f32_at(self.0, range.start)
    }

    /// The byte at that place of the record.
    #[inline]
    pub fn u8(self, at: usize) -> u8 {
        self.0.get(at).copied().unwrap_or(0)
    }

    /// True where every byte of the range is zero.
    pub fn zero(self, range: Range<usize>) -> bool {
        self.0.get(range).is_some_and(|bytes| bytes.iter().all(|&b| b == 0))
    }
}
