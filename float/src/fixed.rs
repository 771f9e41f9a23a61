//! Floats to whole numbers with some bits behind the point, and back, without operations of floats.

use crate::round::{SIGN, normal, round};

/// `value · 2^bits`, without what is behind the point and held within 32 bits; 0 of NaN. `bits` is in -126..126.
#[inline]
pub fn to_fixed(value: f32, bits: i32) -> i32 {
    let number = value.to_bits();
    let exponent = ((number << 1) >> 24) as i32;
    // The mantissa's first bit is in bit 30.
    let right = 157 - bits - exponent;
    let sign = (number as i32) >> 31;
    if right < 0 {
        return if number << 1 > 0xff00_0000 { 0 } else { i32::MAX ^ sign };
    }
    let size = if right > 31 { 0 } else { (((number << 8) | SIGN) >> 1) >> right };
    (size as i32 ^ sign) - sign
}

/// `number / 2^bits`, rounded to the nearest. `bits` is in -96..96.
#[inline]
pub fn from_fixed(number: i32, bits: i32) -> f32 {
    if number == 0 {
        return 0.0;
    }
    let (left, mantissa) = normal(number.unsigned_abs());
    f32::from_bits(round(number as u32 & SIGN, 158 - bits - left, mantissa))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::trial::pairs;

    #[test]
    fn conversions_are_those_of_the_processor() {
        for (x, y) in pairs(1_000_000) {
            let (value, bits) = (f32::from_bits(x), (y % 127) as i32 - 30);
            assert_eq!(to_fixed(value, bits), (value * 2f32.powi(bits)) as i32, "{value:e} 2^{bits}");
            let (number, bits) = (y as i32, (x % 192) as i32 - 95);
            let expected = number as f32 * 2f32.powi(-bits);
            assert_eq!(from_fixed(number, bits).to_bits(), expected.to_bits(), "{number} 2^-{bits}");
        }
    }
}
