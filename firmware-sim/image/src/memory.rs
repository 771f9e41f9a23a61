//! Addresses from the runtime's linker script.

use core::ptr::addr_of_mut;

unsafe extern "C" {
    #[link_name = "__sdata"]
    static mut STATIC_START: u32;
    // End of the static data; the rest of the RAM is the stack.
    #[link_name = "__sheap"]
    static mut STATIC_END: u32;
    #[link_name = "_stack_start"]
    static mut STACK_TOP: u32;
}

/// First address after the static data, on a word boundary.
pub fn stack_floor() -> usize {
    (addr_of_mut!(STATIC_END) as usize).next_multiple_of(4)
}

/// First address above the stack.
pub fn stack_top() -> usize {
    addr_of_mut!(STACK_TOP) as usize
}

/// Bytes of RAM of static data, zero-initialised or not.
pub fn static_bytes() -> usize {
    stack_floor() - addr_of_mut!(STATIC_START) as usize
}
