//! Databases: opening a blob, and what it says about itself.

use core::{
    ffi::{c_char, c_void},
    mem::{align_of, size_of},
};

use gestus_core::{
    Database,
    blob::{Names, layout},
};

use crate::{
    handle::{Cell, DATABASE},
    memory::{self, Region, disjoint},
    status::{Answer, GestusBlobDetail, GestusStatus, of_blob, status},
};

/// A checked blob. It lies in memory that the caller gave, and refers to the blob, which has to stay as long.
pub struct GestusDatabase {
    _opaque: [u8; 0],
}

/// Bytes that are enough for a database on every target; `gestus_database_size` tells the exact number.
pub const GESTUS_DATABASE_BYTES: usize = 1024;

type Opened = Cell<Database<'static>>;

const _: () = assert!(size_of::<Opened>() <= GESTUS_DATABASE_BYTES);

/// The version of this library, as text that ends with a zero and stays for ever: "0.1.0".
#[unsafe(no_mangle)]
pub extern "C" fn gestus_version() -> *const c_char {
    concat!(env!("CARGO_PKG_VERSION"), "\0").as_ptr().cast()
}

/// The version of the blob format that this library reads.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_blob_version() -> u32 {
    u32::from(layout::VERSION)
}

/// Bytes that `gestus_database_open` needs.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_database_size() -> usize {
    size_of::<Opened>()
}

/// Alignment, in bytes, of the memory that `gestus_database_open` needs: 8.
#[unsafe(no_mangle)]
pub extern "C" fn gestus_database_alignment() -> usize {
    align_of::<Opened>()
}

/// Checks a blob and makes a database of it in `memory`. The handle is put into `*database`; it is `memory` itself.
///
/// Every byte is checked, once: lengths, checksums, every index. It takes time in proportion to the blob's length.
/// The blob is read in place from then on. It may be of any alignment, and has to stay as it is for as long as the
/// database, or a stylizer that was made of it, is used.
///
/// `detail` may be null; otherwise it says, where the blob is refused, which section and record is wrong.
///
/// Answers a status `GESTUS_STATUS_BLOB_...`, or `_NULL`, `_MISALIGNED`, `_SHORT` (`bytes` is less than
/// `gestus_database_size()`, or a length is beyond the address space), `_OVERLAP`.
///
/// # Safety
/// `memory` points at `bytes` bytes, `blob` at `blob_bytes` bytes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_open(
    memory: *mut c_void,
    bytes: usize,
    blob: *const u8,
    blob_bytes: usize,
    detail: *mut GestusBlobDetail,
    database: *mut *mut GestusDatabase,
) -> GestusStatus {
    // SAFETY: the caller's word is passed on.
    status(unsafe { open(memory, bytes, blob, blob_bytes, detail, database) })
}

unsafe fn open(
    memory: *mut c_void,
    bytes: usize,
    blob: *const u8,
    blob_bytes: usize,
    detail: *mut GestusBlobDetail,
    database: *mut *mut GestusDatabase,
) -> Answer {
    let place: *mut Opened = memory.cast();
    let own = Region::memory(memory.cast(), bytes, size_of::<Opened>(), align_of::<Opened>())?;
    let (read, out) = (Region::of(blob, blob_bytes)?, Region::of(database, 1)?);
    disjoint([own, read, out])?;
    if !detail.is_null() {
        disjoint([own, read, out, Region::of(detail, 1)?])?;
    }
    // SAFETY: there for `blob_bytes` bytes, for as long as the database is used and unchanged meanwhile, by the
    // caller's word. That is no longer than `'static`, and no reference leaves this library.
    let content: &'static [u8] = unsafe { memory::slice(blob, blob_bytes) }?;
    match Database::open(content) {
        Ok(opened) => {
            // SAFETY: `own` is aligned and long enough, and overlaps nothing that is read here.
            unsafe { Cell::make(place, DATABASE, read, || opened) };
            // SAFETY: `out` was checked, and is the caller's to write.
            unsafe { memory::put(database, &[memory.cast::<GestusDatabase>()]) }
        }
        Err(error) => {
            let (status, found) = of_blob(error);
            if !detail.is_null() {
                // SAFETY: not null, checked above.
                unsafe { memory::put(detail, &[found]) }?;
            }
            Err(status)
        }
    }
}

/// Makes a database's handle stale, so that using it later is noticed. Need not be called; the memory is the
/// caller's again in any case. Stylizers that were made of it go on: they refer to the blob alone.
///
/// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `database` came from `gestus_database_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_close(database: *mut GestusDatabase) -> GestusStatus {
    // SAFETY: the caller's word.
    status(unsafe { Opened::of_mut(database.cast(), DATABASE) }.map(Cell::close))
}

/// A database, the blob that it reads, and where it lies.
///
/// # Safety
/// As for [`Cell::of`].
pub(crate) unsafe fn opened<'a>(
    database: *const GestusDatabase,
) -> Answer<(&'a Database<'static>, [Region; 2])> {
    // SAFETY: the caller's word.
    let cell = unsafe { Opened::of(database.cast(), DATABASE) }?;
    let regions = [cell.region()?, cell.blob];
    Ok((&cell.object, regions))
}

/// Puts a value where the caller wants it, if that is no part of the database or its blob.
///
/// # Safety
/// `place` is null or points at memory for a `T`.
unsafe fn answer<T: Copy>(place: *mut T, [own, blob]: [Region; 2], value: T) -> Answer {
    disjoint([own, blob, Region::of(place, 1)?])?;
    // SAFETY: the caller's word; not null and aligned by the line above.
    unsafe { memory::put(place, &[value]) }
}

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
    /// Poses a second that a stylizer expects.
    pub rate_hz: f32,
}

/// Puts the counts of a database into `*counts`.
///
/// Answers `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `counts` points at memory for a `GestusCounts`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_counts(
    database: *const GestusDatabase,
    counts: *mut GestusCounts,
) -> GestusStatus {
    // SAFETY: the caller's word.
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
        // SAFETY: the caller's word.
        unsafe { answer(counts, regions, value) }
    }))
}

/// What has names. Arguments named `kind` take one of these numbers.
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

fn names(database: &Database<'static>, kind: u32) -> Answer<Names<'static>> {
    let manifest = database.manifest().map_err(|_| GestusStatus::BlobManifest)?;
    match kind {
        0 => Ok(manifest.joints),
        1 => Ok(manifest.styles),
        2 => Ok(manifest.actions),
        3 => Ok(manifest.groups),
        _ => Err(GestusStatus::NotFound),
    }
}

/// Copies the name of a joint, style, action or group into `text`, with a zero behind it.
///
/// `length` may be null; otherwise the name's length without the zero is put there, also where `text` is too short,
/// so that the call can be made again with more room. `text` may be null where `bytes` is 0.
///
/// Answers `GESTUS_STATUS_NOT_FOUND` (no such kind or index), `_SHORT` (`bytes` is not enough: nothing is copied),
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
    // SAFETY: the caller's word is passed on.
    status(unsafe { name(database, kind, index, text, bytes, length) })
}

unsafe fn name(
    database: *const GestusDatabase,
    kind: u32,
    index: u32,
    text: *mut c_char,
    bytes: usize,
    length: *mut usize,
) -> Answer {
    // SAFETY: the caller's word.
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
    // SAFETY: `text` has room for the name and the zero, and lies apart from the blob, where the name is.
    unsafe { memory::put(text, name.as_bytes()) }?;
    // SAFETY: as above; `name.len()` is less than `bytes`.
    unsafe { memory::put(text.add(name.len()), &[0]) }
}

/// Puts the number of the joint, style, action or group of that name into `*index`.
///
/// Answers `GESTUS_STATUS_NOT_FOUND`, `_TEXT` (longer than `GESTUS_NAME_BYTES`, or not UTF-8), `_NULL`,
/// `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `name` points at a text that ends with a zero; `index` points at
/// memory for a `uint32_t`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_find(
    database: *const GestusDatabase,
    kind: u32,
    name: *const c_char,
    index: *mut u32,
) -> GestusStatus {
    // SAFETY: the caller's word.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        // SAFETY: the caller's word.
        let name = unsafe { memory::text(name) }?;
        let found = names(db, kind)?.find(name).ok_or(GestusStatus::NotFound)?;
        // SAFETY: the caller's word. `name` is not used any more.
        unsafe { answer(index, regions, u32::from(found)) }
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

/// Puts joint `index` into `*joint`.
///
/// Answers `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `joint` points at memory for a `GestusJoint`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_joint(
    database: *const GestusDatabase,
    index: u32,
    joint: *mut GestusJoint,
) -> GestusStatus {
    // SAFETY: the caller's word.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        let index = index as usize;
        if index >= db.counts().joints {
            return Err(GestusStatus::NotFound);
        }
        let found = db.joint(index);
        let parent = found.parent.map_or(-1, |p| p as i32);
        // SAFETY: the caller's word.
        unsafe {
            answer(joint, regions, GestusJoint { parent, group: found.group as u32, offset: found.offset })
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

/// Puts class `index` into `*value`.
///
/// Answers `GESTUS_STATUS_NOT_FOUND`, `_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `value` points at memory for a `GestusClass`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_class(
    database: *const GestusDatabase,
    index: u32,
    value: *mut GestusClass,
) -> GestusStatus {
    // SAFETY: the caller's word.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        let index = index as usize;
        if index >= db.counts().classes {
            return Err(GestusStatus::NotFound);
        }
        let class = db.class(index);
        let found =
            GestusClass { action: class.action.into(), style: class.style.into(), frames: class.rows as u32 };
        // SAFETY: the caller's word.
        unsafe { answer(value, regions, found) }
    }))
}
