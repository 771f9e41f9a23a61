//! Gaussian process editing, to compare with (Ikemoto, Arikan and Forsyth, "Generalizing Motion Edits with Gaussian
//! Processes", TOG 2009, as Xia 2015, section 7.2.2, uses it for style): the *difference* of output and input is a Gaussian
//! process over what the input looks like.
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

use std::time::Instant;

use gestus_core::{Database, blob::layout::flag};
use nalgebra::{Cholesky, DMatrix, DVector, Dyn, SymmetricEigen};

use crate::baselines::outputs::{Outputs, output, row};

/// How a process is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// Examples that the hyperparameters are chosen on.
    pub subset: usize,
    /// Examples that are conditioned on.
    pub most: usize,
    /// Principal components of the input, and of `d[t-1]`.
    pub components: usize,
    /// Evaluations of the marginal likelihood from each start.
    pub evaluations: usize,
    /// Starts of the search, up to [`STARTS`].
    pub starts: usize,
}

/// Where the search for hyperparameters starts: lengths in deviations of the inputs, and noise in deviations of the
/// outputs.
pub const STARTS: [(f64, f64); 3] = [(1.0, 0.1), (0.3, 0.03), (3.0, 0.3)];

impl Default for Options {
    fn default() -> Self {
        Self { subset: 160, most: 800, components: 10, evaluations: 50, starts: STARTS.len() }
    }
}

/// Logarithms of lengths, signal and noise deviation.
type Hyper = Vec<f64>;

/// A Gaussian process with several outputs that share their covariance.
#[derive(Debug, Clone)]
pub struct Process {
    /// In lengths, see [`in_lengths`].
    inputs: Vec<Vec<f64>>,
    hyper: Hyper,
    /// Negative log marginal likelihood of the subset at the chosen hyperparameters, a mean over outputs and examples.
    pub evidence: f64,
    factor: Cholesky<f64, Dyn>,
    /// `K⁻¹ Y`, `[n x outputs]`.
    weights: DMatrix<f64>,
    means: Vec<f64>,
    scales: Vec<f64>,
}

/// An input with every number divided by its length: exponentials are taken once an input and not once a pair.
fn in_lengths(hyper: &[f64], input: &[f64]) -> Vec<f64> {
    input.iter().zip(hyper).map(|(v, h)| v * (-h).exp()).collect()
}

/// Squared exponential covariance of two inputs in lengths.
fn covariance(signal: f64, a: &[f64], b: &[f64]) -> f64 {
    let far: f64 = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
    (2.0 * signal - 0.5 * far).exp()
}

/// Covariances of inputs in lengths, with the noise on the diagonal.
fn matrix(hyper: &[f64], z: &[Vec<f64>]) -> DMatrix<f64> {
    let (signal, noise) = (hyper[hyper.len() - 2], (2.0 * hyper[hyper.len() - 1]).exp() + 1e-6);
    let mut k = DMatrix::zeros(z.len(), z.len());
    for i in 0..z.len() {
        for j in 0..=i {
            let value = covariance(signal, &z[i], &z[j]) + if i == j { noise } else { 0.0 };
            (k[(i, j)], k[(j, i)]) = (value, value);
        }
    }
    k
}

/// Negative log marginal likelihood, a mean over outputs and examples, and its gradient. `y` is `[n x outputs]`.
fn likelihood(hyper: &[f64], x: &[Vec<f64>], y: &DMatrix<f64>) -> Option<(f64, Vec<f64>)> {
    let (n, outputs, m) = (x.len(), y.ncols(), hyper.len() - 2);
    let z: Vec<Vec<f64>> = x.iter().map(|x| in_lengths(hyper, x)).collect();
    let k = matrix(hyper, &z);
    let factor = Cholesky::new(k.clone())?;
    let weights = factor.solve(y);
    let log_det: f64 = (0..n).map(|i| 2.0 * factor.l_dirty()[(i, i)].ln()).sum();
    let scale = 1.0 / (n * outputs) as f64;
    let fit: f64 = y.iter().zip(weights.iter()).map(|(a, b)| a * b).sum();
    let value = 0.5 * (fit + outputs as f64 * (log_det + n as f64 * std::f64::consts::TAU.ln())) * scale;
    // dL = ½ tr((outputs K⁻¹ - Σ a aᵀ) dK)
    let slope = factor.inverse() * outputs as f64 - &weights * weights.transpose();
    let signal = (2.0 * hyper[m]).exp();
    let mut gradient = vec![0.0; m + 2];
    for i in 0..n {
        for j in 0..i {
            // Both halves at once: the diagonal has no distance.
            let part = slope[(i, j)] * k[(i, j)];
            for ((slot, a), b) in gradient.iter_mut().zip(&z[i]).zip(&z[j]) {
                *slot += part * (a - b) * (a - b);
            }
            gradient[m] += 2.0 * part;
        }
        gradient[m] += slope[(i, i)] * signal;
        gradient[m + 1] += slope[(i, i)] * (2.0 * hyper[m + 1]).exp();
    }
    gradient.iter_mut().for_each(|g| *g *= scale);
    value.is_finite().then_some((value, gradient))
}

/// Minimises by L-BFGS with backtracking, and gives the least value too; `None` from the function means: not there.
fn minimise(
    mut at: Vec<f64>,
    evaluations: usize,
    f: impl Fn(&[f64]) -> Option<(f64, Vec<f64>)>,
) -> (Vec<f64>, f64) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let Some((mut value, mut gradient)) = f(&at) else { return (at, f64::INFINITY) };
    let mut memory: Vec<(Vec<f64>, Vec<f64>)> = Vec::new();
    let mut used = 1;
    while used < evaluations && dot(&gradient, &gradient) > 1e-10 {
        // The two-loop recursion (Nocedal).
        let mut direction = gradient.clone();
        let mut shares = Vec::new();
        for (s, y) in memory.iter().rev() {
            let share = dot(s, &direction) / dot(s, y);
            direction.iter_mut().zip(y).for_each(|(d, y)| *d -= share * y);
            shares.push(share);
        }
        let scale = memory
            .last()
            .map_or(0.3 / dot(&gradient, &gradient).sqrt().max(1e-12), |(s, y)| dot(s, y) / dot(y, y));
        direction.iter_mut().for_each(|d| *d *= scale);
        for ((s, y), share) in memory.iter().zip(shares.iter().rev()) {
            let back = dot(y, &direction) / dot(s, y);
            direction.iter_mut().zip(s).for_each(|(d, s)| *d += (share - back) * s);
        }
        let downhill = dot(&direction, &gradient);
        let mut step = 1.0;
        let found = loop {
            // Hyperparameters are logarithms: no step of more than a factor of e² at once.
            let longest = direction.iter().fold(0.0f64, |a, d| a.max((step * d).abs()));
            let held = if longest > 2.0 { step * 2.0 / longest } else { step };
            let next: Vec<f64> = at.iter().zip(&direction).map(|(a, d)| a - held * d).collect();
            used += 1;
            match f(&next) {
                Some((v, g)) if v <= value - 1e-4 * held * downhill => break Some((next, v, g)),
                _ if used >= evaluations || step < 1e-6 => break None,
                _ => step *= 0.4,
            }
        };
        let Some((next, v, g)) = found else { break };
        let s: Vec<f64> = next.iter().zip(&at).map(|(a, b)| a - b).collect();
        let y: Vec<f64> = g.iter().zip(&gradient).map(|(a, b)| a - b).collect();
        if dot(&s, &y) > 1e-12 {
            memory.push((s, y));
            if memory.len() > 8 {
                memory.remove(0);
            }
        }
        let gained = value - v;
        (at, value, gradient) = (next, v, g);
        if gained < 1e-7 {
            break;
        }
    }
    (at, value)
}

/// An even choice of that many.
fn even(count: usize, most: usize) -> Vec<usize> {
    let kept = count.min(most);
    (0..kept).map(|i| i * count / kept.max(1)).collect()
}

impl Process {
    /// Chooses hyperparameters on a subset and conditions on the examples. Inputs `[n][m]`, outputs `[n][outputs]`.
    pub fn fit(inputs: &[Vec<f64>], outputs: &[Vec<f64>], options: &Options) -> Option<Self> {
        let (hyper, evidence) = Self::hyper(inputs, outputs, options)?;
        Some(Self { evidence, ..Self::condition(inputs, outputs, hyper, options.most)? })
    }

    /// The hyperparameters of the highest top that is found, and their evidence.
    fn hyper(inputs: &[Vec<f64>], outputs: &[Vec<f64>], options: &Options) -> Option<(Hyper, f64)> {
        use rayon::prelude::*;
        let (means, scales) = standard(outputs)?;
        let subset = even(inputs.len(), options.subset);
        let x: Vec<Vec<f64>> = subset.iter().map(|&i| inputs[i].clone()).collect();
        let y = DMatrix::from_fn(subset.len(), means.len(), |i, d| {
            (outputs[subset[i]][d] - means[d]) / scales[d]
        });
        let m = inputs.first()?.len();
        let (_, spreads) = standard(inputs)?;
        let tops: Vec<(Hyper, f64)> = STARTS[..options.starts.clamp(1, STARTS.len())]
            .par_iter()
            .map(|(length, noise)| {
                let mut start: Hyper =
                    spreads.iter().map(|s| (length * s * (m as f64).sqrt()).ln()).collect();
                start.extend([0.0, noise.ln()]);
                minimise(start, options.evaluations, |h| likelihood(h, &x, &y))
            })
            .collect();
        tops.into_iter().min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn condition(inputs: &[Vec<f64>], outputs: &[Vec<f64>], hyper: Hyper, most: usize) -> Option<Self> {
        let (means, scales) = standard(outputs)?;
        let kept = even(inputs.len(), most);
        let inputs: Vec<Vec<f64>> = kept.iter().map(|&i| in_lengths(&hyper, &inputs[i])).collect();
        let y =
            DMatrix::from_fn(kept.len(), means.len(), |i, d| (outputs[kept[i]][d] - means[d]) / scales[d]);
        // What is smooth enough on the subset may be singular in rounding on more: then there is more noise.
        let mut hyper = hyper;
        for _ in 0..12 {
            if let Some(factor) = Cholesky::new(matrix(&hyper, &inputs)) {
                let weights = factor.solve(&y);
                return Some(Self { inputs, hyper, evidence: f64::NAN, factor, weights, means, scales });
            }
            let last = hyper.len() - 1;
            hyper[last] = hyper[last].max(-8.0) + 0.5;
        }
        None
    }

    /// Mean of every output, and the variance as a share of the outputs' own.
    pub fn predict(&self, at: &[f64]) -> (Vec<f64>, f64) {
        let at = in_lengths(&self.hyper, at);
        let signal = self.hyper[self.hyper.len() - 2];
        let k =
            DVector::from_iterator(self.inputs.len(), self.inputs.iter().map(|z| covariance(signal, z, &at)));
        let mean = self.weights.tr_mul(&k);
        let explained = self.factor.l_dirty().solve_lower_triangular(&k).map_or(0.0, |v| v.norm_squared());
        let prior =
            (2.0 * self.hyper[self.hyper.len() - 2]).exp() + (2.0 * self.hyper[self.hyper.len() - 1]).exp();
        let outputs = mean.iter().zip(&self.means).zip(&self.scales).map(|((v, m), s)| m + v * s).collect();
        (outputs, (prior - explained).max(1e-9))
    }

    /// Bytes that the process keeps.
    pub fn bytes(&self) -> usize {
        let n = self.inputs.len();
        8 * (n * n + n * self.hyper.len() + n * self.means.len())
    }

    /// Examples that it is conditioned on.
    pub fn examples(&self) -> usize {
        self.inputs.len()
    }
}

/// Mean and standard deviation of each column.
fn standard(rows: &[Vec<f64>]) -> Option<(Vec<f64>, Vec<f64>)> {
    let n = rows.len() as f64;
    let width = rows.first()?.len();
    let means: Vec<f64> = (0..width).map(|d| rows.iter().map(|r| r[d]).sum::<f64>() / n).collect();
    let scales = (0..width)
        .map(|d| (rows.iter().map(|r| (r[d] - means[d]).powi(2)).sum::<f64>() / n).sqrt().max(1e-6))
        .collect();
    Some((means, scales))
}

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
    pub fn of(database: &Database<'_>, classes: &[usize], style: usize) -> Self {
        let mut pairs = Self::default();
        let less = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<f64>>();
        for &class in classes {
            let record = database.class(class);
            for r in record.first_row..record.first_row + record.rows {
                if database.flags(r) & flag::SEARCHABLE == 0 {
                    continue;
                }
                let (x, x_prev) = (row(database, r), row(database, r - 1));
                let Some((y, y_prev)) = output(database, class, r, style, Outputs::One) else { continue };
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

    /// Negative log marginal likelihood of the kinematics, see [`Process::evidence`].
    pub fn evidence(&self) -> f64 {
        self.kinematics.evidence
    }

    /// Examples that they are conditioned on.
    pub fn examples(&self) -> usize {
        self.kinematics.examples()
    }
}

/// The output of a clip, by a process over the labelled classes' examples; `None` of too few.
pub fn translate(
    database: &Database<'_>,
    classes: &[usize],
    style: usize,
    x: &[Vec<f64>],
    options: &Options,
) -> Option<Vec<Vec<f64>>> {
    Some(Editor::fit(&Pairs::of(database, classes, style), options)?.run(x))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data(n: usize) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let x: Vec<Vec<f64>> =
            (0..n).map(|i| vec![(i as f64 * 0.61).sin() * 2.0, (i as f64 * 0.37).cos()]).collect();
        // The second input says nothing.
        let y = x.iter().map(|x| vec![(1.5 * x[0]).sin(), 3.0 + 0.5 * x[0] * x[0]]).collect();
        (x, y)
    }

    #[test]
    fn the_gradient_is_that_of_the_likelihood() {
        let (x, y) = data(14);
        let y = DMatrix::from_fn(14, 2, |i, d| y[i][d] - 1.0);
        let hyper = vec![0.2, -0.3, 0.1, -1.5];
        let (_, gradient) = likelihood(&hyper, &x, &y).unwrap();
        for k in 0..4 {
            let at = |h: f64| {
                let mut moved = hyper.clone();
                moved[k] += h;
                likelihood(&moved, &x, &y).unwrap().0
            };
            let slope = (at(1e-5) - at(-1e-5)) / 2e-5;
            assert!((slope - gradient[k]).abs() < 1e-6, "{k}: {slope} {}", gradient[k]);
        }
    }

    #[test]
    fn the_likelihood_is_that_of_a_normal_distribution() {
        let (x, y) = data(5);
        let hyper = vec![0.1, 0.4, 0.2, -1.0];
        let y = DMatrix::from_fn(5, 1, |i, _| y[i][0]);
        let z: Vec<Vec<f64>> = x.iter().map(|x| in_lengths(&hyper, x)).collect();
        let k = matrix(&hyper, &z);
        let slow = 0.5
            * ((y.transpose() * k.clone().try_inverse().unwrap() * &y)[0]
                + k.determinant().ln()
                + 5.0 * std::f64::consts::TAU.ln());
        assert!((likelihood(&hyper, &x, &y).unwrap().0 - slow / 5.0).abs() < 1e-9);
    }

    #[test]
    fn of_several_tops_the_highest_is_taken() {
        let (x, y) = data(40);
        let of = |starts| Process::hyper(&x, &y, &Options { starts, ..Options::default() }).unwrap().1;
        let alone: Vec<f64> = (1..=STARTS.len()).map(of).collect();
        assert!(alone.iter().all(|v| v.is_finite()) && alone.windows(2).all(|w| w[1] <= w[0]), "{alone:?}");
        // What is given is the likelihood at what is given.
        let (hyper, value) = Process::hyper(&x, &y, &Options::default()).unwrap();
        let (means, scales) = standard(&y).unwrap();
        let y = DMatrix::from_fn(x.len(), 2, |i, d| (y[i][d] - means[d]) / scales[d]);
        assert!((likelihood(&hyper, &x, &y).unwrap().0 - value).abs() < 1e-9);
    }

    #[test]
    fn learns_the_function_the_irrelevant_input_and_its_own_doubt() {
        let (x, y) = data(60);
        let process = Process::fit(&x, &y, &Options { evaluations: 80, ..Options::default() }).unwrap();
        for at in [[0.3, 0.2], [-1.1, 0.5], [1.4, -0.6]] {
            let (mean, variance) = process.predict(&at);
            assert!((mean[0] - (1.5 * at[0]).sin()).abs() < 0.02, "{at:?}: {mean:?}");
            assert!((mean[1] - 3.0 - 0.5 * at[0] * at[0]).abs() < 0.02, "{at:?}: {mean:?}");
            assert!(variance < 0.01, "{variance}");
        }
        assert!(process.hyper[1] > process.hyper[0] + 1.0, "{:?}", process.hyper);
        // Far away: the mean of all, and no certainty.
        let (mean, variance) = process.predict(&[60.0, 0.0]);
        assert!(variance > 0.3 && (mean[0] - process.means[0]).abs() < 1e-3, "{mean:?} {variance}");
    }

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
