//! Mean and spread of rotations (paper 002, section 5.4, eq. 6).
//!
//! The mean is recursive: `q̄_n = Slerp(1/n, q̄_{n-1}, q_n)`, every quaternion taken on the mean's side of the sphere.
//! (Eq. 6 prints the weight as `(n-1)/n`, which with the paper's own Slerp would forget all but the last: the order
//! of its arguments is meant.) It depends on the order of the frames; the geodesic mean, which does not, is the
//! rotation with the least sum of squared distances, and [`geodesic`] iterates to it: `q̄ ← q̄ exp(mean of
//! log(q̄⁻¹ q_i))`.
//!
//! In `f32`, by the functions that the core streams with. Cost: one slerp a frame.

use gestus_core::quaternion::{self, Quaternion, angle, slerp};

/// Mean and standard deviation of rotations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// The mean.
    pub mean: Quaternion,
    /// Root mean square of the geodesic distances to it, radians.
    pub deviation: f32,
}

/// Smallest standard deviation of a joint, radians: less is noise.
pub const LEAST: f32 = 1e-3;

/// The recursive mean of rotations; none of none.
pub fn recursive(rotations: impl IntoIterator<Item = Quaternion>) -> Quaternion {
    let mut mean = quaternion::IDENTITY;
    for (before, q) in rotations.into_iter().enumerate() {
        mean = if before == 0 { q } else { slerp(1.0 / (before as f32 + 1.0), mean, q) };
    }
    mean
}

/// The geodesic mean, from a first guess by some rounds of Newton's method; about four are enough.
pub fn geodesic(
    guess: Quaternion,
    rotations: impl IntoIterator<Item = Quaternion> + Clone,
    rounds: usize,
) -> Quaternion {
    let mut mean = guess;
    for _ in 0..rounds {
        let (mut sum, mut count) = ([0.0_f64; 3], 0.0_f64);
        for q in rotations.clone() {
            let way = quaternion::log(quaternion::multiply(quaternion::conjugate(mean), q));
            sum.iter_mut().zip(way).for_each(|(s, w)| *s += f64::from(w));
            count += 1.0;
        }
        let step = sum.map(|s| (s / count.max(1.0)) as f32);
        mean = quaternion::normalize(quaternion::multiply(mean, quaternion::exp(step))).unwrap_or(mean);
    }
    mean
}

/// Mean and spread of rotations: recursive, then `rounds` towards the geodesic mean.
pub fn spread(rotations: impl IntoIterator<Item = Quaternion> + Clone, rounds: usize) -> Spread {
    let mean = geodesic(recursive(rotations.clone()), rotations.clone(), rounds);
    let (mut sum, mut count) = (0.0_f64, 0.0_f64);
    for q in rotations {
        let distance = f64::from(angle(mean, q));
        sum += distance * distance;
        count += 1.0;
    }
    Spread { mean, deviation: ((sum / count.max(1.0)).sqrt() as f32).max(LEAST) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion;
    use nalgebra::{UnitQuaternion, Vector3};

    fn rotations(spread: f64) -> Vec<UnitQuaternion<f64>> {
        (0..300)
            .map(|t| {
                let x = f64::from(t) * 0.21;
                let way = Vector3::new(x.sin(), (1.7 * x).cos() * 0.6, (0.3 * x).sin()) * spread;
                UnitQuaternion::from_scaled_axis(Vector3::new(0.4, 1.1, -0.3))
                    * UnitQuaternion::from_scaled_axis(way)
            })
            .collect()
    }

    /// Every other one with its sign turned: the same rotation.
    fn narrow(rotations: &[UnitQuaternion<f64>]) -> Vec<Quaternion> {
        let signed = |(i, q): (usize, &UnitQuaternion<f64>)| {
            let s = if i % 2 == 0 { 1.0 } else { -1.0 };
            [q.i, q.j, q.k, q.w].map(|v| (s * v) as f32)
        };
        rotations.iter().enumerate().map(signed).collect()
    }

    #[test]
    fn the_recursive_mean_is_the_papers() {
        let all = rotations(0.5);
        let mut truth = all[0];
        for (n, q) in all.iter().enumerate().skip(1) {
            truth = motion::slerp(&truth, q, 1.0 / (n as f64 + 1.0));
        }
        let found = recursive(narrow(&all));
        let truth = narrow(&[truth])[0];
        assert!(angle(found, truth) < 1e-5, "{found:?} {truth:?}");
    }

    #[test]
    fn the_geodesic_mean_is_where_the_squares_are_least() {
        let all = narrow(&rotations(0.8));
        let mean = geodesic(recursive(all.clone()), all.clone(), 8);
        let cost = |m: Quaternion| all.iter().map(|&q| f64::from(angle(m, q)).powi(2)).sum::<f64>();
        let best = cost(mean);
        for way in
            [[0.01, 0.0, 0.0], [-0.01, 0.0, 0.0], [0.0, 0.01, 0.0], [0.0, 0.0, -0.01], [0.0, -0.01, 0.01]]
        {
            assert!(cost(quaternion::multiply(mean, quaternion::exp(way))) > best);
        }
        // The recursive one is near it, and not the same.
        let off = angle(mean, recursive(all.clone()));
        assert!((1e-4..0.05).contains(&off), "{off}");
        assert!((spread(all.clone(), 8).deviation - (best / 300.0).sqrt() as f32).abs() < 1e-4);
    }
}
