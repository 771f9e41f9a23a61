//! Objects in the caller's memory: each is between two guard values, the seals, so that invalid handles are detected.
//!
//! A seal combines a constant, the kind of the object and the seal's address. It detects memory in which no object was
//! made, which was overwritten from either side, or which was moved, and objects that were closed. It can't detect a
//! pointer to memory that can't be read.

use core::{
    mem::{MaybeUninit, offset_of},
    ptr,
};

use crate::{
    memory::Region,
    status::{GestusStatus, StatusResult},
};

/// "Gest", read as a number.
const MAGIC: u32 = 0x4765_7374;

/// Kinds of objects. Those of stylizers are their profiles.
pub(crate) const DATABASE: u32 = 0x6462;

/// The header of every object.
#[repr(C)]
struct Head {
    seal: u32,
    kind: u32,
}

/// An object in the caller's memory.
#[repr(C, align(8))]
pub(crate) struct Cell<T> {
    head: Head,
    /// The blob that the object reads, which outputs must not overlap.
    pub blob: Region,
    pub object: T,
    tail: u32,
}

fn seal(kind: u32, address: usize) -> u32 {
    // Truncating a 64-bit address is fine here.
    MAGIC ^ kind.wrapping_mul(0x9e37_79b9) ^ (address as u32).rotate_left(7)
}

impl<T> Cell<T> {
    /// Makes an object in memory that is large enough. The previous contents do not matter, and are not dropped.
    ///
    /// The object is made on the stack and then moved, which takes its size in stack, once: the compiler does not
    /// construct it in place.
    ///
    /// # Safety
    /// `place` is aligned, valid for writing a `Cell<T>`, and no reference to it is alive.
    pub unsafe fn make(place: *mut Self, kind: u32, blob: Region, object: impl FnOnce() -> T) {
        let seal = seal(kind, place.addr());
        // SAFETY: by the caller's contract; each field is written and none is read. A reference to memory that may hold
        // anything is one to `MaybeUninit`.
        unsafe {
            (&mut *(&raw mut (*place).object).cast::<MaybeUninit<T>>()).write(object());
            (&raw mut (*place).blob).write(blob);
            (&raw mut (*place).tail).write(!seal);
            (&raw mut (*place).head).write(Head { seal, kind });
        }
    }

    /// A shared reference to the object of a handle.
    ///
    /// # Safety
    /// The handle is null or points at memory that can be read, at least as much as the object of its kind needs, and
    /// that nobody writes while the result is used. Whatever carries the seals of `kind` was made as a `Cell<T>`.
    pub unsafe fn of<'a>(handle: *const Self, kind: u32) -> StatusResult<&'a Self> {
        // SAFETY: by the caller's contract.
        unsafe { Self::check(handle, kind) }?;
        // SAFETY: both seals are intact: this is the object that `make` wrote, aligned as `kind_of` has checked; and
        // nobody writes it, by the caller's contract.
        Ok(unsafe { &*handle })
    }

    /// A mutable reference to the object of a handle.
    ///
    /// # Safety
    /// As for [`of`](Self::of), and no other reference to that memory is alive while the result is used.
    pub unsafe fn of_mut<'a>(handle: *mut Self, kind: u32) -> StatusResult<&'a mut Self> {
        // SAFETY: by the caller's contract.
        unsafe { Self::check(handle, kind) }?;
        // SAFETY: as in `of`, and nobody else refers to it, by the caller's contract.
        Ok(unsafe { &mut *handle })
    }

    /// Checks both seals.
    ///
    /// # Safety
    /// As for [`of`](Self::of).
    unsafe fn check(handle: *const Self, kind: u32) -> StatusResult {
        // SAFETY: by the caller's contract.
        let found = unsafe { kind_of(handle.cast()) }?;
        if found != kind {
            return Err(GestusStatus::Handle);
        }
        // SAFETY: `kind_of` has found the first seal, for this kind and this address, so the memory was made a
        // `Cell<T>` by `make` and is as long. The second seal shows whether the object was overwritten. It is
        // read through a pointer, since a reference may be made to intact memory only.
        let tail = unsafe { handle.cast::<u8>().add(offset_of!(Self, tail)).cast::<u32>().read() };
        if tail == !seal(kind, handle.addr()) { Ok(()) } else { Err(GestusStatus::Handle) }
    }

    /// The memory of the object.
    pub fn region(&self) -> StatusResult<Region> {
        Region::of(ptr::from_ref(self), 1)
    }
}

/// The kind of object that a handle points at.
///
/// # Safety
/// The handle is null or points at memory that can be read.
pub(crate) unsafe fn kind_of(handle: *const u64) -> StatusResult<u32> {
    Region::of(handle, 1)?;
    // SAFETY: not null, aligned to 8 as every `Cell` is, and readable by the caller's contract; two numbers have no
    // invalid bit patterns.
    let head = unsafe { handle.cast::<Head>().read() };
    if head.seal == seal(head.kind, handle.addr()) { Ok(head.kind) } else { Err(GestusStatus::Handle) }
}

/// Makes the handle of an intact object invalid.
///
/// # Safety
/// The handle is that of an intact object, which can be written, and no reference to the object is used any more.
pub(crate) unsafe fn close(handle: *mut u64) {
    let seal = handle.cast::<u32>();
    // SAFETY: by the caller's contract; the seal is the first field of every `Cell`.
    unsafe { seal.write(!seal.read()) };
}
