//! Transfer with Euler angles (section 5.3, eq. 5), which the paper shows to fail.
//!
//! `θ_t = σ_r / σ_s (θ_s - θ̄_s) + θ̄_r`, angle by angle, in the order Z, X, Y; equivalent angles are chosen nearest
//! to those of the frame before, so that curves are continuous.

use gestus_core::math::quaternion::Quaternion;
use gestus_motion::{
    clip::rotation,
    euler::{about, angles},
    statistics::moments,
};

use crate::models::{numbers::narrow, statistic::mean::MAX_SCALE};

const ORDER: [usize; 3] = [2, 0, 1];

/// The rotations `from`, with means and standard deviations of the angles of `to`.
pub fn moved(from: &[Quaternion], to: &[Quaternion]) -> Vec<Quaternion> {
    let (source, reference) = (curves(from), curves(to));
    let scaled: [Vec<f64>; 3] = [0, 1, 2].map(|k| {
        let (mean, deviation) = moments(source.iter().map(|a| a[k]), 1e-3);
        let (to_mean, to_deviation) = moments(reference.iter().map(|a| a[k]), 1e-3);
        let scale = (to_deviation / deviation).min(f64::from(MAX_SCALE));
        source.iter().map(|a| to_mean + scale * (a[k] - mean)).collect()
    });
    (0..from.len())
        .map(|t| {
            let turn = |k: usize| about(ORDER[k], scaled[k][t]);
            narrow(&(turn(0) * turn(1) * turn(2)))
        })
        .collect()
}

fn curves(rotations: &[Quaternion]) -> Vec<[f64; 3]> {
    let mut near = [0.0; 3];
    rotations
        .iter()
        .map(|q| {
            near = angles(&rotation(*q), ORDER, near);
            near
        })
        .collect()
}
