//! What [`Robot::open`] checks: the places and checksum of the tables, then every number.

use super::{
    Robot,
    layout::{
        self, MAGIC, MAX_HINGES, MAX_LIMB_HINGES, MAX_LIMBS, VERSION, group, header, hinge, joint, limb,
    },
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

const SECTION: u16 = section::ROBOT;
const ENVELOPE: Envelope = Envelope {
    section: SECTION,
    magic: MAGIC,
    version: VERSION,
    header: header::LENGTH,
    total: header::TOTAL,
    crc: header::CRC,
};

impl<'r> Robot<'r> {
    /// Checks a robot: magic, version, lengths, checksum, every index, every number.
    ///
    /// # Errors
    /// [`BlobError`], with [`section::ROBOT`] as its section.
    pub fn open(bytes: &'r [u8]) -> Result<Self, BlobError> {
        let robot = split(bytes)?;
        contents(&robot)?;
        Ok(robot)
    }
}

/// Finds the tables and checks header and checksum.
fn split(bytes: &[u8]) -> Result<Robot<'_>, BlobError> {
    let head = ENVELOPE.open(bytes)?;
    ENVELOPE.sum(bytes, bytes.len())?;
    reserved(head.zero(header::RESERVED_1) && head.zero(header::RESERVED_2))?;
    let [joints, hinges, groups, limbs] =
        [header::TARGETS, header::HINGES, header::GROUPS, header::LIMBS].map(|r| usize::from(head.u16(r)));
    let counted = (2..=MAX_JOINTS).contains(&joints)
        && (1..=MAX_HINGES).contains(&hinges)
        && (1..=hinges).contains(&groups)
        && limbs <= MAX_LIMBS;
    check(0, counted)?;
    let need = layout::total(joints, hinges, groups, limbs);
    let mut tables = Tables::new(SECTION, bytes, header::LENGTH, need)?;
    Ok(Robot {
        bytes,
        joints: tables.next(joints * joint::LENGTH),
        hinges: tables.next(hinges * hinge::LENGTH),
        groups: tables.next(groups * group::LENGTH),
        limbs: tables.next(limbs * limb::LENGTH),
    })
}

/// Checks every number. Records are counted through the tables, from 1; 0 is the header.
fn contents(robot: &Robot<'_>) -> Checked {
    let near = |v: &f32| (-100.0..=100.0).contains(v);
    let axis_fits = |v: [f32; 3]| is_unit([v[0], v[1], v[2], 0.0]);
    check(0, (1e-4..=1.0).contains(&robot.tick_s()) && is_unit(robot.base()))?;
    let mut number = 0;
    for j in 0..robot.joints() {
        number += 1;
        let (parent, offset) = robot.joint(j);
        let parent_fits = if j == 0 { parent.is_none() } else { parent.is_some_and(|p| p < j) };
        check(number, parent_fits && offset.iter().all(near))?;
        reserved(Record::of(robot.joints, j, joint::LENGTH).zero(joint::RESERVED))?;
    }
    for h in 0..robot.hinges() {
        number += 1;
        let record = robot.hinge(h);
        let fits = record.parent.is_none_or(|p| p < h)
            && record.offset.iter().all(near)
            && is_unit(record.turn)
            && axis_fits(record.axis)
            && robot.limits(h).is_valid()
            && robot.servo(h).is_valid();
        check(number, fits)?;
        reserved(Record::of(robot.hinges, h, hinge::LENGTH).zero(hinge::RESERVED))?;
    }
    let chained = |first: usize, last: usize| {
        (first + 1..=last).all(|h| h < robot.hinges() && robot.hinge(h).parent == Some(h - 1))
    };
    let limbs = robot.limbs();
    let mut next = 0;
    for g in 0..robot.groups() {
        number += 1;
        let record = robot.group(g);
        let count = record.hinges.count;
        let bytes = Record::of(robot.groups, g, group::LENGTH);
        let pointed: [f32; 3] = bytes.floats(group::POINTED);
        // Groups are in the order of their hinges, and no hinge is in two.
        let fits = (1..=3).contains(&count)
            && record.first >= next
            && record.first + count <= robot.hinges()
            && chained(record.first, record.first + count - 1)
            && record.joint < robot.joints()
            && record.limb.is_none_or(|l| l < limbs)
            && is_unit(record.turn)
            && is_unit(record.zero)
            && record.hinges.axes.iter().take(count).all(|&a| axis_fits(a))
            && record.hinges.axes.iter().flatten().all(near)
            && axis_fits(pointed);
        check(number, fits)?;
        next = record.first + count;
    }
    for l in 0..limbs {
        number += 1;
        let Some(record) = robot.limb(l) else { continue };
        let [first, last] = record.hinges;
        let fits = record.joints.iter().all(|&j| j < robot.joints())
            && first <= last
            && last < robot.hinges()
            && last - first < MAX_LIMB_HINGES
            && chained(first, last)
            && (1e-3..=100.0).contains(&record.scale)
            && record.tip.iter().all(near);
        check(number, fits)?;
    }
    Ok(())
}

fn check(record: usize, fits: bool) -> Checked {
    check::check(SECTION, record, fits)
}

fn reserved(is_zero: bool) -> Checked {
    check::reserved(SECTION, is_zero)
}
