//! Phase tables, as [`phase`](crate::blob::layout::phase) lays them out.

use crate::blob::{
    Database, Numbers,
    layout::{
        MAX_GROUPS,
        phase::{self, CONTACT_STEP, CONTACTS, Parts, dof_scale, tables},
    },
    read::Record,
};

/// The phase tables of a class: what its motion and its outputs are on average at each phase.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PhaseTables<'db> {
    /// Feature knots.
    pub feature_knots: usize,
    /// Dof knots.
    pub dof_knots: usize,
    /// Slope knots.
    pub slope_knots: usize,
    /// Whether the end of a cycle is the start of the next.
    pub is_cyclic: bool,
    /// Part of the input's departure from its mean that the output keeps.
    pub gain: f32,
    /// Squared distance that 99% of the class's own frames are within, whitened.
    pub far: f32,
    /// Mean forward speed, m/s, and yaw rate, rad/s, of the class.
    pub drift: [f32; 2],
    /// Seconds of the halves of a cycle.
    pub seconds: [f32; 2],
    /// The same of the outputs.
    pub output_seconds: [f32; 2],
    bytes: &'db [u8],
    features: usize,
    dofs: usize,
}

/// Codes of a dof: which value a stored number means.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct DofScale {
    /// Value of code 0.
    pub centre: f32,
    /// One step of a code.
    pub step: f32,
    /// Codes for one unit.
    pub inverse: f32,
}

impl<'db> PhaseTables<'db> {
    /// Where the parts are.
    pub fn parts(&self) -> Parts {
        Parts::of(self.feature_knots, self.dof_knots, self.slope_knots, self.features, self.dofs)
    }

    /// The feature knots: their codes, one i8 a byte, and their squared lengths, square steps, at most 32 · 128².
    #[inline]
    pub fn knots(&self) -> impl Iterator<Item = (&'db [u8], i32)> + use<'db> {
        let (norms, rest) = self.bytes.split_at_checked(4 * self.feature_knots).unwrap_or_default();
        let norms = norms.as_chunks::<4>().0.iter().map(|&bytes| i32::from_le_bytes(bytes));
        rest.chunks_exact(self.features.max(1)).zip(norms)
    }

    /// One of [`knots`](Self::knots).
    #[inline]
    pub fn knot(&self, knot: usize) -> (&'db [u8], i32) {
        self.knots().nth(knot).unwrap_or_default()
    }

    /// Row `knot` of the table that begins at byte `at`, as [`parts`](Self::parts) says; a row of the slopes is 2 D wide.
    #[inline]
    pub fn row(&self, at: usize, width: usize, knot: usize) -> &'db [u8] {
        self.bytes.get(at + width * knot..).and_then(|rest| rest.get(..width)).unwrap_or(&[])
    }

    /// Standard deviation of each dof from the mean, in steps of its code.
    #[inline]
    pub fn spread(&self) -> &'db [u8] {
        self.row(self.parts().spread, self.dofs, 0)
    }

    /// Likelihood that the left and the right foot stand at one of the stored phases, 0 to 1.
    #[inline]
    pub fn contact(&self, index: usize) -> [f32; 2] {
        let row = Record(self.row(self.parts().contacts, 2, index % CONTACTS));
        [0, 1].map(|side| f32::from(row.u8(side)) * CONTACT_STEP)
    }
}

impl<'db> Database<'db> {
    /// Whether the blob has phase tables.
    #[inline]
    pub fn has_phase(&self) -> bool {
        self.optional.phase.is_some()
    }

    #[inline]
    fn phase(&self) -> Record<'db> {
        Record(self.optional.phase.unwrap_or(&[]))
    }

    /// Whitened units of one step of a feature knot.
    #[inline]
    pub fn phase_step(&self) -> f32 {
        self.phase().f32(phase::STEP)
    }

    /// Steps of a dof for one step of its slopes: for each m/s, and for each rad/s.
    #[inline]
    pub fn slope_steps(&self) -> [f32; 2] {
        self.phase().floats(phase::SLOPE_STEPS)
    }

    /// The whitening matrices, group after group.
    #[inline]
    pub fn whitening(&self) -> Numbers<'db> {
        Numbers::at(self.phase().0, phase::HEADER)
    }

    /// Number of features of each joint group. Where there are phase tables, features ascend by their groups.
    #[inline(never)]
    pub fn features_by_group(&self) -> [usize; MAX_GROUPS] {
        let mut counts = [0; MAX_GROUPS];
        for &group in self.feature_groups() {
            if let Some(count) = counts.get_mut(usize::from(group)) {
                *count += 1;
            }
        }
        counts
    }

    /// Where the dofs' codes begin, bytes from the start of the section.
    #[inline(never)]
    pub(in crate::blob) fn phase_dofs_at(&self) -> usize {
        phase::HEADER + 4 * self.features_by_group().iter().map(|n| n * n).sum::<usize>()
    }

    /// The codes of every dof, in order.
    #[inline]
    pub fn phase_dofs(&self) -> impl Iterator<Item = DofScale> + use<'db> {
        let records = self.phase().0.get(self.phase_dofs_at()..).unwrap_or(&[]);
        records.as_chunks::<{ dof_scale::LENGTH }>().0.iter().take(self.counts.dofs).map(|record| {
            let record = Record(record);
            DofScale {
                centre: record.f32(dof_scale::CENTRE),
                step: record.f32(dof_scale::STEP),
                inverse: record.f32(dof_scale::INVERSE),
            }
        })
    }

    /// Where the classes' records begin, bytes from the start of the section.
    #[inline]
    pub(in crate::blob) fn phase_classes_at(&self) -> usize {
        self.phase_dofs_at() + dof_scale::LENGTH * self.counts.dofs
    }

    /// The record of a class.
    #[inline]
    pub(in crate::blob) fn phase_record(&self, class: usize) -> Record<'db> {
        let records = self.phase().0.get(self.phase_classes_at()..).unwrap_or(&[]);
        Record::of(records, class, tables::LENGTH)
    }

    /// The tables of a class.
    pub fn phase_tables(&self, class: usize) -> PhaseTables<'db> {
        self.phase_tables_of(self.phase_record(class))
    }

    /// The tables of any class, by its number: for many of them, since where the records begin takes longer to find
    /// than what is in one.
    pub fn all_phase_tables(&self) -> impl Fn(usize) -> PhaseTables<'db> {
        let records = self.phase().0.get(self.phase_classes_at()..).unwrap_or(&[]);
        move |class| self.phase_tables_of(Record::of(records, class, tables::LENGTH))
    }

    #[inline(never)]
    fn phase_tables_of(&self, record: Record<'_>) -> PhaseTables<'db> {
        let short = |range| usize::from(record.u16(range));
        let mut found = PhaseTables {
            feature_knots: short(tables::FEATURE_KNOTS),
            dof_knots: short(tables::DOF_KNOTS),
            slope_knots: short(tables::SLOPE_KNOTS),
            is_cyclic: record.u8(tables::CYCLIC) == 1,
            gain: record.f32(tables::GAIN),
            far: record.f32(tables::FAR),
            drift: record.floats(tables::DRIFT),
            seconds: record.floats(tables::SECONDS),
            output_seconds: record.floats(tables::OUTPUT_SECONDS),
            bytes: &[],
            features: self.counts.features,
            dofs: self.counts.dofs,
        };
        let at = record.u32(tables::OFFSET) as usize;
        let bytes = self.phase().0.get(at..).and_then(|rest| rest.get(..found.parts().end));
        found.bytes = bytes.unwrap_or(&[]);
        found
    }
}
