//! The timing metric: which dofs the prediction of the time step compares, and how it weighs them.

use crate::blob::{Database, layout::timing, read::Record};

/// A dof that the timing prediction compares.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TimingDof {
    /// The dof.
    pub dof: usize,
    /// Weight of squared differences of the dof.
    pub pose: f32,
    /// Weight of squared differences of its change from frame to frame.
    pub change: f32,
}

impl Database<'_> {
    /// Entry `index` of the timing metric.
    #[inline(never)]
    pub fn timing(&self, index: usize) -> TimingDof {
        let record = Record::of(self.required.timing, index, timing::LENGTH);
        TimingDof {
            dof: usize::from(record.u16(timing::DOF)),
            pose: record.f32(timing::POSE),
            change: record.f32(timing::CHANGE),
        }
    }
}
