//! What `open` checks, in two passes: where the sections lie and that their bytes are what was written
//! ([`sections`]); then that every number in them is in its range and every index refers to something that is
//! there ([`contents`]), so that nothing afterwards needs a check.

use super::{
    Counts, Database, Manifest,
    check::{Checked, Envelope, as_u32, check, reserved},
    crc::crc32c,
    dial,
    layout::{
        self, ALIGNMENT, DEGREE, ENTRIES, MAGIC, MAX_ACTIONS, MAX_FEATURES, MAX_GROUPS, MAX_JOINTS,
        MAX_STYLES, MAX_TIMING, MAX_WINDOW, NONE, VERSION, block, class, clip, cycle, dof_record, entry,
        flag, foot, header, joint, query, section, timing,
    },
    models,
    read::{Record, f32_at, u16_at, u32_at},
};
use crate::{
    BlobError,
    math::quaternion::{Quaternion, is_unit},
};

/// Most frames, rows, cycles or clips: products with record lengths stay far below 2^32.
const MOST_RECORDS: usize = 1 << 22;

const ENVELOPE: Envelope = Envelope {
    section: 0,
    magic: MAGIC,
    version: VERSION,
    header: header::LENGTH,
    total: header::TOTAL,
    crc: header::CRC,
};

/// Finds the sections and checks header, table, checksums and lengths.
#[inline]
pub(super) fn sections(bytes: &[u8]) -> Result<Database<'_>, BlobError> {
    let head = ENVELOPE.open(bytes)?;
    let total = bytes.len();
    let count = usize::from(head.u16(header::SECTIONS));
    let table_end = header::LENGTH + count * entry::LENGTH;
    ENVELOPE.sum(bytes, table_end)?;
    reserved(0, head.zero(header::RESERVED))?;

    let mut found: [Option<&[u8]>; section::REQUIRED.len()] = [None; section::REQUIRED.len()];
    let mut optional: [Option<&[u8]>; section::OPTIONAL.len()] = [None; section::OPTIONAL.len()];
    let mut end = table_end;
    for i in 0..count {
        let record = Record::of(bytes.get(header::LENGTH..).unwrap_or(&[]), i, entry::LENGTH);
        let id = record.u16(entry::ID);
        if !record.zero(entry::RESERVED) {
            return Err(BlobError::Reserved { section: id });
        }
        let misplaced = BlobError::Section { section: id };
        let (start, length) = (record.u32(entry::OFFSET) as usize, record.u32(entry::BYTES) as usize);
        // Sections follow each other in the order of the table, each on the next boundary.
        if start != end.next_multiple_of(ALIGNMENT) || length > total || section::name(id).is_none() {
            return Err(misplaced);
        }
        let (Some(padding), Some(content)) = (bytes.get(end..start), bytes.get(start..start + length)) else {
            return Err(misplaced);
        };
        if padding.iter().any(|&b| b != 0) {
            return Err(BlobError::Reserved { section: id });
        }
        if crc32c(&[content]) != record.u32(entry::CRC) {
            return Err(BlobError::Checksum { section: id });
        }
        // `name` knows the section, so it is in one of the two lists.
        let slot = match section::REQUIRED.iter().position(|&r| r == id) {
            Some(i) => found.get_mut(i),
            None => section::OPTIONAL.iter().position(|&o| o == id).and_then(|i| optional.get_mut(i)),
        };
        if slot.is_some_and(|slot| slot.replace(content).is_some()) {
            return Err(misplaced);
        }
        end = start + length;
    }
    if end != total {
        return Err(BlobError::Truncated { need: as_u32(end), have: as_u32(total) });
    }
    let mut sections: [&[u8]; section::REQUIRED.len()] = [&[]; section::REQUIRED.len()];
    for ((slot, content), &id) in sections.iter_mut().zip(found).zip(&section::REQUIRED) {
        *slot = content.ok_or(BlobError::Section { section: id })?;
    }
    let [
        manifest,
        skeleton,
        dofs,
        query,
        classes,
        clips,
        cycles,
        knots,
        pairs,
        blocks,
        rows,
        features,
        graph,
        flags,
        timing,
    ] = sections;
    let counts = counts(head)?;
    Ok(Database {
        counts,
        identity: head.u32(header::CRC),
        rate_hz: head.f32(header::RATE),
        block_shift: counts.block_rows.trailing_zeros(),
        manifest,
        skeleton,
        dofs,
        query,
        classes,
        clips,
        cycles,
        knots,
        pairs,
        blocks,
        rows,
        features,
        graph,
        flags,
        timing,
        optional,
    })
}

#[inline]
fn counts(head: Record<'_>) -> Result<Counts, BlobError> {
    let small = |range| usize::from(head.u16(range));
    let large = |range| head.u32(range) as usize;
    let counts = Counts {
        joints: small(header::JOINTS),
        dofs: small(header::DOFS),
        features: small(header::FEATURES),
        window: small(header::WINDOW),
        styles: small(header::STYLES),
        actions: small(header::ACTIONS),
        classes: small(header::CLASSES),
        groups: small(header::GROUPS),
        frames: large(header::FRAMES),
        rows: large(header::ROWS),
        block_rows: small(header::BLOCK_ROWS),
        timing: small(header::TIMING),
        cycles: large(header::CYCLES),
        clips: large(header::CLIPS),
    };
    let c = &counts;
    // A blob that was cut to its models holds no frames, and nothing that is about frames.
    let models_only = c.frames == 0;
    let frameless = [c.features, c.window, c.classes, c.rows, c.timing, c.cycles, c.clips];
    if models_only && frameless.iter().any(|&n| n != 0) {
        return Err(BlobError::Value { section: 0, record: 8 });
    }
    let least = usize::from(!models_only);
    let fits = [
        (2..=MAX_JOINTS).contains(&c.joints),
        c.dofs == layout::dofs(c.joints),
        (least..=MAX_FEATURES).contains(&c.features),
        (least..=MAX_WINDOW).contains(&c.window),
        (1..=MAX_STYLES).contains(&c.styles),
        (1..=MAX_ACTIONS).contains(&c.actions),
        (least..=c.styles * c.actions).contains(&c.classes),
        (1..=MAX_GROUPS).contains(&c.groups),
        (least..=MOST_RECORDS).contains(&c.frames),
        (c.frames..=MOST_RECORDS).contains(&c.rows),
        c.block_rows.is_power_of_two() && c.block_rows <= 64,
        (least..=MAX_TIMING).contains(&c.timing),
        (least..usize::from(NONE)).contains(&c.cycles),
        (least..=MOST_RECORDS).contains(&c.clips),
        (1.0..=1000.0).contains(&head.f32(header::RATE)),
    ];
    match fits.iter().position(|fit| !fit) {
        Some(record) => Err(BlobError::Value { section: 0, record: as_u32(record) }),
        None => Ok(counts),
    }
}

/// Checks every number of every section.
#[inline]
pub(super) fn contents(db: &Database<'_>) -> Checked {
    lengths(db)?;
    manifest(db)?;
    skeleton(db)?;
    dofs(db)?;
    query_section(db)?;
    clips(db)?;
    cycles(db)?;
    classes(db)?;
    blocks(db)?;
    timing_section(db)?;
    models::linear(db)?;
    models::statistics(db)?;
    dial::effort(db)?;
    feet(db)?;
    let translates = db.counts.frames > 0
        || db.optional(section::LTI).is_some()
        || db.optional(section::STATISTIC).is_some();
    if translates { Ok(()) } else { Err(BlobError::Value { section: 0, record: 8 }) }
}

#[inline]
fn lengths(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let coordinates: usize =
        (0..c.features).map(|f| 3 * c.window * joints_of_group(db, db.feature_group(f))).sum();
    let query =
        if c.frames > 0 { query::components(c.window, c.joints, c.features) + 4 * coordinates } else { 0 };
    let need = [
        (section::SKELETON, db.skeleton, c.joints * joint::LENGTH + joint::TRAILER),
        (section::DOFS, db.dofs, c.dofs * dof_record::LENGTH),
        (section::QUERY, db.query, query),
        (section::CLASSES, db.classes, c.classes * class::LENGTH),
        (section::CLIPS, db.clips, c.clips * clip::LENGTH),
        (section::CYCLES, db.cycles, c.cycles * cycle::LENGTH),
        // One table, or two.
        (section::PAIRS, db.pairs, c.cycles * c.styles * 2 * db.outputs()),
        (section::BLOCKS, db.blocks, blocks_of(db) * 4),
        (section::FEATURES, db.features, c.frames * c.features),
        (section::GRAPH, db.graph, c.frames * 2 * DEGREE),
        (section::FLAGS, db.flags, c.frames),
        (section::TIMING, db.timing, c.timing * timing::LENGTH),
    ];
    for (section, bytes, need) in need {
        if bytes.len() != need {
            return Err(BlobError::Length { section, need: as_u32(need), have: as_u32(bytes.len()) });
        }
    }
    if !db.knots.len().is_multiple_of(4) {
        let need = db.knots.len().next_multiple_of(4);
        return Err(BlobError::Length {
            section: section::KNOTS,
            need: as_u32(need),
            have: as_u32(db.knots.len()),
        });
    }
    Ok(())
}

/// Number of blocks that the rows fill; a block holds a power of two of them.
#[inline]
fn blocks_of(db: &Database<'_>) -> usize {
    (db.counts.rows + db.counts.block_rows - 1) >> db.block_shift
}

#[inline]
fn joints_of_group(db: &Database<'_>, group: usize) -> usize {
    (0..db.counts.joints).filter(|&j| db.joint(j).group == group).count()
}

#[inline]
fn manifest(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let manifest: Manifest<'_> = db.manifest()?;
    let agree = manifest.joints.count() == c.joints
        && manifest.actions.count() == c.actions
        && manifest.styles.count() == c.styles
        && manifest.groups.count() == c.groups
        && manifest.clips.count() == c.clips;
    if agree { Ok(()) } else { Err(BlobError::Manifest) }
}

#[inline]
fn skeleton(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    for j in 0..c.joints {
        let record = Record::of(db.skeleton, j, joint::LENGTH);
        let Joint { parent, group, offset, mean } = Joint::read(record);
        let parent_fits = if j == 0 { parent == joint::ROOT } else { usize::from(parent) < j };
        let offset_fits = offset.iter().all(|v| (-100.0..=100.0).contains(v));
        check(
            section::SKELETON,
            j,
            parent_fits && usize::from(group) < c.groups && offset_fits && is_unit(mean),
        )?;
        reserved(section::SKELETON, record.zero(joint::RESERVED))?;
    }
    let line = db.hips_line();
    let unit = is_unit([line[0], line[1], line[2], 0.0]);
    let toes_fit = db.toes().iter().flatten().all(|&t| t < c.joints);
    check(section::SKELETON, c.joints, unit && toes_fit)?;
    let trailer = Record(db.skeleton.get(c.joints * joint::LENGTH..).unwrap_or(&[]));
    reserved(section::SKELETON, trailer.zero(joint::TOES.end..joint::TRAILER))
}

/// Legs: four joints, each a child of the one before, at heights that a body has.
#[inline]
fn feet(db: &Database<'_>) -> Checked {
    let (Some(content), Some(legs)) = (db.optional(section::FEET), db.legs()) else { return Ok(()) };
    if content.len() != 2 * foot::LENGTH {
        return Err(BlobError::Section { section: section::FEET });
    }
    let child =
        |joint: usize, parent: usize| joint < db.counts.joints && db.joint(joint).parent == Some(parent);
    for (side, leg) in legs.iter().enumerate() {
        let chain = leg.hip > 0
            && leg.hip < db.counts.joints
            && child(leg.knee, leg.hip)
            && child(leg.ankle, leg.knee)
            && leg.toe.is_none_or(|toe| child(toe, leg.ankle));
        let heights = leg.heights.iter().all(|h| (-10.0..=10.0).contains(h));
        check(section::FEET, side, chain && heights)?;
        let record = Record::of(content, side, foot::LENGTH);
        reserved(section::FEET, record.zero(foot::RESERVED))?;
    }
    Ok(())
}

struct Joint {
    parent: u8,
    group: u8,
    offset: [f32; 3],
    mean: Quaternion,
}

impl Joint {
    fn read(record: Record<'_>) -> Self {
        Self {
            parent: record.u8(joint::PARENT),
            group: record.u8(joint::GROUP),
            offset: record.floats(joint::OFFSET),
            mean: record.floats(joint::MEAN),
        }
    }
}

#[inline]
fn dofs(db: &Database<'_>) -> Checked {
    for d in 0..db.counts.dofs {
        // A row's value is at most 2^16 steps, and its square has to stay finite in f32.
        let fits = (1e-9..=1e3).contains(&db.step(d)) && (1e-9..=1e6).contains(&db.scale(d));
        check(section::DOFS, d, fits)?;
    }
    Ok(())
}

#[inline]
fn query_section(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    if c.frames == 0 {
        return Ok(());
    }
    let groups = query::groups(c.window, c.joints, c.features);
    let components = query::components(c.window, c.joints, c.features);
    let mut weight = 0.0;
    for j in 0..c.joints {
        let w = f32_at(db.query, query::weights(c.window, c.joints) + 4 * j);
        check(section::QUERY, j, (0.0..=1e6).contains(&w))?;
        weight += w;
    }
    check(section::QUERY, 0, weight > 1e-6)?;
    for f in 0..c.features {
        let scale_fits = (1e-9..=1e6).contains(&db.feature_scale(f));
        check(section::QUERY, f, scale_fits && db.feature_group(f) < c.groups)?;
    }
    reserved(section::QUERY, Record(db.query).zero(groups + c.features..components))?;
    // Mean cloud and components: coordinates of a body, and entries of unit vectors times weights.
    for range in [0..query::weights(c.window, c.joints), components..db.query.len()] {
        for at in range.step_by(4) {
            check(section::QUERY, at / 4, (-1e6..=1e6).contains(&f32_at(db.query, at)))?;
        }
    }
    Ok(())
}

#[inline]
fn clips(db: &Database<'_>) -> Checked {
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
fn cycles(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    for i in 0..c.cycles {
        let record = Record::of(db.cycles, i, cycle::LENGTH);
        let clip = record.u32(cycle::CLIP) as usize;
        let first = record.u32(cycle::FIRST_KNOT) as usize;
        let knots = usize::from(record.u16(cycle::KNOTS));
        let start = record.u32(cycle::START) as usize;
        let refers =
            clip < c.clips && knots >= 2 && first <= MOST_RECORDS && 4 * (first + knots) <= db.knots.len();
        check(section::CYCLES, i, refers)?;
        reserved(section::CYCLES, record.zero(cycle::RESERVED))?;
        let (first_row, rows) = db.clip(clip);
        check(section::CYCLES, i, start >= first_row && start < first_row + rows)?;
        let mut before = f32::NEG_INFINITY;
        for k in first..first + knots {
            let knot = f32_at(db.knots, 4 * k);
            // A hundredth of a frame a segment at least: phases stay finite.
            check(
                section::KNOTS,
                k,
                knot - before >= 0.01 && (-1000.0..=rows as f32 + 1000.0).contains(&knot),
            )?;
            before = knot;
        }
    }
    let table = c.cycles * c.styles;
    for i in 0..db.pairs.len() / 2 {
        let output = u16_at(db.pairs, 2 * i);
        // A second output is there wherever it is looked for.
        check(section::PAIRS, i, usize::from(output) < c.cycles || (output == NONE && i < table))?;
    }
    Ok(())
}

#[inline]
fn classes(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let (mut next_row, mut next_cycle) = (0, 0);
    for i in 0..c.classes {
        let class = db.class(i);
        let bad = |fits| check(section::CLASSES, i, fits);
        bad((1..=usize::from(u16::MAX)).contains(&class.rows) && class.first_row == next_row)?;
        bad(class.first_cycle == next_cycle && (1..=c.cycles).contains(&class.cycles))?;
        bad(usize::from(class.action) < c.actions && usize::from(class.style) < c.styles)?;
        bad((0..i).all(|j| (db.class(j).action, db.class(j).style) != (class.action, class.style)))?;
        next_row += class.rows;
        next_cycle += class.cycles;
        bad(next_row <= c.frames && next_cycle <= c.cycles)?;
        let searchable = (class.first_row..next_row).filter(|&r| db.flags(r) & flag::SEARCHABLE != 0).count();
        bad(searchable == class.searchable && (1..=searchable).contains(&class.k_cap))?;
        let entries = Record::of(db.classes, i, class::LENGTH).0.get(class::ENTRY_POINTS).unwrap_or(&[]);
        bad(db.entries(i).count() > 0)?;
        for e in 0..ENTRIES {
            let row = u16_at(entries, 2 * e);
            bad(row == NONE || can_be_found(db, &class, row))?;
        }
        let mut before = None;
        for j in class.first_cycle..next_cycle {
            let start = Record::of(db.cycles, j, cycle::LENGTH).u32(cycle::START) as usize;
            let ascends = before.is_none_or(|b| start > b);
            check(section::CYCLES, j, ascends && (class.first_row..next_row).contains(&start))?;
            before = Some(start);
        }
        rows_of_class(db, i)?;
    }
    check(section::CLASSES, c.classes, next_row == c.frames)
}

/// A row of the class that the search may return.
fn can_be_found(db: &Database<'_>, class: &super::Class, row: u16) -> bool {
    let row = usize::from(row);
    row < class.rows && db.flags(class.first_row + row) & flag::SEARCHABLE != 0
}

fn rows_of_class(db: &Database<'_>, index: usize) -> Checked {
    let class = db.class(index);
    let mut cycle = None;
    for row in class.first_row..class.first_row + class.rows {
        let flags = db.flags(row);
        check(section::FLAGS, row, flags & !flag::ALL == 0)?;
        // The first row of a class follows nothing.
        check(section::FLAGS, row, flags & flag::FOLLOWS == 0 || row > class.first_row)?;
        if flags & flag::SEARCHABLE != 0 {
            cycle = db.cycle_of(index, row).or(cycle);
            let paired = cycle.is_some_and(|c| db.paired(c));
            check(section::FLAGS, row, flags & flag::FOLLOWS != 0 && paired)?;
        }
        for edge in db.edges(row) {
            check(section::GRAPH, row, edge == NONE || can_be_found(db, &class, edge))?;
        }
    }
    Ok(())
}

fn blocks(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    let mut next = 0;
    for b in 0..blocks_of(db) {
        let start = u32_at(db.blocks, 4 * b) as usize;
        check(section::BLOCKS, b, start == next)?;
        let bytes = db.rows.get(start..).unwrap_or(&[]);
        let row_bytes = usize::from(u16_at(bytes, block::ROW_BYTES.start));
        let widths = bytes.get(block::BASES + 2 * c.dofs..block::header(c.dofs)).unwrap_or(&[]);
        check(section::ROWS, b, widths.len() == c.dofs.div_ceil(2))?;
        let bits: usize = widths.iter().map(|w| usize::from(w & 15) + usize::from(w >> 4)).sum();
        let last_nibble_zero = c.dofs.is_multiple_of(2) || widths.last().is_some_and(|w| w >> 4 == 0);
        check(section::ROWS, b, row_bytes == bits.div_ceil(8) && last_nibble_zero)?;
        let rows = c.block_rows.min(c.rows - b * c.block_rows);
        next = (start + block::header(c.dofs) + rows * row_bytes).next_multiple_of(2);
        check(section::ROWS, b, next <= db.rows.len())?;
    }
    let need = if c.rows > 0 { next + block::PADDING } else { 0 };
    if db.rows.len() != need {
        return Err(BlobError::Length {
            section: section::ROWS,
            need: as_u32(need),
            have: as_u32(db.rows.len()),
        });
    }
    Ok(())
}

#[inline]
fn timing_section(db: &Database<'_>) -> Checked {
    for i in 0..db.counts.timing {
        let record = Record::of(db.timing, i, timing::LENGTH);
        let entry = db.timing(i);
        let weights_fit = (0.0..=1e9).contains(&entry.pose) && (0.0..=1e9).contains(&entry.change);
        check(section::TIMING, i, entry.dof < db.counts.dofs && weights_fit)?;
        reserved(section::TIMING, record.zero(timing::RESERVED))?;
    }
    Ok(())
}
