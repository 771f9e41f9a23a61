//! Sections that describe the body: names, skeleton, dofs and legs.

use crate::{
    BlobError,
    blob::{
        Database, Joint, Manifest,
        check::{Checked, check, length, reserved},
        layout::{foot, joint, section},
        read::Record,
    },
    math::quaternion::is_unit,
};

#[inline]
pub(super) fn manifest(db: &Database<'_>) -> Checked {
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
pub(super) fn skeleton(db: &Database<'_>) -> Checked {
    let c = &db.counts;
    for j in 0..c.joints {
        let record = Record::of(db.required.skeleton, j, joint::LENGTH);
        let Joint { parent, group, offset, mean } = db.joint(j);
        let parent_fits = if j == 0 { parent.is_none() } else { parent.is_some_and(|p| p < j) };
        let offset_fits = offset.iter().all(|v| (-100.0..=100.0).contains(v));
        check(section::SKELETON, j, parent_fits && group < c.groups && offset_fits && is_unit(mean))?;
        reserved(section::SKELETON, record.zero(joint::RESERVED))?;
    }
    let line = db.hips_line();
    let unit = is_unit([line[0], line[1], line[2], 0.0]);
    let toes_fit = db.toes().iter().flatten().all(|&t| t < c.joints);
    check(section::SKELETON, c.joints, unit && toes_fit)?;
    let trailer = Record(db.required.skeleton.get(c.joints * joint::LENGTH..).unwrap_or(&[]));
    reserved(section::SKELETON, trailer.zero(joint::TOES.end..joint::TRAILER))
}

/// Legs: joints that are each a child of the one before, and plausible heights.
#[inline]
pub(super) fn feet(db: &Database<'_>, bytes: &[u8]) -> Checked {
    length(section::FEET, 2 * foot::LENGTH, bytes.len())?;
    let Some(legs) = db.legs() else { return Ok(()) };
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
    }
    Ok(())
}

#[inline]
pub(super) fn dofs(db: &Database<'_>) -> Checked {
    for d in 0..db.counts.dofs {
        // A row's value is at most 2^16 steps, and its square has to stay finite in f32.
        let fits = (1e-9..=1e3).contains(&db.step(d)) && (1e-9..=1e6).contains(&db.scale(d));
        check(section::DOFS, d, fits)?;
    }
    for (i, [least, greatest]) in db.dof_ranges().enumerate() {
        // False for NaN.
        let fits = -1e3 <= least && least <= greatest && greatest <= 1e3;
        check(section::DOFS, db.counts.dofs + i, fits)?;
    }
    Ok(())
}
