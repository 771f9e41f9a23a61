//! Ridge regression, linear and with a radial kernel (Torresani 2006, eqs. 6 and 7), with ten-fold cross-validation.
//!
//! Both are one system, `(K + λ I) a = y - ȳ`, `f(z) = ȳ + Σ a_i k(z_i, z)`: with `k` the inner product that is linear
//! ridge regression in its dual form, with `k(z, z') = exp(-γ |z - z'|²)` the kernel one. For what is between two
//! fragments there is [`Kernel::Between`], which adds no ȳ. The error of a left-out fold
//! F needs no fit of its own: with `C = K + λ I` the residuals are `(C⁻¹_FF)⁻¹ (C⁻¹ y)_F`, so that a whole
//! cross-validation costs one factor and its inverse. Cost: O(n³) for each γ and λ, 0.7 n³ multiplications.

use gestus_motion::statistics::{distance2, dot, mean_or_zero};
use nalgebra::{Cholesky, DMatrix, DVector};

/// Folds of a cross-validation.
pub const FOLDS: usize = 10;

/// A kernel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kernel {
    /// Inner product.
    Linear,
    /// `exp(-γ |z - z'|²)`.
    Radial(f64),
    /// Of pairs of fragments, inputs `[a, b, u]` with halves a and b of one width and `u = 2 α - 1`: with z̃ the same pair
    /// named the other way round, `[b, a, -u]`,
    ///
    /// ```text
    /// (1 - u²) (1 - u'²) ½ (exp(-γ |z - z'|²) + exp(-γ |z̃ - z'|²))
    /// ```
    ///
    /// A sum of these is the same whichever fragment comes first, and 0 where the blend is one of the two.
    Between(f64),
}

/// The same pair, the other way round.
fn turned(z: &[f64]) -> impl Iterator<Item = f64> {
    let half = z.len() / 2;
    (0..z.len()).map(move |i| match i {
        i if i < half => z[i + half],
        i if i < 2 * half => z[i - half],
        i => -z[i],
    })
}

/// `1 - u²`.
fn between(z: &[f64]) -> f64 {
    z.last().map_or(0.0, |u| 1.0 - u * u)
}

impl Kernel {
    /// Its value for two inputs.
    pub fn of(self, a: &[f64], b: &[f64]) -> f64 {
        match self {
            Self::Linear => dot(a, b),
            Self::Radial(gamma) => (-gamma * distance2(a, b)).exp(),
            Self::Between(gamma) => {
                let far: f64 = turned(a).zip(b).map(|(a, b)| (a - b) * (a - b)).sum();
                let near = distance2(a, b);
                0.5 * between(a) * between(b) * ((-gamma * near).exp() + (-gamma * far).exp())
            }
        }
    }

    /// What ridge regression adds to a sum of these kernels: the mean of the targets, or nothing where the sums are to
    /// be 0 at known places.
    fn offset(self, y: &[f64]) -> f64 {
        match self {
            Self::Linear | Self::Radial(_) => mean_or_zero(y.iter().copied()),
            Self::Between(_) => 0.0,
        }
    }

    /// All values, `[n x n]`.
    pub fn matrix(self, z: &[Vec<f64>]) -> DMatrix<f64> {
        let mut matrix = DMatrix::zeros(z.len(), z.len());
        for i in 0..z.len() {
            for j in 0..=i {
                let value = self.of(&z[i], &z[j]);
                (matrix[(i, j)], matrix[(j, i)]) = (value, value);
            }
        }
        matrix
    }
}

/// A sum of kernels: the form of the result of ridge and of support vector regression.
#[derive(Debug, Clone)]
pub struct Machine {
    /// The kernel.
    pub kernel: Kernel,
    /// Inputs that count, and by how much.
    pub terms: Vec<(Vec<f64>, f64)>,
    /// What is added.
    pub offset: f64,
}

impl Machine {
    /// The prediction for an input.
    pub fn predict(&self, z: &[f64]) -> f64 {
        self.offset + self.terms.iter().map(|(at, weight)| weight * self.kernel.of(at, z)).sum::<f64>()
    }
}

/// Fits by ridge.
pub fn fit(kernel: Kernel, lambda: f64, z: &[Vec<f64>], y: &[f64]) -> Machine {
    let offset = kernel.offset(y);
    let system = kernel.matrix(z) + DMatrix::identity(z.len(), z.len()) * lambda;
    let right = DVector::from_iterator(y.len(), y.iter().map(|v| v - offset));
    // A kernel matrix with something on its diagonal is positive definite; rounding alone could say otherwise.
    let weights = Cholesky::new(system).map_or_else(|| DVector::zeros(y.len()), |c| c.solve(&right));
    Machine { kernel, terms: z.iter().cloned().zip(weights.iter().copied()).collect(), offset }
}

/// The inverse of the lower Cholesky factor of a positive definite matrix, rows one after the other; of rows in
/// contiguous memory, since it is what a cross-validation spends its time in. `None` where it has none.
fn inverse_factor(kernel: &DMatrix<f64>, lambda: f64) -> Option<Vec<f64>> {
    let n = kernel.nrows();
    let mut factor = vec![0.0; n * n];
    for i in 0..n {
        for j in 0..=i {
            let known = dot(&factor[i * n..i * n + j], &factor[j * n..j * n + j]);
            let rest = kernel[(j, i)] + if i == j { lambda } else { 0.0 } - known;
            factor[i * n + j] = if i == j { rest.sqrt() } else { rest / factor[j * n + j] };
        }
        let pivot = factor[i * n + i];
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
    }
    // Forward substitution for all columns at once: row i of the inverse from the rows above it.
    let mut inverse = vec![0.0; n * n];
    for i in 0..n {
        let (above, row) = inverse.split_at_mut(i * n);
        let row = &mut row[..=i];
        for k in 0..i {
            let weight = factor[i * n + k];
            row[..=k].iter_mut().zip(&above[k * n..=k * n + k]).for_each(|(r, v)| *r -= weight * v);
        }
        row[i] += 1.0;
        let scale = 1.0 / factor[i * n + i];
        row.iter_mut().for_each(|v| *v *= scale);
    }
    Some(inverse)
}

/// Mean squared error of ten-fold cross-validation with a kernel and its matrix; the folds are every tenth example.
/// Targets are `[k][n]`, one error each: they share the inverse.
pub fn cross_validate(kernel: Kernel, matrix: &DMatrix<f64>, lambda: f64, targets: &[Vec<f64>]) -> Vec<f64> {
    let n = matrix.nrows();
    let Some(factor) = inverse_factor(matrix, lambda) else {
        return vec![f64::INFINITY; targets.len()];
    };
    // C⁻¹ = L⁻ᵀ L⁻¹: of the columns of the folds' own blocks no more is needed.
    let columns: Vec<Vec<f64>> = (0..n).map(|i| (i..n).map(|k| factor[k * n + i]).collect()).collect();
    let entry = |i: usize, j: usize| -> f64 {
        let (low, high) = (i.min(j), i.max(j));
        dot(&columns[low][high - low..], &columns[high])
    };
    let folds: Vec<_> = (0..FOLDS.min(n))
        .map(|fold| {
            let out: Vec<usize> = (fold..n).step_by(FOLDS).collect();
            let block = DMatrix::from_fn(out.len(), out.len(), |i, j| entry(out[i], out[j]));
            (out, Cholesky::new(block))
        })
        .collect();
    targets
        .iter()
        .map(|y| {
            let mean = kernel.offset(y);
            let half: Vec<f64> = (0..n)
                .map(|i| factor[i * n..=i * n + i].iter().zip(y).map(|(l, v)| l * (v - mean)).sum())
                .collect();
            let weight =
                |i: usize| -> f64 { columns[i].iter().zip(&half[i..]).map(|(l, h)| l * h).sum::<f64>() };
            let mut sum = 0.0;
            for (out, block) in &folds {
                let Some(block) = block else { return f64::INFINITY };
                sum += block.solve(&DVector::from_fn(out.len(), |i, _| weight(out[i]))).norm_squared();
            }
            sum / n as f64
        })
        .collect()
}

/// Values of γ that are tried: around one over the number of inputs, which have unit variance.
pub fn gammas(width: usize) -> impl Iterator<Item = f64> {
    (-5..=1).map(move |i| 2f64.powi(i) / width.max(1) as f64)
}

/// A kernel and its values for the training examples.
pub type Tabled = (Kernel, DMatrix<f64>);

/// The kernel, by its index, and λ of least cross-validation error for each target, and that error.
pub fn choose(kernels: &[Tabled], targets: &[Vec<f64>]) -> Vec<(usize, f64, f64)> {
    let mut best = vec![(0, 1.0, f64::INFINITY); targets.len()];
    for (index, (kernel, matrix)) in kernels.iter().enumerate() {
        for lambda in (-6..=2).map(|i| 10f64.powf(0.5 * f64::from(i))) {
            for (best, error) in best.iter_mut().zip(cross_validate(*kernel, matrix, lambda, targets)) {
                if error < best.2 {
                    *best = (index, lambda, error);
                }
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data() -> (Vec<Vec<f64>>, Vec<f64>) {
        let z: Vec<Vec<f64>> =
            (0..37).map(f64::from).map(|i| vec![(i * 0.7).sin(), (i * 1.3).cos(), 0.1 * (i % 5.0)]).collect();
        let y = z.iter().map(|z| 1.0 + 2.0 * z[0] - z[1] * z[0] + z[2]).collect();
        (z, y)
    }

    #[test]
    fn linear_ridge_is_the_primal_normal_equations() {
        let (z, y) = data();
        let machine = fit(Kernel::Linear, 0.3, &z, &y);
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let mut normal = DMatrix::<f64>::identity(3, 3) * 0.3;
        let mut right = DVector::zeros(3);
        for (z, y) in z.iter().zip(&y) {
            let z = DVector::from_row_slice(z);
            normal += &z * z.transpose();
            right += z * (y - mean);
        }
        let theta = normal.lu().solve(&right).unwrap();
        for probe in [[0.3, -0.2, 0.1], [1.0, 1.0, 1.0]] {
            let wanted = mean + probe.iter().zip(theta.iter()).map(|(a, b)| a * b).sum::<f64>();
            assert!((machine.predict(&probe) - wanted).abs() < 1e-9);
        }
    }

    #[test]
    fn folds_without_fits_are_folds_with_fits() {
        let (z, y) = data();
        let kernel = Kernel::Radial(0.8);
        let fast = cross_validate(kernel, &kernel.matrix(&z), 0.1, std::slice::from_ref(&y))[0];
        let mean = y.iter().sum::<f64>() / y.len() as f64;
        let mut slow = 0.0;
        for fold in 0..FOLDS {
            let kept: Vec<usize> = (0..z.len()).filter(|i| i % FOLDS != fold).collect();
            let inputs: Vec<Vec<f64>> = kept.iter().map(|&i| z[i].clone()).collect();
            // The offset is that of all, as in the fast form.
            let system = kernel.matrix(&inputs) + DMatrix::identity(kept.len(), kept.len()) * 0.1;
            let weights = system.lu().solve(&DVector::from_fn(kept.len(), |i, _| y[kept[i]] - mean)).unwrap();
            for i in (fold..z.len()).step_by(FOLDS) {
                let guess: f64 =
                    inputs.iter().zip(weights.iter()).map(|(a, w)| w * kernel.of(a, &z[i])).sum();
                slow += (y[i] - mean - guess).powi(2) / z.len() as f64;
            }
        }
        assert!((fast - slow).abs() < 1e-9, "{fast} {slow}");
    }

    #[test]
    fn a_kernel_learns_what_a_line_cannot() {
        let (z, _) = data();
        let y: Vec<f64> = z.iter().map(|z| z[0] * z[0]).collect();
        let error = |kernels: Vec<Kernel>| {
            let tabled: Vec<Tabled> = kernels.into_iter().map(|k| (k, k.matrix(&z))).collect();
            choose(&tabled, std::slice::from_ref(&y))[0].2
        };
        let (line, curve) = (error(vec![Kernel::Linear]), error(gammas(3).map(Kernel::Radial).collect()));
        assert!(curve < 0.05 * line, "{curve} {line}");
    }

    #[test]
    fn what_lies_between_two_ends_is_nothing_at_the_ends_and_the_same_both_ways() {
        let pairs: Vec<Vec<f64>> = (0..120)
            .map(f64::from)
            .map(|i| {
                vec![(i * 0.7).sin(), (i * 1.3).cos(), (i * 2.1).sin(), (i * 0.4).cos(), (i * 0.9).sin()]
            })
            .collect();
        let bend = |z: &[f64]| (1.0 - z[4] * z[4]) * ((z[0] - z[2]).powi(2) + 0.5 * (z[1] - z[3]).powi(2));
        let y: Vec<f64> = pairs.iter().map(|z| bend(z)).collect();
        let machine = fit(Kernel::Between(0.2), 1e-4, &pairs, &y);
        assert_eq!(machine.offset, 0.0);
        for z in [[0.3, -0.2, 0.5, 0.1, 0.4], [0.9, 0.2, -0.5, 0.6, -0.1]] {
            let other = [z[2], z[3], z[0], z[1], -z[4]];
            let [one, turned] = [z, other].map(|z| machine.predict(&z));
            assert!(
                (one - turned).abs() < 1e-12 && (one - bend(&z)).abs() < 0.15,
                "{one} {turned} {}",
                bend(&z)
            );
            for end in [-1.0, 1.0] {
                assert_eq!(machine.predict(&[z[0], z[1], z[2], z[3], end]), 0.0);
            }
        }
        // The mean is no part of it, nor of its cross-validation.
        let matrix = machine.kernel.matrix(&pairs);
        let fast = cross_validate(machine.kernel, &matrix, 0.1, std::slice::from_ref(&y))[0];
        let mut slow = 0.0;
        for fold in 0..FOLDS {
            let kept: Vec<usize> = (0..pairs.len()).filter(|i| i % FOLDS != fold).collect();
            let (z, own): (Vec<_>, Vec<_>) = kept.iter().map(|&i| (pairs[i].clone(), y[i])).unzip();
            let machine = fit(machine.kernel, 0.1, &z, &own);
            let off = (fold..pairs.len()).step_by(FOLDS).map(|i| y[i] - machine.predict(&pairs[i]));
            slow += off.map(|d| d * d).sum::<f64>() / pairs.len() as f64;
        }
        assert!((fast - slow).abs() < 1e-9, "{fast} {slow}");
    }
}
