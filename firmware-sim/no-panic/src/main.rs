//! A proof by linking: this program links only if nothing that it calls can panic.
//!
//! The panic handler calls a function that exists nowhere. The linker, told to drop what nobody reaches
//! (`--gc-sections`), drops the handler where no panic is left after optimisation, and fails where one is. The
//! program is never run; its arguments come from outside, so that the compiler can conclude nothing from them.
//!
//! What is a proof here and what is not: `docs/ARCHITECTURE.md`, "No panic".
#![no_std]
#![no_main]

mod capi_roots;
mod core_roots;
mod link_roots;
mod loop_roots;
mod robot_roots;

use core::{ffi::c_void, panic::PanicInfo};

/// What comes from outside.
#[repr(C)]
pub struct Outside {
    bytes: *const u8,
    length: usize,
    /// Numbers that settings are made of.
    numbers: [u32; 32],
    floats: [f32; 256],
    pointers: [*mut c_void; 8],
}

/// The root: everything that has to be free of panics is reached from here, and nothing else.
///
/// # Safety
/// Never called.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn _start(outside: *const Outside, sink: *mut u32) {
    // SAFETY: linked, never run.
    let (outside, blob) = unsafe {
        let outside = &*outside;
        (outside, core::slice::from_raw_parts(outside.bytes, outside.length))
    };
    let mut result = core_roots::reach(blob, &outside.numbers, &outside.floats);
    result ^= link_roots::reach(blob, &outside.numbers);
    result ^= loop_roots::reach(&outside.numbers, &outside.floats);
    result ^= robot_roots::reach(blob, &outside.numbers, &outside.floats);
    // SAFETY: as above.
    result ^= unsafe { capi_roots::reach(outside) };
    // SAFETY: as above.
    unsafe { sink.write_volatile(result) };
    #[cfg(feature = "control")]
    control(outside, sink);
}

/// The negative control: an index that nobody has checked.
#[cfg(feature = "control")]
#[inline(never)]
fn control(outside: &Outside, sink: *mut u32) {
    // SAFETY: linked, never run.
    unsafe { sink.write_volatile(outside.numbers[outside.length]) };
}

#[cfg(not(feature = "places"))]
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn gestus_a_panic_can_be_reached() -> !;
    }
    // SAFETY: there is no such function: where this call is kept, nothing is linked.
    unsafe { gestus_a_panic_can_be_reached() }
}

/// Keeps the place of every panic: its file, line and column stay in the program as data.
#[cfg(feature = "places")]
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let place = core::ptr::from_ref(info).cast::<u8>();
    loop {
        // SAFETY: the info is there to be read; volatile, so that it is kept.
        unsafe { place.read_volatile() };
        core::hint::black_box(info.location());
    }
}
