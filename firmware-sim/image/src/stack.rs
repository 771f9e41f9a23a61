//! How much stack was used, by painting: fill what is free, run, see how far down the paint is gone.

use crate::memory::{stack_floor, stack_top};

const PAINT: u32 = 0x5aa5_c33c;
/// Left free below the painting's own frame.
const MARGIN: usize = 64;

/// An address within the frame of the function that this is inlined into.
#[inline(always)]
fn here() -> usize {
    let local = 0u32;
    core::ptr::from_ref(core::hint::black_box(&local)) as usize & !3
}

/// Paints the free part of the stack.
#[inline(never)]
pub fn paint() {
    let end = here().saturating_sub(MARGIN);
    let mut at = stack_floor();
    while at < end {
        // SAFETY: from the end of the static data to the stack pointer, less a margin for this function's own
        // frame, lies RAM that no Rust object lives in: there is no heap, and no interrupt that pushes.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
}

/// Bytes of stack that were ever used since [`paint`], from the top.
#[inline(never)]
pub fn used() -> usize {
    let (mut at, top) = (stack_floor(), stack_top());
    // SAFETY: these are words of RAM between the static data and the top of the stack, read as plain numbers.
    while at < top && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    top - at
}
