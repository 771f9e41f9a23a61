//! Counts the instructions of elementary functions and measures their errors: libm's, micromath's, and the core's own
//! sine and cosine.
//!
//! Prints a line `name instructions error error` for each function: the mean instructions of a call in hundredths (some
//! functions take only ten instructions), and the largest error against libm in f64 in billionths, absolute and
//! relative to the value; for `gestus-sim board m4f --functions`, and m0. A last line `bits digest` has the digest of
//! operations of all kinds of numbers, which is the host's.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use gestus_firmware::counter::Counter;
use gestus_float::trial;
use micromath::{F32, F32Ext};

/// Arguments of a function.
const CALLS: usize = 128;

#[cfg(microbit)]
type Time = gestus_firmware::counter::Nrf51Timer;
#[cfg(not(microbit))]
type Time = gestus_firmware::counter::Mps2Timer;

fn time() -> Time {
    // SAFETY: this is the board's first timer, at this address, and nothing else in the image uses it.
    #[cfg(microbit)]
    let timer = unsafe { Time::start(0x4000_8000) };
    #[cfg(not(microbit))]
    let timer = unsafe { Time::start() };
    timer
}

/// A function of two numbers; most ignore the second.
type Function = fn(f32, f32) -> f32;

fn nothing(x: f32, _: f32) -> f32 {
    x
}

/// Ticks of all calls, through a function pointer that the compiler can't inline.
fn ticks(counter: &Time, function: Function, arguments: &[(f32, f32); CALLS]) -> u32 {
    let function = black_box(function);
    let start = counter.now();
    for &(x, y) in arguments {
        black_box(function(black_box(x), black_box(y)));
    }
    counter.since(start, counter.now())
}

fn report(counter: &Time, name: &str, function: Function, exact: fn(f64, f64) -> f64, [low, high]: [f32; 2]) {
    let mut arguments = [(0.0, 0.0); CALLS];
    for (i, slot) in arguments.iter_mut().enumerate() {
        let part = (i as f32 + 0.5) / CALLS as f32;
        // The second argument is independent of the first, and never 0.
        *slot = (low + (high - low) * part, 0.3 + 2.0 * ((i * 37) % CALLS) as f32 / CALLS as f32);
    }
    let calls = ticks(counter, function, &arguments).saturating_sub(ticks(counter, nothing, &arguments));
    let (mut absolute, mut relative) = (0.0f64, 0.0f64);
    for &(x, y) in &arguments {
        let (found, exact) = (f64::from(function(x, y)), exact(f64::from(x), f64::from(y)));
        let off = if found > exact { found - exact } else { exact - found };
        let size = if exact < 0.0 { -exact } else { exact };
        absolute = if off > absolute { off } else { absolute };
        if size > 0.01 && off / size > relative {
            relative = off / size;
        }
    }
    let billionths = |error: f64| (error * 1e9) as u64;
    semihosting::println!(
        "{name} {} {} {}",
        Time::instructions(u64::from(calls)) * 100 / CALLS as u64,
        billionths(absolute),
        billionths(relative)
    );
}

#[entry]
fn main() -> ! {
    let counter = time();
    let half_turn = [-3.1, 3.1];
    let run = |name: &str, function: Function, exact, range| report(&counter, name, function, exact, range);
    run("sum", |x, y| x + y, |x, y| x + y, half_turn);
    run("product", |x, y| x * y, |x, y| x * y, half_turn);
    run("quotient", |x, y| x / y, |x, y| x / y, half_turn);
    run("sin.libm", |x, _| libm::sinf(x), |x, _| libm::sin(x), half_turn);
    run("sin.micromath", |x, _| F32(x).sin().0, |x, _| libm::sin(x), half_turn);
    run("cos.libm", |x, _| libm::cosf(x), |x, _| libm::cos(x), half_turn);
    run("cos.micromath", |x, _| F32(x).cos().0, |x, _| libm::cos(x), half_turn);
    // Sine and cosine together, as the core calls them.
    run("sin_cos.core", |x, _| gestus_core::math::sin_cos(x).0, |x, _| libm::sin(x), half_turn);
    run("sqrt.libm", |x, _| libm::sqrtf(x), |x, _| libm::sqrt(x), [0.01, 9.0]);
    run("sqrt.micromath", |x, _| F32(x).sqrt().0, |x, _| libm::sqrt(x), [0.01, 9.0]);
    run("exp.libm", |x, _| libm::expf(x), |x, _| libm::exp(x), [-8.0, 0.0]);
    run("exp.micromath", |x, _| F32(x).exp().0, |x, _| libm::exp(x), [-8.0, 0.0]);
    run("acos.libm", |x, _| libm::acosf(x), |x, _| libm::acos(x), [-1.0, 1.0]);
    run("acos.micromath", |x, _| x.acos(), |x, _| libm::acos(x), [-1.0, 1.0]);
    run("atan2.libm", libm::atan2f, libm::atan2, half_turn);
    run("atan2.micromath", |y, x| F32(y).atan2(F32(x)).0, libm::atan2, half_turn);
    run("pow.libm", libm::powf, libm::pow, [0.01, 3.0]);
    run("pow.micromath", |x, y| F32(x).powf(F32(y)).0, libm::pow, [0.01, 3.0]);
    semihosting::println!("bits {}", trial::digest(trial::PAIRS));
    semihosting::process::exit(0)
}
