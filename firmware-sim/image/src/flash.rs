//! The blob where external flash would be: an address that the linker script names. A robot's tables, or a recording, may
//! lie behind it.

use gestus_core::{blob, robot};

unsafe extern "C" {
    #[link_name = "_blob_start"]
    static START: u8;
    #[link_name = "_blob_window"]
    static WINDOW: u8;
}

/// What lies behind a blob begins on this boundary.
const BOUNDARY: usize = 16;

/// The whole window.
fn window() -> &'static [u8] {
    let (start, window) = (&raw const START, &raw const WINDOW as usize);
    // SAFETY: the linker script states that `window` bytes of memory lie at `start`. Nothing writes to them: they
    // are outside of the regions of code, data and stack, and the emulator fills them before the first
    // instruction. Every byte pattern is a `u8`.
    unsafe { core::slice::from_raw_parts(start, window) }
}

/// The bytes that are as long as the number at `total` says; all of them where it says more.
fn cut(bytes: &'static [u8], total: core::ops::Range<usize>) -> &'static [u8] {
    let length = bytes.get(total).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    bytes.get(..length as usize).unwrap_or(bytes)
}

/// The blob in the window, as long as its header says; what is no blob is cut to the window, for `Database::open` to
/// refuse.
pub fn blob() -> &'static [u8] {
    cut(window(), blob::layout::header::TOTAL)
}

/// What lies behind the blob, to the end of the window.
pub fn behind() -> &'static [u8] {
    window().get(blob().len().next_multiple_of(BOUNDARY)..).unwrap_or(&[])
}

/// The robot's tables behind the blob; for `Robot::open` to refuse where there are none.
pub fn robot() -> &'static [u8] {
    cut(behind(), robot::layout::header::TOTAL)
}
