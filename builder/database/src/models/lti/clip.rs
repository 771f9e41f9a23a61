//! Runs a linear model over a whole clip in `f64`, with a settled initial state.
//!
//! The state before the first frame is unknown. The core starts a stream at `x = 0`. A whole clip is extrapolated
//! backwards instead (Hsu 2005, section 4.4), and the model runs over the extrapolation first. It uses linear prediction:
//! each dof is a weighted sum of its next few values, clamped to its range in the clip. Cost: one pass, and one small
//! least squares problem per dof.

use nalgebra::{DMatrix, DVector};

use crate::models::lti::Model;
use gestus_motion::statistics::{dot, mean};

/// Bounds of the logarithm of the time warp, as in the core.
const LOG_STEP: f64 = 1.386_294_4;

/// Order of the linear prediction.
const PREDICTORS: usize = 10;

/// Options of a translation.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// Frames that are extrapolated backwards; 0: the start is at `x = 0`.
    pub before: usize,
    /// kc and kp of the blend of unexpected input (eqs. 7 and 8); `None`: no blend.
    pub generalise: Option<(f64, f64)>,
    /// Part of the last frame's blend that is left in the next, from 0 (as in the paper) to 1.
    pub left: f64,
}

/// Result of a translation.
#[derive(Debug, Clone)]
pub struct Translated {
    /// Dofs, shape `[frames][D]`.
    pub rows: Vec<Vec<f64>>,
    /// Differential time warp of each frame: output time for each unit of input time.
    pub warp: Vec<f64>,
    /// Which foot stands.
    pub contacts: Vec<[bool; 2]>,
    /// How much of the input was blended in.
    pub passed: Vec<f64>,
}

impl Model {
    /// Translates a clip's dofs, shape `[frames][D]`.
    pub fn translate(&self, rows: &[Vec<f64>], options: &Options) -> Translated {
        let dofs = self.inputs.len();
        let mut out =
            Translated { rows: Vec::new(), warp: Vec::new(), contacts: Vec::new(), passed: Vec::new() };
        if rows.is_empty() {
            return out;
        }
        let earlier = backwards(rows, options.before);
        let before = earlier.len();
        let mut states: Vec<DVector<f64>> =
            self.units.iter().map(|u| DVector::zeros(u.system.order())).collect();
        for (t, x) in earlier.into_iter().chain(rows.iter().cloned()).enumerate() {
            let u: Vec<f64> = x.iter().zip(&self.inputs).map(|(x, (mean, sd))| (x - mean) / sd).collect();
            let mut y = vec![0.0; dofs + 1];
            for (unit, state) in self.units.iter().zip(&mut states) {
                let system = &unit.system;
                let own =
                    DVector::from_column_slice(&u[unit.first_input..unit.first_input + system.b.ncols()]);
                let output = &system.c * &*state + &system.d * &own;
                y[unit.first_output..unit.first_output + output.len()].copy_from_slice(output.as_slice());
                *state = &system.a * &*state + &system.b * own;
            }
            if t < before {
                continue;
            }
            let furthest = u.iter().fold(0.0, |most: f64, u| most.max(u.abs()));
            let unexpected = options.generalise.map_or(0.0, |constants| blend(furthest, constants));
            let last = out.passed.last().copied().unwrap_or(unexpected);
            let passed = unexpected + options.left * (last - unexpected);
            let value = |d: usize| self.outputs[d].0 + self.outputs[d].1 * y[d];
            out.rows.push((0..dofs).map(|d| passed * x[d] + (1.0 - passed) * value(d)).collect());
            out.warp.push(((1.0 - passed) * value(dofs).clamp(-LOG_STEP, LOG_STEP)).exp());
            let features: Vec<f64> =
                states.iter().flat_map(|s| s.iter().copied().collect::<Vec<_>>()).collect();
            out.contacts.push([0, 1].map(|side| {
                let foot = &self.feet[side];
                dot(&features, &foot.projection) > foot.boundary
            }));
            out.passed.push(passed);
        }
        out
    }
}

/// How much of the input is blended in where a dof is that many standard deviations from its mean (Hsu 2005, eqs. 7 and 8).
pub fn blend(deviations: f64, (kc, kp): (f64, f64)) -> f64 {
    libm::erf(deviations.abs() / (kc * std::f64::consts::SQRT_2)).powf(kp)
}

/// Extrapolated frames before the first, in order of time. Shape `[count][D]`; empty for clips that are too short.
fn backwards(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let dofs = rows[0].len();
    if rows.len() < 4 * PREDICTORS {
        return Vec::new();
    }
    let mut earlier = vec![vec![0.0; dofs]; count];
    for d in 0..dofs {
        let mean = mean(rows.iter().map(|r| r[d]));
        let values: Vec<f64> = rows.iter().map(|r| r[d] - mean).collect();
        let (low, high) = values.iter().fold((0.0_f64, 0.0_f64), |(l, h), &v| (l.min(v), h.max(v)));
        let known = DMatrix::from_fn(values.len() - PREDICTORS, PREDICTORS, |t, k| values[t + 1 + k]);
        let wanted = DVector::from_column_slice(&values[..values.len() - PREDICTORS]);
        let mut square = known.tr_mul(&known);
        let ridge = 1e-3 * square.trace() / PREDICTORS as f64 + 1e-12;
        for k in 0..PREDICTORS {
            square[(k, k)] += ridge;
        }
        let Some(weights) = square.cholesky().map(|c| c.solve(&known.tr_mul(&wanted))) else { continue };
        let mut next: Vec<f64> = values[..PREDICTORS].to_vec();
        for row in earlier.iter_mut().rev() {
            let value: f64 = next.iter().zip(weights.iter()).map(|(v, w)| v * w).sum();
            let value = value.clamp(low, high);
            row[d] = mean + value;
            next.rotate_right(1);
            next[0] = value;
        }
    }
    earlier
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gait_goes_on_backwards() {
        let value = |t: f64, d: f64| (0.21 * t + d).sin() + 0.3 * (0.42 * t + 2.0 * d).cos() + d;
        let rows: Vec<Vec<f64>> =
            (0..200).map(|t| (0..3).map(|d| value(f64::from(t), f64::from(d))).collect()).collect();
        let earlier = backwards(&rows, 30);
        for (k, row) in earlier.iter().enumerate() {
            for (d, v) in row.iter().enumerate() {
                let truth = value(k as f64 - 30.0, d as f64);
                // It fades the further back it goes.
                let most = if k < 26 { 0.4 } else { 0.15 };
                assert!((v - truth).abs() < most, "frame {k}, dof {d}: {v} for {truth}");
            }
        }
        assert!(backwards(&rows[..20], 30).is_empty());
    }
}
