//! A simulated annotator, to measure how well Effort can be learned without labels from people.
//!
//! It is a fixed function of a motion's kinematics with noise, both unknown to the learner. With E the mean squared speed
//! of the joints and A their mean squared acceleration, each as the deviation from the action's mean in standard deviations, and d the descriptor of flow of [`estimate`](gestus_database::effort::estimate) in the same way:
//!
//! ```text
//! flow   = 1.2 d                  nearly linear (Torresani 2006, Figure 1)
//! weight = 3 tanh(1.5 E)          saturates
//! time   = 3 tanh(1.5 A - 0.3 d)  sooner sudden where flow is free
//! ```
//!
//! held to -3 to 3, with Gaussian noise of 0.3 a factor: analysts agree no better. Both forces are quadratic in
//! the motion, so that a blend is lighter than its ends are on the average and an extrapolation is stronger.

use nalgebra::Vector3;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use gestus_database::effort::{
    Factors, POLE,
    estimate::descriptors,
    fragment::{Library, walk},
};
use gestus_motion::{body::Body, statistics::moments};

/// Standard deviation of the noise.
const NOISE: f64 = 0.3;

/// The annotator, used to the actions of a library.
#[derive(Debug, Clone)]
pub struct Annotator {
    body: Body,
    rate_hz: f64,
    /// Mean and standard deviation of each descriptor, by action.
    habits: Vec<[(f64, f64); 3]>,
    seed: u64,
}

impl Annotator {
    /// An annotator who has seen the fragments of a library.
    pub fn of(library: &Library, seed: u64) -> Self {
        let habits = (0..library.actions.len())
            .map(|action| {
                let seen: Vec<Factors> = library
                    .fragments
                    .iter()
                    .filter(|f| f.action == action)
                    .filter_map(|f| felt(&library.body, &f.rows, library.rate_hz))
                    .collect();
                std::array::from_fn(|k| moments(seen.iter().map(|d| d[k]), 1e-9))
            })
            .collect();
        Self { body: library.body.clone(), rate_hz: library.rate_hz, habits, seed }
    }

    /// What the annotator notes of a motion: the same motion is noted the same way.
    pub fn note(&self, rows: &[Vec<f64>], action: usize) -> Option<Factors> {
        let found = felt(&self.body, rows, self.rate_hz)?;
        let habit = &self.habits[action];
        let d: Factors = std::array::from_fn(|k| (found[k] - habit[k].0) / habit[k].1);
        let seen = [1.2 * d[0], 3.0 * (1.5 * d[1]).tanh(), 3.0 * (1.5 * d[2] - 0.3 * d[0]).tanh()];
        // A stream of chances of its own for every motion, named by its numbers.
        let name = found.iter().fold(0u64, |h, v| h.wrapping_mul(0x0100_0000_01b3) ^ v.to_bits());
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ name);
        let noise = gaussian(&mut rng);
        Some(std::array::from_fn(|k| (seen[k] + NOISE * noise[k]).clamp(-POLE, POLE)))
    }
}

/// The descriptor of flow, mean squared speed and mean squared acceleration.
fn felt(body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Option<Factors> {
    let [flow, _, _] = descriptors(body, rows, rate_hz)?;
    let frames = walk(body, rows, rate_hz);
    let positions: Vec<Vec<Vector3<f64>>> = frames.iter().map(|f| f.positions(&body.skeleton)).collect();
    let (mut speed, mut acceleration) = (0.0, 0.0);
    for w in positions.windows(3) {
        for j in 0..body.skeleton.joints() {
            speed += (w[2][j] - w[1][j]).norm_squared();
            acceleration += (w[2][j] - w[1][j] * 2.0 + w[0][j]).norm_squared();
        }
    }
    let count = (positions.len() - 2) as f64;
    Some([flow, speed / count, acceleration / count])
}

/// Three independent normal numbers, by Box and Muller.
fn gaussian(rng: &mut impl Rng) -> Vector3<f64> {
    let mut one = || {
        let (u, v): (f64, f64) = (rng.random(), rng.random());
        (-2.0 * (1.0 - u).ln()).sqrt() * (std::f64::consts::TAU * v).cos()
    };
    Vector3::new(one(), one(), one())
}
