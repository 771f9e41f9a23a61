//! The flash window: the memory from the linker script's address on, in place of external flash. It holds the blob, and
//! after it a robot's tables or a recording.

use gestus_core::{blob, robot};

unsafe extern "C" {
    #[link_name = "_blob_start"]
    static START: u8;
    #[link_name = "_blob_window"]
    static WINDOW: u8;
}

/// The whole window.
fn window() -> &'static [u8] {
    let (start, window) = (&raw const START, &raw const WINDOW as usize);
    // SAFETY: the linker script states that `window` bytes of memory lie at `start`. Nothing writes to them: they
    // are outside of the regions of code, data and stack, and the emulator fills them before the first
    // instruction. Every byte pattern is a `u8`.
    unsafe { core::slice::from_raw_parts(start, window) }
}

/// The first bytes, as many as the header's number at `total` says; all of them if it says more.
fn declared(bytes: &'static [u8], total: core::ops::Range<usize>) -> &'static [u8] {
    let length = bytes.get(total).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    bytes.get(..length as usize).unwrap_or(bytes)
}

/// The blob in the window, as long as its header says. Bytes that are not a blob are limited to the window;
/// `Database::open` refuses them.
pub fn blob() -> &'static [u8] {
    declared(window(), blob::layout::header::TOTAL)
}

/// The data after the blob, up to the end of the window.
pub fn after_blob() -> &'static [u8] {
    window().get(blob().len().next_multiple_of(blob::layout::ALIGNMENT)..).unwrap_or(&[])
}

/// The robot's tables after the blob. `Robot::open` refuses other bytes.
pub fn robot() -> &'static [u8] {
    declared(after_blob(), robot::layout::header::TOTAL)
}
