//! Serial ports: bytes in, bytes out, polled. What a new board has to write.

#[cfg(target_arch = "arm")]
pub mod cmsdk;
#[cfg(target_arch = "arm")]
pub mod nrf51;
#[cfg(target_arch = "riscv32")]
pub mod ns16550;

/// A serial port.
pub trait Uart {
    /// The next byte that has come, if one has.
    fn read(&mut self) -> Option<u8>;
    /// Sends a byte; waits where the port is busy.
    fn write(&mut self, byte: u8);
}

/// A block of device registers, a word each.
#[cfg(target_arch = "arm")]
#[derive(Debug)]
struct Registers {
    base: usize,
}

#[cfg(target_arch = "arm")]
impl Registers {
    /// # Safety
    /// `base` is the address of the device's registers, on a word boundary, and every offset read or written is one
    /// of a register of the device.
    const unsafe fn new(base: usize) -> Self {
        Self { base }
    }

    fn read(&self, offset: usize) -> u32 {
        // SAFETY: by the promise of `new` this is a register of the device; reads have no effect on memory.
        unsafe { ((self.base + offset) as *const u32).read_volatile() }
    }

    fn write(&self, offset: usize, value: u32) {
        // SAFETY: by the promise of `new` this is a register of the device, which masters no memory of ours.
        unsafe { ((self.base + offset) as *mut u32).write_volatile(value) }
    }
}
