//! Serial ports, polled byte by byte. A new board implements [`Uart`].

#[cfg(target_arch = "arm")]
pub mod cmsdk;
#[cfg(target_arch = "arm")]
pub mod nrf51;
#[cfg(target_arch = "riscv32")]
pub mod ns16550;

/// A serial port.
pub trait Uart {
    /// The next received byte, if there is one.
    fn read(&mut self) -> Option<u8>;
    /// Sends a byte; waits while the port is busy.
    fn write(&mut self, byte: u8);
}
