//! Little-endian reads that can't fail: what lies outside reads as zero. After `open` nothing lies outside.
//!
//! Two kinds, for the sake of the code's size. A [`Record`] of a constant length is checked once, as a whole, and its
//! fields are plain loads. A number at any other place is read by a function of its own ([`u16_at`] and its like), in
//! which its check stands once for all the places that call it.

use core::ops::Range;

#[inline]
fn bytes<const N: usize>(data: &[u8], at: usize) -> [u8; N] {
    match data.get(at..).and_then(|d| d.first_chunk::<N>()) {
        Some(chunk) => *chunk,
        None => [0; N],
    }
}

/// The u16 at byte `at`.
#[inline(never)]
pub fn u16_at(data: &[u8], at: usize) -> u16 {
    u16::from_le_bytes(bytes(data, at))
}

/// The u32 at byte `at`.
#[inline(never)]
pub fn u32_at(data: &[u8], at: usize) -> u32 {
    u32::from_le_bytes(bytes(data, at))
}

/// The f32 at byte `at`.
#[inline(never)]
pub fn f32_at(data: &[u8], at: usize) -> f32 {
    f32::from_le_bytes(bytes(data, at))
}

/// `N` f32 from byte `at` on; zeros where they are not all there.
#[inline(never)]
pub fn floats<const N: usize>(data: &[u8], at: usize) -> [f32; N] {
    match data.get(at..).and_then(|rest| rest.as_chunks::<4>().0.first_chunk::<N>()) {
        Some(numbers) => numbers.map(f32::from_le_bytes),
        None => [0.0; N],
    }
}

/// Stands in for a record that is not there: as long as the longest that a tick reads many of, a robot's hinge.
static ZEROS: [u8; 84] = [0; 84];

/// One record of a table.
#[derive(Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record<'a>(pub &'a [u8]);

impl<'a> Record<'a> {
    /// Record `index` of a table of records of that length; zeros where there is none.
    #[inline]
    pub fn of(table: &'a [u8], index: usize, length: usize) -> Self {
        let found = table.get(index.saturating_mul(length)..).and_then(|rest| rest.get(..length));
        // As long as the record, so that the compiler knows the length either way.
        Self(found.unwrap_or(ZEROS.get(..length).unwrap_or(&[])))
    }

    /// The u16 in that range of the record.
    #[inline]
    pub fn u16(self, range: Range<usize>) -> u16 {
        u16::from_le_bytes(bytes(self.0, range.start))
    }

    /// The u32 in that range of the record.
    #[inline]
    pub fn u32(self, range: Range<usize>) -> u32 {
        u32::from_le_bytes(bytes(self.0, range.start))
    }

    /// The f32 in that range of the record.
    #[inline]
    pub fn f32(self, range: Range<usize>) -> f32 {
        f32::from_le_bytes(bytes(self.0, range.start))
    }

    /// `N` f32 from that place of the record on.
    #[inline]
    pub fn floats<const N: usize>(self, range: Range<usize>) -> [f32; N] {
        core::array::from_fn(|i| f32::from_le_bytes(bytes(self.0, range.start + 4 * i)))
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
