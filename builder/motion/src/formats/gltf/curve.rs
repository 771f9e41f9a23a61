//! An animation curve: keyframes and their interpolation.

use std::rc::Rc;

use gltf::animation::Interpolation;
use nalgebra::{Quaternion, SVector, UnitQuaternion, Vector3};

use crate::{clip::slerp, formats::gltf::data::Numbers, statistics::hermite};

/// Keyframes. With cubic splines each has three values: incoming slope, value, outgoing slope.
#[derive(Debug, Clone)]
pub struct Curve<'b, const N: usize> {
    times: Rc<[f64]>,
    values: Numbers<'b, N>,
    interpolation: Interpolation,
}

impl<'b, const N: usize> Curve<'b, N> {
    /// # Errors
    /// A message if there is not one value (or three) per time.
    pub fn new(
        times: Rc<[f64]>,
        values: Numbers<'b, N>,
        interpolation: Interpolation,
    ) -> Result<Self, &'static str> {
        let each = if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
        if values.len() != each * times.len() {
            return Err("it has another number of values than its times want");
        }
        Ok(Self { times, values, interpolation })
    }

    /// Seconds, ascending.
    pub fn times(&self) -> &[f64] {
        &self.times
    }

    fn value(&self, key: usize) -> SVector<f64, N> {
        let at = if self.interpolation == Interpolation::CubicSpline { 3 * key + 1 } else { key };
        self.values.at(at).into()
    }

    /// The key before a time, and the fraction of the way to the next, 0 to 1. Clamped to the first and last key.
    fn place(&self, time: f64) -> (usize, f64) {
        let after = self.times.partition_point(|&t| t <= time);
        match (after.checked_sub(1), self.times.get(after)) {
            (None, _) => (0, 0.0),
            (Some(key), None) => (key, 0.0),
            (Some(key), Some(next)) => (key, (time - self.times[key]) / (next - self.times[key])),
        }
    }

    /// Value at a time, component by component.
    fn at(&self, time: f64) -> SVector<f64, N> {
        let (key, u) = self.place(time);
        let now = self.value(key);
        if u <= 0.0 || self.interpolation == Interpolation::Step {
            return now;
        }
        let next = self.value(key + 1);
        if self.interpolation == Interpolation::Linear {
            return now + (next - now) * u;
        }
        // glTF 2.0, appendix C: slopes are per second.
        let seconds = self.times[key + 1] - self.times[key];
        let slope = SVector::<f64, N>::from(self.values.at(3 * key + 2)) * seconds;
        let next_slope = SVector::<f64, N>::from(self.values.at(3 * key + 3)) * seconds;
        let [h0, g0, h1, g1] = hermite(u);
        now * h0 + slope * g0 + next * h1 + next_slope * g1
    }
}

impl Curve<'_, 3> {
    /// The vector at a time.
    pub fn vector(&self, time: f64) -> Vector3<f64> {
        self.at(time)
    }
}

impl Curve<'_, 4> {
    /// Whether every key is a rotation.
    pub fn turns(&self) -> bool {
        (0..self.times.len()).all(|key| unit(self.value(key)).is_some())
    }

    /// The rotation at a time; identity where a spline passes through zero.
    pub fn rotation(&self, time: f64) -> UnitQuaternion<f64> {
        let (key, u) = self.place(time);
        if u > 0.0 && self.interpolation == Interpolation::Linear {
            let [from, to] = [key, key + 1].map(|key| unit(self.value(key)).unwrap_or_default());
            return slerp(&from, &to, u);
        }
        unit(self.at(time)).unwrap_or_default()
    }
}

/// The rotation of a quaternion `[x, y, z, w]`, which need not be of unit length; zeros are none.
pub fn unit(numbers: SVector<f64, 4>) -> Option<UnitQuaternion<f64>> {
    UnitQuaternion::try_new(Quaternion::from_vector(numbers), 1e-9)
}
