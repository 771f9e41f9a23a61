//! The models of the other papers in a blob: linear time-invariant models (paper 001) and tables of statistics
//! (paper 002), as [`super::layout`] lays them out; views of their bytes, and what `open` checks in them.

use super::{
    Database,
    check::{Checked, as_u32, check, reserved},
    layout::{MAX_ORDER, NONE, lti, section, statistic},
    read::{Record, f32_at, floats, u16_at},
};
use crate::{
    BlobError,
    math::quaternion::{Quaternion, is_unit},
};

/// The numbers of a byte string, f32 after f32.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Numbers<'a>(&'a [[u8; 4]]);

impl<'a> Numbers<'a> {
    /// Numbers from byte `at` on.
    #[inline]
    pub fn at(bytes: &'a [u8], at: usize) -> Self {
        Self(bytes.get(at..).unwrap_or(&[]).as_chunks::<4>().0)
    }

    /// Takes the next of them: at most so many.
    #[inline]
    pub fn take_first(&mut self, count: usize) -> Self {
        let (first, rest) = self.0.split_at_checked(count).unwrap_or((self.0, &[]));
        self.0 = rest;
        Self(first)
    }

    /// Adds the product of a matrix, row by row the next of them, and a vector: each sum column after column.
    #[inline(never)]
    pub fn add_products(&mut self, sums: &mut [f32], vector: &[f32]) {
        // What joints have: three inputs, and six states unless the builder was told otherwise.
        match vector.as_chunks::<3>() {
            ([x], []) => self.add_rows(sums, x),
            ([x, y], []) => self.add_rows(sums, &[x[0], x[1], x[2], y[0], y[1], y[2]]),
            _ => sums.iter_mut().for_each(|sum| *sum = self.take_first(vector.len()).added_to(*sum, vector)),
        }
    }

    /// The same where the number of columns is known when it is compiled.
    #[inline]
    fn add_rows<const COLUMNS: usize>(&mut self, sums: &mut [f32], vector: &[f32; COLUMNS]) {
        let matrix = self.take_first(sums.len() * COLUMNS).0;
        for (sum, row) in sums.iter_mut().zip(matrix.as_chunks::<COLUMNS>().0) {
            let products = row.iter().zip(vector).map(|(number, x)| f32::from_le_bytes(*number) * x);
            *sum = products.fold(*sum, |sum, product| sum + product);
        }
    }

    /// The sum of their products with the numbers of a vector, one after the other.
    #[inline]
    pub fn product(self, vector: &[f32]) -> f32 {
        self.added_to(0.0, vector)
    }

    #[inline]
    fn added_to(self, sum: f32, vector: &[f32]) -> f32 {
        self.0.iter().zip(vector).fold(sum, |sum, (number, x)| sum + f32::from_le_bytes(*number) * x)
    }

    /// How many there are.
    #[inline]
    pub fn count(self) -> usize {
        self.0.len()
    }
}

impl Iterator for Numbers<'_> {
    type Item = f32;

    #[inline]
    fn next(&mut self) -> Option<f32> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(f32::from_le_bytes(*first))
    }
}

/// A linear time-invariant model: one style of output, estimated from one action or from all.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct LinearModel<'db> {
    /// Style of its output.
    pub style: u16,
    /// The action that it was estimated from; `None`: all.
    pub action: Option<u16>,
    /// Number of units.
    pub units: usize,
    /// States of all units together.
    pub states: usize,
    bytes: &'db [u8],
    dofs: usize,
}

/// One unit of a linear model: some dofs that move on their own, `x' = A x + B u`, `y = C x + D u`.
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

    /// The footplant of a side: boundary, and the projection that it is compared with.
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

    fn unit(bytes: &'db [u8], at: usize) -> Unit<'db> {
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

/// A table of statistics: one style, over one action or all.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Table<'db> {
    /// Its style.
    pub style: u16,
    /// The action that it was taken from; `None`: all.
    pub action: Option<u16>,
    bytes: &'db [u8],
    dofs: usize,
}

impl<'db> Table<'db> {
    /// Mean and standard deviation of height, forward and left velocity.
    #[inline(never)]
    pub fn root(&self, index: usize) -> [f32; 2] {
        floats(self.bytes, statistic::ROOT + 8 * index)
    }

    /// The footplant of a side: boundary, and the projection of the dofs that it is compared with.
    #[inline(never)]
    pub fn foot(&self, side: usize) -> (f32, Numbers<'db>) {
        let at = statistic::FEET + side * 4 * (1 + self.dofs);
        (f32_at(self.bytes, at), Numbers::at(self.bytes, at + 4))
    }

    /// Mean rotation of a joint and standard deviation around it, radians; of joint 0 without the heading.
    #[inline]
    pub fn joint(&self, joint: usize) -> (Quaternion, f32) {
        let bytes = self.bytes.get(statistic::joints(self.dofs)..).unwrap_or(&[]);
        let Some(record) = bytes.as_chunks::<{ statistic::JOINT }>().0.get(joint) else {
            return ([0.0; 4], 0.0);
        };
        let [x, y, z, w, deviation] = Record(record).floats(0..statistic::JOINT);
        ([x, y, z, w], deviation)
    }

    /// Bytes of the table.
    pub fn bytes(&self) -> usize {
        self.bytes.len()
    }
}

fn labelled(action: u16) -> Option<u16> {
    (action != NONE).then_some(action)
}

impl<'db> Database<'db> {
    fn lti(&self) -> Record<'db> {
        Record(self.optional(section::LTI).unwrap_or(&[]))
    }

    fn statistic(&self) -> Record<'db> {
        Record(self.optional(section::STATISTIC).unwrap_or(&[]))
    }

    /// The style that the linear models take; `None` where the blob has none.
    pub fn linear_from(&self) -> Option<u16> {
        self.optional(section::LTI).map(|bytes| u16_at(bytes, lti::FROM.start))
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

    /// Number of the linear model of a style: the one of that action where there is one, else the one of all.
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

    /// The style whose statistics stand for the input's where it is not labelled; `None` where the blob has none.
    pub fn statistic_from(&self) -> Option<u16> {
        self.optional(section::STATISTIC).map(|bytes| u16_at(bytes, statistic::FROM.start))
    }

    /// Number of tables of statistics.
    pub fn tables(&self) -> usize {
        usize::from(self.statistic().u16(statistic::TABLES))
    }

    /// Table `index` of statistics.
    #[inline(never)]
    pub fn table(&self, index: usize) -> Table<'db> {
        let length = statistic::length(self.counts.joints);
        let record = Record::of(self.statistic().0.get(statistic::HEADER..).unwrap_or(&[]), index, length);
        Table {
            style: record.u16(statistic::STYLE),
            action: labelled(record.u16(statistic::ACTION)),
            bytes: record.0,
            dofs: self.counts.dofs,
        }
    }

    /// The statistics of a style: those of that action where there are any, else those of all.
    #[inline(never)]
    pub fn table_of(&self, style: u16, action: Option<u16>) -> Option<Table<'db>> {
        let of = |action: Option<u16>| {
            (0..self.tables()).map(|i| self.table(i)).find(|t| t.style == style && t.action == action)
        };
        action.and_then(|a| of(Some(a))).or_else(|| of(None))
    }
}

#[inline]
fn in_range(mut numbers: impl Iterator<Item = f32>, most: f32) -> bool {
    numbers.all(|v| (-most..=most).contains(&v))
}

#[inline]
fn is_deviation(value: f32) -> bool {
    (1e-6..=1e3).contains(&value)
}

#[inline]
fn length(id: u16, need: usize, have: usize) -> Checked {
    if need == have {
        Ok(())
    } else {
        Err(BlobError::Length { section: id, need: as_u32(need), have: as_u32(have) })
    }
}

/// Checks the linear models: directory, ranges, dofs, poles.
#[inline]
pub(super) fn linear(db: &Database<'_>) -> Checked {
    let Some(bytes) = db.optional(section::LTI) else { return Ok(()) };
    let c = db.counts();
    let (id, models) = (section::LTI, db.linear_models());
    let mut next = lti::HEADER + models * lti::ENTRY;
    if bytes.len() < next {
        return length(id, next, bytes.len());
    }
    reserved(id, Record(bytes).zero(lti::RESERVED))?;
    let from = u16_at(bytes, lti::FROM.start);
    check(id, models, usize::from(from) < c.styles)?;
    for i in 0..models {
        let entry = Record::of(bytes.get(lti::HEADER..).unwrap_or(&[]), i, lti::ENTRY);
        let model = db.linear_model(i);
        let labels_fit = usize::from(model.style) < c.styles
            && model.style != from
            && model.action.is_none_or(|a| usize::from(a) < c.actions);
        check(id, i, labels_fit && entry.u32(lti::OFFSET) as usize == next)?;
        let doubled =
            (0..i).map(|j| db.linear_model(j)).any(|m| (m.style, m.action) == (model.style, model.action));
        // One unit a joint, and two more of the root; their states have room in a stylizer of as many joints.
        check(id, i, !doubled && model.units <= c.joints + 2 && model.states <= MAX_ORDER * c.joints)?;
        next = next.saturating_add(entry.u32(lti::BYTES) as usize);
        check(id, i, next <= bytes.len())?;
        check(id, i, one_model(&model, c.dofs))?;
    }
    length(id, next, bytes.len())?;
    let every = (0..c.styles as u16).all(|s| s == from || db.linear_model_of(s, None).is_some());
    check(id, models, every)
}

#[inline]
fn one_model(model: &LinearModel<'_>, dofs: usize) -> bool {
    let units = lti::units(dofs, model.states);
    if model.bytes() < units {
        return false;
    }
    let dofs_fit = (0..=dofs).all(|d| {
        let [input_mean, input_deviation, output_mean, output_deviation] = model.dof(d);
        in_range([input_mean, output_mean].into_iter(), 1e3)
            && is_deviation(input_deviation)
            && is_deviation(output_deviation)
    });
    let feet_fit = in_range(Numbers::at(model.bytes.get(..units).unwrap_or(&[]), lti::feet(dofs)), 1e6);
    if !dofs_fit || !feet_fit {
        return false;
    }
    let (mut at, mut states) = (units, 0);
    for _ in 0..model.units {
        let unit = LinearModel::unit(model.bytes, at);
        let numbers = lti::numbers(unit.order, unit.inputs, unit.outputs);
        let sizes_fit = unit.order <= MAX_ORDER
            && (1..=4).contains(&unit.inputs)
            && (1..=4).contains(&unit.outputs)
            && unit.first_input + unit.inputs <= dofs
            && unit.first_output + unit.outputs <= dofs + 1
            && model.bytes.get(at + lti::UNIT_RESERVED) == Some(&0);
        if !sizes_fit || unit.numbers.count() < numbers {
            return false;
        }
        if !in_range(unit.numbers.take(numbers), 1e4) || !is_stable(&unit) {
            return false;
        }
        at += lti::UNIT + 4 * numbers;
        states += unit.order;
    }
    at == model.bytes() && states == model.states
}

// A function of its own, and of slices: the compiler would lay out all 64 products.
#[inline(never)]
fn add_scaled(sums: &mut [f32], factor: f32, values: &[f32]) {
    for (sum, value) in sums.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// True where every pole lies inside the unit circle: `A` to the power of 1,024 is small. Ten squarings.
#[inline]
fn is_stable(unit: &Unit<'_>) -> bool {
    let mut power = [[0.0_f32; MAX_ORDER]; MAX_ORDER];
    let mut numbers = unit.numbers;
    for row in power.iter_mut().take(unit.order) {
        for (slot, number) in row.iter_mut().take(unit.order).zip(&mut numbers) {
            *slot = number;
        }
    }
    for _ in 0..10 {
        let mut square = [[0.0; MAX_ORDER]; MAX_ORDER];
        for (out, row) in square.iter_mut().zip(&power) {
            for (&factor, other) in row.iter().zip(&power) {
                add_scaled(out, factor, other);
            }
        }
        power = square;
    }
    // What has grown beyond all bounds is no number, and in no range.
    (0.0..=1.0).contains(&power.iter().flatten().map(|v| v * v).sum::<f32>())
}

/// Checks the tables of statistics.
#[inline]
pub(super) fn statistics(db: &Database<'_>) -> Checked {
    let Some(bytes) = db.optional(section::STATISTIC) else { return Ok(()) };
    let c = db.counts();
    let (id, tables) = (section::STATISTIC, db.tables());
    length(id, statistic::HEADER + tables * statistic::length(c.joints), bytes.len())?;
    reserved(id, Record(bytes).zero(statistic::RESERVED))?;
    check(id, tables, usize::from(u16_at(bytes, statistic::FROM.start)) < c.styles)?;
    for i in 0..tables {
        let table = db.table(i);
        reserved(id, Record(table.bytes).zero(statistic::TABLE_RESERVED))?;
        let labels_fit =
            usize::from(table.style) < c.styles && table.action.is_none_or(|a| usize::from(a) < c.actions);
        let doubled = (0..i).map(|j| db.table(j)).any(|t| (t.style, t.action) == (table.style, table.action));
        let root_fits = (0..3).all(|r| {
            let [mean, deviation] = table.root(r);
            in_range([mean].into_iter(), 1e3) && is_deviation(deviation)
        });
        let feet = table.bytes.get(..statistic::joints(c.dofs)).unwrap_or(&[]);
        let feet_fit = in_range(Numbers::at(feet, statistic::FEET), 1e6);
        let joints_fit = (0..c.joints).all(|j| {
            let (mean, deviation) = table.joint(j);
            is_unit(mean) && is_deviation(deviation)
        });
        check(id, i, labels_fit && !doubled && root_fits && feet_fit && joints_fit)?;
    }
    check(id, tables, (0..c.styles as u16).all(|s| db.table_of(s, None).is_some()))
}
