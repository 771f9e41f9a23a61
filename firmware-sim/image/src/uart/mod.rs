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
