//! Vectors of three numbers: metres, metres a second, or directions.

use crate::math::{quaternion::Vector, sqrt};

/// Squared length below which a vector has no direction, metres² (or its square).
const NO_DIRECTION: f32 = 1e-12;

/// `a + b`.
#[inline]
pub(crate) fn add(a: Vector, b: Vector) -> Vector {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// `a - b`.
#[inline]
pub(crate) fn subtract(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// The scalar product.
#[inline]
pub(crate) fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The vector product.
#[inline(never)]
pub(crate) fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Length of a vector.
#[inline(never)]
pub(crate) fn norm(v: Vector) -> f32 {
    sqrt(dot(v, v))
}

/// Distance of two points.
pub fn distance(a: Vector, b: Vector) -> f32 {
    norm(subtract(a, b))
}

/// The direction of a vector: of length 1, or `None` where it has none.
#[inline(never)]
pub(crate) fn unit(v: Vector) -> Option<Vector> {
    let length2 = dot(v, v);
    (length2 > NO_DIRECTION).then(|| {
        let inverse = 1.0 / sqrt(length2);
        v.map(|x| x * inverse)
    })
}
