//! Sections of captured motion: clips, cycles and their pairs, classes with each frame's flags and edges, packed rows,
//! and the timing metric.

use super::{labels::Labels, lengths::blocks_of};
use crate::{
    Method,
    blob::{
        Class, Database,
        check::{Checked, check, length, reserved},
        layout::{DEGREE, ENTRIES, NONE, block, class, cycle, distances, flag, section, timing, trust},
        read::{Record, u16_at, u32_at},
    },
    search::metric::MOST_NORM2,
};

#[inline]
pub(super) fn clips(db: &Database<'_>) -> Checked {
    let mut next = 0;
    for i in 0..db.counts.clips {
        let (first, rows) = db.clip(i);
        // Clips lie side by side and fill the rows.
        check(section::CLIPS, i, first == next && (1..=db.counts.rows).contains(&rows))?;
        next = first + rows;
    }
    check(section::CLIPS, db.counts.clips, next == db.counts.rows)
}

#[inline]
pub(super) fn cycles(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let mut rest = db.required.knots.as_chunks::<4>().0;
    let mut next = 0;
    for i in 0..c.cycles {
        let record = Record::of(db.required.cycles, i, cycle::LENGTH);
        let clip = record.u32(cycle::CLIP) as usize;
        let first = record.u32(cycle::FIRST_KNOT) as usize;
        let knots = usize::from(record.u16(cycle::KNOTS));
        let start = record.u32(cycle::START) as usize;
        // Knots of the cycles lie side by side and fill their section.
        let refers = clip < c.clips && knots >= 2 && first == next && knots <= rest.len();
        check(section::CYCLES, i, refers)?;
        reserved(section::CYCLES, record.zero(cycle::RESERVED))?;
        let (first_row, rows) = db.clip(clip);
        check(section::CYCLES, i, start >= first_row && start < first_row + rows)?;
        next += knots;
        let (own, others) = rest.split_at_checked(knots).unwrap_or((rest, &[]));
        rest = others;
        let mut before = f32::NEG_INFINITY;
        for (k, &knot) in (first..).zip(own) {
            let knot = f32::from_le_bytes(knot);
            // At least a hundredth of a frame for each segment, so that phases stay finite.
            check(
                section::KNOTS,
                k,
                knot - before >= 0.01 && (-1000.0..=rows as f32 + 1000.0).contains(&knot),
            )?;
            before = knot;
        }
    }
    length(section::KNOTS, 4 * next, db.required.knots.len())?;
    let table = c.cycles * c.styles;
    for (i, &output) in db.required.pairs.as_chunks::<2>().0.iter().enumerate() {
        let output = u16::from_le_bytes(output);
        // The second table has an output for every cycle and style.
        check(section::PAIRS, i, usize::from(output) < c.cycles || (output == NONE && i < table))?;
    }
    Ok(())
}

/// The labels of classes and, if the mixture `is_built`, their rows.
// Not inlined, so that the labels do not stay on the stack.
#[inline(never)]
pub(super) fn classes(db: &Database<'_>, is_built: &impl Fn(Method) -> bool) -> Checked {
    let (c, reads_frames) = (&db.counts, is_built(Method::Mar));
    let (mut next_row, mut next_cycle) = (0, 0);
    let mut labels = Labels::new();
    for i in 0..c.classes {
        let class = db.class(i);
        let bad = |fits| check(section::CLASSES, i, fits);
        bad(usize::from(class.action) < c.actions && usize::from(class.style) < c.styles)?;
        bad(labels.insert(class.style, Some(class.action)))?;
        if c.frames == 0 {
            // A blob that was cut to its models: labels, and nothing else.
            let record = Record::of(db.required.classes, i, class::LENGTH);
            bad(record.zero(0..class::ACTION.start) && record.zero(class::STYLE.end..class::LENGTH))?;
            continue;
        }
        if !reads_frames {
            continue;
        }
        bad((1..=usize::from(u16::MAX)).contains(&class.rows) && class.first_row == next_row)?;
        bad(class.first_cycle == next_cycle && (1..=c.cycles).contains(&class.cycles))?;
        next_row += class.rows;
        next_cycle += class.cycles;
        bad(next_row <= c.frames && next_cycle <= c.cycles)?;
        let flags = db.required.flags.get(class.first_row..next_row).unwrap_or(&[]);
        let searchable = flags.iter().filter(|&&f| f & flag::SEARCHABLE != 0).count();
        bad(searchable == class.searchable && (1..=searchable).contains(&class.k_cap))?;
        let entries =
            Record::of(db.required.classes, i, class::LENGTH).0.get(class::ENTRY_POINTS).unwrap_or(&[]);
        bad(db.entries(i).count() > 0)?;
        for e in 0..ENTRIES {
            let row = u16_at(entries, 2 * e);
            bad(row == NONE || can_be_found(flags, row))?;
        }
        let mut before = None;
        for j in class.first_cycle..next_cycle {
            let start = Record::of(db.required.cycles, j, cycle::LENGTH).u32(cycle::START) as usize;
            let ascends = before.is_none_or(|b| start > b);
            check(section::CYCLES, j, ascends && (class.first_row..next_row).contains(&start))?;
            before = Some(start);
        }
        rows_of_class(db, &class, flags)?;
    }
    check(section::CLASSES, c.classes, next_row == c.frames || !reads_frames)
}

/// True if the search may return this row of the class with those flags.
#[inline]
fn can_be_found(flags: &[u8], row: u16) -> bool {
    flags.get(usize::from(row)).is_some_and(|f| f & flag::SEARCHABLE != 0)
}

/// Flags and edges of each row of a class, cycle by cycle; the cycles are checked.
// Not inlined: the shells of `open` are compiled with the program, often for size.
#[inline(never)]
fn rows_of_class(db: &Database<'_>, class: &Class, flags: &[u8]) -> Checked {
    let edges = db.required.graph.as_chunks::<{ 2 * DEGREE }>().0.get(class.first_row..).unwrap_or(&[]);
    let (mut from, mut paired) = (0, false);
    let end = class.first_cycle + class.cycles;
    for cycle in class.first_cycle..=end {
        let start =
            if cycle < end { db.cycle_start(cycle).saturating_sub(class.first_row) } else { class.rows };
        let own = flags.get(from..start).unwrap_or(&[]);
        let edges = edges.get(from..start).unwrap_or(&[]);
        for (i, (&own, edges)) in own.iter().zip(edges).enumerate() {
            let row = from + i;
            let follows = own & flag::FOLLOWS != 0;
            // The first row of a class follows nothing.
            let fits = own & !flag::ALL == 0
                && !(follows && row == 0)
                && (own & flag::SEARCHABLE == 0 || (follows && paired));
            if !fits {
                return check(section::FLAGS, class.first_row + row, false);
            }
            // No class has a row with the number `NONE`.
            let fit = edges.as_chunks::<2>().0.iter().all(|&edge| {
                let edge = u16::from_le_bytes(edge);
                can_be_found(flags, edge) || edge == NONE
            });
            if !fit {
                return check(section::GRAPH, class.first_row + row, false);
            }
        }
        (from, paired) = (start, cycle < end && db.paired(cycle));
    }
    Ok(())
}

pub(super) fn blocks(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let mut next = 0;
    for b in 0..blocks_of(db) {
        let start = u32_at(db.required.blocks, 4 * b) as usize;
        check(section::BLOCKS, b, start == next)?;
        let bytes = db.required.rows.get(start..).unwrap_or(&[]);
        let row_bytes = usize::from(u16_at(bytes, block::ROW_BYTES.start));
        let widths = bytes.get(block::BASES + 2 * c.dofs..block::header(c.dofs)).unwrap_or(&[]);
        check(section::ROWS, b, widths.len() == c.dofs.div_ceil(2))?;
        let bits: usize = widths.iter().map(|w| usize::from(w & 15) + usize::from(w >> 4)).sum();
        let last_nibble_zero = c.dofs.is_multiple_of(2) || widths.last().is_some_and(|w| w >> 4 == 0);
        check(section::ROWS, b, row_bytes == bits.div_ceil(8) && last_nibble_zero)?;
        let rows = c.block_rows.min(c.rows - b * c.block_rows);
        next = (start + block::header(c.dofs) + rows * row_bytes).next_multiple_of(2);
        check(section::ROWS, b, next <= db.required.rows.len())?;
    }
    let need = if c.rows > 0 { next + block::PADDING } else { 0 };
    length(section::ROWS, need, db.required.rows.len())
}

/// Falls are parts, and a norm may be any that codes and weights can have: no distance overflows.
pub(super) fn distances(db: &Database<'_>, bytes: &[u8]) -> Checked {
    length(section::DISTANCES, distances::length(db.counts.frames), bytes.len())?;
    for (i, number) in bytes.as_chunks::<4>().0.iter().enumerate() {
        let fits = if i < distances::FALLS {
            (0.0..=1.0).contains(&f32::from_le_bytes(*number))
        } else {
            u32::from_le_bytes(*number) <= MOST_NORM2
        };
        check(section::DISTANCES, i, fits)?;
    }
    Ok(())
}

/// Distances and speeds are those of a body.
pub(super) fn trust(db: &Database<'_>, bytes: &[u8]) -> Checked {
    length(section::TRUST, trust::LENGTH * db.counts.classes, bytes.len())?;
    for class in 0..db.counts.classes {
        let fits = db.familiar(class).is_some_and(|familiar| {
            let [slowest, fastest] = familiar.speeds;
            let is_near = (0.0..=1e6).contains(&familiar.far) && (0.0..=1e3).contains(&familiar.turning);
            is_near && 0.0 <= slowest && slowest <= fastest && fastest <= 1e3
        });
        check(section::TRUST, class, fits)?;
    }
    Ok(())
}

#[inline]
pub(super) fn timing_metric(db: &Database<'_>) -> Checked {
    for i in 0..db.counts.timing {
        let record = Record::of(db.required.timing, i, timing::LENGTH);
        let entry = db.timing(i);
        let weights_fit = (0.0..=1e9).contains(&entry.pose) && (0.0..=1e9).contains(&entry.change);
        check(section::TIMING, i, entry.dof < db.counts.dofs && weights_fit)?;
        reserved(section::TIMING, record.zero(timing::RESERVED))?;
    }
    Ok(())
}
