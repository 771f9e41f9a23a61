//! The blob where external flash would be: an address that the linker script names.

use gestus_core::blob::layout::header;

unsafe extern "C" {
    #[link_name = "_blob_start"]
    static START: u8;
    #[link_name = "_blob_window"]
    static WINDOW: u8;
}

/// The blob in the window, as long as its header says; what is no blob is cut to the window, for `Database::open` to
/// refuse.
pub fn blob() -> &'static [u8] {
    let (start, window) = (&raw const START, &raw const WINDOW as usize);
    // SAFETY: the linker script states that `window` bytes of memory lie at `start`. Nothing writes to them: they
    // are outside of the regions of code, data and stack, and the emulator fills them before the first
    // instruction. Every byte pattern is a `u8`.
    let bytes = unsafe { core::slice::from_raw_parts(start, window) };
    let length = bytes.get(header::TOTAL).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes);
    bytes.get(..length as usize).unwrap_or(bytes)
}
