//! A mark: the note that a blob was checked.

use super::{Database, layout::VERSION};
use crate::Method;

/// Grows when `open` checks more than it did: marks of before no longer hold.
const CHECKS: u32 = 1;

/// A bit for each method that the core was built with: `open` checks only what they read.
const METHODS: u32 = {
    let (mut bits, mut method) = (0, 0);
    while method < Method::ALL.len() {
        bits |= (Method::ALL[method].is_built() as u32) << method;
        method += 1;
    }
    bits
};

/// Of which format version, checks and methods a mark is.
const KIND: u32 = (VERSION as u32) << 16 | CHECKS << 8 | METHODS;

/// The note that [`Database::open`] has checked a blob, for [`Database::open_marked`]. A board that can store eight bytes
/// checks a blob once, when it was flashed, and not at every start.
///
/// A mark is of one blob, by the checksum of its header and section table, which holds the sections' checksums; and of
/// the checks of one version of the core with the same methods.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Mark(u64);

impl Mark {
    /// The number to store. No mark is 0, nor all ones, which erased flash is.
    pub const fn to_bits(self) -> u64 {
        self.0
    }

    /// A mark from storage; any number will do, and those that are no mark hold for no blob.
    pub const fn from_bits(bits: u64) -> Self {
        Self(bits)
    }
}

impl Database<'_> {
    /// The mark of this blob, which is checked.
    pub fn mark(&self) -> Mark {
        Mark(u64::from(KIND) << 32 | u64::from(self.identity))
    }
}

// Erased storage, all zeros or all ones, is no mark.
const _: () = assert!(KIND != 0 && KIND != u32::MAX);
