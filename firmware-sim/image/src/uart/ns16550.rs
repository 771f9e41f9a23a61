//! The NS16550, as on RISC-V `virt`. Its FIFO holds 16 bytes.

use super::Uart;

const DATA: usize = 0;
const FIFO: usize = 2;
const LINE: usize = 3;
const STATUS: usize = 5;
const FIFO_ON: u8 = 1;
const EIGHT_BITS: u8 = 3;
const RECEIVED: u8 = 1;
const ROOM_TO_SEND: u8 = 1 << 5;

/// An NS16550 with registers of one byte each.
#[derive(Debug)]
pub struct Ns16550 {
    base: usize,
}

impl Ns16550 {
    /// Switches the port on.
    ///
    /// # Safety
    /// `base` is the address of an NS16550 that nothing else uses.
    pub unsafe fn new(base: usize) -> Self {
        let port = Self { base };
        port.set(FIFO, FIFO_ON);
        port.set(LINE, EIGHT_BITS);
        port
    }

    fn get(&self, register: usize) -> u8 {
        // SAFETY: by the contract of `new` this is a register of the device; reads have no effect on memory.
        unsafe { ((self.base + register) as *const u8).read_volatile() }
    }

    fn set(&self, register: usize, value: u8) {
        // SAFETY: as in `get`; the device does no DMA.
        unsafe { ((self.base + register) as *mut u8).write_volatile(value) }
    }
}

impl Uart for Ns16550 {
    fn read(&mut self) -> Option<u8> {
        (self.get(STATUS) & RECEIVED != 0).then(|| self.get(DATA))
    }

    fn write(&mut self, byte: u8) {
        while self.get(STATUS) & ROOM_TO_SEND == 0 {}
        self.set(DATA, byte);
    }
}
