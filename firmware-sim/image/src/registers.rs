//! Device registers.

/// A block of device registers, a word each.
#[derive(Debug)]
pub(crate) struct Registers {
    base: usize,
}

impl Registers {
    /// # Safety
    /// `base` is the address of the device's registers, on a word boundary, and every offset read or written is one
    /// of a register of the device.
    pub const unsafe fn new(base: usize) -> Self {
        Self { base }
    }

    pub fn read(&self, offset: usize) -> u32 {
        // SAFETY: by the contract of `new` this is a register of the device; reads have no effect on memory.
        unsafe { ((self.base + offset) as *const u32).read_volatile() }
    }

    pub fn write(&self, offset: usize, value: u32) {
        // SAFETY: by the contract of `new` this is a register of the device, which does no DMA.
        unsafe { ((self.base + offset) as *mut u32).write_volatile(value) }
    }
}
