//! Counters of executed instructions that are cheap to read.
//!
//! With `-icount` the emulator gives every instruction a fixed virtual time, so that a timer counts them. On a real
//! board the same timers count cycles.

#[cfg(target_arch = "arm")]
use crate::registers::Registers;

/// A counter of instructions, or of a multiple of them.
pub trait Counter {
    /// Ticks so far; wraps after 2³².
    fn now(&self) -> u32;
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
        end.wrapping_sub(start)
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

/// The first CMSDK timer of Arm's MPS2 boards, 32 bits, which counts down at the system's clock. SysTick has 24 bits,
/// which a frame without an FPU exceeds. `BASE` is the timer's address; a constant saves a register in every stage. With
/// `-icount shift=6` an instruction takes 64 ns; `TICK_PS` is the timer's tick in picoseconds.
#[cfg(target_arch = "arm")]
#[derive(Debug)]
pub struct Cmsdk<const BASE: usize, const TICK_PS: u32>(());

/// The timer of the boards that run at 25 MHz.
#[cfg(target_arch = "arm")]
pub type Mps2Timer = Cmsdk<0x4000_0000, 40_000>;

#[cfg(target_arch = "arm")]
impl<const BASE: usize, const TICK_PS: u32> Cmsdk<BASE, TICK_PS> {
    const CONTROL: usize = 0x0;
    const VALUE: usize = 0x4;
    const RELOAD: usize = 0x8;
    const ENABLE: u32 = 1;
    // SAFETY: by the contract of `start`; the offsets above are the device's.
    const REGISTERS: Registers = unsafe { Registers::new(BASE) };

    /// Starts the timer.
    ///
    /// # Safety
    /// `BASE` is the address of a CMSDK timer, and nothing else uses it.
    pub unsafe fn start() -> Self {
        Self::REGISTERS.write(Self::RELOAD, u32::MAX);
        Self::REGISTERS.write(Self::VALUE, u32::MAX);
        Self::REGISTERS.write(Self::CONTROL, Self::ENABLE);
        Self(())
    }
}

#[cfg(target_arch = "arm")]
impl<const BASE: usize, const TICK_PS: u32> Counter for Cmsdk<BASE, TICK_PS> {
    const RATIO: (u32, u32) = (TICK_PS, 64_000);

    fn now(&self) -> u32 {
        !Self::REGISTERS.read(Self::VALUE)
    }
}

/// The nRF51's first timer, 32 bits at 16 MHz. With `-icount shift=6` a tick is 62.5 ns.
#[cfg(target_arch = "arm")]
#[derive(Debug)]
pub struct Nrf51Timer(Registers);

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
        let registers = unsafe { Registers::new(base) };
        registers.write(Self::WIDTH, Self::BITS_32);
        registers.write(Self::PRESCALER, 0);
        registers.write(Self::START, 1);
        Self(registers)
    }
}

#[cfg(target_arch = "arm")]
impl Counter for Nrf51Timer {
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
    const RATIO: (u32, u32) = (1, 1);

    fn now(&self) -> u32 {
        riscv::register::minstret::read() as u32
    }
}
