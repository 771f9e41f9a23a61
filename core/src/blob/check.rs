//! The checks that blobs, retargeting maps and robots share: their headers, and the errors.

use core::ops::Range;

use super::{crc::crc32c, read::Record};
use crate::{BlobError, error::saturating_u32};

pub(crate) type Checked = Result<(), BlobError>;

/// The fields that the header of a blob, a map or a robot has in common, and where they are.
pub(crate) struct Envelope {
    /// Section in errors; 0 for a database.
    pub section: u16,
    /// First bytes.
    pub magic: [u8; 8],
    /// Version that this core reads; a u16 behind the magic.
    pub version: u16,
    /// Length of the header.
    pub header: usize,
    /// The length of all bytes in the header, u32.
    pub total: Range<usize>,
    /// The CRC-32C in the header.
    pub crc: Range<usize>,
}

impl Envelope {
    /// Checks magic, version and length.
    pub fn open<'a>(&self, bytes: &'a [u8]) -> Result<Record<'a>, BlobError> {
        let head = Record(bytes);
        if bytes.len() < self.header {
            return Err(truncated(self.header, bytes.len()));
        }
        if bytes.get(..self.magic.len()) != Some(&self.magic) {
            return Err(BlobError::Magic);
        }
        let version = head.u16(self.magic.len()..self.magic.len() + 2);
        if version != self.version {
            return Err(BlobError::Version { need: self.version, have: version });
        }
        let total = head.u32(self.total.clone()) as usize;
        if total != bytes.len() {
            return Err(truncated(total, bytes.len()));
        }
        Ok(head)
    }

    /// Checks the checksum of the bytes up to `end`, with its own four bytes as zero.
    pub fn sum(&self, bytes: &[u8], end: usize) -> Checked {
        let (Some(before), Some(after)) = (bytes.get(..self.crc.start), bytes.get(self.crc.end..end)) else {
            return Err(truncated(end, bytes.len()));
        };
        if crc32c(&[before, &[0; 4], after]) != Record(bytes).u32(self.crc.clone()) {
            return Err(BlobError::Checksum { section: self.section });
        }
        Ok(())
    }
}

/// The tables of a map or a robot, which follow its header one after the other.
pub(crate) struct Tables<'a> {
    rest: &'a [u8],
}

impl<'a> Tables<'a> {
    /// The tables of `bytes`, whose length has to be `need`, after a header of `header` bytes.
    pub fn new(section: u16, bytes: &'a [u8], header: usize, need: usize) -> Result<Self, BlobError> {
        length(section, need, bytes.len())?;
        Ok(Self { rest: bytes.get(header..).unwrap_or(&[]) })
    }

    /// The next table, of `length` bytes.
    pub fn next(&mut self, length: usize) -> &'a [u8] {
        let (table, rest) = self.rest.split_at_checked(length).unwrap_or((&[], &[]));
        self.rest = rest;
        table
    }
}

/// [`BlobError::Value`] unless the record `fits`.
pub(crate) fn check(section: u16, record: usize, fits: bool) -> Checked {
    if fits { Ok(()) } else { Err(BlobError::Value { section, record: saturating_u32(record) }) }
}

/// [`BlobError::Reserved`] unless the reserved bytes are zero.
pub(crate) fn reserved(section: u16, is_zero: bool) -> Checked {
    if is_zero { Ok(()) } else { Err(BlobError::Reserved { section }) }
}

/// [`BlobError::Length`] unless a section has the length that it needs.
pub(crate) fn length(section: u16, need: usize, have: usize) -> Checked {
    if need == have {
        Ok(())
    } else {
        Err(BlobError::Length { section, need: saturating_u32(need), have: saturating_u32(have) })
    }
}

/// The error of bytes that are fewer or more than their header says.
fn truncated(need: usize, have: usize) -> BlobError {
    BlobError::Truncated { need: saturating_u32(need), have: saturating_u32(have) }
}

/// True if every number is between -`most` and `most`, which is not negative.
#[inline]
pub(crate) fn in_range(mut numbers: impl Iterator<Item = f32>, most: f32) -> bool {
    // Without its sign a float has the order of its bits, NaN behind all numbers.
    numbers.all(|v| v.to_bits() << 1 <= most.to_bits() << 1)
}

/// True for a positive standard deviation of plausible size.
#[inline]
pub(crate) fn is_deviation(value: f32) -> bool {
    (1e-6..=1e3).contains(&value)
}
