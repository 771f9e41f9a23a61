//! Pairs: the counterpart of a captured frame in another style.
//!
//! A cycle (a gait cycle, or a whole-clip action) holds knots: positions in its clip at uniform steps of canonical time.
//! For every cycle and style the blob names one output cycle. A frame's counterpart is that cycle at the frame's
//! canonical time, between two rows. No motion is copied: a pair costs two bytes.
//!
//! A blob may name a **second** output cycle, in a second table behind the first one: the frame's output is then the mean
//! of both, which averages out some of the difference between two performances.
//!
//! The counterpart of the frame *before* comes from the same output cycle, since an autoregressive model needs a
//! `y[t-1]` that leads to `y[t]`. At the beginning of a cycle it lies a little before phase 0.
//!
//! The time step is the way between the two on the output's timeline. Where a gesture is repeated, as in a wave, two clips
//! need not repeat it equally often, and the slope of their warp says little of the output's pace. So a step of a
//! whole-clip action is half of that way, and half of what both cycles' durations say.

use core::ops::Range;

use crate::{
    blob::{
        Class, Database,
        layout::{NONE, cycle},
        read::{Record, u16_at},
    },
    math::clamp,
};

/// Segments of a gait cycle: from one strike of the left foot to that of the right one, and to the next.
const GAIT_SEGMENTS: usize = 2;
/// Part of a whole-clip action's step that its cycles' durations say; the warp's slope says the rest.
const WHOLE_PART: f32 = 0.5;

/// A place in a clip, between two rows.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Moment {
    /// The row at or before the moment.
    pub row: usize,
    /// Fraction of the way to the next row, 0 to 1; 0 at the clip's last row.
    pub fraction: f32,
}

/// The counterpart of a frame in one style.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counterpart {
    /// The moment of `y[t]`.
    pub now: Moment,
    /// The moment of `y[t-1]`, in the same cycle.
    pub before: Moment,
    /// Seconds from one to the other on the output's own timeline.
    pub step_s: f32,
}

#[derive(Clone, Copy)]
struct Cycle<'db> {
    /// Positions of its knots, f32 each.
    knots: &'db [[u8; 4]],
    segments: usize,
    first_row: usize,
    rows: usize,
}

impl Cycle<'_> {
    #[inline]
    fn knot(&self, index: usize) -> f32 {
        self.knots.get(index).map_or(0.0, |knot| f32::from_le_bytes(*knot))
    }

    #[inline]
    fn is_gait(&self) -> bool {
        self.segments == GAIT_SEGMENTS
    }

    /// Rows from the first knot to the last: above 0.
    #[inline]
    fn duration(&self) -> f32 {
        self.knot(self.segments) - self.knot(0)
    }

    /// Canonical time of a position, in segments, 0 at the first knot. The outer segments are extrapolated.
    #[inline(never)]
    fn canonical(&self, position: f32) -> f32 {
        // The knots ascend: count the inner ones up to the position. There may be many.
        let inner = self.knots.get(1..self.segments).unwrap_or(&[]);
        let segment = inner.partition_point(|knot| f32::from_le_bytes(*knot) <= position);
        let start = self.knot(segment);
        segment as f32 + (position - start) / (self.knot(segment + 1) - start)
    }

    /// Position at a canonical time.
    #[inline]
    fn position(&self, canonical: f32) -> f32 {
        let last = self.segments.saturating_sub(1);
        // The cast saturates: below 0 and NaN give segment 0.
        let segment = (canonical as usize).min(last);
        let start = self.knot(segment);
        start + (canonical - segment as f32) * (self.knot(segment + 1) - start)
    }

    /// A position in the clip as a row and a fraction, clamped to the clip's ends.
    #[inline]
    fn moment(&self, position: f32) -> Moment {
        let last = self.rows.saturating_sub(1);
        let position = clamp(position, 0.0, last as f32);
        let row = position as usize;
        Moment { row: self.first_row + row, fraction: if row < last { position - row as f32 } else { 0.0 } }
    }
}

impl<'db> Database<'db> {
    #[inline(never)]
    fn cycle(&self, index: usize) -> Cycle<'db> {
        let record = Record::of(self.required.cycles, index, cycle::LENGTH);
        let (first_row, rows) = self.clip(record.u32(cycle::CLIP) as usize);
        let first_knot = record.u32(cycle::FIRST_KNOT) as usize;
        let knots = self.required.knots.as_chunks::<4>().0.get(first_knot..).unwrap_or(&[]);
        let segments = usize::from(record.u16(cycle::KNOTS)).saturating_sub(1);
        Cycle { knots, segments, first_row, rows }
    }

    /// True if the class is a gait: its cycles go from strike to strike, in two segments. Those of other actions have more.
    #[inline(never)]
    pub fn is_gait(&self, class: usize) -> bool {
        let class = self.class(class);
        class.cycles > 0 && self.cycle(class.first_cycle).is_gait()
    }

    /// First row of a cycle.
    #[inline]
    pub(in crate::blob) fn cycle_start(&self, index: usize) -> usize {
        Record::of(self.required.cycles, index, cycle::LENGTH).u32(cycle::START) as usize
    }

    /// The cycle of class `class` that a row lies in: the last that starts at or before it.
    #[inline(never)]
    pub fn cycle_of(&self, class: usize, row: usize) -> Option<usize> {
        let class = self.class(class);
        let (mut low, mut high) = (0, class.cycles);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.cycle_start(class.first_cycle + middle) <= row {
                low = middle + 1;
            } else {
                high = middle;
            }
        }
        Some(class.first_cycle + low.checked_sub(1)?)
    }

    /// Output cycles of a cycle in a style: 1 or 2.
    #[inline]
    pub fn outputs(&self) -> usize {
        1 + usize::from(self.required.pairs.len() > 2 * self.counts.cycles * self.counts.styles)
    }

    /// The counterparts in `style` of a row of `cycle`, at most two. The row's output is their mean.
    pub fn counterparts(&self, cycle: usize, row: usize, style: usize) -> impl Iterator<Item = Counterpart> {
        (0..self.outputs()).filter_map(move |table| self.counterpart(cycle, row, style, table))
    }

    /// The counterpart by one table of pairs, 0 or 1.
    #[inline(never)]
    pub(crate) fn counterpart(
        &self,
        cycle: usize,
        row: usize,
        style: usize,
        table: usize,
    ) -> Option<Counterpart> {
        let place = (table * self.counts.cycles + cycle) * self.counts.styles + style;
        let output = u16_at(self.required.pairs, 2 * place);
        if output == NONE {
            return None;
        }
        let output = usize::from(output);
        let seconds = 1.0 / self.rate_hz;
        let input = self.cycle(cycle);
        let position = row.saturating_sub(input.first_row) as f32;
        // Where input and output cycle are the same, the output is the input.
        let (there, now, before, step_s) = if output == cycle {
            (input, position, position - 1.0, seconds)
        } else {
            let there = self.cycle(output);
            let scale = there.segments as f32 / input.segments as f32;
            let now = there.position(input.canonical(position) * scale);
            let before = there.position(input.canonical(position - 1.0) * scale);
            let mut rows = now - before;
            if !input.is_gait() {
                rows += WHOLE_PART * (there.duration() / input.duration() - rows);
            }
            (there, now, before, rows * seconds)
        };
        Some(Counterpart { now: there.moment(now), before: there.moment(before), step_s })
    }

    /// The rows of a cycle of `class`.
    #[inline]
    pub(crate) fn cycle_rows(&self, class: &Class, cycle: usize) -> Range<usize> {
        let next = cycle + 1;
        let is_last = next >= class.first_cycle + class.cycles;
        self.cycle_start(cycle)..if is_last { class.first_row + class.rows } else { self.cycle_start(next) }
    }

    /// Rows from a cycle's first knot to its last: above 0.
    #[inline]
    pub(crate) fn cycle_duration(&self, cycle: usize) -> f32 {
        self.cycle(cycle).duration()
    }

    /// Canonical time of a row in a cycle: 0 at its first knot, 1 at its last.
    #[inline(never)]
    pub(crate) fn cycle_time(&self, cycle: usize, row: usize) -> f32 {
        let cycle = self.cycle(cycle);
        cycle.canonical(row.saturating_sub(cycle.first_row) as f32) / cycle.segments as f32
    }

    /// The row nearest to a canonical time of a cycle, 0 to 1.
    #[inline(never)]
    pub(crate) fn row_at(&self, cycle: usize, time: f32) -> usize {
        let cycle = self.cycle(cycle);
        cycle.moment(cycle.position(time * cycle.segments as f32) + 0.5).row
    }

    /// True if the cycle has an output in every style.
    pub fn paired(&self, cycle: usize) -> bool {
        (0..self.counts.styles)
            .all(|s| u16_at(self.required.pairs, 2 * (cycle * self.counts.styles + s)) != NONE)
    }
}
