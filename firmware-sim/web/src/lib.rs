//! The core in a browser: the functions of the C interface as the exports of a wasm module.
//!
//! There is nothing here but the module: memory is the module's own, exported, and JavaScript grows it and hands pieces
//! of it to the functions, as a caller in C would with memory of its own (`gestus.js`). So the page runs what firmware
//! that is written in C runs.
#![no_std]

// What it exports, it exports by being linked.
extern crate gestus;

/// There is no panic to handle: see `cargo xtask no-panic`.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    core::arch::wasm32::unreachable()
}
