//! A proof by linking: this program links only if nothing that it calls can panic.
//!
//! The panic handler calls a function that does not exist. With `--gc-sections` the linker drops the handler if no panic
//! remains after optimisation, and fails if one does. The program is never run. Its arguments are unknown to the compiler,
//! so that it cannot optimise checks away.
//!
//! For the limits of this proof, see `docs/ARCHITECTURE.md`, "No panic".
#![no_std]
#![no_main]

mod capi_roots;
mod core_roots;
mod link_roots;
mod loop_roots;
mod robot_roots;

use core::{ffi::c_void, panic::PanicInfo};

/// Arguments that the compiler does not know.
#[repr(C)]
pub struct Outside {
    bytes: *const u8,
    length: usize,
    /// Numbers from which settings are made.
    numbers: [u32; 32],
    floats: [f32; 256],
    pointers: [*mut c_void; 8],
}

/// The root: it reaches everything that must not panic, and nothing else.
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

/// The negative control: an unchecked index.
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
    // SAFETY: the function does not exist: if this call remains, linking fails.
    unsafe { gestus_a_panic_can_be_reached() }
}

/// Keeps the location of every panic: file, line and column remain in the program as data.
#[cfg(feature = "places")]
#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    let place = core::ptr::from_ref(info).cast::<u8>();
    loop {
        // SAFETY: the reference is valid for reads; the read is volatile so that it is not optimised away.
        unsafe { place.read_volatile() };
        core::hint::black_box(info.location());
    }
}
