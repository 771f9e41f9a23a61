//! What `gestus translate` does, as a wasm module: clips are read, retargeted, streamed through the core and written by
//! the same code, so a page computes the digest of the command.
//!
//! JavaScript and the module exchange two buffers, `text` (JSON) and `data` (bytes): a caller sets their lengths, writes
//! into the module's memory, and calls one of the functions of [`call`], which leaves its answer in the same buffers. The
//! module imports nothing.

mod settings;
mod work;

use std::cell::RefCell;

use work::Page;

thread_local! {
    static PAGE: RefCell<Page> = RefCell::default();
}

/// Makes the text that long; returns where it is.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn text(length: usize) -> *mut u8 {
    PAGE.with_borrow_mut(|page| fit(&mut page.text, length))
}

/// Makes the data that long; returns where it is.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn data(length: usize) -> *mut u8 {
    PAGE.with_borrow_mut(|page| fit(&mut page.data, length))
}

/// Where the text is.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn text_at() -> *const u8 {
    PAGE.with_borrow(|page| page.text.as_ptr())
}

/// Length of the text.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn text_length() -> usize {
    PAGE.with_borrow(|page| page.text.len())
}

/// Where the data is.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn data_at() -> *const u8 {
    PAGE.with_borrow(|page| page.data.as_ptr())
}

/// Length of the data.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn data_length() -> usize {
    PAGE.with_borrow(|page| page.data.len())
}

/// Calls a function by its number: 0 [`Page::database`], 1 [`Page::clip`], 2 [`Page::animation`], 3 [`Page::translate`],
/// 4 [`Page::file`], 5 [`Page::unpacked`]. Returns 0, or 1 where it failed and the text is the message.
#[allow(unsafe_code, reason = "the name of an export")]
#[unsafe(no_mangle)]
pub extern "C" fn call(function: u32) -> u32 {
    PAGE.with_borrow_mut(|page| {
        let answer = match function {
            0 => page.database(),
            1 => page.clip(),
            2 => page.animation(),
            3 => page.translate(),
            4 => page.file(),
            5 => page.unpacked(),
            _ => Err(anyhow::anyhow!("the module has no function {function}")),
        };
        let failed = answer.is_err();
        page.text = match answer {
            Ok(json) => json.to_string(),
            Err(error) => format!("{error:#}"),
        }
        .into_bytes();
        u32::from(failed)
    })
}

fn fit(buffer: &mut Vec<u8>, length: usize) -> *mut u8 {
    buffer.clear();
    buffer.resize(length, 0);
    buffer.as_mut_ptr()
}
