//! From a neighbor's number to its variables: `x[t-1]`, `x[t]`, and the outputs `y[t-1]`, `y[t]` in the wanted mix
//! of styles.
//!
//! Outputs are not stored: they are the frame's counterparts in other clips ([`crate::blob::Counterpart`]), each
//! between two rows. Style weights blend them here, before the fit, so that any number of styles costs one
//! regression (METHODS, "Regression"). Neighbors come sorted by row, and neighbors in time share rows: a small
//! cache of unpacked rows saves more than half of the unpacking.

use crate::{
    blob::{Database, Moment, layout::MAX_STYLES},
    pose::Dofs,
    regress::Variables,
};

/// Rows that are kept unpacked.
const CACHED: usize = 6;
const NOTHING: u32 = u32::MAX;

/// Weight of each output style; they sum to 1.
pub type StyleWeights = [f32; MAX_STYLES];

/// Unpacks examples, one at a time.
#[derive(Debug, Clone)]
pub struct Reader<const J: usize> {
    rows: [u32; CACHED],
    cache: [Dofs<J>; CACHED],
    next: u8,
    /// The variables of the last example read.
    pub variables: Variables<J>,
    /// Seconds from its `y[t-1]` to its `y[t]`.
    pub step_s: f32,
    /// Bytes of rows read since [`start`](Self::start).
    pub bytes: u32,
}

impl<const J: usize> Reader<J> {
    /// A reader that has read nothing.
    #[inline(never)]
    pub const fn new() -> Self {
        Self {
            rows: [NOTHING; CACHED],
            cache: [[[0.0; 4]; J]; CACHED],
            next: 0,
            variables: Variables::ZERO,
            step_s: 0.0,
            bytes: 0,
        }
    }

    /// Starts a frame's account of bytes.
    pub fn start(&mut self) {
        self.bytes = 0;
    }

    /// Reads the example at `row`, a searchable row of `class`, into [`variables`](Self::variables).
    pub fn read(&mut self, database: &Database<'_>, class: usize, row: usize, styles: &StyleWeights) {
        let Some(cycle) = database.cycle_of(class, row) else { return };
        self.variables.x_prev = *self.unpacked(database, row.saturating_sub(1));
        self.variables.x = *self.unpacked(database, row);
        self.variables.y_prev = [[0.0; 4]; J];
        self.variables.y = [[0.0; 4]; J];
        self.step_s = 0.0;
        let weighted = styles.iter().enumerate().take(database.counts().styles).filter(|(_, w)| **w > 0.0);
        for (style, &weight) in weighted {
            // `open` has checked that a searchable row has its counterparts.
            let Some(counterpart) = database.counterpart(cycle, row, style) else { continue };
            self.step_s += weight * counterpart.step_s;
            self.blend(database, counterpart.before, weight, true);
            self.blend(database, counterpart.now, weight, false);
        }
    }

    fn blend(&mut self, database: &Database<'_>, moment: Moment, weight: f32, before: bool) {
        let fraction = moment.fraction;
        self.blend_row(database, moment.row, weight * (1.0 - fraction), before);
        if fraction > 0.0 {
            self.blend_row(database, moment.row + 1, weight * fraction, before);
        }
    }

    fn blend_row(&mut self, database: &Database<'_>, row: usize, weight: f32, before: bool) {
        let slot = self.slot(database, row);
        let target = if before { &mut self.variables.y_prev } else { &mut self.variables.y };
        let quads = database.counts().dofs.div_ceil(4);
        for (sums, values) in target.iter_mut().zip(&self.cache[slot]).take(quads) {
            for (sum, value) in sums.iter_mut().zip(values) {
                *sum += weight * value;
            }
        }
    }

    fn unpacked(&mut self, database: &Database<'_>, row: usize) -> &Dofs<J> {
        let slot = self.slot(database, row);
        &self.cache[slot]
    }

    /// The place of a row in the cache; unpacks it where it is not there yet. Less than [`CACHED`].
    fn slot(&mut self, database: &Database<'_>, row: usize) -> usize {
        let row_id = row as u32;
        if let Some(slot) = self.rows.iter().position(|&r| r == row_id) {
            return slot;
        }
        let slot = usize::from(self.next) % CACHED;
        self.next = ((slot + 1) % CACHED) as u8;
        self.rows[slot] = row_id;
        database.decode(row, self.cache[slot].as_flattened_mut());
        self.bytes += database.row_cost(row) as u32;
        slot
    }
}

impl<const J: usize> Default for Reader<J> {
    fn default() -> Self {
        Self::new()
    }
}
