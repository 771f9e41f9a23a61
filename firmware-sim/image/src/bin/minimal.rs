//! The smallest firmware with the reference's capacities, to measure its code size. It opens a database, makes a
//! stylizer and steps one pose after another, whose places the compiler does not know, so that no code is optimised away.
//! No link, no counters.
#![no_std]
#![no_main]

use core::{
    hint::black_box,
    mem::MaybeUninit,
    ptr::{addr_of, addr_of_mut},
};

use cortex_m_rt::entry;
use gestus_core::{Config, Database, Fit, Method, Pose, Stylizer};
use gestus_firmware::{exit, flash};

const JOINTS: usize = 22;

/// The initial value: all zeros, so that it takes no flash.
const NOTHING: Pose<JOINTS> = Pose { position: [0.0; 3], rotations: [[0.0; 4]; JOINTS] };

static mut INPUT: Pose<JOINTS> = NOTHING;
static mut OUTPUT: Pose<JOINTS> = NOTHING;
static mut STYLE: u16 = 0;
static mut STYLIZER: MaybeUninit<Stylizer<'static, JOINTS, 40, 28>> = MaybeUninit::uninit();

#[entry]
fn main() -> ! {
    let Ok(database) = Database::open(flash::blob()) else { semihosting::process::exit(exit::DATABASE) };
    let Ok(fit) = Fit::new(database, Config::new().method(Method::of(&database))) else {
        semihosting::process::exit(exit::CAPACITY)
    };
    // SAFETY: the program has one thread, which takes this reference once.
    let stylizer = unsafe { (*addr_of_mut!(STYLIZER)).write(fit.stylizer()) };
    // SAFETY: a static of this program; volatile, so that the compiler does not know its value.
    let _ = stylizer.set_style(&[(unsafe { addr_of!(STYLE).read_volatile() }, 1.0)]);
    // SAFETY: as above.
    let (mut input, mut output) = unsafe { (&*addr_of!(INPUT), &mut *addr_of_mut!(OUTPUT)) };
    loop {
        (input, output) = black_box((input, output));
        let _ = stylizer.step(input, output);
    }
}
