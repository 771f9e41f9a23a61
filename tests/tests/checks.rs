//! Every check of `Database::open`, one case each: a blob with one thing wrong, checksums repaired behind it, and the
//! error that has to come.

use std::ops::Range;

use gestus_core::{
    BlobError, Database,
    blob::{
        layout::{
            ALIGNMENT, NONE, VERSION, block, class, clip, cycle, dof_record, effort, entry, flag, foot,
            header, joint, query, section, timing,
        },
        read::{f32_at, u16_at, u32_at},
    },
};
use gestus_tests::{
    motion,
    patch::{self, entry_of, patched, put, with_section},
};

fn blob() -> &'static [u8] {
    motion::tiny()
}

fn database() -> Database<'static> {
    Database::open(blob()).unwrap()
}

/// The bytes of a section.
fn bytes(id: u16) -> &'static [u8] {
    &blob()[patch::section(blob(), id)]
}

fn refuses(name: &str, blob: &[u8], error: BlobError) {
    assert_eq!(Database::open(blob).err(), Some(error), "{name}");
    // Whatever is refused is refused in words that say what to do.
    assert!(error.to_string().contains(": "), "{error}");
}

fn value(section: u16, record: usize) -> BlobError {
    BlobError::Value { section, record: record as u32 }
}

/// Refuses `value` at byte `at` of a section, as the value of that record.
fn refuses_value(name: &str, id: u16, at: usize, written: &[u8], record: usize) {
    refuses(name, &patched(blob(), id, at, written), value(id, record));
}

fn float(value: f32) -> [u8; 4] {
    value.to_le_bytes()
}

const NOT_FINITE: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

#[test]
fn length_magic_and_version() {
    let whole = blob().len() as u32;
    refuses("nothing", &[], BlobError::Truncated { need: 64, have: 0 });
    refuses("less than a header", &blob()[..63], BlobError::Truncated { need: 64, have: 63 });
    refuses("cut", &blob()[..1000], BlobError::Truncated { need: whole, have: 1000 });
    refuses("text mode", &put(blob(), 6, b"\n\n"), BlobError::Magic);
    let newer = put(blob(), header::VERSION.start, &(VERSION + 1).to_le_bytes());
    refuses("newer", &newer, BlobError::Version { need: VERSION, have: VERSION + 1 });
    let total = put(blob(), header::TOTAL.start, &(whole - 4).to_le_bytes());
    refuses("total", &total, BlobError::Truncated { need: whole - 4, have: whole });
    let sections = put(blob(), header::SECTIONS.start, &[255, 255]);
    refuses("table", &sections, BlobError::Truncated { need: 64 + 16 * 65535, have: whole });
}

#[test]
fn checksums_and_reserved_bytes_of_the_header() {
    let mut damaged = blob().to_vec();
    damaged[header::CRC.start] ^= 1;
    refuses("checksum itself", &damaged, BlobError::Checksum { section: 0 });
    let mut damaged = blob().to_vec();
    damaged[entry_of(blob(), section::ROWS) + entry::CRC.start] ^= 1;
    refuses("table", &damaged, BlobError::Checksum { section: 0 });
    for id in section::REQUIRED {
        let mut damaged = blob().to_vec();
        let middle = patch::section(blob(), id);
        damaged[middle.start + middle.len() / 2] ^= 4;
        refuses("section", &damaged, BlobError::Checksum { section: id });
    }
    for at in header::RESERVED {
        refuses("reserved", &put(blob(), at, &[1]), BlobError::Reserved { section: 0 });
    }
}

#[test]
fn the_section_table() {
    let at = entry_of(blob(), section::CLIPS);
    let misplaced = |id| BlobError::Section { section: id };
    for i in entry::RESERVED {
        let reserved = BlobError::Reserved { section: section::CLIPS };
        refuses("reserved", &put(blob(), at + i, &[1]), reserved);
    }
    let start = u32_at(blob(), at + entry::OFFSET.start);
    for offset in [start + 16, start - 16, start + 4, 0, u32::MAX] {
        let moved = put(blob(), at + entry::OFFSET.start, &offset.to_le_bytes());
        refuses("moved", &moved, misplaced(section::CLIPS));
    }
    let length = at + entry::BYTES.start;
    for bytes in [blob().len() as u32 - 16, blob().len() as u32 + 1, u32::MAX] {
        refuses("longer", &put(blob(), length, &bytes.to_le_bytes()), misplaced(section::CLIPS));
    }
    refuses("unknown", &put(blob(), at, &[77, 0]), misplaced(77));
    refuses("doubled", &put(blob(), at, &section::SKELETON.to_le_bytes()), misplaced(section::SKELETON));
    // Another known section in its place: clips are missing.
    let absent = section::OPTIONAL.into_iter().find(|&id| database().optional(id).is_none());
    let absent = absent.expect("a section that the blob lacks");
    refuses("missing", &put(blob(), at, &absent.to_le_bytes()), misplaced(section::CLIPS));

    let end = patch::section(blob(), section::MANIFEST).end;
    let next = end.next_multiple_of(ALIGNMENT);
    assert!(end < next, "the manifest has to end off the boundary for this test");
    for at in end..next {
        let reserved = BlobError::Reserved { section: section::SKELETON };
        refuses("padding", &put(blob(), at, &[1]), reserved);
    }
    let mut longer = blob().to_vec();
    longer.extend([0; 16]);
    let have = longer.len() as u32;
    longer[header::TOTAL].copy_from_slice(&have.to_le_bytes());
    patch::repair(&mut longer);
    refuses("bytes behind", &longer, BlobError::Truncated { need: have - 16, have });
}

#[test]
fn counts_of_the_header() {
    let c = *database().counts();
    let half = |range: Range<usize>, value: usize| put(blob(), range.start, &(value as u16).to_le_bytes());
    let word = |range: Range<usize>, value: usize| put(blob(), range.start, &(value as u32).to_le_bytes());
    let most = (1 << 22) + 1;
    let cases: Vec<(&str, usize, Vec<Vec<u8>>)> = vec![
        ("joints", 0, vec![half(header::JOINTS, 1), half(header::JOINTS, 65)]),
        ("dofs", 1, vec![half(header::DOFS, c.dofs + 1), half(header::JOINTS, c.joints - 1)]),
        ("features", 2, vec![half(header::FEATURES, 0), half(header::FEATURES, 33)]),
        ("window", 3, vec![half(header::WINDOW, 0), half(header::WINDOW, 9)]),
        ("styles", 4, vec![half(header::STYLES, 0), half(header::STYLES, 33)]),
        ("actions", 5, vec![half(header::ACTIONS, 0), half(header::ACTIONS, 257)]),
        ("classes", 6, vec![half(header::CLASSES, 0), half(header::CLASSES, c.styles * c.actions + 1)]),
        ("groups", 7, vec![half(header::GROUPS, 0), half(header::GROUPS, 9)]),
        ("frames", 8, vec![word(header::FRAMES, 0), word(header::FRAMES, most)]),
        ("rows", 9, vec![word(header::ROWS, c.frames - 1), word(header::ROWS, most)]),
        (
            "block rows",
            10,
            vec![half(header::BLOCK_ROWS, 0), half(header::BLOCK_ROWS, 24), half(header::BLOCK_ROWS, 128)],
        ),
        ("timing", 11, vec![half(header::TIMING, 0), half(header::TIMING, 17)]),
        ("cycles", 12, vec![word(header::CYCLES, 0), word(header::CYCLES, 65535)]),
        ("clips", 13, vec![word(header::CLIPS, 0), word(header::CLIPS, most)]),
    ];
    for (name, record, blobs) in cases {
        blobs.iter().for_each(|blob| refuses(name, blob, value(0, record)));
    }
    for rate in [0.0, 0.9, 1001.0, -30.0].into_iter().chain(NOT_FINITE) {
        refuses("rate", &put(blob(), header::RATE.start, &float(rate)), value(0, 14));
    }
}

#[test]
fn lengths_follow_from_the_counts() {
    for id in section::REQUIRED {
        if id == section::MANIFEST {
            continue;
        }
        let have = bytes(id).len() as u32;
        // Knots are as many as the cycles say: a whole one more is none too many.
        let more = if id == section::KNOTS { 2 } else { 4 };
        let longer = with_section(blob(), id, |b| b.resize(b.len() + more, 0));
        let have = have + more as u32;
        let need = if id == section::KNOTS { have + 2 } else { have - 4 };
        refuses("longer", &longer, BlobError::Length { section: id, need, have });
    }
    // The rows' length follows from the blocks; all other checks come before it.
    let shorter = with_section(blob(), section::FLAGS, |b| b.truncate(b.len() - 1));
    let need = bytes(section::FLAGS).len() as u32;
    refuses("shorter", &shorter, BlobError::Length { section: section::FLAGS, need, have: need - 1 });
}

#[test]
fn the_manifest() {
    let refused = |name: &str, blob: &[u8]| refuses(name, blob, BlobError::Manifest);
    refused("empty", &with_section(blob(), section::MANIFEST, Vec::clear));
    refused("cut", &with_section(blob(), section::MANIFEST, |b| b.truncate(20)));
    refused("no text", &patched(blob(), section::MANIFEST, 3, &[0xff]));
    // One name less than there are: a line break becomes a space.
    for name in ["Spine", "heavy", "left-arm"] {
        let at = bytes(section::MANIFEST).windows(name.len()).position(|w| w == name.as_bytes()).unwrap();
        assert_eq!(bytes(section::MANIFEST)[at - 1], b'\n', "{name} is not the first of its list");
        refused(name, &patched(blob(), section::MANIFEST, at - 1, b" "));
    }
    // One more.
    for name in ["walk-normal-0", "walk"] {
        let at = bytes(section::MANIFEST).windows(name.len()).position(|w| w == name.as_bytes()).unwrap();
        refused(name, &patched(blob(), section::MANIFEST, at + 2, b"\n"));
    }
}

#[test]
fn the_skeleton() {
    let record = |j: usize, at: usize| j * joint::LENGTH + at;
    let bad = |name: &str, j: usize, at: usize, written: &[u8]| {
        refuses_value(name, section::SKELETON, record(j, at), written, j);
    };
    bad("the root has a parent", 0, joint::PARENT, &[0]);
    bad("its own parent", 3, joint::PARENT, &[3]);
    bad("a later parent", 3, joint::PARENT, &[4]);
    bad("a second root", 3, joint::PARENT, &[joint::ROOT]);
    for v in [101.0, -101.0].into_iter().chain(NOT_FINITE) {
        bad("offset", 5, joint::OFFSET.start + 4, &float(v));
    }
    for v in [0.5, -2.0].into_iter().chain(NOT_FINITE) {
        bad("mean", 6, joint::MEAN.start + 12, &float(v));
    }
    for at in joint::RESERVED {
        let changed = patched(blob(), section::SKELETON, record(2, at), &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: section::SKELETON });
    }
    // A group beyond the last, with the features of its joints in it, so that lengths still agree.
    let c = *database().counts();
    let mut group = blob().to_vec();
    let (skeleton, groups) = (patch::section(blob(), section::SKELETON), feature_groups());
    for j in (0..c.joints).filter(|&j| database().joint_group(j) == 2) {
        group[skeleton.start + record(j, joint::GROUP)] = 7;
    }
    for f in (0..c.features).filter(|&f| database().feature_group(f) == 2) {
        group[groups.start + f] = 7;
    }
    patch::repair(&mut group);
    let first = (0..c.joints).find(|&j| database().joint_group(j) == 2).unwrap();
    refuses("group", &group, value(section::SKELETON, first));

    let trailer = c.joints * joint::LENGTH;
    let in_trailer = |name: &str, at: usize, written: &[u8]| {
        refuses_value(name, section::SKELETON, trailer + at, written, c.joints);
    };
    for v in [0.0, 2.0].into_iter().chain(NOT_FINITE) {
        in_trailer("hips line", joint::HIPS_LINE.start, &float(v));
    }
    in_trailer("left toes", joint::TOES.start, &[c.joints as u8]);
    in_trailer("right toes", joint::TOES.start + 1, &[254]);
    let no_toes =
        patched(blob(), section::SKELETON, trailer + joint::TOES.start, &[joint::ROOT, joint::ROOT]);
    assert_eq!(Database::open(&no_toes).unwrap().toes(), [None, None]);
    for at in joint::TOES.end..joint::TRAILER {
        let changed = patched(blob(), section::SKELETON, trailer + at, &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: section::SKELETON });
    }
}

#[test]
fn legs_are_chains_at_heights_of_a_body() {
    let legs = database().legs().unwrap();
    let bad = |name: &str, side: usize, at: usize, written: &[u8]| {
        refuses_value(name, section::FEET, side * foot::LENGTH + at, written, side);
    };
    bad("the root as a hip", 0, foot::HIP, &[0]);
    bad("no such hip", 1, foot::HIP, &[database().counts().joints as u8]);
    bad("a knee of the other leg", 0, foot::KNEE, &[legs[1].knee as u8]);
    bad("no such ankle", 1, foot::ANKLE, &[254]);
    bad("toes on the knee", 0, foot::TOE, &[legs[0].knee as u8]);
    for v in [10.5, -10.5].into_iter().chain(NOT_FINITE) {
        bad("height", 1, foot::TOE_HEIGHT.start, &float(v));
        bad("height", 0, foot::ANKLE_HEIGHT.start, &float(v));
    }
    for at in foot::RESERVED {
        let changed = patched(blob(), section::FEET, at, &[1]);
        refuses("reserved", &changed, BlobError::Reserved { section: section::FEET });
    }
    let no_toes = patched(blob(), section::FEET, foot::TOE, &[foot::NO_TOE]);
    assert_eq!(Database::open(&no_toes).unwrap().legs().unwrap()[0].toe, None);
    let short = patch::with_section(blob(), section::FEET, |bytes| bytes.truncate(foot::LENGTH));
    refuses("one leg", &short, BlobError::Section { section: section::FEET });
}

/// Where the groups of the features are in the blob.
fn feature_groups() -> Range<usize> {
    let c = *database().counts();
    let start = patch::section(blob(), section::QUERY).start + query::groups(c.window, c.joints, c.features);
    start..start + c.features
}

#[test]
fn dofs_and_their_scales() {
    for (d, range) in [(0, dof_record::STEP), (11, dof_record::STEP), (66, dof_record::SCALE)] {
        for v in [0.0, -1e-3, 1e-10, 1e7].into_iter().chain(NOT_FINITE) {
            refuses_value("dof", section::DOFS, d * dof_record::LENGTH + range.start, &float(v), d);
        }
    }
    refuses_value("large step", section::DOFS, dof_record::STEP.start, &float(1e4), 0);
}

#[test]
fn the_query() {
    let c = *database().counts();
    let id = section::QUERY;
    let weights = query::weights(c.window, c.joints);
    let scales = query::scales(c.window, c.joints);
    let components = query::components(c.window, c.joints, c.features);
    for v in [-1.0, 1e7].into_iter().chain(NOT_FINITE) {
        refuses_value("weight", id, weights + 4 * 13, &float(v), 13);
    }
    refuses_value("no weight at all", id, weights, &vec![0; 4 * c.joints], 0);
    for v in [0.0, -1.0, 1e7].into_iter().chain(NOT_FINITE) {
        refuses_value("scale", id, scales + 4 * 3, &float(v), 3);
    }
    for v in [1e7, -1e7].into_iter().chain(NOT_FINITE) {
        refuses_value("mean cloud", id, 4 * 17, &float(v), 17);
        refuses_value("component", id, components + 40, &float(v), components / 4 + 10);
    }
    // A feature of a group that has no joint needs no coordinates.
    let last = c.features - 1;
    let joints =
        (0..c.joints).filter(|&j| database().joint_group(j) == database().feature_group(last)).count();
    let nowhere = with_section(blob(), id, |b| {
        b.truncate(b.len() - 12 * c.window * joints);
        b[query::groups(c.window, c.joints, c.features) + last] = c.groups as u8;
    });
    refuses("group", &nowhere, value(id, last));
    // Without the last feature there is one byte of padding behind the groups.
    let mut fewer = blob().to_vec();
    for (id, change) in [(section::QUERY, true), (section::FEATURES, false)] {
        fewer = rebuilt(&fewer, id, |b| {
            if change {
                b.truncate(b.len() - 12 * c.window * joints);
                b[query::groups(c.window, c.joints, c.features) + last] = 1;
                let scale = scales + 4 * last;
                b.drain(scale..scale + 4);
            } else {
                let kept: Vec<u8> = b.chunks(c.features).flat_map(|f| f[..last].iter().copied()).collect();
                *b = kept;
            }
        });
    }
    fewer[header::FEATURES].copy_from_slice(&(last as u16).to_le_bytes());
    patch::repair(&mut fewer);
    refuses("padding of the groups", &fewer, BlobError::Reserved { section: id });
}

/// [`with_section`] for a blob that does not open (yet): the sections behind move along.
fn rebuilt(blob: &[u8], id: u16, change: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut change = Some(change);
    let count = usize::from(u16_at(blob, header::SECTIONS.start));
    let mut result = blob[..header::LENGTH + count * entry::LENGTH].to_vec();
    let held = (0..count).map(|i| u16_at(blob, header::LENGTH + i * entry::LENGTH + entry::ID.start));
    for other in held {
        let mut content = blob[patch::section(blob, other)].to_vec();
        if other == id {
            change.take().expect("a section comes once")(&mut content);
        }
        result.resize(result.len().next_multiple_of(ALIGNMENT), 0);
        let at = entry_of(blob, other);
        let offset = (result.len() as u32).to_le_bytes();
        result[at + entry::OFFSET.start..at + entry::OFFSET.end].copy_from_slice(&offset);
        let length = (content.len() as u32).to_le_bytes();
        result[at + entry::BYTES.start..at + entry::BYTES.end].copy_from_slice(&length);
        result.extend(content);
    }
    let total = (result.len() as u32).to_le_bytes();
    result[header::TOTAL].copy_from_slice(&total);
    patch::repair(&mut result);
    result
}

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
    let blob = gestus_builder::write::with_section(blob(), id, &dial_bytes()).unwrap();
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
            value_at("effort", effort::styles() + 4 * i, &float(v), 10 + i);
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
