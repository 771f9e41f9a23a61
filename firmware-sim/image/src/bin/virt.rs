//! RISC-V `virt`, 32 bits, with and without FPU.
#![no_std]
#![no_main]

use gestus_core::{Config, link::buffer_length};
use gestus_firmware::{Desk, Room, counter::Retired, flash, serve, stack, uart::ns16550::Ns16550};
use riscv_rt::entry;

const UART0: usize = 0x1000_0000;
const BUFFER: usize = buffer_length(22);

static ROOM: Room<22, 40, 28> = Room::new();
static DESK: Desk<Retired, 22, 40, 28, BUFFER> = Desk::new();

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: this is the address of the board's UART, and nothing else in the image uses it.
    let port = unsafe { Ns16550::new(UART0) };
    serve(port, Retired, flash::blob(), &ROOM, &DESK, Config::new())
}
