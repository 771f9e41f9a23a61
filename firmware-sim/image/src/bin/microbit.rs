//! The BBC micro:bit: a Cortex-M0 with 16 KB of RAM and no FPU. Its database is part of the image.
//!
//! Capacities of the small profile: 9 joints, 16 neighbors, 6 classes. `docs/PORTING.md` says how they are chosen.
#![no_std]
#![no_main]

use cortex_m_rt::entry;
#[cfg(feature = "defmt")]
use defmt_semihosting as _;
use gestus_core::{Config, link::buffer_length};
use gestus_firmware::{counter::Nrf51Timer, serve, stack, uart::nrf51::Nrf51};

const JOINTS: usize = 9;
const NEIGHBORS: usize = 16;
const CLASSES: usize = 6;
const BUFFER: usize = buffer_length(JOINTS);
const UART0: usize = 0x4000_2000;
const TIMER0: usize = 0x4000_8000;

static BLOB: &[u8] = include_bytes!(env!("GESTUS_BLOB"));

#[entry]
fn main() -> ! {
    stack::paint();
    // SAFETY: these are the addresses of the chip's first timer and its UART, and nothing else in the image uses
    // them.
    let (counter, port) = unsafe { (Nrf51Timer::start(TIMER0), Nrf51::new(UART0)) };
    let config = Config::new().k(NEIGHBORS as u16).pool(24);
    serve::<_, JOINTS, NEIGHBORS, CLASSES, BUFFER>(port, counter, BLOB, config)
}
