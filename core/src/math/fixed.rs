//! Fixed-point arithmetic. On a processor without an FPU, an integer product takes a few instructions and a float product
//! some fifty.

/// Without an FPU by whole numbers; the bits are the same.
#[cfg(feature = "soft-float")]
pub use gestus_float::fixed::{from_fixed, to_fixed};

/// `value · 2^bits`, truncated towards zero and clamped to 32 bits; 0 for NaN.
#[cfg(not(feature = "soft-float"))]
#[inline]
pub fn to_fixed(value: f32, bits: i32) -> i32 {
    (value * power_of_two(bits)) as i32
}

/// `number / 2^bits`, rounded to the nearest.
#[cfg(not(feature = "soft-float"))]
#[inline]
pub fn from_fixed(number: i32, bits: i32) -> f32 {
    number as f32 * power_of_two(-bits)
}

/// 2 to the power of `bits`, which is in -126..127.
#[inline]
pub fn power_of_two(bits: i32) -> f32 {
    f32::from_bits(((127 + bits) << 23) as u32)
}

/// Number of bits of the magnitude of `value`; 0 for 0 and -1.
#[inline]
pub fn bit_length(value: i32) -> i32 {
    (u32::BITS - (value ^ (value >> 31)).leading_zeros()) as i32
}

/// Every bit that the magnitude of one of the numbers has, but for the last one of a negative number.
#[inline]
pub fn magnitude_bits(numbers: impl IntoIterator<Item = i32>) -> i32 {
    numbers.into_iter().fold(0, |bits, number| bits | (number ^ (number >> 31)))
}

/// A factor 2^power.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PowerOfTwo {
    left: i32,
    right: i32,
}

impl PowerOfTwo {
    #[inline]
    pub fn new(power: i32) -> Self {
        Self { left: power.clamp(0, 31), right: (-power).clamp(0, 31) }
    }

    /// `value` times the factor, rounded down. The caller knows that it fits.
    // Two shifts in place of a branch.
    #[inline]
    pub fn of(self, value: i32) -> i32 {
        (value << (self.left & 31)) >> (self.right & 31)
    }
}

/// `value · 2^power`, rounded down. The caller knows that it fits.
#[inline]
pub fn shift(value: i32, power: i32) -> i32 {
    PowerOfTwo::new(power).of(value)
}

/// `a · b / 2^bits`, rounded down. The caller knows that it fits.
#[inline]
pub fn product(a: i32, b: i32, bits: u32) -> i32 {
    ((i64::from(a) * i64::from(b)) >> bits) as i32
}

/// `a / b`, rounded towards zero, for b below 2^16 and a quotient that fits; 0 is taken as 1. Two divisions of 32 bits: one
/// of 64 takes a kilobyte of flash.
#[inline]
pub fn quotient(a: i64, b: u32) -> i32 {
    let (size, b) = (a.unsigned_abs(), b.max(1));
    let high = (size >> 16) as u32;
    let rest = (high % b) << 16 | (size & 0xffff) as u32;
    let quotient = ((high / b) << 16).wrapping_add(rest / b) as i32;
    if a < 0 { quotient.wrapping_neg() } else { quotient }
}

/// `value` clamped to ±`most`.
#[inline]
fn clamped(value: i64, most: i32) -> i32 {
    let low = value as i32;
    if i64::from(low) == value {
        low.max(-most).min(most)
    } else if value < 0 {
        -most
    } else {
        most
    }
}

/// A non-negative factor for integers: a mantissa of 31 bits and a power of two.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Multiplier {
    /// In 2^30..2^31, or 0.
    mantissa: i32,
    /// Exponent of the mantissa's last bit.
    power: i32,
}

impl Multiplier {
    /// The factor `value`, which is finite, not negative and below 2^31.
    pub fn new(value: f32) -> Self {
        let bits = value.to_bits() as i32;
        let mantissa = if bits >> 23 == 0 { 0 } else { ((bits & 0x7f_ffff) | 0x80_0000) << 7 };
        Self { mantissa, power: (bits >> 23) - 127 - 30 }
    }

    /// The factor as `mantissa · 2^power`; the mantissa is in 2^30..2^31, or 0.
    #[inline]
    pub fn parts(self) -> (i32, i32) {
        (self.mantissa, self.power)
    }

    /// `value` times the factor, rounded down and clamped to 31 bits.
    #[inline]
    pub fn of(self, value: i32) -> i32 {
        let wide = i64::from(value) * i64::from(self.mantissa);
        clamped(wide >> (-self.power).clamp(0, 63), i32::MAX)
    }
}

/// Number of fractional bits of what [`InverseSqrt`] takes, which is below 1.
pub const BITS: u32 = 29;

/// The inverse square root of a positive number with [`BITS`] fractional bits.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct InverseSqrt {
    /// 1 to 2, with [`BITS`] fractional bits.
    mantissa: i32,
    /// Power of two that the mantissa is multiplied by.
    power: u32,
}

impl InverseSqrt {
    /// Of `value / 2^29`; `value` is clamped to 1..2^29. Relative error 2^-23.
    #[inline(never)]
    pub fn new(value: i32) -> Self {
        let value = value.clamp(1, (1 << BITS) - 1);
        let power = (value.leading_zeros() - 3) >> 1;
        // A quarter to 1.
        let x = (value as u32) << (2 * power);
        let x16 = x >> 13;
        // A line, 9% off at most; Newton's r (3 - x r²) / 2 leaves 1.5 times the square of what one is off.
        let mut r = 34_734 - ((19_661 * x16) >> 16);
        r = (r * (3 * (1 << 14) - ((x16 * ((r * r) >> 14)) >> 16))) >> 15;
        // Now with 15 fractional bits.
        r = (r * (3 * (1 << 14) - ((x16 * ((r * r) >> 14)) >> 16))) >> 14;
        let r = r.min(u32::from(u16::MAX));
        // 1 - x r² with 24 fractional bits. It is small, so all bits of `x` are needed.
        let off = (1 << 24) - ((u64::from(x) * u64::from(r * r)) >> 35) as i32;
        Self { mantissa: ((r << 14) as i32) + ((r as i32 * off) >> 11), power }
    }

    /// The inverse square root is in 1 to 2, times two to this power.
    #[inline]
    pub fn power(self) -> u32 {
        self.power
    }

    /// `value`, of 30 bits at most, times the inverse square root, clamped to ±`most`. The product with the mantissa is
    /// rounded down, before it is shifted.
    #[inline]
    pub fn of(self, value: i32, most: i32) -> i32 {
        let most = most >> (self.power & 31);
        product(value, self.mantissa, BITS).max(-most).min(most) << (self.power & 31)
    }
}

/// The square root of `value`, times 2^14.5: `value` is in 0..2^29.
#[inline]
pub fn sqrt_wide(value: i32) -> i32 {
    // √v = v / √v, and v / 2^29 is what the inverse is taken of.
    let InverseSqrt { mantissa, power } = InverseSqrt::new(value);
    product(value << ((2 * power) & 31), mantissa, BITS) >> (power & 31)
}

/// Fractional bits of a [`Fraction`].
const FRACTION_BITS: u32 = 31;

/// A number from 0 to 1, to multiply integers with.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Fraction(i32);

impl Fraction {
    /// The nearest to `value`; what is above 1 becomes 1.
    pub fn new(value: f32) -> Self {
        Self((value * (1u32 << FRACTION_BITS) as f32) as i32)
    }

    /// That part of `value`, rounded down.
    #[inline]
    pub fn of(self, value: i32) -> i32 {
        product(value, self.0, FRACTION_BITS)
    }

    /// That part of `value`, with `bits` fractional bits, rounded down and clamped to 31 bits.
    #[inline]
    pub fn finely_of(self, value: i32, bits: u32) -> i32 {
        clamped((i64::from(value) * i64::from(self.0)) >> (FRACTION_BITS - bits), i32::MAX)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inverse_square_roots_agree_with_f64() {
        let mut worst = 0.0_f64;
        let small = 1..100_000;
        let large = (0..200_000).map(|i| 100_000 + i * 2_683);
        for value in small.chain(large).chain([(1 << 27) - 1, 1 << 27, (1 << 29) - 1]) {
            let truth = (f64::from(value) / f64::from(1 << BITS)).sqrt().recip();
            let InverseSqrt { mantissa, power } = InverseSqrt::new(value);
            let found = f64::from(mantissa) / f64::from(1 << BITS) * f64::from(1 << power);
            worst = worst.max((found / truth - 1.0).abs());
        }
        assert!(worst < 1.2e-7, "{worst:e}");
    }

    #[test]
    fn square_roots_agree_with_f64() {
        for value in [0, 1, 2, 3, 99, 65_536, 12_345_678, (1 << 29) - 1] {
            let truth = f64::from(value).sqrt() * 2f64.powf(14.5);
            let found = f64::from(sqrt_wide(value));
            assert!((found - truth).abs() <= 1e-6 * truth + 1.0, "{value}: {found} not {truth}");
        }
    }

    #[test]
    fn a_multiplier_gives_the_rounded_product_or_its_limit() {
        for factor in [0.0, 1e-9, 0.3, 1.0, 7.25, 1e6_f32] {
            for value in [0, 1, -1, 1000, -12_345, 1 << 30, i32::MAX, i32::MIN] {
                let truth = (f64::from(factor) * f64::from(value)).floor();
                let held = truth.clamp(-f64::from(i32::MAX), f64::from(i32::MAX));
                assert_eq!(f64::from(Multiplier::new(factor).of(value)), held, "{factor} {value}");
            }
        }
    }

    #[test]
    fn a_fraction_gives_the_part_rounded_down() {
        for fraction in [0.0, 1e-6, 0.25, 0.7, 0.999_999_9, 1.0_f32] {
            for value in [0, 1, -1, 1000, -12_345, 1 << 30, i32::MAX, i32::MIN] {
                let truth = f64::from(fraction) * f64::from(value);
                let found = f64::from(Fraction::new(fraction).of(value));
                assert!((found - truth).abs() <= 2.0, "{fraction} {value}: {found}");
                let finely = f64::from(Fraction::new(fraction).finely_of(value, 4));
                let held = (16.0 * truth).clamp(-f64::from(i32::MAX), f64::from(i32::MAX));
                assert!((finely - held).abs() <= 32.0, "{fraction} {value}: {finely}");
            }
        }
    }

    #[test]
    fn quotients_are_those_of_64_bits() {
        for b in [1, 2, 3, 255, 256, 1000, 32_768, 65_534, 65_535] {
            let most = i64::from(b) * i64::from(i32::MAX);
            for a in [0, 1, 7, 65_535, 65_536, 1 << 20, 123_456_789, (1 << 36) + 12_345, most - 1, most] {
                for a in [a, -a].map(|a| a.clamp(-most, most)) {
                    assert_eq!(i64::from(quotient(a, b)), a / i64::from(b), "{a} / {b}");
                }
            }
        }
        assert_eq!(quotient(5, 0), 5);
    }

    #[test]
    fn shifts_round_down_and_lengths_count_the_bits() {
        assert_eq!([shift(3, 4), shift(-3, -1), shift(-1, -40), shift(5, -40)], [48, -2, -1, 0]);
        assert_eq!([0, 1, -1, -2, 255, -256, i32::MAX].map(bit_length), [0, 1, 0, 1, 8, 8, 31]);
        assert_eq!(product(-3, 1 << 20, 21), -2);
    }
}
