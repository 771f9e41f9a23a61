//! Unpacks the variables of a neighbor: `x[t-1]`, `x[t]`, and the outputs `y[t-1]`, `y[t]` in a mix of styles.
//!
//! Outputs are not stored. They are the frame's counterparts in other clips ([`crate::blob::Counterpart`]), each
//! interpolated between two rows. If the blob names two counterparts for a style, their mean is used. Outputs are
//! blended by the style weights before the fit, so that any number of styles costs one regression.
//!
//! Cost: a run of two rows for the input, and one of two to four rows for each output with weight. The rows of a run are
//! unpacked together, or one by one where a block ends between them.

use crate::{
    blob::{Counterpart, Database, Moment, layout::MAX_STYLES},
    methods::mixture::{
        contact_votes::OutputContacts,
        variables::{FRACTION, X, X_PREV, Y, Y_PREV},
    },
    stylizer::style_mix::StyleMix,
};

/// Greatest number of rows that are unpacked together.
const MAX_RUN: usize = 4;
/// The fixed-point weight that stands for 1.
const ONE: f32 = (1 << FRACTION) as f32;

/// The styles that have weight, by number.
pub(crate) type ActiveStyles = heapless::Vec<u8, MAX_STYLES>;

/// Lists the styles that have weight in a mix.
pub(crate) fn active_styles(mix: StyleMix<'_>, styles: usize) -> ActiveStyles {
    let mut active = ActiveStyles::new();
    for (style, _) in mix.weighted(styles) {
        // There is room for every style.
        let _ = active.push(style as u8);
    }
    active
}

/// What [`read`] returns beside the variables.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Read {
    /// Seconds from the example's `y[t-1]` to its `y[t]`.
    pub step_s: f32,
    /// Bytes of rows read.
    pub bytes: u32,
    /// Which feet stand in the example's `y[t]`.
    pub stands: OutputContacts,
}

/// Reads the example at `row`, a searchable row of `class`, with its outputs in the `active` styles, by their weights in
/// `mix`; `variables` as in [`Example`](super::variables::Example).
// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
pub(crate) fn read(
    database: &Database<'_>,
    class: usize,
    row: usize,
    mix: StyleMix<'_>,
    active: &[u8],
    variables: &mut [[i32; 4]],
) -> Read {
    let mut read = Read::default();
    // `open` has checked that a searchable row has a row before it, and its counterparts.
    let (Some(cycle), Some(before)) = (database.cycle_of(class, row), row.checked_sub(1)) else {
        return read;
    };
    // Outputs are added up, from 0.
    let both = database.unpack(before, variables, |slot, [x_prev, x]| {
        *slot = [0; 4];
        slot[X_PREV] = x_prev << FRACTION;
        slot[X] = x << FRACTION;
    });
    read.bytes += both.unwrap_or_else(|| {
        variables.fill([0; 4]);
        let one = |row, place: usize, variables: &mut [[i32; 4]]| {
            database.unpack(row, variables, |slot, [value]| slot[place & 3] = value << FRACTION).unwrap_or(0)
        };
        one(before, X_PREV, variables) + one(row, X, variables)
    });
    let outputs = database.outputs();
    let share = if outputs > 1 { 0.5 } else { 1.0 };
    // The running sum of the weights is rounded, not each weight, so that they sum to 1.
    let (mut sum, mut parts) = (0.0, 0);
    for table in 0..outputs {
        for style in active.iter().map(|&style| usize::from(style)) {
            let Some(counterpart) = database.counterpart(cycle, row, style, table) else { continue };
            let weight = share * mix.weight(style);
            read.step_s += weight * counterpart.step_s;
            read.stands.add(database, counterpart.now, row, weight);
            sum += weight;
            let before = core::mem::replace(&mut parts, rounded(sum * ONE));
            read.bytes += blend(database, &counterpart, parts - before, variables);
        }
    }
    read
}

/// Rounds a number that is not negative to the nearest integer.
fn rounded(value: f32) -> i32 {
    (value + 0.5) as i32
}

/// Adds a counterpart to the outputs with a fixed-point weight. Returns the bytes read.
fn blend(database: &Database<'_>, counterpart: &Counterpart, weight: i32, variables: &mut [[i32; 4]]) -> u32 {
    let Counterpart { before, now, .. } = counterpart;
    let mut run = Run { start: before.row, count: 0, weights: [[0; 2]; MAX_RUN] };
    run.mark(before, weight, 0);
    if now.row >= before.row && now.row + 1 < before.row + MAX_RUN {
        // Both moments are nearly always close: one run, usually of three rows.
        run.mark(now, weight, 1);
        return run.add(database, variables);
    }
    let bytes = run.add(database, variables);
    run = Run { start: now.row, count: 0, weights: [[0; 2]; MAX_RUN] };
    run.mark(now, weight, 1);
    bytes + run.add(database, variables)
}

/// Consecutive rows and their weights in `y[t-1]` and `y[t]`.
struct Run {
    start: usize,
    count: usize,
    weights: [[i32; 2]; MAX_RUN],
}

impl Run {
    /// Adds the weights of the rows around a moment; `output` is 0 for `y[t-1]` and 1 for `y[t]`.
    fn mark(&mut self, moment: &Moment, weight: i32, output: usize) {
        let at = moment.row - self.start;
        // The two parts sum to the weight in spite of rounding.
        let second = rounded(weight as f32 * moment.fraction);
        let parts = [weight - second, second];
        for (i, part) in parts.into_iter().enumerate().take(if moment.fraction > 0.0 { 2 } else { 1 }) {
            if let Some(slot) = self.weights.get_mut(at + i) {
                slot[output & 1] += part;
            }
            self.count = self.count.max(at + i + 1);
        }
    }

    /// Adds the rows to the outputs. Returns the bytes read.
    fn add(&self, database: &Database<'_>, variables: &mut [[i32; 4]]) -> u32 {
        let count = self.count.min(MAX_RUN);
        // Weights for `y[t-1]` and for `y[t]`, by row. `y[t-1]` begins in row 0 of the run and has two rows at most: of
        // a run of three or four rows the others have no weight in it, nor have the first ones in `y[t]`.
        let [[p0, n0], [p1, n1], [_, n2], [_, n3]] = self.weights;
        let whole = match count {
            2 => database.unpack(self.start, variables, |slot, [a, b]| {
                slot[Y_PREV] += p0 * a + p1 * b;
                slot[Y] += n0 * a + n1 * b;
            }),
            3 => database.unpack(self.start, variables, |slot, [a, b, c]| {
                slot[Y_PREV] += p0 * a + p1 * b;
                slot[Y] += n1 * b + n2 * c;
            }),
            4 => database.unpack(self.start, variables, |slot, [a, b, c, d]| {
                slot[Y_PREV] += p0 * a + p1 * b;
                slot[Y] += n2 * c + n3 * d;
            }),
            _ => None,
        };
        whole.unwrap_or_else(|| self.add_row_by_row(database, variables))
    }

    /// [`add`](Self::add) for rows of two blocks.
    #[inline(never)]
    fn add_row_by_row(&self, database: &Database<'_>, variables: &mut [[i32; 4]]) -> u32 {
        let rows = self.weights.iter().enumerate().take(self.count);
        rows.map(|(i, &weights)| add_row(database, self.start + i, weights, variables)).sum()
    }
}

/// Adds a row to the outputs, with its weights in `y[t-1]` and `y[t]`. Returns the bytes read.
#[inline(never)]
fn add_row(database: &Database<'_>, row: usize, [before, now]: [i32; 2], variables: &mut [[i32; 4]]) -> u32 {
    let bytes = database.unpack(row, variables, |slot: &mut [i32; 4], [value]| {
        slot[Y_PREV] += before * value;
        slot[Y] += now * value;
    });
    bytes.unwrap_or(0)
}
