//! Simulated annotators, to measure how well Effort can be learned without labels from people.
//!
//! They are fixed functions of a motion's kinematics with noise, both unknown to the learner. The first one sees the
//! descriptors d of [`estimate`](gestus_database::effort::estimate), each as the deviation from the action's mean in
//! standard deviations:
//!
//! ```text
//! flow   = 1.2 d_flow                       nearly linear (Torresani 2006, Figure 1)
//! weight = 3 tanh(1.8 d_weight)             saturates
//! time   = 3 tanh(1.5 d_time - 0.5 d_flow)  sooner sudden where flow is free
//! ```
//!
//! The second one feels force instead; it was made when the learner got its kernel of pairs, which is why both are measured
//! (`docs/experiments/effort.md`). With E the mean squared speed
//! of the joints and A their mean squared acceleration, in the same way:
//!
//! ```text
//! flow   = 1.2 d_flow
//! weight = 3 tanh(1.5 E)
//! time   = 3 tanh(1.5 A - 0.3 d_flow)
//! ```
//!
//! Both are held to -3 to 3, with Gaussian noise of 0.3 a factor: analysts agree no better. The forces are quadratic in
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

/// What an annotator goes by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Eye {
    /// The descriptors of weight and time.
    Descriptors,
    /// Mean squared speed and acceleration.
    Force,
}

/// The annotator, used to the actions of a library.
#[derive(Debug, Clone)]
pub struct Annotator {
    eye: Eye,
    body: Body,
    rate_hz: f64,
    /// Mean and standard deviation of each descriptor, by action.
    usual: Vec<[(f64, f64); 3]>,
    seed: u64,
}

impl Annotator {
    /// An annotator who has seen the fragments of a library.
    pub fn of(library: &Library, eye: Eye, seed: u64) -> Self {
        let usual = (0..library.actions.len())
            .map(|action| {
                let seen: Vec<Factors> = library
                    .fragments
                    .iter()
                    .filter(|f| f.action == action)
                    .filter_map(|f| eye.numbers(&library.body, &f.rows, library.rate_hz))
                    .collect();
                std::array::from_fn(|k| moments(seen.iter().map(|d| d[k]), eye.least()))
            })
            .collect();
        Self { eye, body: library.body.clone(), rate_hz: library.rate_hz, usual, seed }
    }

    /// What the annotator notes of a motion: the same motion is noted the same way.
    pub fn note(&self, rows: &[Vec<f64>], action: usize) -> Option<Factors> {
        let found = self.eye.numbers(&self.body, rows, self.rate_hz)?;
        let usual = &self.usual[action];
        let d: Factors = std::array::from_fn(|k| (found[k] - usual[k].0) / usual[k].1);
        let (weight, flow) = match self.eye {
            Eye::Descriptors => (1.8, 0.5),
            Eye::Force => (1.5, 0.3),
        };
        let seen = [1.2 * d[0], 3.0 * (weight * d[1]).tanh(), 3.0 * (1.5 * d[2] - flow * d[0]).tanh()];
        // A stream of chances of its own for every motion, named by its numbers.
        let name = found.iter().fold(0u64, |h, v| h.wrapping_mul(0x0100_0000_01b3) ^ v.to_bits());
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ name);
        let noise = gaussian(&mut rng);
        Some(std::array::from_fn(|k| (seen[k] + NOISE * noise[k]).clamp(-POLE, POLE)))
    }
}

impl Eye {
    /// The numbers that it goes by.
    fn numbers(self, body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Option<Factors> {
        match self {
            Self::Descriptors => descriptors(body, rows, rate_hz),
            Self::Force => force(body, rows, rate_hz),
        }
    }

    /// Least deviation of these numbers.
    fn least(self) -> f64 {
        match self {
            Self::Descriptors => 0.01,
            Self::Force => 1e-9,
        }
    }
}

/// The descriptor of flow, mean squared speed and mean squared acceleration.
fn force(body: &Body, rows: &[Vec<f64>], rate_hz: f64) -> Option<Factors> {
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
