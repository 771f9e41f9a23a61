//! Little-endian reads that can't fail: bytes outside of the slice read as zero. After `open` no read is outside.
//!
//! There are two kinds, to keep the code small. A [`Record`] of constant length is checked once, as a whole, and its
//! fields are plain loads. A number at any other offset is read by a function that is not inlined ([`u16_at`] and the
//! like), so that the bounds check exists once.

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

/// `N` f32 from byte `at` on; zeros if they are not all inside.
#[inline(never)]
pub fn floats<const N: usize>(data: &[u8], at: usize) -> [f32; N] {
    match data.get(at..).and_then(|rest| rest.as_chunks::<4>().0.first_chunk::<N>()) {
        Some(numbers) => numbers.map(f32::from_le_bytes),
        None => [0.0; N],
    }
}

/// Takes the place of a record outside of its table. As long as the longest record that is read often, a robot's hinge.
static ZEROS: [u8; 84] = [0; 84];

/// One record of a table.
#[derive(Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Record<'a>(pub &'a [u8]);

impl<'a> Record<'a> {
    /// Record `index` of a table of records of that length; zeros if the table is shorter.
    #[inline]
    pub fn of(table: &'a [u8], index: usize, length: usize) -> Self {
        let found = table.get(index.saturating_mul(length)..).and_then(|rest| rest.get(..length));
        // As long as the record, so that the compiler knows the length in both cases.
        Self(found.unwrap_or(ZEROS.get(..length).unwrap_or(&[])))
    }

    /// The u16 at that range of the record.
    #[inline]
    pub fn u16(self, range: Range<usize>) -> u16 {
        u16::from_le_bytes(bytes(self.0, range.start))
    }

    /// The u32 at that range of the record.
    #[inline]
    pub fn u32(self, range: Range<usize>) -> u32 {
        u32::from_le_bytes(bytes(self.0, range.start))
    }

    /// The f32 at that range of the record.
    #[inline]
    pub fn f32(self, range: Range<usize>) -> f32 {
        f32::from_le_bytes(bytes(self.0, range.start))
    }

    /// `N` f32 from the start of that range on.
    #[inline]
    pub fn floats<const N: usize>(self, range: Range<usize>) -> [f32; N] {
        core::array::from_fn(|i| f32::from_le_bytes(bytes(self.0, range.start + 4 * i)))
    }

    /// The byte at that index of the record.
    #[inline]
    pub fn u8(self, at: usize) -> u8 {
        self.0.get(at).copied().unwrap_or(0)
    }

    /// True if every byte of the range is zero.
    pub fn zero(self, range: Range<usize>) -> bool {
        self.0.get(range).is_some_and(|bytes| bytes.iter().all(|&b| b == 0))
    }
}
