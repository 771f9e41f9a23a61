//! Counters of executed instructions that are cheap to read.
//!
//! With `-icount` the emulator gives every instruction a fixed virtual time, so that a timer counts them. On a real
//! board the same timers count cycles.

#[cfg(target_arch = "arm")]
use core::sync::atomic::{AtomicU32, Ordering};

/// A counter of instructions, or of a multiple of them.
pub trait Counter {
    /// Ticks so far; wraps after [`RANGE`](Self::RANGE).
    fn now(&self) -> u32;
    /// Bit mask of the ticks, which is their largest value.
    const RANGE: u32;
    /// Instructions are ticks times the first number, divided by the second.
    const RATIO: (u32, u32);
    /// The ratio in lowest terms. The second number is then a power of 2 on every board, and a division is a shift.
    const LOWEST: (u32, u32) = lowest(Self::RATIO);

    /// Instructions of so many ticks.
    fn instructions(ticks: u64) -> u64 {
        const { assert!(Self::LOWEST.1.is_power_of_two(), "the division would need a library function") };
        let (more, less) = Self::LOWEST;
        ticks * u64::from(more) / u64::from(less)
    }

    /// Ticks from one reading to another, less than one wrap later.
    fn since(&self, start: u32, end: u32) -> u32 {
        end.wrapping_sub(start) & Self::RANGE
    }

    /// Calls a function that may take longer than one wrap. Returns its result and its ticks.
    #[inline(always)]
    fn during<R>(&self, what: impl FnOnce() -> R) -> (R, u32) {
        let start = self.now();
        let done = what();
        (done, self.since(start, self.now()))
    }
}

/// A ratio in lowest terms, by Euclid's algorithm.
const fn lowest((a, b): (u32, u32)) -> (u32, u32) {
    let (mut divisor, mut rest) = (a, b);
    while rest != 0 {
        (divisor, rest) = (rest, divisor % rest);
    }
    (a / divisor, b / divisor)
}

/// Cortex-M: SysTick, which counts down. With `-icount shift=6` an instruction takes 64 ns; `TICK_PS` is the timer's
/// tick in picoseconds.
#[cfg(target_arch = "arm")]
#[derive(Debug)]
pub struct SysTick<const TICK_PS: u32>;

#[cfg(target_arch = "arm")]
impl<const TICK_PS: u32> SysTick<TICK_PS> {
    /// Starts the timer.
    pub fn start(mut timer: cortex_m::peripheral::SYST) -> Self {
        timer.set_clock_source(cortex_m::peripheral::syst::SystClkSource::Core);
        timer.set_reload(0x00ff_ffff);
        timer.clear_current();
        timer.enable_counter();
        Self
    }
}

#[cfg(target_arch = "arm")]
impl<const TICK_PS: u32> Counter for SysTick<TICK_PS> {
    const RANGE: u32 = 0x00ff_ffff;
    const RATIO: (u32, u32) = (TICK_PS, 64_000);

    fn now(&self) -> u32 {
        !cortex_m::peripheral::SYST::get_current() & Self::RANGE
    }

    /// 24 bits are only 10 million instructions on some boards, so the timer's interrupt counts up to 256 wraps. It is
    /// enabled for this function only.
    #[inline(always)]
    fn during<R>(&self, what: impl FnOnce() -> R) -> (R, u32) {
        WRAPS.store(0, Ordering::Relaxed);
        // SAFETY: this image has no critical sections that an interrupt could violate; the timer's is the only
        // interrupt.
        let mut timer = unsafe { cortex_m::Peripherals::steal() }.SYST;
        timer.enable_interrupt();
        let start = self.now();
        let done = what();
        let end = self.now();
        timer.disable_interrupt();
        (done, (WRAPS.load(Ordering::Relaxed) << 24).wrapping_add(end).wrapping_sub(start))
    }
}

/// Wraps of the timer while its interrupt is on.
#[cfg(target_arch = "arm")]
static WRAPS: AtomicU32 = AtomicU32::new(0);

/// The timer has wrapped.
#[cfg(target_arch = "arm")]
#[cortex_m_rt::exception]
fn SysTick() {
    // A load and a store, since a Cortex-M0 has no atomic addition. Nothing else writes here.
    WRAPS.store(WRAPS.load(Ordering::Relaxed) + 1, Ordering::Relaxed);
}

/// The nRF51 has no SysTick: its first timer, 32 bits at 16 MHz. With `-icount shift=6` a tick is 62.5 ns.
#[cfg(target_arch = "arm")]
#[derive(Debug)]
pub struct Nrf51Timer(crate::registers::Registers);

#[cfg(target_arch = "arm")]
impl Nrf51Timer {
    const START: usize = 0x000;
    const CAPTURE: usize = 0x040;
    const WIDTH: usize = 0x508;
    const PRESCALER: usize = 0x510;
    const CAPTURED: usize = 0x540;
    const BITS_32: u32 = 3;

    /// Starts the timer.
    ///
    /// # Safety
    /// `base` is the address of the nRF51's `TIMER0`, and nothing else uses it.
    pub unsafe fn start(base: usize) -> Self {
        // SAFETY: by the caller's contract; the offsets above are the device's.
        let registers = unsafe { crate::registers::Registers::new(base) };
        registers.write(Self::WIDTH, Self::BITS_32);
        registers.write(Self::PRESCALER, 0);
        registers.write(Self::START, 1);
        Self(registers)
    }
}

#[cfg(target_arch = "arm")]
impl Counter for Nrf51Timer {
    const RANGE: u32 = u32::MAX;
    const RATIO: (u32, u32) = (62_500, 64_000);

    fn now(&self) -> u32 {
        self.0.write(Self::CAPTURE, 1);
        self.0.read(Self::CAPTURED)
    }
}

/// RISC-V: the counter of retired instructions, with `-icount shift=0`.
#[cfg(target_arch = "riscv32")]
#[derive(Debug)]
pub struct Retired;

#[cfg(target_arch = "riscv32")]
impl Counter for Retired {
    const RANGE: u32 = u32::MAX;
    const RATIO: (u32, u32) = (1, 1);

    fn now(&self) -> u32 {
        riscv::register::minstret::read() as u32
    }
}
