//! RISC-V `virt`, 32 bits, with and without FPU.
#![no_std]
#![no_main]

use gestus_core::{Config, link::buffer_length};
use gestus_firmware::{counter::Retired, flash, serve, stack, uart::ns16550::Ns16550};
use riscv_rt::entry;

const UART0: usize = 0x1000_0000;
const BUFFER: usize = buffer_length(22);

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: this is the address of the board's UART, and nothing else in the image uses it.
    let port = unsafe { Ns16550::new(UART0) };
    serve::<_, 22, 40, 28, BUFFER>(port, Retired, flash::blob(), Config::new())
}
