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
    search::metric::MAX_NORM2,
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
        let searchable = sum_of(flags, flag::SEARCHABLE.trailing_zeros(), 1);
        bad(searchable == class.searchable && (1..=searchable).contains(&class.k_cap))?;
        let entries =
            Record::of(db.required.classes, i, class::LENGTH).0.get(class::ENTRY_POINTS).unwrap_or(&[]);
        bad(db.entries(i).count() > 0 || !db.has_graph())?;
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
    }
    check(section::CLASSES, c.classes, next_row == c.frames || !reads_frames)
}

/// Flags and edges of the classes' rows; the classes are checked.
pub(super) fn rows(db: &Database<'_>) -> Checked {
    (0..db.counts.classes).try_for_each(|class| rows_of_class(db, &db.class(class)))
}

/// True if the search may return this row of the class with those flags.
#[inline]
fn can_be_found(flags: &[u8], row: u16) -> bool {
    flags.get(usize::from(row)).is_some_and(|f| f & flag::SEARCHABLE != 0)
}

/// Flags and edges of each row of a class, cycle by cycle; the cycles are checked.
// Not inlined: the shells of `open` are compiled with the program, often for size.
#[inline(never)]
fn rows_of_class(db: &Database<'_>, class: &Class) -> Checked {
    let flags = db.required.flags.get(class.first_row..class.first_row + class.rows).unwrap_or(&[]);
    let edges = db.required.graph.as_chunks::<{ 2 * DEGREE }>().0.get(class.first_row..).unwrap_or(&[]);
    // The first row of a class follows nothing.
    let first_fits = flags.first().is_none_or(|first| first & flag::FOLLOWS == 0);
    check(section::FLAGS, class.first_row, first_fits)?;
    let (mut from, mut paired) = (0, false);
    let end = class.first_cycle + class.cycles;
    for cycle in class.first_cycle..=end {
        let start =
            if cycle < end { db.cycle_start(cycle).saturating_sub(class.first_row) } else { class.rows };
        let own = flags.get(from..start).unwrap_or(&[]);
        let edges = edges.get(from..start).unwrap_or(&[]);
        if let Some((row, section)) = misfit(flags, own, edges, ALLOWED[usize::from(paired)]) {
            return check(section, class.first_row + from + row, false);
        }
        (from, paired) = (start, cycle < end && db.paired(cycle));
    }
    Ok(())
}

/// What [`allowed_flags`] gives for cycles without and with outputs in every style.
const ALLOWED: [u32; 2] = [allowed_flags(false), allowed_flags(true)];

/// Flags that a row of a cycle may have, a bit for each value. The search may return rows that follow another, if the
/// cycle is `paired` with outputs.
const fn allowed_flags(paired: bool) -> u32 {
    let (mut allowed, mut flags) = (0, 0);
    while flags <= flag::ALL {
        if flags & flag::SEARCHABLE == 0 || (paired && flags & flag::FOLLOWS != 0) {
            allowed |= 1 << flags;
        }
        flags += 1;
    }
    allowed
}

/// The first row of a cycle with flags other than the `allowed` or edges that can't be, and the section of those. There
/// are no `edges` in a blob without a graph.
// Not inlined, so that all that the loop reads is in registers.
#[inline(never)]
fn misfit(flags: &[u8], own: &[u8], edges: &[[u8; 2 * DEGREE]], allowed: u32) -> Option<(usize, u16)> {
    let is_allowed = |flags: u8| allowed.checked_shr(flags.into()).unwrap_or(0) & 1 != 0;
    if edges.is_empty() {
        return own.iter().position(|&own| !is_allowed(own)).map(|row| (row, section::FLAGS));
    }
    let fits = |edge: &[u8; 2]| {
        let edge = u16::from_le_bytes(*edge);
        // No class has a row with the number `NONE`.
        flags.get(usize::from(edge)).map_or(edge == NONE, |f| f & flag::SEARCHABLE != 0)
    };
    for (row, (&own, edges)) in own.iter().zip(edges).enumerate() {
        if !is_allowed(own) {
            return Some((row, section::FLAGS));
        }
        let [a, b, c, d, e, f, g, h] = edges.as_chunks().0.first_chunk()?;
        // Written out, because the images that the budgets are for do not unroll a loop as long as this.
        if !(fits(a) && fits(b) && fits(c) && fits(d) && fits(e) && fits(f) && fits(g) && fits(h)) {
            return Some((row, section::GRAPH));
        }
    }
    None
}

/// The sum of the same bits of each byte: those of a mask, of at most six bits, that many places up.
// Not inlined: the shells of `open` are compiled with the program, often for size.
#[inline(never)]
fn sum_of(bytes: &[u8], places: u32, mask: u8) -> usize {
    let (words, rest) = bytes.as_chunks();
    let masks = u32::from_ne_bytes([mask; 4]);
    // Each byte of a word is a number, and the product's highest byte the sum of all four.
    let sum = |word: u32| ((word >> places) & masks).wrapping_mul(0x0101_0101) >> 24;
    let of_words: u32 = words.iter().map(|&word| sum(u32::from_le_bytes(word))).sum();
    let of_rest: u32 = rest.iter().map(|&byte| u32::from((byte >> places) & mask)).sum();
    (of_words + of_rest) as usize
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
        let bits = sum_of(widths, 0, 15) + sum_of(widths, 4, 15);
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
    let (falls, norms) = bytes.as_chunks().0.split_at_checked(distances::FALLS).unwrap_or((&[], &[]));
    for (i, &fall) in falls.iter().enumerate() {
        check(section::DISTANCES, i, (0.0..=1.0).contains(&f32::from_le_bytes(fall)))?;
    }
    match beyond(norms) {
        Some(i) => check(section::DISTANCES, distances::FALLS + i, false),
        None => Ok(()),
    }
}

/// The first norm that no feature can have.
// Not inlined: the shells of `open` are compiled with the program, often for size.
#[inline(never)]
fn beyond(norms: &[[u8; 4]]) -> Option<usize> {
    let is_beyond = |norm: &[u8; 4]| u32::from_le_bytes(*norm) > MAX_NORM2;
    // Four at a time, because the images that the budgets are for do not unroll a loop as long as this.
    let fours = norms.as_chunks::<4>().0.iter();
    let fit = 4 * fours.take_while(|four| !four.iter().any(is_beyond)).count();
    norms.get(fit..)?.iter().position(is_beyond).map(|i| fit + i)
}

/// Distances and speeds are those of a body.
pub(super) fn trust(db: &Database<'_>, bytes: &[u8]) -> Checked {
    length(section::TRUST, trust::LENGTH * db.counts.classes, bytes.len())?;
    for class in 0..db.counts.classes {
        let fits = db.trust_limits(class).is_some_and(|trust_limits| {
            let [slowest, fastest] = trust_limits.speeds;
            let is_near =
                (0.0..=1e6).contains(&trust_limits.far) && (0.0..=1e3).contains(&trust_limits.turning);
            is_near && -1e3 <= slowest && slowest <= fastest && fastest <= 1e3
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_of_bytes_are_summed_up_whatever_their_number() {
        let bytes: [u8; 11] = core::array::from_fn(|i| (37 * i + 201) as u8);
        for length in 0..=bytes.len() {
            for (places, mask) in [(0, 15), (4, 15), (2, 1)] {
                let one_by_one =
                    bytes[..length].iter().map(|byte| usize::from((byte >> places) & mask)).sum();
                assert_eq!(sum_of(&bytes[..length], places, mask), one_by_one, "{length} bytes");
            }
        }
    }

    #[test]
    fn the_row_that_does_not_fit_is_told() {
        let found = flag::SEARCHABLE | flag::FOLLOWS;
        let flags = [0, found, found, 0, found];
        let edges = |edge: u16| {
            let mut edges = [0xff; 2 * DEGREE];
            edges[2 * DEGREE - 2..].copy_from_slice(&edge.to_le_bytes());
            edges
        };
        let row = |own: u8, edge: u16, paired: bool| {
            misfit(&flags, &[0, own], &[edges(1), edges(edge)], ALLOWED[usize::from(paired)])
        };
        assert_eq!(row(found, 4, true), None);
        assert_eq!(row(flag::FOLLOWS, NONE, false), None);
        for own in [found, 16, 31, 32, 255] {
            assert_eq!(row(own, 4, false), Some((1, section::FLAGS)), "{own}");
        }
        assert_eq!(row(flag::SEARCHABLE, 4, true), Some((1, section::FLAGS)));
        assert_eq!(misfit(&flags, &[0, found, 16], &[], ALLOWED[1]), Some((2, section::FLAGS)));
        assert_eq!(misfit(&flags, &[0, found], &[], ALLOWED[1]), None);
        for edge in [0, 3, 5, NONE - 1] {
            assert_eq!(row(found, edge, true), Some((1, section::GRAPH)), "{edge}");
        }
    }

    #[test]
    fn the_first_norm_beyond_the_most_is_told() {
        for length in 0..11 {
            let norms = [MAX_NORM2.to_le_bytes(); 11];
            assert_eq!(beyond(&norms[..length]), None);
            for at in 0..length {
                let mut norms = norms;
                norms[at] = (MAX_NORM2 + 1).to_le_bytes();
                assert_eq!(beyond(&norms[..length]), Some(at));
            }
        }
    }
}
