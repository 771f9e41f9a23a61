//! From a neighbor's number to its variables: `x[t-1]`, `x[t]`, and the outputs `y[t-1]`, `y[t]` in the wanted mix
//! of styles.
//!
//! Outputs are not stored: they are the frame's counterparts in other clips ([`crate::blob::Counterpart`]), each
//! between two rows. Style weights blend them here, before the fit, so that any number of styles costs one
//! regression (METHODS, "Regression").
//!
//! Cost: a run of two rows for the input, and one of two to four rows for each style that has weight. The rows of
//! a run are unpacked together, and go into the variables as they come.

use crate::{
    blob::{Counterpart, Database, Moment, layout::MAX_STYLES, rows::MAX_RUN},
    contact::Stands,
    regress::{Example, X, X_PREV, Y, Y_PREV},
    stylizer::Mix,
};

/// Weight of each output style; they sum to 1.
pub type StyleWeights = [f32; MAX_STYLES];

/// What was read beside the variables.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Read {
    /// Seconds from the example's `y[t-1]` to its `y[t]`.
    pub step_s: f32,
    /// Bytes of rows read.
    pub bytes: u32,
    /// Which foot stands in the example's `y[t]`.
    pub stands: Stands,
}

/// Reads the example at `row`, a searchable row of `class`.
pub(crate) fn read<const J: usize>(
    database: &Database<'_>,
    class: usize,
    row: usize,
    mix: Mix<'_>,
    example: &mut Example<J>,
) -> Read {
    let mut read = Read::default();
    // `open` has checked that a searchable row has a row before it, and its counterparts.
    let (Some(cycle), Some(before)) = (database.cycle_of(class, row), row.checked_sub(1)) else {
        return read;
    };
    let variables = example.as_flattened_mut();
    read.bytes += database.decode_run(before, 2, variables, |i, slot, value| {
        slot[if i == 0 { X_PREV } else { X }] = value;
    });
    let mut first = true;
    for (style, weight) in mix.weighted(database.counts().styles) {
        let Some(counterpart) = database.counterpart(cycle, row, style) else { continue };
        read.step_s += weight * counterpart.step_s;
        read.stands.add(database, counterpart.now, row, weight);
        read.bytes += blend(database, &counterpart, weight, first, variables);
        first = false;
    }
    read
}

/// Adds a counterpart to the outputs; the first one takes their place.
fn blend(
    database: &Database<'_>,
    counterpart: &Counterpart,
    weight: f32,
    first: bool,
    variables: &mut [[f32; 4]],
) -> u32 {
    let Counterpart { before, now, .. } = counterpart;
    let mut run = Run { start: before.row, count: 0, weights: [[0.0; 2]; MAX_RUN] };
    run.mark(before, weight, 0);
    if now.row >= before.row && now.row + 1 < before.row + MAX_RUN {
        // Next to each other, as good as always: one run, of three rows for the most part.
        run.mark(now, weight, 1);
        return run.add(database, first, variables);
    }
    let bytes = run.add(database, first, variables);
    run = Run { start: now.row, count: 0, weights: [[0.0; 2]; MAX_RUN] };
    run.mark(now, weight, 1);
    bytes + run.add(database, false, variables)
}

/// Rows that follow each other, and their weights in `y[t-1]` and `y[t]`.
struct Run {
    start: usize,
    count: usize,
    weights: [[f32; 2]; MAX_RUN],
}

impl Run {
    /// Gives the rows about a moment their weights; `output` is 0 for `y[t-1]`, 1 for `y[t]`.
    fn mark(&mut self, moment: &Moment, weight: f32, output: usize) {
        let at = moment.row - self.start;
        let parts = [weight * (1.0 - moment.fraction), weight * moment.fraction];
        for (i, part) in parts.into_iter().enumerate().take(if moment.fraction > 0.0 { 2 } else { 1 }) {
            if let Some(slot) = self.weights.get_mut(at + i) {
                slot[output & 1] += part;
            }
            self.count = self.count.max(at + i + 1);
        }
    }

    /// Unpacks the rows into the outputs. Returns the bytes read.
    fn add(&self, database: &Database<'_>, first: bool, variables: &mut [[f32; 4]]) -> u32 {
        let count = self.count.min(MAX_RUN);
        let weights = &self.weights;
        if first {
            database.decode_run(self.start, count, variables, |i, slot, value| {
                let [before, now] = weights[i % MAX_RUN];
                if i == 0 {
                    slot[Y_PREV] = before * value;
                    slot[Y] = now * value;
                } else {
                    slot[Y_PREV] += before * value;
                    slot[Y] += now * value;
                }
            })
        } else {
            database.decode_run(self.start, count, variables, |i, slot, value| {
                let [before, now] = weights[i % MAX_RUN];
                slot[Y_PREV] += before * value;
                slot[Y] += now * value;
            })
        }
    }
}
