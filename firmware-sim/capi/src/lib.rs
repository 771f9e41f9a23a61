//! Gestus for C: gestus-core behind functions that take pointers.
//!
//! Everything happens in memory that the caller gives: ask for a size, give that many bytes, get a handle that lies in
//! them. Nothing is allocated, nothing is kept behind the caller's back, and nothing has to be released.
//!
//! ```text
//! gestus_database_open    blob in flash  --> GestusDatabase   in the caller's memory
//! gestus_stylizer_init    GestusDatabase --> GestusStylizer   in the caller's memory
//! gestus_stylizer_step    a pose         --> a pose and a report
//! ```
//!
//! Every function checks its pointers before it follows one: null, alignment, length against what is needed, and
//! overlap. What no library can check is said at each function: that a pointer which is neither null nor misaligned
//! points at memory of the length that it comes with.
//!
//! This crate is the one place in Gestus with `unsafe` code. It is small on purpose: [`memory`] turns pointers into
//! references, [`handle`] keeps what lies in the caller's memory recognisable, and the rest is safe but for the calls
//! of these two.
#![no_std]

// On a host the panic handler is that of `std`. It is never reached; a static library has to have one.
#[cfg(not(any(target_os = "none", target_os = "unknown")))]
extern crate std;

pub mod config;
pub mod database;
mod handle;
mod memory;
pub mod parameter;
pub mod pose;
mod profile;
pub mod settings;
pub mod status;
pub mod stylizer;

/// There is no panic to handle: `cargo xtask no-panic` links this library with a handler that exists nowhere.
#[cfg(all(feature = "panic-handler", target_os = "none"))]
#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    loop {
        core::hint::spin_loop();
    }
}
