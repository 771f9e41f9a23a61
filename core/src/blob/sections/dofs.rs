//! Degrees of freedom: quantisation step, scale and range of each.

use crate::blob::{
    Database,
    layout::{dof_range, dof_record},
    read::Record,
};

impl<'db> Database<'db> {
    /// Quantisation step of a dof, in its unit.
    #[inline(never)]
    pub fn step(&self, dof: usize) -> f32 {
        Record::of(self.required.dofs, dof, dof_record::LENGTH).f32(dof_record::STEP)
    }

    /// Standard deviation of a dof over the database, in its unit.
    #[inline(never)]
    pub fn scale(&self, dof: usize) -> f32 {
        Record::of(self.required.dofs, dof, dof_record::LENGTH).f32(dof_record::SCALE)
    }

    /// Whether the blob stores the ranges of dofs.
    #[inline]
    pub fn has_dof_ranges(&self) -> bool {
        self.required.dofs.len() > self.counts.dofs * dof_record::LENGTH
    }

    /// Least and greatest value of each dof in the captured frames, in its unit, in the order of the dofs. Empty for blobs
    /// written before 2026-11-28, which do not store them.
    #[inline]
    pub fn dof_ranges(&self) -> impl Iterator<Item = [f32; 2]> + use<'db> {
        let ranges = self.required.dofs.get(self.counts.dofs * dof_record::LENGTH..).unwrap_or(&[]);
        ranges.as_chunks::<{ dof_range::LENGTH }>().0.iter().map(|range| {
            let range = Record(range);
            [range.f32(dof_range::LEAST), range.f32(dof_range::GREATEST)]
        })
    }
}
