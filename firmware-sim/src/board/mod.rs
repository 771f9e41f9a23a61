//! Emulated boards: the firmware of `image/` in QEMU, a clip through it over the link, every bit compared with the
//! host, and what it costs there.
//!
//! [`boards`] lists them, [`image`] builds their firmware, [`emulator`] runs it, [`measure`] streams a clip and
//! counts, [`programs`] count by themselves, [`generated`] has databases for those who have none; [`command`] is `gestus-sim board`.

pub mod boards;
pub mod command;
pub mod emulator;
pub mod generated;
pub mod image;
pub mod measure;
pub mod programs;
