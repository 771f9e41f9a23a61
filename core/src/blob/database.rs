//! The view of a checked blob: its counts and the bytes of its sections.

use super::{
    Manifest,
    layout::section::{self, Optional, Required},
};
use crate::BlobError;

/// The counts of a database. Every one fits the width that it is stored in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Joints, 2 to [`MAX_JOINTS`](super::layout::MAX_JOINTS).
    pub joints: usize,
    /// Degrees of freedom: 3 joints + 4.
    pub dofs: usize,
    /// Principal components of a feature.
    pub features: usize,
    /// Frames of the query window.
    pub window: usize,
    /// Styles.
    pub styles: usize,
    /// Actions.
    pub actions: usize,
    /// Classes: combinations of action and style that hold frames.
    pub classes: usize,
    /// Joint groups.
    pub groups: usize,
    /// Captured frames, the rows that a search returns; 0 in a blob that was cut to its models, which
    /// has no section about frames.
    pub frames: usize,
    /// Captured frames and the prototypes' frames behind them.
    pub rows: usize,
    /// Rows of a block.
    pub block_rows: usize,
    /// Dofs of the timing metric.
    pub timing: usize,
    /// Cycles.
    pub cycles: usize,
    /// Clips.
    pub clips: usize,
}

/// A checked blob. Cheap to copy; several stylizers may share one.
#[derive(Clone, Copy)]
pub struct Database<'db> {
    pub(super) counts: Counts,
    pub(super) identity: u32,
    pub(super) rate_hz: f32,
    pub(super) block_shift: u32,
    pub(super) required: Required<&'db [u8]>,
    pub(super) optional: Optional<Option<&'db [u8]>>,
}

/// The counts, not the bytes.
impl core::fmt::Debug for Database<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        let Self { counts, identity, rate_hz, .. } = self;
        f.debug_struct("Database")
            .field("counts", counts)
            .field("identity", identity)
            .field("rate_hz", rate_hz)
            .finish_non_exhaustive()
    }
}

/// The counts, not the bytes.
#[cfg(feature = "defmt")]
impl defmt::Format for Database<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Database {} at {} Hz", self.counts, self.rate_hz);
    }
}

impl<'db> Database<'db> {
    /// The counts.
    #[inline]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// CRC-32C of header and section table. The table holds the sections' own checksums, so that two databases with
    /// the same identity are the same bytes, short of a collision: how a board and its host know each other's.
    #[inline]
    pub fn identity(&self) -> u32 {
        self.identity
    }

    /// Frames a second of the motion, and of the stream that a stylizer expects.
    #[inline]
    pub fn rate_hz(&self) -> f32 {
        self.rate_hz
    }

    /// Names, licences and build parameters.
    ///
    /// # Errors
    /// [`BlobError::Manifest`]; not after `open`, which has decoded it once.
    pub fn manifest(&self) -> Result<Manifest<'db>, BlobError> {
        Manifest::read(self.required.manifest).ok_or(BlobError::Manifest)
    }

    /// The bytes of one of [`section::OPTIONAL`]; `None` where the blob has no such section.
    #[inline(never)]
    pub fn optional(&self, id: u16) -> Option<&'db [u8]> {
        self.optional.numbered().into_iter().find(|section| section.0 == id)?.1
    }

    /// The optional sections that the blob has: number and bytes, in the order of [`section::OPTIONAL`].
    pub fn optional_sections(&self) -> impl Iterator<Item = (u16, &'db [u8])> + use<'db> {
        self.optional.numbered().into_iter().filter_map(|(id, bytes)| bytes.map(|b| (id, b)))
    }

    /// The sections that every blob has: number and bytes, in the order of [`section::REQUIRED`].
    pub fn sections(&self) -> [(u16, &'db [u8]); section::REQUIRED.len()] {
        self.required.numbered()
    }
}
