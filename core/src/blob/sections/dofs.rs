//! Degrees of freedom: quantisation step and scale of each.

use crate::blob::{Database, layout::dof_record, read::Record};

impl Database<'_> {
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
}
