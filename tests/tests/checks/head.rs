//! Header, section table, and what their counts say of the rest.

use super::*;

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
