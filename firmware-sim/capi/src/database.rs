//! Databases: opening a blob.

use core::{
    ffi::{c_char, c_void},
    mem::{align_of, size_of},
};

use gestus_core::{
    Database,
    blob::{Mark, layout},
};

use crate::{
    handle::{Cell, DATABASE, close},
    memory::{self, Region, disjoint},
    status::{GestusBlobDetail, GestusStatus, StatusResult, of_blob, status},
};

/// A checked blob. It is in memory that the caller provided, and refers to the blob, which has to stay valid as long.
/// Several threads may use it at once, also to make stylizers and to step them, while none of them closes it.
pub struct GestusDatabase {
    _opaque: [u8; 0],
}

/// Bytes that are enough for a database on every target; `gestus_database_size` returns the exact number.
pub const GESTUS_DATABASE_BYTES: usize = 1024;

type Opened = Cell<Database<'static>>;

const _: () = assert!(size_of::<Opened>() <= GESTUS_DATABASE_BYTES);

/// The version of this library, as a zero-terminated string that stays valid forever: "0.1.0".
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

/// Checks a blob and makes a database from it in `memory`. The handle, which is `memory` itself, is written to
/// `*database`.
///
/// Every byte is checked once: lengths, checksums, every index. This takes time in proportion to the blob's length.
/// From then on the blob is read in place. It may have any alignment, and must not change while the database, or a
/// stylizer made from it, is in use.
///
/// `detail` may be null; otherwise, if the blob is refused, the wrong section and record are written to it.
///
/// Returns a status `GESTUS_STATUS_BLOB_...`, or `_NULL`, `_MISALIGNED`, `_SHORT` (`bytes` is less than
/// `gestus_database_size()`, or a length exceeds the address space), `_OVERLAP`.
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
    // SAFETY: the caller's contract is passed on.
    status(unsafe { open(memory, bytes, blob, blob_bytes, 0, detail, database) })
}

/// Opens a blob as `gestus_database_open` does, but without checking what is in it where `mark` is that of the blob
/// (`gestus_database_mark`): for a board that checks a blob once, after flashing, and can store eight bytes. With another
/// mark, such as 0, it is `gestus_database_open`. With the mark its time does not depend on the size of the sections.
///
/// Flash that has changed since the blob was checked is not found then: a step still writes only where it may, but poses
/// can be wrong.
///
/// # Safety
/// As for `gestus_database_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_open_marked(
    memory: *mut c_void,
    bytes: usize,
    blob: *const u8,
    blob_bytes: usize,
    mark: u64,
    detail: *mut GestusBlobDetail,
    database: *mut *mut GestusDatabase,
) -> GestusStatus {
    // SAFETY: the caller's contract is passed on.
    status(unsafe { open(memory, bytes, blob, blob_bytes, mark, detail, database) })
}

/// Writes the mark of a database, which is checked, to `*mark`: to be stored, for `gestus_database_open_marked`.
///
/// Returns `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`, `_OVERLAP`.
///
/// # Safety
/// `database` came from `gestus_database_open`; `mark` points at memory for a number.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_mark(
    database: *const GestusDatabase,
    mark: *mut u64,
) -> GestusStatus {
    // SAFETY: by the caller's contract.
    status(unsafe { opened(database) }.and_then(|(db, regions)| {
        // SAFETY: by the caller's contract.
        unsafe { write_value(mark, regions, db.mark().to_bits()) }
    }))
}

unsafe fn open(
    memory: *mut c_void,
    bytes: usize,
    blob: *const u8,
    blob_bytes: usize,
    mark: u64,
    detail: *mut GestusBlobDetail,
    database: *mut *mut GestusDatabase,
) -> StatusResult {
    let place: *mut Opened = memory.cast();
    let own = Region::memory(memory.cast(), bytes, size_of::<Opened>(), align_of::<Opened>())?;
    let (read, out) = (Region::of(blob, blob_bytes)?, Region::of(database, 1)?);
    disjoint([own, read, out])?;
    if !detail.is_null() {
        disjoint([own, read, out, Region::of(detail, 1)?])?;
    }
    // SAFETY: by the caller's contract there are `blob_bytes` bytes, which do not change while the database is in use.
    // `'static` is longer than that, but no reference leaves this library.
    let content: &'static [u8] = unsafe { memory::slice(blob, blob_bytes) }?;
    match Database::open_marked(content, Mark::from_bits(mark)) {
        Ok(opened) => {
            // SAFETY: `own` is aligned and long enough, and overlaps nothing that is read here.
            unsafe { Cell::make(place, DATABASE, read, || opened) };
            // SAFETY: `out` was checked, and may be written by the caller's contract.
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

/// Makes a database's handle invalid, so that later use of it is detected. Calling this is optional: the memory may be
/// reused in any case. Stylizers made from the database stay valid: they refer to the blob only.
///
/// Returns `GESTUS_STATUS_NULL`, `_MISALIGNED`, `_HANDLE`.
///
/// # Safety
/// `database` came from `gestus_database_open`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn gestus_database_close(database: *mut GestusDatabase) -> GestusStatus {
    // SAFETY: by the caller's contract.
    let found = unsafe { opened(database) }.map(|_| ());
    // SAFETY: as above; the handle is that of an intact object.
    status(found.map(|()| unsafe { close(database.cast()) }))
}

/// A database, and the regions of the database and of its blob.
///
/// # Safety
/// As for [`Cell::of`].
pub(crate) unsafe fn opened<'a>(
    database: *const GestusDatabase,
) -> StatusResult<(&'a Database<'static>, [Region; 2])> {
    // SAFETY: by the caller's contract.
    let cell = unsafe { Opened::of(database.cast(), DATABASE) }?;
    let regions = [cell.region()?, cell.blob];
    Ok((&cell.object, regions))
}

/// Writes a value to the caller's memory, if that does not overlap the database or its blob.
///
/// # Safety
/// `place` is null or points at memory for a `T`.
pub(crate) unsafe fn write_value<T: Copy>(place: *mut T, [own, blob]: [Region; 2], value: T) -> StatusResult {
    disjoint([own, blob, Region::of(place, 1)?])?;
    // SAFETY: by the caller's contract; not null and aligned by the line above.
    unsafe { memory::put(place, &[value]) }
}
