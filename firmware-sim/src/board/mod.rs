//! Emulated boards: streams a clip over the link through the firmware of `image/` in QEMU, compares every bit with the
//! host, and counts instructions and memory.
//!
//! [`boards`] lists the boards, [`image`] builds their firmware, [`emulator`] runs it, and [`measure`] streams a clip
//! and collects the counts. [`programs`] runs programs that count on their own, [`generated`] has databases of
//! generated motion, and [`command`] is `gestus-sim board`.

pub mod boards;
pub mod command;
pub mod emulator;
pub mod generated;
pub mod image;
pub mod measure;
pub mod programs;
