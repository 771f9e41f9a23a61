//! Unit quaternions `[x, y, z, w]` and the exponential map.
//!
//! `exp` converts a rotation vector (axis times angle, radians) to a quaternion. `log` converts it back along the
//! shorter arc (angle at most π). Source: Grassia 1998, "Practical parameterization of rotations using the exponential
//! map", which Xia 2015 (section 4) and Hsu 2005 (section 4.1) use for joint angles.
//!
//! Except for the vector as a factor, both are even functions of the angle. They therefore need neither the angle nor
//! its sine, and no root, quotient or arc function: `exp` is `[v s(|v|²), c(|v|²)]` and `log` is `[x, y, z] f(1 - w)`,
//! with `s(a²) = sin(a/2) / a`, `c(a²) = cos(a/2)` and `f(1 - cos(a/2)) = a / sin(a/2)` minimax polynomials over all
//! angles up to π. Quaternions have nearly unit length, and are normalised by the series of `1 / √(1 + e)`.
//!
//! | function | instructions on a Cortex-M4F, about | error |
//! |---|---|---|
//! | [`multiply`], [`rotate`], [`normalize`] | 105, 120, 35 | rounding |
//! | [`exp`], [`between`], [`turned`] | 190, 210, 240 | 2e-7 rad up to π |
//! | [`log`] | 150 | 4e-7 rad |
//!
//! All but [`normalize`] and [`angle`] compute in fixed point with 30 fractional bits. Without an FPU, a product in
//! fixed point takes half of the instructions of a float product, and a sum a twentieth. With an FPU both take as long,
//! and the conversion from and to floats takes 50 instructions more.
//!
//! None is used in the loop over the examples, so all but the smallest are not inlined, which halves the code of the
//! callers.

use crate::math::{
    abs, atan2,
    fixed::{from_fixed, to_fixed},
    sin_cos, sqrt,
};

/// A unit quaternion, `[x, y, z, w]`.
pub type Quaternion = [f32; 4];
/// A vector, metres (positions) or radians (rotation vectors).
pub type Vector = [f32; 3];

/// No rotation.
pub const IDENTITY: Quaternion = [0.0, 0.0, 0.0, 1.0];

/// Fractional bits of a unit quaternion's components.
const UNIT: i32 = 30;
const ONE: i32 = 1 << UNIT;

/// A unit quaternion in fixed point, with [`UNIT`] fractional bits.
type Fixed = [i32; 4];

#[inline(always)]
fn fixed(q: Quaternion) -> Fixed {
    q.map(|v| to_fixed(v, UNIT))
}

#[inline(always)]
fn float(q: Fixed) -> Quaternion {
    q.map(|v| from_fixed(v, UNIT))
}

#[inline(always)]
fn wide(a: i32, b: i32) -> i64 {
    i64::from(a) * i64::from(b)
}

/// Rounds a sum of products of two fixed-point numbers to a fixed-point number.
#[inline(always)]
fn nearest(sum: i64) -> i32 {
    (sum.wrapping_add(1 << (UNIT - 1)) >> UNIT) as i32
}

#[inline(always)]
fn times(a: i32, b: i32) -> i32 {
    (wide(a, b) >> UNIT) as i32
}

/// The product `a b`: the rotation `b`, followed by `a`.
#[inline(never)]
pub fn multiply(a: Quaternion, b: Quaternion) -> Quaternion {
    float(product(fixed(a), fixed(b)))
}

// May wrap if an argument is not a unit quaternion; then the result is not one either.
#[inline(always)]
fn product(a: Fixed, b: Fixed) -> Fixed {
    let [ax, ay, az, aw] = a;
    let [bx, by, bz, bw] = b;
    let sum =
        |p: i64, q: i64, r: i64, minus: i64| nearest(p.wrapping_add(q).wrapping_add(r).wrapping_sub(minus));
    [
        sum(wide(aw, bx), wide(ax, bw), wide(ay, bz), wide(az, by)),
        sum(wide(aw, by), wide(ay, bw), wide(az, bx), wide(ax, bz)),
        sum(wide(aw, bz), wide(ax, by), wide(az, bw), wide(ay, bx)),
        nearest(
            wide(aw, bw).wrapping_sub(wide(ax, bx)).wrapping_sub(wide(ay, by)).wrapping_sub(wide(az, bz)),
        ),
    ]
}

#[inline(always)]
fn inverse(q: Fixed) -> Fixed {
    [q[0].wrapping_neg(), q[1].wrapping_neg(), q[2].wrapping_neg(), q[3]]
}

/// `1 / |q|`, if the length is within 1% of 1.
#[inline(always)]
fn inverse_length(q: Fixed) -> Option<i32> {
    let squares = q.iter().fold(0i64, |sum, &v| sum.wrapping_add(wide(v, v)));
    let off = nearest(squares).wrapping_sub(ONE);
    if off.unsigned_abs() < 1 << 14 {
        // The next term is below a bit.
        return Some(ONE - (off >> 1));
    }
    (off.unsigned_abs() < ONE as u32 / 50).then(|| {
        // The series of `1 / √(1 + e)`, up to where the next term is 4e-8.
        let (half, second, third) = (ONE / 2, ONE / 8 * 3, ONE / 16 * 5);
        ONE + times(off, times(off, second - times(off, third)) - half)
    })
}

/// The inverse rotation of a unit quaternion.
#[inline]
pub fn conjugate(q: Quaternion) -> Quaternion {
    [-q[0], -q[1], -q[2], q[3]]
}

/// The vector `v` rotated by `q`.
#[inline(never)]
pub fn rotate(q: Quaternion, v: Vector) -> Vector {
    let [x, y, z, w] = fixed(q);
    // The largest number has 28 or 29 bits.
    let largest = v.iter().fold(0, |most, v| (v.to_bits() << 1).max(most)) >> 24;
    let bits = (155 - largest as i32).min(MAX_FRACTION_BITS);
    let v = v.map(|v| to_fixed(v, bits));
    // Half of `2 q × v`, of which `times` would keep too few bits.
    let cross = |a: i32, b: i32, c: i32, d: i32| (wide(a, b).wrapping_sub(wide(c, d)) >> (UNIT - 1)) as i32;
    let t = [cross(y, v[2], z, v[1]), cross(z, v[0], x, v[2]), cross(x, v[1], y, v[0])];
    let turned = |v: i32, t: i32, [a, b, c, d]: [i32; 4]| {
        let sum = wide(w, t).wrapping_add(wide(a, b)).wrapping_sub(wide(c, d));
        from_fixed(v.wrapping_add(nearest(sum)), bits)
    };
    [
        turned(v[0], t[0], [y, t[2], z, t[1]]),
        turned(v[1], t[1], [z, t[0], x, t[2]]),
        turned(v[2], t[2], [x, t[1], y, t[0]]),
    ]
}

/// Greatest number of fractional bits of a vector.
const MAX_FRACTION_BITS: i32 = 96;

/// The rotation about a unit axis.
pub(crate) fn about(axis: Vector, angle: f32) -> Quaternion {
    let (s, c) = sin_cos(0.5 * angle);
    [axis[0] * s, axis[1] * s, axis[2] * s, c]
}

/// Normalises a quaternion; `None` if its squared length is outside 1e-6..1e6 or NaN.
#[inline(never)]
pub fn normalize(q: Quaternion) -> Option<Quaternion> {
    let length2 = squared(q);
    // Also refuses NaN and infinity.
    if !(1e-6..1e6).contains(&length2) {
        return None;
    }
    let inverse = if is_near_one(length2) { inverse_root(length2) } else { 1.0 / sqrt(length2) };
    Some(scaled(q, inverse))
}

#[inline(always)]
fn squared(q: Quaternion) -> f32 {
    q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]
}

#[inline(always)]
fn scaled(q: Quaternion, by: f32) -> Quaternion {
    [q[0] * by, q[1] * by, q[2] * by, q[3] * by]
}

/// Whether a squared length is that of a rotation after rounding: the length is within 1% of 1.
#[inline(always)]
fn is_near_one(length2: f32) -> bool {
    abs(length2 - 1.0) < 0.02
}

/// `1 / √x` for x within 0.02 of 1: the series up to where the next term is 4e-8.
#[inline(always)]
fn inverse_root(x: f32) -> f32 {
    let e = x - 1.0;
    1.0 + e * (-0.5 + e * (0.375 - 0.3125 * e))
}

/// The rotation about Y (up) by `angle` radians.
#[inline]
pub fn about_y(angle: f32) -> Quaternion {
    let (s, c) = sin_cos(0.5 * angle);
    [0.0, s, 0.0, c]
}

/// Exponential map: rotation vector, radians, to quaternion.
#[inline]
pub fn exp(v: Vector) -> Quaternion {
    turned_in_parent(IDENTITY, v)
}

/// The rotation `q` turned by the rotation vector `v`, radians, in its own frame: `q exp(v)`, normalised.
#[inline(never)]
pub fn turned(q: Quaternion, v: Vector) -> Quaternion {
    let turned = product(fixed(q), exponential(v));
    float(match inverse_length(turned) {
        Some(inverse) => turned.map(|v| times(v, inverse)),
        None => turned,
    })
}

/// The rotation `q` turned by the rotation vector `v`, radians, in its parent's frame: `exp(v) q`.
#[inline(never)]
pub fn turned_in_parent(q: Quaternion, v: Vector) -> Quaternion {
    float(product(exponential(v), fixed(q)))
}

/// Fractional bits of a rotation vector's components, which are below 4.
const MAP: i32 = 29;

#[inline(always)]
fn exponential(v: Vector) -> Fixed {
    // Hardly more than π each, so that the sum of their squares fits 63 bits; also false for NaN.
    let is_near = v.iter().all(|v| v.to_bits() << 1 < 3.2f32.to_bits() << 1);
    if is_near {
        let v = v.map(|v| to_fixed(v, MAP));
        let squares = v.iter().fold(0i64, |sum, &v| sum.wrapping_add(wide(v, v)));
        // 27 fractional bits, or 31 of a sixteenth.
        let angle2 = squares >> 31;
        if angle2 <= i64::from(HALF_TURN2) {
            let (s, c) = half_sine(angle2 as i32);
            let [x, y, z] = v.map(|v| (wide(v, s) >> MAP) as i32);
            return [x, y, z, c];
        }
    }
    fixed(exponential_beyond(v, v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))
}

/// Slightly more than π², with 27 fractional bits.
const HALF_TURN2: i32 = (9.88 * (1u32 << 27) as f32) as i32;

/// `sin(a/2) / a` and `cos(a/2)` of `a²` up to π², with [`UNIT`] fractional bits and errors of 4e-9 and 2e-9. The
/// polynomials take a sixteenth of the square, so that no coefficient exceeds 2.
#[inline(always)]
fn half_sine(angle2: i32) -> (i32, i32) {
    let step = |sum: i32, coefficient: i32| ((wide(sum, angle2) >> 31) as i32).wrapping_add(coefficient);
    let s = [S3, S2, S1, ONE / 2].into_iter().fold(S4, step);
    let c = [C4, C3, C2, C1, ONE].into_iter().fold(C5, step);
    (s, c)
}

/// A coefficient of `x^power` as one of `(x / 16)^power`.
const fn coefficient(value: f64, power: i32) -> i32 {
    (value * (1u64 << (UNIT + 4 * power)) as f64) as i32
}

const S1: i32 = coefficient(-2.083_332_5e-2, 1);
const S2: i32 = coefficient(2.604_083_3e-4, 2);
const S3: i32 = coefficient(-1.547_607_8e-6, 3);
const S4: i32 = coefficient(5.087_566_4e-9, 4);
const C1: i32 = coefficient(-0.125, 1);
const C2: i32 = coefficient(2.604_166e-3, 2);
const C3: i32 = coefficient(-2.170_091_5e-5, 3);
const C4: i32 = coefficient(9.675_850_5e-8, 4);
const C5: i32 = coefficient(-2.559_466e-10, 5);

/// The exponential of a vector of any length; the identity for NaN. A cold function, since no joint turns beyond π.
#[cold]
#[inline(never)]
fn exponential_beyond(v: Vector, angle2: f32) -> Quaternion {
    // Also false for NaN, and beyond the range of the sine.
    if angle2 < 2e8 {
        let angle = sqrt(angle2);
        let (s, c) = sin_cos(0.5 * angle);
        let s = s / angle;
        return [v[0] * s, v[1] * s, v[2] * s, c];
    }
    IDENTITY
}

/// Logarithm: quaternion to rotation vector, radians, along the shorter arc. The length need not be exactly 1.
#[inline(never)]
pub fn log(q: Quaternion) -> Vector {
    let length2 = squared(q);
    let unit = if is_near_one(length2) { q } else { scaled(q, inverse_root_beyond(length2)) };
    logarithm(fixed(unit))
}

/// The rotation vector from `a` to `b` in the frame of `a`, radians, along the shorter arc: `log(a⁻¹ b)`.
#[inline(never)]
pub fn between(a: Quaternion, b: Quaternion) -> Vector {
    logarithm(product(inverse(fixed(a)), fixed(b)))
}

/// The rotation vector from `a` to `b` in their parent's frame, radians, along the shorter arc: `log(b a⁻¹)`.
#[inline(never)]
pub fn between_in_parent(a: Quaternion, b: Quaternion) -> Vector {
    logarithm(product(fixed(b), inverse(fixed(a))))
}

#[inline(always)]
fn logarithm(q: Fixed) -> Vector {
    match inverse_length(q) {
        Some(inverse) => logarithm_of(q, inverse),
        None => logarithm_beyond(q),
    }
}

/// The logarithm of a quaternion, given the inverse of its length.
#[inline(always)]
fn logarithm_of(q: Fixed, unit: i32) -> Vector {
    // 1 less the cosine of half the angle: 0 to 1 on the short way.
    let c = times(unit, q[3]);
    let t = ONE.wrapping_sub(c.wrapping_abs());
    let step = |sum: i32, coefficient: i32| times(sum, t).wrapping_add(coefficient);
    let f = [F8, F7, F6, F5, F4, F3, F2, F1, F0].into_iter().fold(F9, step);
    let s = times(f, unit);
    let s = if c < 0 { s.wrapping_neg() } else { s };
    [q[0], q[1], q[2]].map(|v| from_fixed(times(v, s), MAP))
}

/// The logarithm of a quaternion whose length is more than 1% off, such as a product of two that are less off.
#[cold]
#[inline(never)]
fn logarithm_beyond(q: Fixed) -> Vector {
    let q = float(q);
    let unit = fixed(scaled(q, inverse_root_beyond(squared(q))));
    // A quaternion of length 0 has no inverse length.
    inverse_length(unit).map_or([0.0; 3], |inverse| logarithm_of(unit, inverse))
}

/// Coefficients of `a / sin(a/2)`, with [`MAP`] fractional bits.
const F0: i32 = 2 << MAP;
const F1: i32 = map_coefficient(0.666_670_4);
const F2: i32 = map_coefficient(0.266_526_16);
const F3: i32 = map_coefficient(0.116_107_64);
const F4: i32 = map_coefficient(3.930_282_6e-2);
const F5: i32 = map_coefficient(6.354_417e-2);
const F6: i32 = map_coefficient(-7.349_289e-2);
const F7: i32 = map_coefficient(0.108_701_28);
const F8: i32 = map_coefficient(-6.896_664e-2);
const F9: i32 = map_coefficient(2.319_969_4e-2);

const fn map_coefficient(value: f64) -> i32 {
    (value * (1u64 << MAP) as f64) as i32
}

/// `1 / √x` of any other; 0 of what has no direction.
#[cold]
#[inline(never)]
fn inverse_root_beyond(x: f32) -> f32 {
    if (1e-12..1e12).contains(&x) { 1.0 / sqrt(x) } else { 0.0 }
}

/// The rotation a fraction `t` of the way from `a` to `b`, along the short way; beyond `b` where `t` is above 1.
#[inline(never)]
pub fn slerp(t: f32, a: Quaternion, b: Quaternion) -> Quaternion {
    let way = between(a, b);
    turned(a, [t * way[0], t * way[1], t * way[2]])
}

/// Angle between two rotations, radians, 0 to π: the geodesic distance.
#[inline(never)]
pub fn angle(a: Quaternion, b: Quaternion) -> f32 {
    // By the sine of half the difference, which is exact for small angles, where the cosine is not.
    let q = multiply(conjugate(a), b);
    let sine = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2]);
    2.0 * atan2(sine, abs(q[3]))
}

/// True where every number is finite and the length is within 1% of 1.
pub fn is_unit(q: Quaternion) -> bool {
    is_near_one(squared(q))
}

/// True where all are unit quaternions.
#[inline(never)]
pub(crate) fn are_units(rotations: &[Quaternion]) -> bool {
    rotations.iter().all(|&q| is_unit(q))
}

#[cfg(test)]
mod tests;
