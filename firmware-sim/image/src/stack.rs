//! How much stack was used, by painting: fill what is free, run, see how far down the paint is gone.

use core::ptr::addr_of_mut;

const PAINT: u32 = 0x5aa5_c33c;
/// Below the stack pointer, for the frames of the painting itself.
const MARGIN: usize = 256;

#[cfg(target_arch = "arm")]
unsafe extern "C" {
    // End of the static data and start of the stack, from the runtime's linker script.
    #[link_name = "__sheap"]
    static mut FLOOR: u32;
    #[link_name = "_stack_start"]
    static mut TOP: u32;
}

#[cfg(target_arch = "riscv32")]
unsafe extern "C" {
    #[link_name = "__ebss"]
    static mut FLOOR: u32;
    #[link_name = "_stack_start"]
    static mut TOP: u32;
}

fn floor() -> usize {
    (addr_of_mut!(FLOOR) as usize).next_multiple_of(4)
}

/// An address within the caller's stack frame.
#[inline(always)]
fn here() -> usize {
    let local = 0u32;
    core::ptr::from_ref(core::hint::black_box(&local)) as usize & !3
}

/// Paints the free part of the stack.
#[inline(never)]
pub fn paint() {
    let end = here().saturating_sub(MARGIN);
    let mut at = floor();
    while at < end {
        // SAFETY: between the end of the static data and the stack pointer, less a margin for this function's
        // own frame, lies RAM that no Rust object lives in; there is no heap and no interrupt that pushes.
        unsafe { (at as *mut u32).write_volatile(PAINT) };
        at += 4;
    }
}

/// Bytes of stack that were ever used since [`paint`], from the top.
#[inline(never)]
pub fn used() -> usize {
    let (mut at, top) = (floor(), addr_of_mut!(TOP) as usize);
    // SAFETY: as in `paint`; these are words of RAM, read as plain numbers.
    while at < top && unsafe { (at as *const u32).read_volatile() } == PAINT {
        at += 4;
    }
    top - at
}

/// Bytes of stack in use right now.
#[inline(always)]
pub fn depth() -> usize {
    addr_of_mut!(TOP) as usize - here()
}
