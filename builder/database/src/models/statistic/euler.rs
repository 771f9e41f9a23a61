//! Transfer with Euler angles (section 5.3, eq. 5), which the paper shows to fail.
//!
//! `θ_t = σ_r / σ_s (θ_s - θ̄_s) + θ̄_r`, angle by angle, in the order Z, X, Y; equivalent angles are chosen nearest
//! to those of the frame before, so that curves are continuous.

use gestus_core::math::quaternion::Quaternion;
use nalgebra::UnitQuaternion;

use gestus_motion::euler::{about, angles};
use gestus_motion::statistics::moments;

const ORDER: [usize; 3] = [2, 0, 1];
/// Greatest factor of a standard deviation, as with quaternions.
const MOST_SCALE: f64 = 4.0;

/// The rotations `from`, with means and standard deviations of the angles of `to`.
pub fn moved(from: &[Quaternion], to: &[Quaternion]) -> Vec<Quaternion> {
    let (source, reference) = (curves(from), curves(to));
    let scaled: [Vec<f64>; 3] = [0, 1, 2].map(|k| {
        let (mean, deviation) = moments(source.iter().map(|a| a[k]), 1e-3);
        let (to_mean, to_deviation) = moments(reference.iter().map(|a| a[k]), 1e-3);
        let scale = (to_deviation / deviation).min(MOST_SCALE);
        source.iter().map(|a| to_mean + scale * (a[k] - mean)).collect()
    });
    (0..from.len())
        .map(|t| {
            let q =
                about(ORDER[0], scaled[0][t]) * about(ORDER[1], scaled[1][t]) * about(ORDER[2], scaled[2][t]);
            [q.i as f32, q.j as f32, q.k as f32, q.w as f32]
        })
        .collect()
}

fn curves(rotations: &[Quaternion]) -> Vec<[f64; 3]> {
    let mut near = [0.0; 3];
    rotations
        .iter()
        .map(|q| {
            let [x, y, z, w] = q.map(f64::from);
            near = angles(&UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z)), ORDER, near);
            near
        })
        .collect()
}
