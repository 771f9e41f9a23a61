//! Poses as C has them: flat arrays of numbers. And the digest of a stream of them.

use gestus_core::{Digest, blob::layout::MAX_JOINTS, math::quaternion::Quaternion};

use crate::{
    memory::{self, Region, disjoint},
    status::{Answer, GestusStatus, status},
};

/// The regions of a pose's numbers, as far as they are used: `used` joints of the `joints` that are there.
pub(crate) fn regions(
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    used: usize,
) -> Answer<[Region; 2]> {
    let regions = [Region::of(position, 3)?, Region::of(rotations.cast::<f32>(), used.saturating_mul(4))?];
    // The whole array has to be possible, not only the part that is used.
    Region::of(rotations, joints.checked_mul(4).ok_or(GestusStatus::Short)?)?;
    if joints < used { Err(GestusStatus::Short) } else { Ok(regions) }
}

/// Copies a pose of `joints` joints; no more than a database may have.
///
/// # Safety
/// [`regions`] has passed the pointers, and they point at as many numbers.
pub(crate) unsafe fn read(
    position: *const f32,
    rotations: *const f32,
    joints: usize,
) -> Answer<([f32; 3], [Quaternion; MAX_JOINTS])> {
    let mut pose = ([0.0; 3], [[0.0; 4]; MAX_JOINTS]);
    // SAFETY: the caller's word. Nothing is written while the slices are alive.
    let (from, turns) =
        unsafe { (memory::slice(position, 3)?, memory::slice(rotations, joints.saturating_mul(4))?) };
    for (slot, &value) in pose.0.iter_mut().zip(from) {
        *slot = value;
    }
    for (slot, &value) in pose.1.as_flattened_mut().iter_mut().zip(turns) {
        *slot = value;
    }
    Ok(pose)
}

/// Takes a pose and its time step into the digest of a stream: `*digest` is 0 before the first pose, and equal on every
/// machine where every bit of every pose is.
///
/// Answers `GESTUS_STATUS_SHORT` (`joints` is 0, or more than a database may have, 64), `_NULL`, `_MISALIGNED`, `_OVERLAP`.
///
/// # Safety
/// `digest` points at a `uint32_t`, `position` at 3 numbers, `rotations` at 4 times `joints`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_digest(
    digest: *mut u32,
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    step_s: f32,
) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { add(digest, position, rotations, joints, step_s) })
}

unsafe fn add(
    digest: *mut u32,
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    step_s: f32,
) -> Answer {
    if !(1..=MAX_JOINTS).contains(&joints) {
        return Err(GestusStatus::Short);
    }
    let [from, turns] = regions(position, rotations, joints, joints)?;
    let place = Region::of(digest, 1)?;
    disjoint([place, from])?;
    disjoint([place, turns])?;
    // SAFETY: both arrays were checked, and are there by the caller's word.
    let (root, turns) = unsafe { read(position, rotations, joints) }?;
    // SAFETY: not null and aligned, and there by the caller's word.
    let before = unsafe { memory::slice(digest, 1) }?.first().copied().unwrap_or(0);
    let mut sum = Digest::resume(before);
    sum.add_joints(root, turns.get(..joints).unwrap_or(&[]), step_s);
    // SAFETY: as above; the slice is not used any more.
    unsafe { memory::put(digest, &[sum.value()]) }
}
