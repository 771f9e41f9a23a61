//! Axes with their signs: which way is up.

use nalgebra::{UnitQuaternion, Vector3};

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
