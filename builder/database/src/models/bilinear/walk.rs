//! One cycle at a mix of styles and a speed, and the walk that repeats it.

use gestus_core::blob::layout::dof;
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame, interpolate},
};
use nalgebra::Vector3;

use super::{Bilinear, error::BilinearError};

/// Positions tried between two known speeds.
const TRIED: usize = 20;
/// The most by which steps are made quicker, or slower.
const MAX_CADENCE_RATIO: f64 = 2.0;

/// One cycle of a walk, whose end meets its start.
#[derive(Debug, Clone)]
pub struct LoopCycle {
    /// Dofs, shape `[frames][D]`.
    pub rows: Vec<Vec<f64>>,
    /// Time from each row to the next, the last one's to the first, seconds.
    pub steps_s: Vec<f64>,
    /// How much quicker its steps are than the model has them there.
    pub cadence: f64,
}

impl LoopCycle {
    /// Length, seconds.
    pub fn duration_s(&self) -> f64 {
        self.steps_s.iter().sum()
    }

    /// Mean forward speed, metres a second.
    pub fn speed_m_s(&self) -> f64 {
        let way: f64 = self.rows.iter().zip(&self.steps_s).map(|(row, step)| row[dof::FORWARD] * step).sum();
        way / self.duration_s().max(1e-9)
    }

    fn at_cadence(mut self, cadence: f64) -> Self {
        self.cadence = cadence;
        self.steps_s.iter_mut().for_each(|step| *step /= cadence);
        for row in &mut self.rows {
            [dof::FORWARD, dof::LEFT, dof::YAW].into_iter().for_each(|rate| row[rate] *= cadence);
        }
        self
    }

    /// The cycle again and again, as a clip of some seconds.
    pub fn walk(&self, body: &Body, seconds: f64, rate_hz: f64) -> Clip {
        let (mut ground, mut heading, mut time) = (Vector3::zeros(), 0.0, 0.0);
        let mut poses: Vec<(f64, Frame)> = Vec::new();
        for (row, step) in self.rows.iter().zip(&self.steps_s).cycle() {
            // Steps are longer than 0: it ends.
            if time > seconds {
                break;
            }
            poses.push((time, body.pose(row, [ground.x, ground.z], heading)));
            ground += about_y(heading) * Vector3::new(row[dof::LEFT], 0.0, row[dof::FORWARD]) * *step;
            heading += row[dof::YAW] * step;
            time += step;
        }
        let mut at = 0;
        let count = (poses.last().map_or(0.0, |p| p.0).min(seconds) * rate_hz) as usize;
        let frames = (0..=count)
            .map(|i| {
                let now = i as f64 / rate_hz;
                while at + 2 < poses.len() && poses[at + 1].0 <= now {
                    at += 1;
                }
                let next = (at + 1).min(poses.len() - 1);
                let span = (poses[next].0 - poses[at].0).max(1e-9);
                interpolate(&poses[at].1, &poses[next].1, ((now - poses[at].0) / span).clamp(0.0, 1.0))
            })
            .collect();
        Clip { name: "loop".into(), skeleton: body.skeleton.clone(), rate_hz, frames }
    }
}

impl Bilinear {
    /// The cycle at a mix of styles (weights that sum to 1; some may be negative) that walks at a speed, metres a
    /// second.
    ///
    /// A style has speeds of its own, so its place among the known ones is found by walking: the nearest one to their
    /// middle that has the speed. Where none has, the nearest speed is walked in quicker or slower steps.
    ///
    /// `beyond` is how far beyond the slowest and the fastest cycle the model is extrapolated before that, in steps
    /// from one known speed to the next. The paper extrapolates; real cycles at such speeds are nearer to 0
    /// (`docs/PAPERS.md`).
    ///
    /// # Errors
    /// [`BilinearError::Speed`] where steps would have to be more than twice as quick, or slow.
    pub fn cycle(&self, weights: &[f64], speed: f64, beyond: f64) -> Result<LoopCycle, BilinearError> {
        let last = (self.speeds_m_s.len() - 1) as f64;
        let count = ((last + 2.0 * beyond) * TRIED as f64).round() as usize;
        let tried: Vec<(f64, f64)> = (0..=count)
            .map(|i| i as f64 / TRIED as f64 - beyond)
            .map(|position| (position, self.at(weights, position).speed_m_s()))
            .collect();
        let crossings = tried.windows(2).filter(|w| (w[0].1 - speed) * (w[1].1 - speed) <= 0.0);
        let from_middle = |w: &[(f64, f64)]| (w[0].0 - last / 2.0).abs();
        let found = crossings.min_by(|a, b| from_middle(a).total_cmp(&from_middle(b))).map(|w| {
            let (mut low, mut high) = (w[0], w[1]);
            for _ in 0..40 {
                let middle = (low.0 + high.0) / 2.0;
                let walked = (middle, self.at(weights, middle).speed_m_s());
                *if (walked.1 - speed) * (low.1 - speed) > 0.0 { &mut low } else { &mut high } = walked;
            }
            high
        });
        let distance = |t: &(f64, f64)| (t.1 - speed).abs();
        let nearest = tried.iter().copied().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let (position, walked) = found.or(nearest).unwrap_or((0.0, speed));
        let cadence = speed / walked.max(1e-6);
        if !(1.0 / MAX_CADENCE_RATIO..=MAX_CADENCE_RATIO).contains(&cadence) {
            let speeds = || tried.iter().map(|t| t.1.max(0.0));
            return Err(BilinearError::Speed {
                speed_m_s: speed,
                slowest: speeds().fold(f64::INFINITY, f64::min) / MAX_CADENCE_RATIO,
                fastest: speeds().fold(0.0, f64::max) * MAX_CADENCE_RATIO,
            });
        }
        Ok(self.at(weights, position).at_cadence(cadence))
    }

    /// Mean forward speeds of a mix of styles at the known speeds, the slowest first, metres a second.
    pub fn speeds_of(&self, weights: &[f64]) -> Vec<f64> {
        (0..self.speeds_m_s.len()).map(|v| self.at(weights, v as f64).speed_m_s()).collect()
    }

    /// The cycle at a place among the known speeds: 0 at the slowest, 1 at the next; beyond them it is extrapolated.
    fn at(&self, weights: &[f64], position: f64) -> LoopCycle {
        let vector = self.vector(weights, position);
        let rows: Vec<&[f64]> = vector.chunks_exact(self.dofs + 1).collect();
        let closing: Vec<f64> = rows[self.frames].iter().zip(rows[0]).map(|(a, b)| a - b).collect();
        let closed = rows[..self.frames].iter().enumerate().map(|(k, row)| {
            // What the end has more than the start is taken away evenly.
            let share = k as f64 / self.frames as f64 - 0.5;
            let mut row: Vec<f64> = row.iter().zip(&closing).map(|(v, c)| v - share * c).collect();
            let slope = row.pop().unwrap_or(0.0).clamp(-1.4, 1.4).exp();
            (row, slope / self.rate_hz)
        });
        let (rows, steps_s) = closed.unzip();
        LoopCycle { rows, steps_s, cadence: 1.0 }
    }

    /// The vector at a mix of styles and a place among the known speeds: between two of them, or beyond the last two.
    pub(super) fn vector(&self, weights: &[f64], position: f64) -> Vec<f64> {
        let styles = self.styles.nrows();
        let a: Vec<f64> =
            (0..styles).map(|i| (0..styles).map(|s| weights[s] * self.styles[(s, i)]).sum()).collect();
        let speeds = self.speeds_m_s.len();
        let at = (position.max(0.0) as usize).min(speeds.saturating_sub(2));
        let t = position - at as f64;
        let b: Vec<f64> =
            (0..speeds).map(|j| (1.0 - t) * self.speeds[(at, j)] + t * self.speeds[(at + 1, j)]).collect();
        let mut sum = self.mean.clone();
        for (row, a) in self.core.iter().zip(&a) {
            for (vector, b) in row.iter().zip(&b) {
                sum.iter_mut().zip(vector).for_each(|(s, v)| *s += a * b * v);
            }
        }
        sum
    }
}
