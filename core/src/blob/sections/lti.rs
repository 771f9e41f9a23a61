//! Linear time-invariant models (Hsu 2005), as [`lti`](crate::blob::layout::lti) lays them out.

use super::labelled;
use crate::blob::{
    Database, Numbers,
    layout::lti,
    read::{Record, f32_at, floats, u16_at},
};

/// A linear time-invariant model: one style of output, estimated from one action or from all.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinearModel<'db> {
    /// Style of its output.
    pub style: u16,
    /// The action that it was estimated from; `None` for all.
    pub action: Option<u16>,
    /// Number of units.
    pub units: usize,
    /// States of all units together.
    pub states: usize,
    pub(in crate::blob) bytes: &'db [u8],
    dofs: usize,
}

/// One unit of a linear model: dofs that are modelled together, `x' = A x + B u`, `y = C x + D u`.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Unit<'db> {
    /// States n.
    pub order: usize,
    /// Inputs m.
    pub inputs: usize,
    /// Outputs p.
    pub outputs: usize,
    /// First input dof.
    pub first_input: usize,
    /// First output dof; D is the logarithm of the time warp.
    pub first_output: usize,
    /// A `[n][n]`, B `[n][m]`, C `[p][n]`, D `[p][m]`, row by row.
    pub numbers: Numbers<'db>,
}

impl<'db> LinearModel<'db> {
    /// Mean and standard deviation of the inputs, dof by dof.
    #[inline]
    pub fn inputs(&self) -> impl Iterator<Item = [f32; 2]> + use<'db> {
        let records = self.bytes.as_chunks::<{ lti::DOF }>().0;
        records.iter().take(self.dofs).map(|record| Record(record).floats(0..8))
    }

    /// Mean and standard deviation of a dof's input, then of its output; of dof D those of the log time warp.
    #[inline]
    pub fn dof(&self, dof: usize) -> [f32; 4] {
        match self.bytes.as_chunks::<{ lti::DOF }>().0.get(dof) {
            Some(record) if dof < self.dofs => Record(record).floats(0..16),
            _ => {
                let [mean, deviation] = floats(self.bytes, lti::step(self.dofs));
                [0.0, 1.0, mean, deviation]
            }
        }
    }

    /// The footplant detector of a side: the boundary, and the projection of the states that is compared with it.
    #[inline(never)]
    pub fn foot(&self, side: usize) -> (f32, Numbers<'db>) {
        let at = lti::feet(self.dofs) + side * 4 * (1 + self.states);
        (f32_at(self.bytes, at), Numbers::at(self.bytes, at + 4))
    }

    /// The units in order.
    pub fn units(&self) -> impl Iterator<Item = Unit<'db>> + use<'db> {
        let (bytes, mut at) = (self.bytes, lti::units(self.dofs, self.states));
        (0..self.units).map(move |_| {
            let unit = Self::unit(bytes, at);
            at += lti::UNIT + 4 * lti::numbers(unit.order, unit.inputs, unit.outputs);
            unit
        })
    }

    pub(in crate::blob) fn unit(bytes: &'db [u8], at: usize) -> Unit<'db> {
        let record = Record(bytes.get(at..).unwrap_or(&[]));
        Unit {
            order: usize::from(record.u8(lti::ORDER)),
            inputs: usize::from(record.u8(lti::INPUTS)),
            outputs: usize::from(record.u8(lti::OUTPUTS)),
            first_input: usize::from(record.u16(lti::FIRST_INPUT)),
            first_output: usize::from(record.u16(lti::FIRST_OUTPUT)),
            numbers: Numbers::at(record.0, lti::UNIT),
        }
    }

    /// Bytes of the model.
    pub fn bytes(&self) -> usize {
        self.bytes.len()
    }
}

impl<'db> Database<'db> {
    fn lti(&self) -> Record<'db> {
        Record(self.optional.lti.unwrap_or(&[]))
    }

    /// The input style of the linear models; `None` if the blob has none.
    pub fn linear_from(&self) -> Option<u16> {
        self.optional.lti.map(|bytes| u16_at(bytes, lti::FROM.start))
    }

    /// Number of linear models.
    pub fn linear_models(&self) -> usize {
        usize::from(self.lti().u16(lti::MODELS))
    }

    /// Linear model `index`.
    #[inline(never)]
    pub fn linear_model(&self, index: usize) -> LinearModel<'db> {
        let entry = Record::of(self.lti().0.get(lti::HEADER..).unwrap_or(&[]), index, lti::ENTRY);
        let start = entry.u32(lti::OFFSET) as usize;
        let end = start.saturating_add(entry.u32(lti::BYTES) as usize);
        LinearModel {
            style: entry.u16(lti::STYLE),
            action: labelled(entry.u16(lti::ACTION)),
            units: usize::from(entry.u16(lti::UNITS)),
            states: usize::from(entry.u16(lti::STATES)),
            bytes: self.lti().0.get(start..end).unwrap_or(&[]),
            dofs: self.counts.dofs,
        }
    }

    /// Number of the linear model of a style: that of the action if there is one, otherwise that of all actions.
    #[inline(never)]
    pub fn linear_model_of(&self, style: u16, action: Option<u16>) -> Option<usize> {
        let of = |action: Option<u16>| {
            (0..self.linear_models()).find(|&i| {
                let model = self.linear_model(i);
                model.style == style && model.action == action
            })
        };
        action.and_then(|a| of(Some(a))).or_else(|| of(None))
    }
}
