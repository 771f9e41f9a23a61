//! Elementary functions: the only door to `libm` and `micromath`.
//!
//! Every function gives the same bits on every target: no fused multiply-add, no platform library, comparisons
//! instead of `min`/`max` (which differ at signed zeros). Sine and cosine are polynomials of our own, because
//! `libm`'s reduce in `f64`, which is soft on a Cortex-M4F (about 1,250 instructions a call against about 40).
//!
//! | function | from | accuracy |
//! |---|---|---|
//! | [`sin_cos`] | minimax polynomial after Cody-Waite reduction (feature `micromath`: its approximation) | 2 ulp on ±π (1.1e-3 absolute) |
//! | [`atan2`], [`exp`], [`ln`], [`sqrt`] | `libm` | 1 ulp |
//! | [`acos`] | `atan2` | 3e-7 |
//! | [`pow`] | [`exp`] and [`ln`] | 6e-6 relative down to 1e-30 |
//! | [`erf`] | Abramowitz and Stegun, 7.1.26 | 5e-7 absolute |

use libm::{atan2f, expf, logf, sqrtf};

/// Square root; negative values give 0.
#[inline(never)]
pub fn sqrt(x: f32) -> f32 {
    if x > 0.0 { sqrtf(x) } else { 0.0 }
}

/// `e` to the power of `x`.
#[inline(never)]
pub fn exp(x: f32) -> f32 {
    expf(x)
}

/// The part that is left after `seconds` of a decay with time constant `time`, both in seconds: `e^(-seconds / time)`; 0
/// where `time` is 0.
#[inline]
pub fn decay(seconds: f32, time: f32) -> f32 {
    if time > 0.0 { exp(-seconds / time) } else { 0.0 }
}

/// The error function, -1 to 1.
#[inline(never)]
pub fn erf(x: f32) -> f32 {
    // Abramowitz and Stegun 1964, eq. 7.1.26: small beside libm's, which is exact to the last bit.
    let size = abs(x);
    let t = 1.0 / (1.0 + 0.327_591_1 * size);
    let sum = 0.254_829_6 + t * (-0.284_496_74 + t * (1.421_413_7 + t * (-1.453_152 + t * 1.061_405_4)));
    let value = 1.0 - t * sum * exp(-size * size);
    if x < 0.0 { -value } else { value }
}

/// `x` to the power of `y`; 0 of an `x` that is not positive.
pub fn pow(x: f32, y: f32) -> f32 {
    if x > 0.0 { exp(y * ln(x)) } else { 0.0 }
}

/// Natural logarithm of a positive number.
pub fn ln(x: f32) -> f32 {
    logf(x)
}

/// Arc cosine of `x`, clamped to -1..1, radians.
pub fn acos(x: f32) -> f32 {
    let x = clamp(x, -1.0, 1.0);
    atan2(sqrt((1.0 - x) * (1.0 + x)), x)
}

/// Angle of the vector (`x`, `y`), radians, in -π..π.
#[inline(never)]
pub fn atan2(y: f32, x: f32) -> f32 {
    atan2f(y, x)
}

/// `x` clamped to `low` and `high`.
#[inline]
pub fn clamp(x: f32, low: f32, high: f32) -> f32 {
    if x < low {
        low
    } else if x > high {
        high
    } else {
        x
    }
}

/// The lesser of two numbers; `b` if either is NaN. [`f32::min`] leaves open which of -0 and 0 it returns.
#[inline]
pub fn minimum(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers; `b` if either is NaN. [`f32::max`] leaves open which of -0 and 0 it returns.
#[inline]
pub fn maximum(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// Rises from 0 to 1 as `t` does, level at both ends; steepest in its middle, with slope 1.5.
#[inline]
pub fn smoothstep(t: f32) -> f32 {
    t * t * (3.0 - 2.0 * t)
}

/// `x` without its sign.
#[inline]
pub fn abs(x: f32) -> f32 {
    f32::from_bits(x.to_bits() & 0x7fff_ffff)
}

/// The angle `x` brought into -π..π, radians.
#[inline]
pub fn wrap_angle(x: f32) -> f32 {
    use core::f32::consts::PI;
    let mut x = x;
    // Differences of two angles in -π..π need one turn at most; more would be a caller's stray input.
    if x > PI {
        x -= 2.0 * PI;
    } else if x < -PI {
        x += 2.0 * PI;
    }
    x
}

/// Sine and cosine of `x` radians. Not finite or beyond ±8192: (0, 1).
#[cfg(not(feature = "micromath"))]
#[inline(never)]
pub fn sin_cos(x: f32) -> (f32, f32) {
    // Also false for NaN.
    let in_range = abs(x) < 8192.0;
    if !in_range {
        return (0.0, 1.0);
    }
    // x = k·π/2 + r, |r| ≤ π/4; π/2 in three parts (Cody and Waite), so that k·part is exact.
    const PART_1: f32 = 1.570_312_5;
    const PART_2: f32 = 4.837_513e-4;
    const PART_3: f32 = 7.549_79e-8;
    let scaled = x * core::f32::consts::FRAC_2_PI;
    let k = (if scaled >= 0.0 { scaled + 0.5 } else { scaled - 0.5 }) as i32;
    let kf = k as f32;
    let r = ((x - kf * PART_1) - kf * PART_2) - kf * PART_3;
    let r2 = r * r;
    let sine = r + r * r2 * (-0.166_666_55 + r2 * (8.332_161e-3 + r2 * -1.951_529_6e-4));
    let cosine = 1.0 - 0.5 * r2 + r2 * r2 * (4.166_664_6e-2 + r2 * (-1.388_731_6e-3 + r2 * 2.443_315_7e-5));
    match k & 3 {
        0 => (sine, cosine),
        1 => (cosine, -sine),
        2 => (-sine, -cosine),
        _ => (-cosine, sine),
    }
}

/// Sine and cosine of `x` radians by `micromath`, for boards without an FPU.
#[cfg(feature = "micromath")]
pub fn sin_cos(x: f32) -> (f32, f32) {
    let in_range = abs(x) < 8192.0;
    if !in_range {
        return (0.0, 1.0);
    }
    let x = micromath::F32(x);
    (x.sin().0, x.cos().0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    #[cfg(not(feature = "micromath"))]
    fn sine_and_cosine_agree_with_f64() {
        let mut worst = 0.0_f64;
        for i in -200_000..=200_000 {
            let x = i as f32 * 2.0e-5 * core::f32::consts::PI;
            let (s, c) = sin_cos(x);
            let x = f64::from(x);
            worst = worst.max((f64::from(s) - libm::sin(x)).abs()).max((f64::from(c) - libm::cos(x)).abs());
        }
        assert!(worst < 2.0e-7, "worst error {worst}");
    }

    #[test]
    fn stray_values_do_no_harm() {
        assert_eq!(sin_cos(f32::NAN), (0.0, 1.0));
        assert_eq!(sin_cos(f32::INFINITY), (0.0, 1.0));
        assert_eq!(sqrt(-1.0), 0.0);
        assert_eq!(acos(1.5), 0.0);
    }

    #[test]
    fn what_is_made_of_other_functions_agrees_with_f64() {
        for i in -20_000..=20_000 {
            let x = i as f32 * 5e-5;
            let wide = f64::from(x);
            assert!((f64::from(acos(x)) - libm::acos(wide)).abs() < 4e-7, "acos {x}");
            let x = 5.0 * x;
            assert!((f64::from(erf(x)) - libm::erf(f64::from(x))).abs() < 5e-7, "erf {x}");
            let x = abs(x);
            for y in [0.5, 8.0] {
                let wanted = libm::pow(f64::from(x), f64::from(y));
                assert!((f64::from(pow(x, y)) - wanted).abs() <= 6e-6 * wanted, "{x} to the power of {y}");
            }
        }
        assert_eq!((erf(f32::INFINITY), erf(f32::NEG_INFINITY), pow(-1.0, 2.0)), (1.0, -1.0, 0.0));
    }

    #[test]
    fn angles_wrap_once() {
        assert!((wrap_angle(3.5) - (3.5 - core::f32::consts::TAU)).abs() < 1e-6);
        assert!((wrap_angle(-3.5) + 3.5 - core::f32::consts::TAU).abs() < 1e-6);
    }
}
