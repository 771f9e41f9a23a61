//! What the checks of every table have in common: the header that it begins with, and the error for what does not
//! fit.

use core::ops::Range;

use super::{crc::crc32c, read::Record};
use crate::BlobError;

pub(crate) type Checked = Result<(), BlobError>;

/// Where a table that stands for itself says what it is.
pub(crate) struct Envelope {
    /// Section that errors name; 0 is a database's header.
    pub section: u16,
    /// First bytes.
    pub magic: [u8; 8],
    /// Version that this core reads; it stands behind the magic, as u16.
    pub version: u16,
    /// Length of the header.
    pub header: usize,
    /// Where the header says the length of everything, u32.
    pub total: Range<usize>,
    /// Where the header holds its CRC-32C.
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

    /// Checks the checksum of the bytes up to `end`, in which its own four bytes count as zero.
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

/// Whether a record holds what it may.
pub(crate) fn check(section: u16, record: usize, fits: bool) -> Checked {
    if fits { Ok(()) } else { Err(BlobError::Value { section, record: as_u32(record) }) }
}

/// Whether reserved bytes are zero.
pub(crate) fn reserved(section: u16, zero: bool) -> Checked {
    if zero { Ok(()) } else { Err(BlobError::Reserved { section }) }
}

/// Whether a section has the length that it needs.
pub(crate) fn length(section: u16, need: usize, have: usize) -> Checked {
    if need == have {
        Ok(())
    } else {
        Err(BlobError::Length { section, need: as_u32(need), have: as_u32(have) })
    }
}

/// The error of a table that is shorter or longer than it says.
fn truncated(need: usize, have: usize) -> BlobError {
    BlobError::Truncated { need: as_u32(need), have: as_u32(have) }
}

/// Lengths and counts as errors hold them.
pub(crate) fn as_u32(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}
