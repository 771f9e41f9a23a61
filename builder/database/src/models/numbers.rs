//! Numbers that several models need.

use gestus_core::math::quaternion::Quaternion;
use nalgebra::UnitQuaternion;

/// Little-endian bytes of numbers, as f32.
pub(crate) fn floats(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect()
}

/// A rotation as the core has it.
pub(crate) fn narrow(q: &UnitQuaternion<f64>) -> Quaternion {
    [q.i as f32, q.j as f32, q.k as f32, q.w as f32]
}
