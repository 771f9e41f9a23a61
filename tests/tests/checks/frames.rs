//! What the frames are found and read by: clips, cycles, pairs, classes, graph, rows; timing, and the effort dial.

use super::*;

#[test]
fn clips_fill_the_rows() {
    let c = *database().counts();
    let id = section::CLIPS;
    let at = |i: usize, range: Range<usize>| i * clip::LENGTH + range.start;
    refuses_value("not at 0", id, at(0, clip::FIRST_ROW), &1u32.to_le_bytes(), 0);
    refuses_value("empty", id, at(0, clip::ROWS), &[0; 4], 0);
    refuses_value("gap", id, at(1, clip::FIRST_ROW), &121u32.to_le_bytes(), 1);
    refuses_value("endless", id, at(1, clip::ROWS), &u32::MAX.to_le_bytes(), 1);
    let last = c.clips - 1;
    let rows = database().clip(last).1 as u32;
    refuses_value("rows left over", id, at(last, clip::ROWS), &(rows - 1).to_le_bytes(), c.clips);
    refuses_value("rows missing", id, at(last, clip::ROWS), &(rows + 1).to_le_bytes(), c.clips);
}

#[test]
fn cycles_knots_and_pairs() {
    let c = *database().counts();
    let id = section::CYCLES;
    let at = |i: usize, range: Range<usize>| i * cycle::LENGTH + range.start;
    let start = |i: usize| u32_at(bytes(id), at(i, cycle::START));
    refuses_value("clip", id, at(1, cycle::CLIP), &(c.clips as u32).to_le_bytes(), 1);
    refuses_value("one knot", id, at(0, cycle::KNOTS), &1u16.to_le_bytes(), 0);
    refuses_value("many knots", id, at(0, cycle::KNOTS), &u16::MAX.to_le_bytes(), 0);
    let knots = bytes(section::KNOTS).len() as u32 / 4;
    for first in [knots - 1, (1 << 22) + 1, u32::MAX] {
        refuses_value("first knot", id, at(0, cycle::FIRST_KNOT), &first.to_le_bytes(), 0);
    }
    // Knots belong to one cycle each: as many cycles as there are could otherwise share as many knots.
    let second = u32_at(bytes(id), at(1, cycle::FIRST_KNOT));
    for first in [0, second - 1, second + 1] {
        refuses_value("shared or skipped knots", id, at(1, cycle::FIRST_KNOT), &first.to_le_bytes(), 1);
    }
    let longer = with_section(blob(), section::KNOTS, |knots| knots.extend(float(1.0)));
    let need = bytes(section::KNOTS).len() as u32;
    let left_over = BlobError::Length { section: section::KNOTS, need, have: need + 4 };
    refuses("a knot of no cycle", &longer, left_over);
    for i in cycle::RESERVED {
        let changed = patched(blob(), id, i, &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: id });
    }
    let other = database().clip(1).0 as u32;
    refuses_value("starts in another clip", id, at(0, cycle::START), &other.to_le_bytes(), 0);
    refuses_value("starts nowhere", id, at(0, cycle::START), &u32::MAX.to_le_bytes(), 0);
    refuses_value("before its clip", id, at(c.cycles - 1, cycle::START), &[0; 4], c.cycles - 1);

    let id = section::KNOTS;
    let second = f32_at(bytes(id), 4);
    refuses_value("knots that go back", id, 8, &float(second - 1.0), 2);
    refuses_value("knots that stand", id, 8, &float(second), 2);
    for v in [-1001.0, f32::NAN, f32::NEG_INFINITY] {
        refuses_value("first knot", id, 0, &float(v), 0);
    }
    for v in [5000.0, f32::NAN, f32::INFINITY] {
        refuses_value("last knot", id, 8, &float(v), 2);
    }

    let id = section::PAIRS;
    refuses_value("pair", id, 2, &(c.cycles as u16).to_le_bytes(), 1);
    refuses_value("pair", id, 2, &(NONE - 1).to_le_bytes(), 1);
    // A second output for each: all of them are there.
    let table = c.cycles * c.styles;
    assert_eq!(database().outputs(), 2);
    refuses_value("no second", id, 2 * table + 2, &NONE.to_le_bytes(), table + 1);
    refuses_value("second", id, 2 * table + 2, &(c.cycles as u16).to_le_bytes(), table + 1);
    // One alone will do, and one and a bit will not.
    let once = with_section(blob(), id, |pairs| pairs.truncate(2 * table));
    assert_eq!(Database::open(&once).map(|db| db.outputs()), Ok(1));
    for have in [2 * table + 2, 4 * table - 2, 4 * table + 2] {
        let odd = with_section(blob(), id, |pairs| pairs.resize(have, 0));
        let length = BlobError::Length { section: id, need: 4 * table as u32, have: have as u32 };
        refuses("half a table", &odd, length);
    }
    // Both cycles of a class from the same row.
    let class = database().class(0);
    assert!(class.cycles > 1, "a class of one cycle can't show that they ascend");
    let (first, second) = (class.first_cycle, class.first_cycle + 1);
    let id = section::CYCLES;
    refuses_value("not ascending", id, at(second, cycle::START), &start(first).to_le_bytes(), second);
    // A cycle of class 0 that lies in the clip of class 1, whole and well.
    let mut moved = blob().to_vec();
    let cycles = patch::section(blob(), id).start;
    moved[cycles + at(second, cycle::CLIP)] = 1;
    moved[cycles + at(second, cycle::START)..][..4].copy_from_slice(&other.to_le_bytes());
    patch::repair(&mut moved);
    refuses("in another class", &moved, value(id, second));
}

#[test]
fn classes() {
    let id = section::CLASSES;
    let own = database().class(1);
    let last = class::LENGTH;
    let half = |name: &str, at: usize, v: usize| {
        refuses_value(name, id, last + at, &(v as u16).to_le_bytes(), 1);
    };
    let word = |name: &str, at: usize, v: usize| {
        refuses_value(name, id, last + at, &(v as u32).to_le_bytes(), 1);
    };
    word("no rows", class::ROWS.start, 0);
    word("many rows", class::ROWS.start, 65536);
    word("rows beyond the frames", class::ROWS.start, own.rows + 1);
    word("first row", class::FIRST_ROW.start, own.first_row - 1);
    word("first cycle", class::FIRST_CYCLE.start, own.first_cycle + 1);
    word("no cycles", class::CYCLES.start, 0);
    word("many cycles", class::CYCLES.start, own.cycles + 1);
    word("endless cycles", class::CYCLES.start, u32::MAX as usize);
    half("action", class::ACTION.start, 1);
    half("style", class::STYLE.start, 2);
    half("the same class again", class::STYLE.start, 0);
    half("searchable", class::SEARCHABLE.start, own.searchable + 1);
    half("nothing searchable", class::SEARCHABLE.start, 0);
    half("no neighbors", class::K_CAP.start, 0);
    half("more neighbors than rows", class::K_CAP.start, own.searchable + 1);
    let entries = class::ENTRY_POINTS.start;
    refuses_value("no entry", id, last + entries, &[255; 24], 1);
    let lost = (0..own.rows).find(|r| database().flags(own.first_row + r) & flag::SEARCHABLE == 0).unwrap();
    half("an entry that can't be found", entries, lost);
    half("an entry beyond the class", entries, own.rows);
    // A last row that no search returns, left to no class.
    let end = own.first_row + own.rows - 1;
    assert_eq!(database().flags(end) & flag::SEARCHABLE, 0);
    let short = ((own.rows - 1) as u32).to_le_bytes();
    refuses_value("rows of no class", id, last + class::ROWS.start, &short, 2);
}

#[test]
fn flags_and_graph() {
    let own = database().class(1);
    let found = |r: &usize| database().flags(*r) & flag::SEARCHABLE != 0;
    let row = (own.first_row..).find(found).unwrap();
    let flags = |name: &str, row: usize, flags: u8| refuses_value(name, section::FLAGS, row, &[flags], row);
    flags("unknown", row, database().flags(row) | 16);
    flags("unknown", 0, 0x80);
    flags("a first row that follows", own.first_row, flag::FOLLOWS);
    flags("a row from nowhere", row + 1, database().flags(row + 1) & !flag::FOLLOWS);
    // A row before the first cycle that a search may return, and that is counted.
    let early = own.first_row + 1;
    assert!(database().cycle_of(1, early).is_none());
    let mut counted = blob().to_vec();
    counted[patch::section(blob(), section::FLAGS).start + early] |= flag::SEARCHABLE;
    let count = patch::section(blob(), section::CLASSES).start + class::LENGTH + class::SEARCHABLE.start;
    counted[count..count + 2].copy_from_slice(&(own.searchable as u16 + 1).to_le_bytes());
    patch::repair(&mut counted);
    refuses("in no cycle", &counted, value(section::FLAGS, early));
    // Its cycle has no output in one style.
    let cycle = database().cycle_of(1, row).unwrap();
    let unpaired = patched(blob(), section::PAIRS, 2 * (cycle * 2 + 1), &NONE.to_le_bytes());
    refuses("unpaired", &unpaired, value(section::FLAGS, row));

    let edge = |name: &str, to: usize| {
        refuses_value(name, section::GRAPH, 16 * row + 2, &(to as u16).to_le_bytes(), row);
    };
    edge("out of the class", own.rows);
    edge("far out of the class", 65534);
    let lost = (0..own.rows).find(|r| !found(&(own.first_row + r))).unwrap();
    edge("to a row that can't be found", lost);
    let none = patched(blob(), section::GRAPH, 16 * row, &[255; 16]);
    assert!(Database::open(&none).is_ok(), "a row without edges is no fault");
}

#[test]
fn blocks_and_rows() {
    let c = *database().counts();
    let second = u32_at(bytes(section::BLOCKS), 4) as usize;
    refuses_value("first block", section::BLOCKS, 0, &2u32.to_le_bytes(), 0);
    refuses_value("gap", section::BLOCKS, 4, &(second as u32 + 2).to_le_bytes(), 1);
    refuses_value("endless", section::BLOCKS, 4, &u32::MAX.to_le_bytes(), 1);
    let id = section::ROWS;
    let row_bytes = u16_at(bytes(id), second);
    for wrong in [0, row_bytes - 1, row_bytes + 1, u16::MAX] {
        refuses_value("bytes of a row", id, second, &wrong.to_le_bytes(), 1);
    }
    // A wider field than the row has room for.
    let widths = second + block::BASES + 2 * c.dofs;
    refuses_value("widths", id, widths, &[0xff], 1);
    assert_eq!(c.dofs % 2, 1, "an even number of dofs leaves no nibble over");
    let nibble = second + block::header(c.dofs) - 1;
    refuses_value("a width of no dof", id, nibble, &[bytes(id)[nibble] | 0xf0], 1);
    let blocks = bytes(section::BLOCKS).len() / 4;
    let cut = with_section(blob(), id, |b| b.truncate(10));
    refuses("cut in a block's header", &cut, value(id, 0));
    let cut = with_section(blob(), id, |b| b.truncate(b.len() - block::PADDING - 2));
    refuses("cut in the last row", &cut, value(id, blocks - 1));
    let have = bytes(id).len() as u32;
    let cut = with_section(blob(), id, |b| b.truncate(b.len() - 2));
    refuses("cut in the padding", &cut, BlobError::Length { section: id, need: have, have: have - 2 });
}

#[test]
fn the_timing_metric() {
    let c = *database().counts();
    let id = section::TIMING;
    let at = |range: Range<usize>| 2 * timing::LENGTH + range.start;
    refuses_value("dof", id, at(timing::DOF), &(c.dofs as u16).to_le_bytes(), 2);
    for v in [-1.0, 1e10].into_iter().chain(NOT_FINITE) {
        refuses_value("pose", id, at(timing::POSE), &float(v), 2);
        refuses_value("change", id, at(timing::CHANGE), &float(v), 2);
    }
    for i in timing::RESERVED {
        let changed = patched(blob(), id, i, &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: id });
    }
}

/// An effort section for the two styles of the blob, with 2 x 2 x 2 nodes.
fn dial_bytes() -> Vec<u8> {
    let mut bytes: Vec<u8> = [2u16; 3].iter().flat_map(|n| n.to_le_bytes()).chain([0, 0]).collect();
    let axes = [-1.0f32, 1.0, -2.0, 2.0, -0.5, 0.5];
    let rest = [0.0f32; 3];
    let efforts = [-1.0f32, -2.0, -0.5, 1.0, 2.0, 0.5];
    bytes.extend(axes.iter().chain(&rest).chain(&efforts).flat_map(|v| v.to_le_bytes()));
    bytes.extend((0..8u8).flat_map(|node| [255 - 30 * node, 30 * node]));
    bytes
}

#[test]
fn the_effort_dial() {
    let id = section::EFFORT;
    let styles = database().counts().styles;
    assert_eq!(styles, 2);
    let blob = gestus_database::blob::assemble::with_section(blob(), id, &dial_bytes()).unwrap();
    let dial = Database::open(&blob).unwrap().dial().unwrap();
    assert_eq!(dial.of_style(1).factors(), [1.0, 2.0, 0.5]);
    assert!(database().dial().is_none());

    let value_at = |name: &str, at: usize, written: &[u8], record: usize| {
        refuses(name, &patched(&blob, id, at, written), value(id, record));
    };
    for nodes in [0u16, 1, effort::MAX_NODES as u16 + 1, u16::MAX] {
        for k in 0..3 {
            value_at("nodes", effort::NODES.start + 2 * k, &nodes.to_le_bytes(), k);
        }
    }
    value_at("labels", effort::LABELS, &[2], 3);
    let reserved = patched(&blob, id, effort::RESERVED.start, &[1]);
    refuses("reserved", &reserved, BlobError::Reserved { section: id });
    for v in NOT_FINITE.into_iter().chain([10.5, -10.5]) {
        for k in 0..3 {
            value_at("low end", effort::AXES.start + 8 * k, &float(v), 4 + k);
            value_at("high end", effort::AXES.start + 8 * k + 4, &float(v), 4 + k);
            value_at("rest", effort::REST.start + 4 * k, &float(v), 7 + k);
        }
        for i in 0..3 * styles {
            value_at("effort", effort::STYLES + 4 * i, &float(v), 10 + i);
        }
    }
    value_at("an axis without length", effort::AXES.start + 4, &float(-0.995), 4);
    value_at("a mix of more than all", effort::table(styles) + 4, &[200], 10 + 3 * styles + 2);
    let need = (effort::table(styles) + 8 * styles) as u32;
    for (have, need) in [(need - 1, need), (need + 1, need), (10, effort::table(styles) as u32)] {
        let cut = with_section(&blob, id, |b| b.resize(have as usize, 0));
        refuses("length", &cut, BlobError::Length { section: id, need, have });
    }
    // More nodes than there is table for.
    let more = patched(&blob, id, effort::NODES.start, &3u16.to_le_bytes());
    let need = (effort::table(styles) + 12 * styles) as u32;
    refuses("table", &more, BlobError::Length { section: id, need, have: dial_bytes().len() as u32 });
}
