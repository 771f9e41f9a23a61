//! The core in a browser: a wasm module that exports the functions of the C interface.
//!
//! This crate adds nothing to them. The module exports its memory; JavaScript grows it and passes parts of it to the
//! functions, as a caller in C passes its own memory (`gestus.js`). So a page runs the same code as firmware in C.
#![no_std]

// Linking the crate exports its functions.
extern crate gestus;

/// Never called: see `cargo xtask no-panic`.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
