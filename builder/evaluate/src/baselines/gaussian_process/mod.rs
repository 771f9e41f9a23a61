//! Gaussian process editing (Ikemoto, Arikan and Forsyth, "Generalizing Motion Edits with Gaussian Processes", TOG 2009)
//! as a baseline for style, as in Xia 2015, section 7.2.2: the *difference* of output and input is a Gaussian process over
//! the input's pose and change.
//!
//! Two processes are learned and their predictions multiplied, which is what keeps the result stable:
//!
//! ```text
//! kinematics   d[t]          from x[t], x[t] - x[t-1]              variance v_k
//! dynamics     d[t] - d[t-1] from those and d[t-1]                 variance v_d
//! d[t] = (d_k / v_k + (d[t-1] + Δ) / (v + v_d)) / (1 / v_k + 1 / (v + v_d)),   v that of d[t-1]
//! ```
//!
//! Dynamics alone drifts away with its own errors; kinematics alone is as rough as its nearest examples. Far from every
//! example both fall back to their priors: the mean difference, unchanging. Inputs are the first principal components
//! of pose and change (the paper's inputs are poses; a GP over 67 correlated dofs has no lengths to learn).
//!
//! Model selection is that of a user of GPML (Rasmussen and Nickisch 2010): squared exponential covariance with one length
//! an input (ARD) and noise, shared by all outputs, the exact marginal likelihood maximised by L-BFGS on an even subset;
//! from the data's own spread, and again from shorter lengths with less noise and from longer ones with more, for the
//! likelihood has several tops; the highest is taken. Then all examples, up to a stated number, are conditioned on.
//!
//! Cost: O(n³) time and O(n²) memory to fit, O(n²) a prediction with its variance: what makes it unfit for large data.

mod minimise;
mod process;

use std::time::Instant;

use gestus_core::Database;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::baselines::outputs::{Example, Outputs, examples};
use process::{Process, even, standard};

pub use process::{Options, STARTS};

/// Principal components of rows.
#[derive(Debug, Clone)]
struct Principal {
    mean: Vec<f64>,
    directions: Vec<DVector<f64>>,
}

impl Principal {
    fn of(rows: &[Vec<f64>], kept: usize) -> Option<Self> {
        let (mean, _) = standard(rows)?;
        let data = DMatrix::from_fn(rows.len(), mean.len(), |i, d| rows[i][d] - mean[d]);
        let eigen = SymmetricEigen::new(data.tr_mul(&data));
        let mut order: Vec<usize> = (0..mean.len()).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let directions = order.into_iter().take(kept).map(|i| eigen.eigenvectors.column(i).into_owned());
        Some(Self { directions: directions.collect(), mean })
    }

    fn project(&self, row: &[f64]) -> Vec<f64> {
        self.directions
            .iter()
            .map(|c| c.iter().zip(row).zip(&self.mean).map(|((c, v), m)| c * (v - m)).sum())
            .collect()
    }
}

/// The examples of some classes in a style.
#[derive(Debug, Clone, Default)]
pub struct Pairs {
    /// `x[t]`, `x[t-1]`.
    inputs: Vec<[Vec<f64>; 2]>,
    /// `y[t] - x[t]`, `y[t-1] - x[t-1]`.
    differences: Vec<[Vec<f64>; 2]>,
}

impl Pairs {
    /// Every searchable row of the classes with its output.
    pub fn of(database: &Database<'_>, classes: &[usize], style: usize, outputs: Outputs) -> Self {
        let mut pairs = Self::default();
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        for &class in classes {
            for Example { x, x_prev, y, y_prev, .. } in examples(database, class, style, outputs) {
                pairs.differences.push([less(&y, &x), less(&y_prev, &x_prev)]);
                pairs.inputs.push([x, x_prev]);
            }
        }
        pairs
    }

    /// How many.
    pub fn count(&self) -> usize {
        self.inputs.len()
    }

    /// An even choice of that many.
    pub fn thinned(&self, most: usize) -> Self {
        let kept = even(self.count(), most);
        Self {
            inputs: kept.iter().map(|&i| self.inputs[i].clone()).collect(),
            differences: kept.iter().map(|&i| self.differences[i].clone()).collect(),
        }
    }
}

/// Both processes.
#[derive(Debug, Clone)]
pub struct Editor {
    pose: Principal,
    before: Principal,
    kinematics: Process,
    dynamics: Process,
    /// Seconds that it took to fit.
    pub fit_s: f64,
}

/// Pose and change of an input, the change as weighty as a second of it.
fn seen(x: &[f64], x_prev: &[f64]) -> Vec<f64> {
    let change = x.iter().zip(x_prev).map(|(a, b)| 5.0 * (a - b));
    x.iter().copied().chain(change).collect()
}

impl Editor {
    /// Learns the difference of two styles. `None` of too few examples.
    pub fn fit(pairs: &Pairs, options: &Options) -> Option<Self> {
        if pairs.count() < 16 {
            return None;
        }
        let start = Instant::now();
        let looks: Vec<Vec<f64>> = pairs.inputs.iter().map(|[x, before]| seen(x, before)).collect();
        let pose = Principal::of(&looks, options.components)?;
        let befores: Vec<Vec<f64>> = pairs.differences.iter().map(|d| d[1].clone()).collect();
        let before = Principal::of(&befores, options.components)?;
        let inputs: Vec<Vec<f64>> = looks.iter().map(|l| pose.project(l)).collect();
        let nows: Vec<Vec<f64>> = pairs.differences.iter().map(|d| d[0].clone()).collect();
        let kinematics = Process::fit(&inputs, &nows, options)?;
        let both: Vec<Vec<f64>> =
            inputs.iter().zip(&befores).map(|(i, b)| [&i[..], &before.project(b)].concat()).collect();
        let changes: Vec<Vec<f64>> = pairs
            .differences
            .iter()
            .map(|[now, before]| now.iter().zip(before).map(|(a, b)| a - b).collect())
            .collect();
        let dynamics = Process::fit(&both, &changes, options)?;
        Some(Self { pose, before, kinematics, dynamics, fit_s: start.elapsed().as_secs_f64() })
    }

    /// Translates a clip's dofs, `[frames][D]`.
    pub fn run(&self, x: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let dofs = self.kinematics.means.len();
        let mut difference: Vec<f64> = Vec::new();
        let mut variance = vec![0.0; dofs];
        (0..x.len())
            .map(|t| {
                let input = self.pose.project(&seen(&x[t], &x[t.saturating_sub(1)]));
                let (now, own) = self.kinematics.predict(&input);
                let own: Vec<f64> = self.kinematics.scales.iter().map(|s| own * s * s).collect();
                if difference.is_empty() {
                    (difference, variance) = (now, own);
                } else {
                    let both = [&input[..], &self.before.project(&difference)].concat();
                    let (change, step) = self.dynamics.predict(&both);
                    for d in 0..dofs {
                        let carried = variance[d] + step * self.dynamics.scales[d].powi(2);
                        let (a, b) = (1.0 / own[d], 1.0 / carried);
                        difference[d] = (now[d] * a + (difference[d] + change[d]) * b) / (a + b);
                        variance[d] = 1.0 / (a + b);
                    }
                }
                x[t].iter().zip(&difference).map(|(x, d)| x + d).collect()
            })
            .collect()
    }

    /// Bytes that both processes keep.
    pub fn bytes(&self) -> usize {
        self.kinematics.bytes() + self.dynamics.bytes()
    }

    /// Negative log marginal likelihood of the kinematics, see `Process::evidence`.
    pub fn evidence(&self) -> f64 {
        self.kinematics.evidence
    }

    /// Examples that they are conditioned on.
    pub fn examples(&self) -> usize {
        self.kinematics.examples()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_editor_is_stable_and_near_on_a_warped_wave() {
        let wave = |t: f64| vec![(0.4 * t).sin(), (0.4 * t + 1.0).sin()];
        let styled = |t: f64| vec![1.6 * (0.4 * t).sin() + 0.3, (0.4 * t + 0.6).sin()];
        let mut pairs = Pairs::default();
        for t in 1..160 {
            // Times that never repeat, so that the phase is seen everywhere.
            let t = f64::from(t) * 0.97;
            let less = |t: f64| styled(t).iter().zip(wave(t)).map(|(a, b)| a - b).collect::<Vec<f64>>();
            pairs.inputs.push([wave(t), wave(t - 1.0)]);
            pairs.differences.push([less(t), less(t - 1.0)]);
        }
        let options = Options { subset: 60, most: 120, components: 2, evaluations: 40, starts: 1 };
        let editor = Editor::fit(&pairs, &options).unwrap();
        assert_eq!(editor.examples(), 120);
        let mut input: Vec<Vec<f64>> = (0..200).map(|t| wave(f64::from(t) + 0.33)).collect();
        // A few frames of nonsense in the middle.
        for row in &mut input[80..84] {
            row[0] += 3.0;
        }
        let output = editor.run(&input);
        for t in (5..80).chain(110..200) {
            for (a, b) in output[t].iter().zip(styled(t as f64 + 0.33)) {
                assert!((a - b).abs() < 0.08, "{t}: {a} {b}");
            }
        }
        assert!(output[80..84].iter().flatten().all(|v| v.abs() < 12.0));
    }
}
