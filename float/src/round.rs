//! What all results go through.

pub const MANTISSA_BITS: u32 = 23;
pub const SIGN: u32 = 1 << 31;
pub const INFINITY: u32 = 0xff << MANTISSA_BITS;
pub const NOT_A_NUMBER: u32 = INFINITY | 1 << (MANTISSA_BITS - 1);

/// Bits of a mantissa that are rounded off.
const ROUNDED: u32 = 8;

/// The number with a sign, an exponent, and a mantissa of 32 bits, whose first one is set and whose last one stands for all
/// that follow: to the nearest, of two as near the even one.
#[inline(always)]
pub fn round(sign: u32, exponent: i32, mantissa: u32) -> u32 {
    if (exponent as u32).wrapping_sub(1) >= 254 {
        return round_rare(sign, exponent, mantissa);
    }
    // The first bit, which is not stored, counts the exponent up; so does a mantissa of ones that is rounded up, to
    // infinity if need be.
    sign + (((exponent - 1) as u32) << MANTISSA_BITS) + rounded(mantissa)
}

#[inline(always)]
fn rounded(mantissa: u32) -> u32 {
    let kept = mantissa >> ROUNDED;
    kept + (((mantissa & 0xff) + 0x7f + (kept & 1)) >> ROUNDED)
}

/// [`round`] of a number beyond the largest, or below the smallest ordinary one.
#[cold]
#[inline(never)]
pub(crate) fn round_rare(sign: u32, exponent: i32, mantissa: u32) -> u32 {
    if exponent > 0 {
        return sign | INFINITY;
    }
    let right = (1 - exponent) as u32;
    if right > 31 {
        // Not even half of the smallest.
        return sign;
    }
    let moved = mantissa >> right;
    sign + rounded(moved | u32::from(moved << right != mantissa))
}

/// A number other than 0 shifted left until bit 31 is set, behind how far that was.
#[inline(always)]
pub fn normal(mut number: u32) -> (i32, u32) {
    let mut left = 0;
    for step in [16, 8, 4, 2, 1] {
        if number >> (32 - step) == 0 {
            number <<= step;
            left += step;
        }
    }
    (left, number)
}
