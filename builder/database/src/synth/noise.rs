//! Smooth noise over canonical time.
//!
//! Numbers drawn once at regular points, with cubic (Catmull-Rom) curves between them: the
//! numbers belong to the content, their amplitude and speed to the style. Standard deviation about 1 at the points,
//! limited to 2.

use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Channels of smooth noise.
#[derive(Debug, Clone)]
pub struct Noise {
    per_unit: f64,
    start: f64,
    values: Vec<Vec<f64>>,
}

impl Noise {
    /// Noise with `per_unit` points for each unit of canonical time, from `start` to `end`.
    pub fn new(seed: u64, stream: u64, channels: usize, per_unit: f64, start: f64, end: f64) -> Self {
        let mut rng = rng(seed, stream);
        let points = ((end - start) * per_unit).ceil().max(0.0) as usize + 4;
        let values = (0..channels).map(|_| (0..points).map(|_| normal(&mut rng)).collect()).collect();
        Self { per_unit, start: start - 1.0 / per_unit, values }
    }

    /// Value of a channel at a canonical time.
    pub fn at(&self, channel: usize, canonical: f64) -> f64 {
        let values = &self.values[channel];
        let x = ((canonical - self.start) * self.per_unit).clamp(1.0, (values.len() - 3) as f64 + 0.999_999);
        let i = x as usize;
        let t = x - i as f64;
        let [a, b, c, d] = [values[i - 1], values[i], values[i + 1], values[i + 2]];
        b + 0.5 * t * (c - a + t * (2.0 * a - 5.0 * b + 4.0 * c - d + t * (3.0 * (b - c) + d - a)))
    }
}

/// The generator of one stream of a seed: streams do not depend on how much another one drew.
pub fn rng(seed: u64, stream: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(stream);
    rng
}

/// About normal: twelve uniform numbers, limited to two standard deviations.
pub fn normal(rng: &mut ChaCha8Rng) -> f64 {
    ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0).clamp(-2.0, 2.0)
}

/// Uniform between two numbers.
pub fn between(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * rng.random::<f64>()
}
