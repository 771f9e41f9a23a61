//! Unit quaternions `[x, y, z, w]` and the exponential map.
//!
//! `exp` takes a rotation vector (axis times angle, radians) to a quaternion, `log` takes it back along the
//! short way (angle at most π). Source: Grassia 1998, "Practical parameterization of rotations using the
//! exponential map", which paper 000 (section 4) and paper 001 (section 4.1) use for joint angles.
//!
//! None is in a loop over the examples: all but the smallest are functions of their own, which halves the code of
//! those who use them.

use crate::math::{abs, acos, atan2, sin_cos, sqrt};

/// A unit quaternion, `[x, y, z, w]`.
pub type Quaternion = [f32; 4];
/// A vector, metres (positions) or radians (rotation vectors).
pub type Vector = [f32; 3];

/// No rotation.
pub const IDENTITY: Quaternion = [0.0, 0.0, 0.0, 1.0];

/// The rotation `b`, then `a`.
#[inline(never)]
pub fn multiply(a: Quaternion, b: Quaternion) -> Quaternion {
    let [ax, ay, az, aw] = a;
    let [bx, by, bz, bw] = b;
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

/// The inverse rotation of a unit quaternion.
#[inline]
pub fn conjugate(q: Quaternion) -> Quaternion {
    [-q[0], -q[1], -q[2], q[3]]
}

/// The vector `v` rotated by `q`.
#[inline(never)]
pub fn rotate(q: Quaternion, v: Vector) -> Vector {
    let [x, y, z, w] = q;
    let t = [2.0 * (y * v[2] - z * v[1]), 2.0 * (z * v[0] - x * v[2]), 2.0 * (x * v[1] - y * v[0])];
    [
        v[0] + w * t[0] + (y * t[2] - z * t[1]),
        v[1] + w * t[1] + (z * t[0] - x * t[2]),
        v[2] + w * t[2] + (x * t[1] - y * t[0]),
    ]
}

/// The quaternion brought back to unit length; `None` where it has no direction.
#[inline(never)]
pub fn normalize(q: Quaternion) -> Option<Quaternion> {
    let length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    // Also refuses NaN and infinity.
    if !(1e-6..1e6).contains(&length2) {
        return None;
    }
    let inverse = 1.0 / sqrt(length2);
    Some([q[0] * inverse, q[1] * inverse, q[2] * inverse, q[3] * inverse])
}

/// The rotation about Y (up) by `angle` radians.
#[inline]
pub fn about_y(angle: f32) -> Quaternion {
    let (s, c) = sin_cos(0.5 * angle);
    [0.0, s, 0.0, c]
}

/// Exponential map: rotation vector, radians, to quaternion.
#[inline(never)]
pub fn exp(v: Vector) -> Quaternion {
    let angle2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    if angle2 < 1e-8 {
        // sin(a/2)/a to second order: exact in f32 below 1e-4 rad.
        let s = 0.5 - angle2 * (1.0 / 48.0);
        return [v[0] * s, v[1] * s, v[2] * s, 1.0 - angle2 * 0.125];
    }
    let angle = sqrt(angle2);
    let (s, c) = sin_cos(0.5 * angle);
    let s = s / angle;
    [v[0] * s, v[1] * s, v[2] * s, c]
}

/// Logarithm: quaternion to rotation vector, radians, along the short way.
#[inline(never)]
pub fn log(q: Quaternion) -> Vector {
    let q = if q[3] < 0.0 { [-q[0], -q[1], -q[2], -q[3]] } else { q };
    let sine2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2];
    if sine2 < 1e-10 {
        return [2.0 * q[0], 2.0 * q[1], 2.0 * q[2]];
    }
    let sine = sqrt(sine2);
    let s = 2.0 * atan2(sine, q[3]) / sine;
    [q[0] * s, q[1] * s, q[2] * s]
}

/// The rotation a fraction `t` of the way from `a` to `b`, along the short way; beyond `b` where `t` is above 1.
#[inline(never)]
pub fn slerp(t: f32, a: Quaternion, b: Quaternion) -> Quaternion {
    let d = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let (d, sign) = if d < 0.0 { (-d, -1.0) } else { (d, 1.0) };
    // Very near each other the sphere is flat.
    let (from, to) = if d > 0.999_999 {
        (1.0 - t, t)
    } else {
        let angle = acos(d);
        let inverse = 1.0 / sqrt(1.0 - d * d);
        (sin_cos((1.0 - t) * angle).0 * inverse, sin_cos(t * angle).0 * inverse)
    };
    let to = to * sign;
    let q =
        [from * a[0] + to * b[0], from * a[1] + to * b[1], from * a[2] + to * b[2], from * a[3] + to * b[3]];
    normalize(q).unwrap_or(IDENTITY)
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
    let length2 = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    abs(length2 - 1.0) < 0.02
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn log_undoes_exp() {
        for v in [[0.0, 0.0, 0.0], [1e-5, 0.0, -2e-5], [0.3, -0.2, 0.9], [-2.0, 1.0, 1.5], [0.0, 3.1, 0.0]] {
            let back = log(exp(v));
            for i in 0..3 {
                assert!((back[i] - v[i]).abs() < 2e-5, "{v:?} came back as {back:?}");
            }
        }
    }

    #[test]
    fn slerp_goes_along_the_geodesic() {
        let (a, b) = (exp([0.4, 1.0, -0.3]), exp([-0.2, 0.1, 0.7]));
        let way = log(multiply(conjugate(a), b));
        for t in [0.0, 0.25, 0.5, 1.0, 1.6] {
            let expected = multiply(a, exp(way.map(|v| t * v)));
            for other in [b, b.map(|v| -v)] {
                assert!(angle(slerp(t, a, other), expected) < 1e-5, "{t}");
            }
        }
        assert!(angle(slerp(0.5, a, a), a) < 1e-6);
        let near = multiply(a, exp([1e-3, 0.0, 0.0]));
        assert!((angle(a, near) - 1e-3).abs() < 1e-6 && (angle(slerp(0.5, a, near), a) - 5e-4).abs() < 1e-6);
    }

    #[test]
    fn rotating_by_a_product_is_rotating_twice() {
        let (a, b) = (exp([0.4, 1.0, -0.3]), exp([-1.2, 0.1, 0.7]));
        let v = [0.3, -1.0, 2.0];
        let once = rotate(multiply(a, b), v);
        let twice = rotate(a, rotate(b, v));
        for i in 0..3 {
            assert!((once[i] - twice[i]).abs() < 1e-5);
        }
    }

    #[test]
    fn a_quarter_turn_about_y_takes_forward_to_left() {
        let v = rotate(about_y(core::f32::consts::FRAC_PI_2), [0.0, 0.0, 1.0]);
        assert!((v[0] - 1.0).abs() < 1e-6 && v[2].abs() < 1e-6);
    }
}
