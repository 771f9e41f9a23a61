//! Axes: which way is up, with their signs, and those of a body.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use serde::{Deserialize, Deserializer, Serialize, Serializer, de::Error};

/// Y.
pub const Y: (usize, f64) = (1, 1.0);
/// Axes with their signs, in words.
pub const AXES: [(&str, (usize, f64)); 6] =
    [("x", (0, 1.0)), ("y", Y), ("z", (2, 1.0)), ("-x", (0, -1.0)), ("-y", (1, -1.0)), ("-z", (2, -1.0))];

/// The axis and the sign of a word.
///
/// # Errors
/// Another word, with those that there are.
pub fn of_name(word: &str) -> Result<(usize, f64), String> {
    let known = AXES.iter().find(|(name, _)| *name == word);
    known.map(|(_, axis)| *axis).ok_or_else(|| "x, y, z, -x, -y or -z".to_owned())
}

/// Reads an axis of a settings file; the reader names the line.
///
/// # Errors
/// As [`of_name`].
pub fn deserialize<'d, D: Deserializer<'d>>(from: D) -> Result<Option<(usize, f64)>, D::Error> {
    let word = String::deserialize(from)?;
    let axis = of_name(&word).map_err(|known| D::Error::custom(format!("`{word}` is no axis: {known}")))?;
    Ok(Some(axis))
}

/// Writes an axis for a settings file.
///
/// # Errors
/// A writer that fails.
pub fn serialize<S: Serializer>(axis: &Option<(usize, f64)>, to: S) -> Result<S::Ok, S::Error> {
    axis.map(name).serialize(to)
}

/// An axis and its sign in words.
pub fn name((axis, sign): (usize, f64)) -> String {
    format!("{}{}", if sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis])
}

/// The rotation of an axis to Y.
pub fn to_y((axis, sign): (usize, f64)) -> UnitQuaternion<f64> {
    let from = Vector3::from_fn(|i, _| if i == axis { sign } else { 0.0 });
    UnitQuaternion::rotation_between(&from, &Vector3::y())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// Axes with Y along `up` and X as near to `left` as possible; the reverse if `left` is more reliable.
pub fn axes(up: Vector3<f64>, left: Vector3<f64>, left_first: bool) -> UnitQuaternion<f64> {
    let (first, second) = if left_first { (left, up) } else { (up, left) };
    let a = first.try_normalize(1e-9).unwrap_or_else(Vector3::y);
    let b = (second - a * a.dot(&second)).try_normalize(1e-6).unwrap_or_else(|| any_across(&a));
    let (y, x) = if left_first { (b, a) } else { (a, b) };
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

/// A direction across another.
pub fn any_across(v: &Vector3<f64>) -> Vector3<f64> {
    let other = if v.x.abs() < 0.7 * v.norm() { Vector3::x() } else { Vector3::z() };
    v.cross(&other).normalize()
}
