//! Sums, products and quotients, of the bits of numbers.
//!
//! Each has a straight way for ordinary numbers, whose result is ordinary, and a cold one for the rest: zeros, numbers
//! below 2^-126, infinities and NaN.

use crate::round::{INFINITY, MANTISSA_BITS, NOT_A_NUMBER, SIGN, normal, round};

#[inline(always)]
fn exponent(number: u32) -> u32 {
    (number << 1) >> (MANTISSA_BITS + 1)
}

/// Neither 0 nor subnormal, infinite or NaN, by its exponent.
#[inline(always)]
fn is_ordinary(exponent: u32) -> bool {
    exponent.wrapping_sub(1) < 254
}

/// All 24 bits of an ordinary number's mantissa, the first one in bit 31.
#[inline(always)]
fn mantissa(number: u32) -> u32 {
    (number << 8) | SIGN
}

#[inline(always)]
fn size(number: u32) -> u32 {
    number & !SIGN
}

/// Exponent and mantissa of any finite number but 0, as if all could be ordinary.
fn scaled(number: u32) -> (i32, u32) {
    match exponent(number) as i32 {
        0 => {
            let (left, mantissa) = normal(number << 8);
            (1 - left, mantissa)
        }
        exponent => (exponent, mantissa(number)),
    }
}

/// `a + b`.
#[inline(always)]
pub fn add(a: u32, b: u32) -> u32 {
    // The larger first.
    let (a, b) = if (a << 1) < (b << 1) { (b, a) } else { (a, b) };
    let (larger, smaller) = (exponent(a), exponent(b));
    // What is infinite or NaN is the larger, what is 0 or subnormal the smaller.
    if larger == 255 || smaller == 0 {
        return add_rare(a, b);
    }
    add_ordered(a, b, larger - smaller, mantissa(b))
}

/// The sum of an ordinary number and a smaller one, whose mantissa is that of `apart` powers of two below.
#[inline(always)]
fn add_ordered(a: u32, b: u32, apart: u32, smaller: u32) -> u32 {
    // Less than half of the last bit, even of the number before.
    if apart > MANTISSA_BITS + 2 {
        return a;
    }
    let (sign, exponent) = (a & SIGN, exponent(a) as i32);
    let (larger, smaller) = (mantissa(a) >> 1, smaller >> 1);
    let moved = smaller >> apart;
    // Of the bits that go, all that counts is whether any is set.
    let smaller = moved | u32::from(moved << apart != smaller);
    if ((a ^ b) as i32) >= 0 {
        let sum = larger + smaller;
        return if (sum as i32) < 0 {
            round(sign, exponent + 1, sum)
        } else {
            round(sign, exponent, sum << 1)
        };
    }
    let difference = larger - smaller;
    if difference == 0 {
        return 0;
    }
    let (left, mantissa) = normal(difference);
    round(sign, exponent + 1 - left, mantissa)
}

/// The sum where one is not ordinary; `a` is not the smaller one.
#[cold]
#[inline(never)]
pub(crate) fn add_rare(a: u32, b: u32) -> u32 {
    let opposite = ((a ^ b) as i32) < 0;
    if size(a) >= INFINITY {
        let is_number = size(a) == INFINITY && (size(b) < INFINITY || !opposite);
        return if is_number { a } else { NOT_A_NUMBER };
    }
    if exponent(a) > 0 {
        return match size(b) {
            0 => a,
            // Subnormal: as if its exponent were 1.
            smaller => add_ordered(a, b, exponent(a) - 1, smaller << 8),
        };
    }
    // Both below 2^-126: they are whole numbers of the smallest.
    match (size(a), size(b)) {
        (0, 0) => a & b,
        (x, y) if x == y && opposite => 0,
        (_, y) if opposite => a - y,
        (_, y) => a + y,
    }
}

/// `a - b`.
#[inline(always)]
pub fn subtract(a: u32, b: u32) -> u32 {
    add(a, b ^ SIGN)
}

/// `a · b`.
#[inline(always)]
pub fn multiply(a: u32, b: u32) -> u32 {
    let (ea, eb) = (exponent(a), exponent(b));
    if !(is_ordinary(ea) && is_ordinary(eb)) {
        return multiply_rare(a, b);
    }
    multiply_scaled((a ^ b) & SIGN, (ea + eb) as i32, mantissa(a), mantissa(b))
}

/// The product of two mantissas, whose exponents are summed up.
#[inline(always)]
fn multiply_scaled(sign: u32, exponents: i32, a: u32, b: u32) -> u32 {
    let product = upper(a, b);
    if (product as i32) < 0 {
        round(sign, exponents - 126, product)
    } else {
        round(sign, exponents - 127, product << 1)
    }
}

/// The upper half of the product of two numbers whose lowest 8 bits are 0. Its last bit is set where the lower half is
/// not 0.
#[inline(always)]
fn upper(a: u32, b: u32) -> u32 {
    let product = u64::from(a) * u64::from(b);
    (product >> 32) as u32 | u32::from(product as u32 != 0)
}

/// The product where one is not ordinary.
#[cold]
#[inline(never)]
pub(crate) fn multiply_rare(a: u32, b: u32) -> u32 {
    let sign = (a ^ b) & SIGN;
    let (most, least) = if size(a) < size(b) { (size(b), size(a)) } else { (size(a), size(b)) };
    if most >= INFINITY {
        return if most > INFINITY || least == 0 { NOT_A_NUMBER } else { sign | INFINITY };
    }
    if least == 0 {
        return sign;
    }
    let ((ea, a), (eb, b)) = (scaled(a), scaled(b));
    multiply_scaled(sign, ea + eb, a, b)
}

/// `a / b`.
#[inline(always)]
pub fn divide(a: u32, b: u32) -> u32 {
    let (ea, eb) = (exponent(a), exponent(b));
    if !(is_ordinary(ea) && is_ordinary(eb)) {
        return divide_rare(a, b);
    }
    divide_scaled((a ^ b) & SIGN, (ea as i32) - (eb as i32), mantissa(a), mantissa(b))
}

/// The quotient of two mantissas, whose exponents are so far apart.
#[inline(always)]
fn divide_scaled(sign: u32, exponents: i32, a: u32, b: u32) -> u32 {
    let (a, b) = (a >> 8, b >> 8);
    // 1 to 2, so that 25 bits of the quotient and whether there are more are all.
    let (rest, exponent) = if a < b { (a << 1, exponents + 126) } else { (a, exponents + 127) };
    // The inverse, 16 bits: a line, 6% off at most, and Newton's r (2 - b r) twice. At most 4 too large, so less 5.
    let wide = b >> 8;
    let mut inverse = 92_500 - ((wide * 30_840) >> 15);
    inverse = (inverse * ((1 << 16) - ((wide * inverse) >> 16))) >> 15;
    inverse = ((inverse * ((1 << 16) - ((wide * inverse) >> 16))) >> 15) - 5;
    // Twelve bits, and what is left of them, below four times `b`; then twelve more. Each is too small by a few at most.
    let first = ((rest >> 9) * inverse) >> 18;
    let rest = (rest << 12).wrapping_sub(first.wrapping_mul(b));
    let second = ((rest >> 10) * inverse) >> 17;
    let (mut quotient, mut rest) =
        ((first << 12) + second, (rest << 12).wrapping_sub(second.wrapping_mul(b)));
    while rest >= b {
        rest -= b;
        quotient += 1;
    }
    // All 24 bits, one for rounding, and whether anything is left.
    round(sign, exponent, (quotient << 7) | u32::from(rest != 0))
}

/// The quotient where one is not ordinary.
#[cold]
#[inline(never)]
pub(crate) fn divide_rare(a: u32, b: u32) -> u32 {
    let sign = (a ^ b) & SIGN;
    match (size(a), size(b)) {
        (x, y) if x > INFINITY || y > INFINITY || (x == y && (x == 0 || x == INFINITY)) => NOT_A_NUMBER,
        (INFINITY, _) | (_, 0) => sign | INFINITY,
        (_, INFINITY) | (0, _) => sign,
        _ => {
            let ((ea, a), (eb, b)) = (scaled(a), scaled(b));
            divide_scaled(sign, ea - eb, a, b)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::pairs;

    /// The same number, or both none.
    fn same(found: u32, expected: f32) -> bool {
        if expected.is_nan() { f32::from_bits(found).is_nan() } else { found == expected.to_bits() }
    }

    #[test]
    fn every_result_is_that_of_the_processor() {
        for (x, y) in pairs(3_000_000) {
            let (a, b) = (f32::from_bits(x), f32::from_bits(y));
            assert!(same(add(x, y), a + b), "{a:e} + {b:e} ({x:#x}, {y:#x})");
            assert!(same(subtract(x, y), a - b), "{a:e} - {b:e} ({x:#x}, {y:#x})");
            assert!(same(multiply(x, y), a * b), "{a:e} * {b:e} ({x:#x}, {y:#x})");
            assert!(same(divide(x, y), a / b), "{a:e} / {b:e} ({x:#x}, {y:#x})");
        }
    }

    #[test]
    fn a_quotient_of_any_mantissas_is_exact() {
        // Every upper half of a divisor, which the inverse is found from, and the mantissas next to a whole quotient.
        for wide in 0..1u32 << 15 {
            for low in [0, 1, 0x7f, 0xff] {
                let y = 0x3f80_0000 | wide << 8 | low;
                for x in [
                    0x3f80_0000,
                    y,
                    y + 1,
                    y ^ 1,
                    0x3fff_ffff,
                    0x3f80_0000 | (y.wrapping_mul(77) & 0x7f_ffff),
                ] {
                    let (a, b) = (f32::from_bits(x), f32::from_bits(y));
                    assert!(same(divide(x, y), a / b), "{a:e} / {b:e} ({x:#x}, {y:#x})");
                }
            }
        }
    }

    #[test]
    fn products_about_the_smallest_and_the_largest_are_rounded_once() {
        for e in 0..48 {
            for m in (0..1 << 23).step_by(4_099) {
                let (x, y) = (m | (100 + e) << 23, (m ^ 0x55_5555) | (5 << 23));
                let (a, b) = (f32::from_bits(x), f32::from_bits(y));
                assert!(same(multiply(x, y), a * b), "{a:e} * {b:e}");
                let (x, y) = (m | (254 - e) << 23, (m ^ 0x2a_aaaa) | (126 << 23));
                let (a, b) = (f32::from_bits(x), f32::from_bits(y));
                assert!(same(add(x, y), a + b) && same(multiply(x, x), a * a), "{a:e}, {b:e}");
            }
        }
    }
}
