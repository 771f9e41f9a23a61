//! Poses in C, as flat arrays of numbers, and the digest of a stream of poses.

use gestus_core::{Digest, blob::layout::MAX_JOINTS, math::quaternion::Quaternion};

use crate::{
    memory::{self, Region, disjoint},
    status::{GestusStatus, StatusResult, status},
};

/// The regions of a pose's numbers that are used: `used` joints of the `joints` in the array.
pub(crate) fn regions(
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    used: usize,
) -> StatusResult<[Region; 2]> {
    let regions = [Region::of(position, 3)?, Region::of(rotations, used.saturating_mul(4))?];
    // The whole array has to be valid, not only the part that is used.
    Region::of(rotations, joints.checked_mul(4).ok_or(GestusStatus::Short)?)?;
    if joints < used { Err(GestusStatus::Short) } else { Ok(regions) }
}

/// Copies a pose of `joints` joints, at most as many as a database may have.
///
/// # Safety
/// [`regions`] has checked the pointers, and they point at that many numbers.
pub(crate) unsafe fn read(
    position: *const f32,
    rotations: *const f32,
    joints: usize,
) -> StatusResult<([f32; 3], [Quaternion; MAX_JOINTS])> {
    let mut pose = ([0.0; 3], [[0.0; 4]; MAX_JOINTS]);
    // SAFETY: by the caller's contract. Nothing is written while the slices are alive.
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

/// Adds a pose and its time step to the digest of a stream. `*digest` is 0 before the first pose. Digests are equal on
/// all machines on which every bit of every pose is equal.
///
/// Returns `GESTUS_STATUS_SHORT` (`joints` is 0, or more than a database may have, 64), `_NULL`, `_MISALIGNED`,
/// `_OVERLAP`.
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
    // SAFETY: the caller's contract is passed on.
    status(unsafe { add(digest, position, rotations, joints, step_s) })
}

unsafe fn add(
    digest: *mut u32,
    position: *const f32,
    rotations: *const f32,
    joints: usize,
    step_s: f32,
) -> StatusResult {
    if !(1..=MAX_JOINTS).contains(&joints) {
        return Err(GestusStatus::Short);
    }
    let [from, turns] = regions(position, rotations, joints, joints)?;
    let place = Region::of(digest, 1)?;
    disjoint([place, from])?;
    disjoint([place, turns])?;
    // SAFETY: both arrays were checked, and exist by the caller's contract.
    let (root, turns) = unsafe { read(position, rotations, joints) }?;
    // SAFETY: not null and aligned, and exists by the caller's contract.
    let before = unsafe { memory::slice(digest, 1) }?.first().copied().unwrap_or(0);
    let mut sum = Digest::resume(before);
    sum.add_joints(root, turns.get(..joints).unwrap_or(&[]), step_s);
    // SAFETY: as above; the slice is not used after this.
    unsafe { memory::put(digest, &[sum.value()]) }
}
