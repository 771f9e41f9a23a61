//! The UART of Arm's Cortex-M System Design Kit, as on the MPS2 boards. Its buffers hold one byte.

use super::Uart;
use crate::registers::Registers;

const DATA: usize = 0x00;
const STATE: usize = 0x04;
const CONTROL: usize = 0x08;
const DIVIDER: usize = 0x10;
const TRANSMITTER_FULL: u32 = 1;
const RECEIVER_FULL: u32 = 2;
const ENABLE_BOTH: u32 = 3;

/// A CMSDK UART.
#[derive(Debug)]
pub struct Cmsdk(Registers);

impl Cmsdk {
    /// Switches the port on.
    ///
    /// # Safety
    /// `base` is the address of a CMSDK UART that nothing else uses.
    pub unsafe fn new(base: usize) -> Self {
        // SAFETY: by the caller's contract; the offsets above are the device's.
        let registers = unsafe { Registers::new(base) };
        // 25 MHz over 217: 115,200 baud.
        registers.write(DIVIDER, 217);
        registers.write(CONTROL, ENABLE_BOTH);
        Self(registers)
    }
}

impl Uart for Cmsdk {
    fn read(&mut self) -> Option<u8> {
        (self.0.read(STATE) & RECEIVER_FULL != 0).then(|| self.0.read(DATA) as u8)
    }

    fn write(&mut self, byte: u8) {
        while self.0.read(STATE) & TRANSMITTER_FULL != 0 {}
        self.0.write(DATA, u32::from(byte));
    }
}
