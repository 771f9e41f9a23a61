//! What lies in the caller's memory: an object between two seals, so that a handle that is none is recognised.
//!
//! A seal is made of a number of ours, the kind of object and its own address. It finds memory that was never made
//! an object, was overwritten from either side, was closed, or was moved. It can't find everything: a handle is a
//! pointer, and one that points at no memory at all can't be looked at.

use core::{
    mem::{MaybeUninit, offset_of},
    ptr,
};

use crate::{
    memory::Region,
    status::{Answer, GestusStatus},
};

/// "Gest", read as a number.
const MAGIC: u32 = 0x4765_7374;

/// Kinds of objects. Those of stylizers are their profiles.
pub(crate) const DATABASE: u32 = 0x6462;

/// What every object starts with.
#[repr(C)]
struct Head {
    seal: u32,
    kind: u32,
}

/// An object in the caller's memory.
#[repr(C, align(8))]
pub(crate) struct Cell<T> {
    head: Head,
    /// The blob that the object reads: outputs must not lie in it.
    pub blob: Region,
    pub object: T,
    tail: u32,
}

fn seal(kind: u32, address: usize) -> u32 {
    // Which half of a wide address is lost does not matter.
    MAGIC ^ kind.wrapping_mul(0x9e37_79b9) ^ (address as u32).rotate_left(7)
}

impl<T> Cell<T> {
    /// Makes an object in memory that has room for it. What was there before does not matter, and is not dropped.
    ///
    /// The object is made on the way to its place, which takes as much stack as it is large, once and not twice: the
    /// compiler does not pass the place on to what makes it.
    ///
    /// # Safety
    /// `place` is aligned, valid for writing a `Cell<T>`, and no reference to it is alive.
    pub unsafe fn make(place: *mut Self, kind: u32, blob: Region, object: impl FnOnce() -> T) {
        let seal = seal(kind, place.addr());
        // SAFETY: the caller's word; each field is written and none is read. A reference to memory that may hold
        // anything is one to `MaybeUninit`.
        unsafe {
            (&mut *(&raw mut (*place).object).cast::<MaybeUninit<T>>()).write(object());
            (&raw mut (*place).blob).write(blob);
            (&raw mut (*place).tail).write(!seal);
            (&raw mut (*place).head).write(Head { seal, kind });
        }
    }

    /// The object of a handle, to read.
    ///
    /// # Safety
    /// The handle is null or points at memory that can be read, at least as much as the object of its kind needs, and
    /// that nobody writes as long as the answer is used. Whatever carries the seals of `kind` was made as a `Cell<T>`.
    pub unsafe fn of<'a>(handle: *const Self, kind: u32) -> Answer<&'a Self> {
        // SAFETY: the caller's word.
        unsafe { Self::check(handle, kind) }?;
        // SAFETY: both seals are whole: this is the object that `make` wrote, aligned as `kind_of` has checked; and
        // nobody writes it, by the caller's word.
        Ok(unsafe { &*handle })
    }

    /// The object of a handle, to change.
    ///
    /// # Safety
    /// As for [`of`](Self::of), and no other reference to that memory is alive as long as the answer is used.
    pub unsafe fn of_mut<'a>(handle: *mut Self, kind: u32) -> Answer<&'a mut Self> {
        // SAFETY: the caller's word.
        unsafe { Self::check(handle, kind) }?;
        // SAFETY: as in `of`, and nobody else refers to it, by the caller's word.
        Ok(unsafe { &mut *handle })
    }

    /// Looks at both seals.
    ///
    /// # Safety
    /// As for [`of`](Self::of).
    unsafe fn check(handle: *const Self, kind: u32) -> Answer {
        // SAFETY: the caller's word.
        let found = unsafe { kind_of(handle.cast()) }?;
        if found != kind {
            return Err(GestusStatus::Handle);
        }
        // SAFETY: `kind_of` has found the first seal, for this kind and this address, so the memory was made a
        // `Cell<T>` by `make` and is as long. The seal behind it tells whether what lies between was run over. It is
        // read through a pointer, since a reference may be made only of what is known to be whole.
        let tail = unsafe { handle.cast::<u8>().add(offset_of!(Self, tail)).cast::<u32>().read() };
        if tail == !seal(kind, handle.addr()) { Ok(()) } else { Err(GestusStatus::Handle) }
    }

    /// Makes the handle stale.
    pub fn close(&mut self) {
        self.head.seal = 0;
        self.tail = 0;
    }

    /// Where the object lies.
    pub fn region(&self) -> Answer<Region> {
        Region::of(ptr::from_ref(self), 1)
    }
}

/// The kind of object that a handle points at.
///
/// # Safety
/// The handle is null or points at memory that can be read.
pub(crate) unsafe fn kind_of(handle: *const u64) -> Answer<u32> {
    Region::of(handle, 1)?;
    // SAFETY: not null, aligned to 8 as every `Cell` is, and readable by the caller's word; two numbers have no
    // invalid patterns.
    let head = unsafe { handle.cast::<Head>().read() };
    if head.seal == seal(head.kind, handle.addr()) { Ok(head.kind) } else { Err(GestusStatus::Handle) }
}
