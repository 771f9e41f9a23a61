//! Pointers from C: checks all that can be checked without dereferencing them, and then dereferences them.

use core::{
    ffi::c_char,
    mem::{align_of, size_of},
    ptr, slice,
};

use crate::status::{GestusStatus, StatusResult};

/// Types for which every bit pattern is a value, so that any memory that C has written may be read.
///
/// # Safety
/// Only for such types.
pub(crate) unsafe trait Plain: Copy {}

// SAFETY: numbers have no invalid bit patterns.
unsafe impl Plain for u8 {}
// SAFETY: as above.
unsafe impl Plain for u16 {}
// SAFETY: as above.
unsafe impl Plain for u32 {}
// SAFETY: as above.
unsafe impl Plain for f32 {}
// SAFETY: an array of plain values has no padding.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {}

/// The range of addresses of an argument or a handle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Region {
    start: usize,
    bytes: usize,
}

impl Region {
    /// The region of an array, which has to be not null, aligned, and inside the address space.
    pub fn of<T>(pointer: *const T, count: usize) -> StatusResult<Self> {
        Self::aligned(pointer.addr(), align_of::<T>(), count.checked_mul(size_of::<T>()))
    }

    /// The region of memory for an object: the first `need` bytes, which have to be there.
    pub fn memory(pointer: *const u8, bytes: usize, need: usize, alignment: usize) -> StatusResult<Self> {
        let given = Self::aligned(pointer.addr(), alignment, Some(bytes))?;
        if bytes < need { Err(GestusStatus::Short) } else { Ok(Self { bytes: need, ..given }) }
    }

    fn aligned(start: usize, alignment: usize, bytes: Option<usize>) -> StatusResult<Self> {
        if start == 0 {
            return Err(GestusStatus::Null);
        }
        // Alignments are powers of two.
        if start & alignment.wrapping_sub(1) != 0 {
            return Err(GestusStatus::Misaligned);
        }
        match bytes {
            // No object is larger than half of the address space, or wraps around its end.
            Some(bytes) if bytes <= isize::MAX as usize && start.checked_add(bytes).is_some() => {
                Ok(Self { start, bytes })
            }
            _ => Err(GestusStatus::Short),
        }
    }

    fn overlaps(self, other: Self) -> bool {
        // Ends do not overflow: `aligned` has checked it.
        self.start < other.start.saturating_add(other.bytes)
            && other.start < self.start.saturating_add(self.bytes)
    }
}

/// Refuses regions that share a byte.
pub(crate) fn disjoint<const N: usize>(regions: [Region; N]) -> StatusResult {
    for (i, &one) in regions.iter().enumerate() {
        if regions.iter().skip(i + 1).any(|&other| one.overlaps(other)) {
            return Err(GestusStatus::Overlap);
        }
    }
    Ok(())
}

/// A slice of an array from C, after the checks of [`Region::of`].
///
/// # Safety
/// `pointer` points at `count` values that nobody writes as long as the slice is used.
pub(crate) unsafe fn slice<'a, T: Plain>(pointer: *const T, count: usize) -> StatusResult<&'a [T]> {
    Region::of(pointer, count)?;
    // SAFETY: not null, aligned and not too long, by the line above; there, initialised by its owner and not
    // written meanwhile, by the caller's contract; and `Plain` has no invalid bit patterns.
    Ok(unsafe { slice::from_raw_parts(pointer, count) })
}

/// Copies values to memory of C, after the checks of [`Region::of`].
///
/// # Safety
/// `pointer` points at memory for as many values, and no reference to it is alive.
pub(crate) unsafe fn put<T>(pointer: *mut T, values: &[T]) -> StatusResult
where
    T: Copy,
{
    Region::of(pointer, values.len())?;
    // SAFETY: the target is valid for writes by the caller's contract, aligned by the line above, and no part of
    // `values`, which is a reference that is alive.
    unsafe { ptr::copy_nonoverlapping(values.as_ptr(), pointer, values.len()) };
    Ok(())
}

/// Most bytes of a name, with the zero that ends it.
pub const GESTUS_NAME_BYTES: usize = 256;

/// A string from C.
///
/// # Safety
/// `pointer` points at bytes that can be read up to and with the first zero, or [`GESTUS_NAME_BYTES`] of them, and that
/// nobody writes as long as the text is used.
pub(crate) unsafe fn text<'a>(pointer: *const c_char) -> StatusResult<&'a str> {
    if pointer.is_null() {
        return Err(GestusStatus::Null);
    }
    let mut length = 0;
    // SAFETY: no byte before this one was zero, so the string extends to here.
    while unsafe { pointer.add(length).read() } != 0 {
        length += 1;
        if length == GESTUS_NAME_BYTES {
            return Err(GestusStatus::Text);
        }
    }
    // SAFETY: `length` bytes were just read.
    let bytes = unsafe { slice(pointer.cast::<u8>(), length) }?;
    core::str::from_utf8(bytes).map_err(|_| GestusStatus::Text)
}
