//! Measures the stack by painting: fills the free stack with a pattern, and later looks how much of it is overwritten.

use crate::memory::{stack_floor, stack_top};

const PAINT: u32 = 0x5aa5_c33c;
/// Bytes left unpainted below the frame of `paint`.
const MARGIN: usize = 64;

/// An address in the stack frame of the calling function, into which this is inlined.
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
        // SAFETY: the RAM from the end of the static data to the stack pointer, less a margin for this function's own
        // frame, holds no Rust object: there is no heap, and no interrupt that uses the stack.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
}

/// Most bytes of stack in use at any time since [`paint`].
#[inline(never)]
pub fn used() -> usize {
    let (mut at, top) = (stack_floor(), stack_top());
    // SAFETY: these are words of RAM between the static data and the top of the stack, read as plain numbers.
    while at < top && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    top - at
}
