//! What is in a database: counts, names, joints, classes.

use core::ffi::c_char;

use gestus_core::{Database, blob::Names};

use crate::{
    database::{GestusDatabase, opened, write_value},
    memory::{self, Region, disjoint},
    status::{GestusStatus, StatusResult, status},
};

/// The counts of a database.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GestusCounts {
    /// Joints of the skeleton; joint 0 is the root.
    pub joints: u32,
    /// Styles.
    pub styles: u32,
    /// Actions.
    pub actions: u32,
    /// Classes: combinations of action and style that hold frames.
    pub classes: u32,
    /// Joint groups.
    pub groups: u32,
    /// Captured frames.
    pub frames: u32,
    /// Input rate that a stylizer expects, poses a second.
    pub rate_hz: f32,
}

/// Writes the counts of a database to `*counts`.
///
/// Returns `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `counts` points at memory for a `GestusCounts`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_counts(
    database: *const GestusDatabase,
    counts: *mut GestusCounts,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        let c = db.counts();
        let value = GestusCounts {
            joints: c.joints as u32,
            styles: c.styles as u32,
            actions: c.actions as u32,
            classes: c.classes as u32,
            groups: c.groups as u32,
            frames: c.frames as u32,
            rate_hz: db.rate_hz(),
        };
        // SAFETY: by the caller's contract.
        unsafe { write_value(counts, regions, value) }
    }))
}

/// Kinds of names. Arguments named `kind` take one of these numbers.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusKind {
    /// Joints.
    Joint = 0,
    /// Styles.
    Style = 1,
    /// Actions.
    Action = 2,
    /// Joint groups.
    Group = 3,
}

fn names(database: &Database<'static>, kind: u32) -> StatusResult<Names<'static>> {
    let manifest = database.manifest().map_err(|_| GestusStatus::BlobManifest)?;
    match kind {
        0 => Ok(manifest.joints),
        1 => Ok(manifest.styles),
        2 => Ok(manifest.actions),
        3 => Ok(manifest.groups),
        _ => Err(GestusStatus::NotFound),
    }
}

/// Copies the name of a joint, style, action or group to `text`, zero-terminated.
///
/// `length` may be null; otherwise the name's length without the zero is written to it, even if `text` is too short, so
/// that the call can be repeated with more memory. `text` may be null if `bytes` is 0.
///
/// Returns `GESTUS_STATUS_NOT_FOUND` (no such kind or index), `_SHORT` (`bytes` is not enough: nothing is copied),
/// `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `text` points at `bytes` bytes; `length` is null or points at memory
/// for a `size_t`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_name(
    database: *const GestusDatabase,
    kind: u32,
    index: u32,
    text: *mut c_char,
    bytes: usize,
    length: *mut usize,
) -> GestusStatus {
    // SAFETY: the caller's contract is passed on.
    status(unsafe { name(database, kind, index, text, bytes, length) })
}

unsafe fn name(
    database: *const GestusDatabase,
    kind: u32,
    index: u32,
    text: *mut c_char,
    bytes: usize,
    length: *mut usize,
) -> StatusResult {
    // SAFETY: by the caller's contract.
    let (db, regions) = unsafe { opened(database) }?;
    let [own, blob] = regions;
    let text: *mut u8 = text.cast();
    if bytes > 0 {
        disjoint([own, blob, Region::of(text, bytes)?])?;
    }
    if !length.is_null() {
        disjoint([own, blob, Region::of(length, 1)?])?;
        if bytes > 0 {
            disjoint([Region::of(text, bytes)?, Region::of(length, 1)?])?;
        }
    }
    let name = names(db, kind)?.get(index as usize).ok_or(GestusStatus::NotFound)?;
    if !length.is_null() {
        // SAFETY: checked above.
        unsafe { memory::put(length, &[name.len()]) }?;
    }
    if bytes <= name.len() {
        return Err(GestusStatus::Short);
    }
    // SAFETY: `text` is long enough for the name and the zero, and does not overlap the blob, which contains the name.
    unsafe { memory::put(text, name.as_bytes()) }?;
    // SAFETY: as above; `name.len()` is less than `bytes`.
    unsafe { memory::put(text.add(name.len()), &[0]) }
}

/// Writes the number of the joint, style, action or group of that name to `*index`.
///
/// Returns `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `name` points at a zero-terminated string; `index` points at
/// memory for a `uint32_t`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_find(
    database: *const GestusDatabase,
    kind: u32,
    name: *const c_char,
    index: *mut u32,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        // SAFETY: by the caller's contract.
        let name = unsafe { memory::text(name) }?;
        let found = names(db, kind)?.find(name).ok_or(GestusStatus::NotFound)?;
        // SAFETY: by the caller's contract. `name` is not used after this.
        unsafe { write_value(index, regions, u32::from(found)) }
    }))
}

/// A joint of the database's skeleton.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GestusJoint {
    /// Number of the parent, which is smaller than the joint's own; -1 for the root.
    pub parent: i32,
    /// Joint group.
    pub group: u32,
    /// Position in the parent's frame, metres.
    pub offset: [f32; 3],
}

/// Writes joint `index` to `*joint`.
///
/// Returns `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `joint` points at memory for a `GestusJoint`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_joint(
    database: *const GestusDatabase,
    index: u32,
    joint: *mut GestusJoint,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        let index = index as usize;
        if index >= db.counts().joints {
            return Err(GestusStatus::NotFound);
        }
        let found = db.joint(index);
        let parent = found.parent.map_or(-1, |p| p as i32);
        // SAFETY: by the caller's contract.
        unsafe {
            write_value(
                joint,
                regions,
                GestusJoint { parent, group: found.group as u32, offset: found.offset },
            )
        }
    }))
}

/// A class of a database: the frames of one action in one style.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GestusClass {
    /// Number of the action.
    pub action: u32,
    /// Number of the style.
    pub style: u32,
    /// Frames.
    pub frames: u32,
}

/// Writes class `index` to `*value`.
///
/// Returns `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `value` points at memory for a `GestusClass`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_class(
    database: *const GestusDatabase,
    index: u32,
    value: *mut GestusClass,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        let index = index as usize;
        if index >= db.counts().classes {
            return Err(GestusStatus::NotFound);
        }
        let class = db.class(index);
        let found =
            GestusClass { action: class.action.into(), style: class.style.into(), frames: class.rows as u32 };
        // SAFETY: by the caller's contract.
        unsafe { write_value(value, regions, found) }
    }))
}
