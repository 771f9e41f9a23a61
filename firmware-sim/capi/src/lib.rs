//! The C interface: gestus-core behind functions that take pointers.
//!
//! All objects are in memory that the caller provides: ask for a size, provide that many bytes, and get a handle that
//! points to them. Nothing is allocated, there is no hidden state, and nothing has to be released.
//!
//! ```text
//! gestus_database_open    blob in flash  --> GestusDatabase   in the caller's memory
//! gestus_stylizer_init    GestusDatabase --> GestusStylizer   in the caller's memory
//! gestus_stylizer_step    a pose         --> a pose and a report
//! gestus_step_many        the same of many stylizers
//! ```
//!
//! Every function checks its pointers before it dereferences one: null, alignment, length, and overlap. No library can
//! check that a pointer which is neither null nor misaligned points at memory of the stated length; the docs of each
//! function state this under "Safety".
//!
//! Apart from the firmware image and from tests, only this crate has blocks of `unsafe` code; `gestus-float` and
//! `gestus-page` need the word for the names of their exports. It is kept small: [`memory`] turns pointers into
//! references, [`handle`] recognises objects in the caller's memory, and the rest is safe except for calls to these two.
#![no_std]

// On a host the panic handler is that of `std`. It is never reached, but a static library has to have one.
#[cfg(not(any(target_os = "none", target_os = "unknown")))]
extern crate std;

pub mod config;
pub mod contents;
pub mod crowd;
pub mod database;
mod handle;
mod memory;
pub mod parameter;
pub mod pose;
mod profile;
pub mod settings;
pub mod status;
pub mod stylizer;

/// Never called: `cargo xtask no-panic` proves it by linking this library with an undefined handler.
#[cfg(all(feature = "panic-handler", target_os = "none"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
