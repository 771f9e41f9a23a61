//! One Gaussian process with several outputs: covariance, marginal likelihood, model selection and prediction.

use gestus_motion::statistics::moments;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rayon::prelude::*;

use super::minimise::minimise;

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
    pub(super) means: Vec<f64>,
    pub(super) scales: Vec<f64>,
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

/// An even choice of that many.
pub(super) fn even(count: usize, most: usize) -> Vec<usize> {
    let kept = count.min(most);
    (0..kept).map(|i| i * count / kept.max(1)).collect()
}

impl Process {
    /// Chooses hyperparameters on a subset and conditions on the examples. Inputs `[n][m]`, outputs `[n][outputs]`.
    pub fn fit(inputs: &[Vec<f64>], outputs: &[Vec<f64>], options: &Options) -> Option<Self> {
        let (hyper, evidence) = Self::hyper(inputs, outputs, options)?;
        Some(Self { evidence, ..Self::condition(inputs, outputs, hyper, options.most)? })
    }

    /// The hyperparameters of the highest maximum that is found, and their evidence.
    fn hyper(inputs: &[Vec<f64>], outputs: &[Vec<f64>], options: &Options) -> Option<(Hyper, f64)> {
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

/// Mean and standard deviation of each column; `None` where there are no rows.
pub(super) fn standard(rows: &[Vec<f64>]) -> Option<(Vec<f64>, Vec<f64>)> {
    let width = rows.first()?.len();
    Some((0..width).map(|d| moments(rows.iter().map(|r| r[d]), 1e-6)).unzip())
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
}
