//! Shared by the boards: opens a database, makes a stylizer, and serves a host over a serial port.
//!
//! A board's binary calls [`serve`] with its port and counter. [`serve`] never returns, and keeps stylizer and server
//! as locals, which are constructed in place. (To put them in a `static` would copy them, and the copy would have to
//! fit the stack.)
#![no_std]

pub mod board;
pub mod counter;
#[cfg(not(microbit))]
pub mod flash;
pub mod log;
pub mod memory;
#[cfg(target_arch = "arm")]
mod registers;
pub mod stack;
pub mod stages;
pub mod uart;
#[cfg(target_arch = "arm")]
mod vectors;

use board::Firmware;
use counter::Counter;
use gestus_core::{
    BlobError, Config, Database, Fit, Method,
    link::{Board, Server},
};
use uart::Uart;

/// Exit codes of an image, for the emulator.
pub mod exit {
    /// The database can't be opened.
    pub const DATABASE: i32 = 2;
    /// The database does not fit the stylizer's capacities.
    pub const CAPACITY: i32 = 3;
    /// No robot's tables after the database, or tables made for another database.
    pub const ROBOT: i32 = 4;
    /// A panic.
    pub const PANIC: i32 = 101;
}

/// Opens the database and serves it over the port, forever. Ends the emulation if the database is invalid or does not
/// fit.
pub fn serve<T: Counter, const J: usize, const K: usize, const C: usize, const N: usize>(
    mut port: impl Uart,
    counter: T,
    blob: &'static [u8],
    config: Config,
) -> ! {
    let (fit, open) = prepare::<T, J, K, C>(&counter, blob, config);
    let mut stylizer = fit.stylizer();
    let state = size_of_val(&stylizer) + size_of::<Server<'_, '_, Firmware<T>, J, K, C, N>>();
    let board = Firmware::new(counter, open, state);
    #[cfg(all(feature = "robot", not(microbit)))]
    let board = with_robot(board, stylizer.database());
    let mut server = Server::<_, J, K, C, N>::new(&mut stylizer, board);
    loop {
        let Some(byte) = port.read() else { continue };
        for &byte in receive(&mut server, byte).unwrap_or(&[]) {
            port.write(byte);
        }
    }
}

// Separate functions that are not inlined, so that each one's stack frame is free while another runs.

/// Opens the database and checks it against the capacities; ends the emulation if it fails.
#[inline(never)]
fn prepare<T: Counter, const J: usize, const K: usize, const C: usize>(
    counter: &T,
    blob: &'static [u8],
    config: Config,
) -> (Fit<'static, J, K, C>, u32) {
    let start = counter.now();
    let opened = open(blob);
    let open = counter.since(start, counter.now());
    let database = match opened {
        Ok(database) => database,
        Err(error) => {
            log::refused(error);
            end(exit::DATABASE, c"gestus: the database can't be opened: is it at the address in README.md, and of this version?\n")
        }
    };
    log::opened(database.counts().frames, database.counts().classes, T::instructions(u64::from(open)));
    // A blob that was cut to its models starts with the first method that it supports; the host may choose another.
    match Fit::<J, K, C>::new(database, config.method(Method::of(&database))) {
        Ok(fit) => (fit, open),
        Err(error) => {
            log::unfit(error);
            end(
                exit::CAPACITY,
                c"gestus: the database has more joints or classes than this image has room for\n",
            )
        }
    }
}

/// Capacity of the image for a robot's hinges.
pub const HINGES: usize = 32;

/// Adds to the board the robot whose tables follow the database; ends the emulation if there are none.
#[cfg(all(feature = "robot", not(microbit)))]
fn with_robot<B>(board: B, database: &Database<'_>) -> gestus_core::link::Driver<'static, B, HINGES> {
    use gestus_core::{link::Driver, robot::Robot};
    let driver = Robot::open(flash::robot()).ok().and_then(|robot| Driver::new(board, robot, database).ok());
    driver.unwrap_or_else(|| end(exit::ROBOT, c"gestus: no robot's tables of this database follow it\n"))
}

/// Prints why the image ends, for a person who has started the emulator by hand, and ends the emulation.
#[cold]
fn end(code: i32, why: &core::ffi::CStr) -> ! {
    // With the log on, this channel carries its frames.
    #[cfg(not(feature = "defmt"))]
    semihosting::sys::arm_compat::sys_write0(why);
    #[cfg(feature = "defmt")]
    let _ = why;
    semihosting::process::exit(code)
}

#[inline(never)]
fn open(blob: &'static [u8]) -> Result<Database<'static>, BlobError> {
    Database::open(blob)
}

#[inline(never)]
fn receive<'s, B: Board<J>, const J: usize, const K: usize, const C: usize, const N: usize>(
    server: &'s mut Server<'_, '_, B, J, K, C, N>,
    byte: u8,
) -> Option<&'s [u8]> {
    server.receive(byte)
}

/// Ends the image in a panic. The core has none.
#[panic_handler]
fn panic(_info: &core::panic::PanicInfo<'_>) -> ! {
    #[cfg(feature = "defmt")]
    defmt::error!("{}", defmt::Display2Format(_info));
    semihosting::process::exit(exit::PANIC)
}
