//! Arm's MPS2 boards: Cortex-M4F (AN386, also for Armv6-M code), M7 (AN500), M33 (AN505, in the secure world).
#![no_std]
#![no_main]

use cortex_m_rt::entry;
#[cfg(feature = "defmt")]
use defmt_semihosting as _;
use gestus_core::{Config, link::buffer_length};
use gestus_firmware::{counter, flash, serve, stack, uart};

/// The M33's board has its ports at other addresses, and runs at 20 MHz instead of 25.
const AN505: bool = cfg!(an505);
const UART0: usize = if AN505 { 0x5020_0000 } else { 0x4000_4000 };
const TIMER0: usize = if AN505 { 0x5000_0000 } else { 0x4000_0000 };
const TICK_PS: u32 = if AN505 { 50_000 } else { 40_000 };
const BUFFER: usize = buffer_length(22);

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: these are the addresses of the board's first timer and its first UART, and nothing else in the image uses
    // them.
    let (counter, port) =
        unsafe { (counter::Cmsdk::<TIMER0, TICK_PS>::start(), uart::cmsdk::Cmsdk::new(UART0)) };
    serve::<_, 22, 40, 28, BUFFER>(port, counter, flash::blob(), Config::new())
}
