//! The UART of the nRF51. Its receive FIFO holds six bytes.

use super::Uart;
use crate::registers::Registers;

const START_RX: usize = 0x000;
const START_TX: usize = 0x008;
const RX_READY: usize = 0x108;
const TX_READY: usize = 0x11c;
const ENABLE: usize = 0x500;
const PIN_TX: usize = 0x50c;
const PIN_RX: usize = 0x514;
const RXD: usize = 0x518;
const TXD: usize = 0x51c;
const BAUD: usize = 0x524;
const ENABLED: u32 = 4;
const BAUD_115200: u32 = 0x01d7_e000;
/// Pins of the micro:bit's USB interface.
const TX_PIN: u32 = 24;
const RX_PIN: u32 = 25;

/// The nRF51's UART.
#[derive(Debug)]
pub struct Nrf51 {
    registers: Registers,
    sending: bool,
}

impl Nrf51 {
    /// Switches the port on.
    ///
    /// # Safety
    /// `base` is the address of the nRF51's UART, and nothing else uses it.
    pub unsafe fn new(base: usize) -> Self {
        // SAFETY: by the caller's contract; the offsets above are the device's.
        let registers = unsafe { Registers::new(base) };
        registers.write(PIN_TX, TX_PIN);
        registers.write(PIN_RX, RX_PIN);
        registers.write(BAUD, BAUD_115200);
        registers.write(ENABLE, ENABLED);
        registers.write(RX_READY, 0);
        registers.write(START_RX, 1);
        registers.write(START_TX, 1);
        Self { registers, sending: false }
    }
}

impl Uart for Nrf51 {
    fn read(&mut self) -> Option<u8> {
        if self.registers.read(RX_READY) == 0 {
            return None;
        }
        // The event occurs again if more bytes are waiting.
        self.registers.write(RX_READY, 0);
        Some(self.registers.read(RXD) as u8)
    }

    fn write(&mut self, byte: u8) {
        if self.sending {
            while self.registers.read(TX_READY) == 0 {}
        }
        self.registers.write(TX_READY, 0);
        self.registers.write(TXD, u32::from(byte));
        self.sending = true;
    }
}
