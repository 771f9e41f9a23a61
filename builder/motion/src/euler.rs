//! Channel angles <-> quaternions, for any order of the three axes.
//!
//! Forward, a joint's rotation is the product of its channels in order. Backward, angles come directly from
//! the quaternion (Bernardes and Viollet 2022, "Quaternion to Euler angles conversion: a direct, general
//! and computationally efficient method"): two half angles by `atan2`, exact also where the middle angle is a
//! quarter turn, since an undefined half angle then drops out of the product. Of all equivalent angles, the nearest to
//! the last frame's are used, so that curves are continuous.

use std::f64::consts::{FRAC_PI_2, PI, TAU};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// Rotation about an axis (0 X, 1 Y, 2 Z), radians.
pub fn about(axis: usize, angle: f64) -> UnitQuaternion<f64> {
    let (s, c) = (angle / 2.0).sin_cos();
    let mut v = [0.0; 3];
    v[axis] = s;
    UnitQuaternion::new_unchecked(Quaternion::new(c, v[0], v[1], v[2]))
}

/// Angles `t` with `q = R_axes[0](t[0]) R_axes[1](t[1]) R_axes[2](t[2])`, nearest to `near`; radians.
///
/// `axes` is a permutation of 0, 1, 2.
pub fn angles(q: &UnitQuaternion<f64>, axes: [usize; 3], near: [f64; 3]) -> [f64; 3] {
    let [k, j, i] = axes;
    let sign = (i as f64 - j as f64) * (j as f64 - k as f64) * (k as f64 - i as f64) / 2.0;
    let v: Vector3<f64> = q.imag();
    let (a, b) = (q.w - v[j], v[i] + v[k] * sign);
    let (c, d) = (v[j] + q.w, v[k] * sign - v[i]);
    let middle = 2.0 * c.hypot(d).atan2(a.hypot(b)) - FRAC_PI_2;
    let (half_sum, half_difference) = (b.atan2(a), d.atan2(c));
    let found = [(half_sum + half_difference) * sign, middle, half_sum - half_difference];
    let other = [found[0] + PI, PI - found[1], found[2] + PI];
    let [found, other] = [found, other].map(|t| std::array::from_fn(|n| nearest(t[n], near[n])));
    if distance(&other, &near) < distance(&found, &near) { other } else { found }
}

fn nearest(angle: f64, near: f64) -> f64 {
    let turns = ((near - angle) / TAU).round();
    angle + turns * TAU
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ORDERS: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

    #[test]
    fn every_order_and_the_gimbal_come_back() {
        for axes in ORDERS {
            for step in 0..2000 {
                let t = step as f64;
                let middle = if step % 4 == 0 { FRAC_PI_2 } else { (t * 0.77).sin() * 3.0 };
                let given = [(t * 0.31).sin() * 3.0, middle, (t * 1.3).cos() * 3.0];
                let q = about(axes[0], given[0]) * about(axes[1], given[1]) * about(axes[2], given[2]);
                let near = if step % 3 == 0 { given } else { [0.0; 3] };
                let back = angles(&q, axes, near);
                let r = about(axes[0], back[0]) * about(axes[1], back[1]) * about(axes[2], back[2]);
                assert!(q.angle_to(&r) < 1e-7, "{axes:?} {given:?} {back:?}");
                if step % 3 == 0 && step % 4 != 0 && (middle.abs() - FRAC_PI_2).abs() > 1e-3 {
                    assert!(distance(&given, &back) < 1e-9, "{axes:?} {given:?} {back:?}");
                }
            }
        }
    }
}
