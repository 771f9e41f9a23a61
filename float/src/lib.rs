//! Sums, products, quotients and comparisons of `f32` for processors without an FPU, with the same bits as the
//! compiler's routines, in half of the instructions.
//!
//! Without an FPU the compiler calls a routine for every operation of a float, and its own ones are generic. A program that
//! names this crate (`use gestus_float as _;`, or the feature `soft-float` of gestus-core) takes the routines from here,
//! everywhere and with the same results: those of the compiler are weak symbols. A linker that finds two says so: leave
//! this crate out where a HAL brings its own.
//!
//! | routine | Armv6-M and up, in assembly | RISC-V, in Rust |
//! |---|---|---|
//! | `a + b`, `a - b` | `__aeabi_fadd`, `__aeabi_fsub` | `__addsf3`, `__subsf3` |
//! | `a · b` | `__aeabi_fmul` | `__mulsf3` |
//! | `a / b` | `__aeabi_fdiv`, in Rust | `__divsf3` |
//! | `a < b` and the like | `__aeabi_fcmplt`, `fcmple`, `fcmpgt`, `fcmpge`, `fcmpun` | |
//! | product of whole numbers of 64 bits | `__aeabi_lmul` | |
//! | leading zeros | `__clzsi2` | |
//!
//! On other processors nothing is replaced. Results are rounded to the nearest, of two as near to the even one; numbers
//! below 2^-126 are kept. A NaN is a quiet one without a payload.
#![cfg_attr(not(test), no_std)]

pub mod arithmetic;
pub mod fixed;
mod round;
pub mod trial;

// The names are those that the compiler calls: nothing else may define them, and what they do is what it expects.
#[cfg(all(target_arch = "arm", target_abi = "eabi"))]
mod thumb {
    use crate::{arithmetic, round};

    core::arch::global_asm!(include_str!("thumb.s"), options(raw));

    #[unsafe(no_mangle)]
    extern "aapcs" fn __aeabi_fdiv(a: u32, b: u32) -> u32 {
        arithmetic::divide(a, b)
    }

    #[unsafe(no_mangle)]
    extern "aapcs" fn gestus_float_add_rare(a: u32, b: u32) -> u32 {
        arithmetic::add_rare(a, b)
    }

    #[unsafe(no_mangle)]
    extern "aapcs" fn gestus_float_multiply_rare(a: u32, b: u32) -> u32 {
        arithmetic::multiply_rare(a, b)
    }

    #[unsafe(no_mangle)]
    extern "aapcs" fn gestus_float_round_rare(sign: u32, exponent: i32, mantissa: u32) -> u32 {
        round::round_rare(sign, exponent, mantissa)
    }
}

// Where there is an FPU nothing calls them, and the linker drops them.
#[cfg(target_arch = "riscv32")]
mod riscv {
    use crate::arithmetic;

    #[unsafe(no_mangle)]
    extern "C" fn __addsf3(a: u32, b: u32) -> u32 {
        arithmetic::add(a, b)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __subsf3(a: u32, b: u32) -> u32 {
        arithmetic::subtract(a, b)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __mulsf3(a: u32, b: u32) -> u32 {
        arithmetic::multiply(a, b)
    }

    #[unsafe(no_mangle)]
    extern "C" fn __divsf3(a: u32, b: u32) -> u32 {
        arithmetic::divide(a, b)
    }
}
