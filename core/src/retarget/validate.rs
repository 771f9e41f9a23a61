//! What [`Map::open`] checks: the places and checksum of the tables, then every number.

use super::{
    Map, Side,
    layout::{self, MAGIC, MAX_LIMBS, MAX_SOURCES, VERSION, header, joint, limb, record},
};
use crate::{
    BlobError,
    blob::{
        check::{self, Checked, Envelope, Tables},
        layout::{MAX_JOINTS, section},
        read::Record,
    },
    math::quaternion::is_unit,
};

const SECTION: u16 = section::RETARGET;
const ENVELOPE: Envelope = Envelope {
    section: SECTION,
    magic: MAGIC,
    version: VERSION,
    header: header::LENGTH,
    total: header::TOTAL,
    crc: header::CRC,
};

impl<'m> Map<'m> {
    /// Checks a map: magic, version, lengths, checksum, every index, every number.
    ///
    /// # Errors
    /// [`BlobError`], with [`section::RETARGET`] as its section.
    pub fn open(bytes: &'m [u8]) -> Result<Self, BlobError> {
        let map = split(bytes)?;
        contents(&map)?;
        Ok(map)
    }
}

/// Finds the tables and checks header and checksum.
fn split(bytes: &[u8]) -> Result<Map<'_>, BlobError> {
    let head = ENVELOPE.open(bytes)?;
    ENVELOPE.sum(bytes, bytes.len())?;
    reserved(head.zero(header::RESERVED))?;
    let [sources, targets, limbs] =
        [header::SOURCES, header::TARGETS, header::LIMBS].map(|r| usize::from(head.u16(r)));
    let counted =
        (2..=MAX_SOURCES).contains(&sources) && (2..=MAX_JOINTS).contains(&targets) && limbs <= MAX_LIMBS;
    check(0, counted)?;
    let need = layout::total(sources, targets, limbs);
    let mut tables = Tables::new(SECTION, bytes, header::LENGTH, need)?;
    let source_skeleton = tables.next(sources * joint::LENGTH);
    let target_skeleton = tables.next(targets * joint::LENGTH);
    let inwards = tables.next(targets * record::LENGTH);
    let outwards = tables.next(sources * record::LENGTH);
    Ok(Map {
        bytes,
        source: Side {
            joints: sources,
            skeleton: source_skeleton,
            records: outwards,
            hips: Record(bytes).floats(header::SOURCE_HIPS),
            ankle: head.f32(header::SOURCE_ANKLE),
        },
        target: Side {
            joints: targets,
            skeleton: target_skeleton,
            records: inwards,
            hips: Record(bytes).floats(header::TARGET_HIPS),
            ankle: head.f32(header::TARGET_ANKLE),
        },
        limbs: tables.next(limbs * limb::LENGTH),
        scale: head.f32(header::SCALE),
        world: Record(bytes).floats(header::WORLD),
    })
}

/// Checks every number. Records are counted through the tables, from 1; 0 is the header.
fn contents(map: &Map<'_>) -> Checked {
    let near = |v: &f32| (-100.0..=100.0).contains(v);
    let head = (0.01..=100.0).contains(&map.scale)
        && is_unit(map.world)
        && [map.source.hips, map.target.hips].iter().flatten().all(near)
        && [map.source.ankle, map.target.ankle].iter().all(near);
    check(0, head)?;
    let limbs = map.limbs.len() / limb::LENGTH;
    let mut number = 0;
    for side in [&map.source, &map.target] {
        for j in 0..side.joints {
            number += 1;
            let bytes = Record::of(side.skeleton, j, joint::LENGTH);
            let parent = bytes.u8(joint::PARENT);
            let parent_fits = if j == 0 { parent == u8::MAX } else { usize::from(parent) < j };
            let offset: [f32; 3] = bytes.floats(joint::OFFSET);
            let segment_fits = usize::from(bytes.u8(joint::SEGMENT)) <= 2 * limbs;
            check(number, parent_fits && segment_fits && offset.iter().all(near))?;
            reserved(bytes.zero(joint::RESERVED))?;
        }
    }
    for (side, other) in [(&map.target, &map.source), (&map.source, &map.target)] {
        for j in 0..side.joints {
            number += 1;
            let bytes = Record::of(side.records, j, record::LENGTH);
            let kind = bytes.u8(record::KIND);
            let from = [0, 1].map(|i| usize::from(bytes.u8(record::FROM.start + i)));
            let turns = [0, 16].map(|at| is_unit(bytes.floats(record::TURNS.start + at..record::TURNS.end)));
            let fits = (kind == record::FOLLOW || (kind == record::STAY && j > 0))
                && from.iter().all(|&f| f < other.joints)
                && (0.0..=1.0).contains(&bytes.f32(record::WEIGHT))
                && turns == [true; 2];
            check(number, fits)?;
            reserved(bytes.u8(record::RESERVED) == 0)?;
        }
    }
    for l in 0..limbs {
        number += 1;
        let bytes = Record::of(map.limbs, l, limb::LENGTH);
        // A limb's joints descend: parents come before their children.
        let of = |at: usize, joints: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| usize::from(bytes.u8(at + i)));
            a < b && b < c && c < joints
        };
        let fits = of(limb::SOURCE.start, map.source.joints)
            && of(limb::TARGET.start, map.target.joints)
            && [limb::LEG, limb::ARM].contains(&bytes.u8(limb::KIND));
        check(number, fits)?;
        reserved(bytes.zero(limb::RESERVED))?;
    }
    Ok(())
}

fn check(record: usize, fits: bool) -> Checked {
    check::check(SECTION, record, fits)
}

fn reserved(is_zero: bool) -> Checked {
    check::reserved(SECTION, is_zero)
}
