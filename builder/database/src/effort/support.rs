//! ε-insensitive support vector regression (Torresani 2006, section 6; Drucker et al. 1997, Vapnik 1995).
//!
//! Differences smaller than ε cost nothing, larger ones their excess times C, so that many examples drop out and
//! fewer support vectors remain. In the dual, with `β = α⁺ - α⁻`:
//!
//! ```text
//! least ½ βᵀ K β - yᵀ β + ε Σ |β_i|,   -C <= β_i <= C
//! ```
//!
//! There is no offset, and therefore no constraint on the sum of β: what is added here is known, it is linear
//! interpolation ([`Kernel::Between`]). So each β_i can move alone, to its best place in closed form (dual coordinate
//! descent: Ho and Lin, "Large-scale Linear Support Vector Regression", JMLR 2012), the one first that lowers the
//! objective most. It takes the kernel matrix from outside, so that the folds of a cross-validation share it, and starts
//! from the solution for a smaller C, which is inside the box of a larger one; that is why it is written here and not
//! taken from a crate. Cost: O(n) a step, some n to 100 n steps.

use nalgebra::DMatrix;

use crate::effort::ridge::{FOLDS, Kernel, Machine, Tabled};

/// Violation of optimality at which it stops, in units of y.
const TOLERANCE: f64 = 1e-3;

/// C and ε.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Price of an error beyond ε.
    pub c: f64,
    /// Errors below it are free, in units of y.
    pub epsilon: f64,
}

/// β for some of the examples of a kernel matrix.
pub fn solve(kernel: &DMatrix<f64>, of: &[usize], y: &[f64], parameters: Parameters) -> Vec<f64> {
    let mut problem = Problem::new(kernel, of, y);
    problem.improve(parameters, TOLERANCE);
    problem.beta
}

/// A problem and the best β so far.
struct Problem {
    /// Rows of the kernel matrix, one after the other.
    kernel: Vec<f64>,
    beta: Vec<f64>,
    /// `K β - y`.
    gradient: Vec<f64>,
}

impl Problem {
    fn new(kernel: &DMatrix<f64>, of: &[usize], y: &[f64]) -> Self {
        Self {
            kernel: of.iter().flat_map(|&i| of.iter().map(move |&j| kernel[(i, j)])).collect(),
            beta: vec![0.0; of.len()],
            gradient: of.iter().map(|&i| -y[i]).collect(),
        }
    }

    /// Goes on to the optimum of parameters whose C is no less than the last one's.
    fn improve(&mut self, Parameters { c, epsilon }: Parameters, tolerance: f64) {
        let n = self.beta.len();
        for _ in 0..400 * n.max(50) {
            let (mut most, mut violation, mut step) = (0.0, 0.0f64, (0, 0.0));
            for (i, (&b, &g)) in self.beta.iter().zip(&self.gradient).enumerate() {
                // How steeply the objective falls where β_i grows, and where it shrinks; the tube turns over at 0.
                let up = if b < 0.0 { epsilon - g } else { -epsilon - g };
                let down = if b > 0.0 { epsilon + g } else { g - epsilon };
                let slope = f64::max(if b < c { up } else { 0.0 }, if b > -c { down } else { 0.0 });
                if slope <= tolerance {
                    continue;
                }
                violation = violation.max(slope);
                // ½ a (β - b)² + g (β - b) + ε |β| is least at a soft threshold.
                let a = self.kernel[i * n + i].max(1e-12);
                let pull = a * b - g;
                let best = (pull.signum() * (pull.abs() - epsilon).max(0.0) / a).clamp(-c, c);
                let move_by = best - b;
                let gain = -move_by * (0.5 * a * move_by + g) - epsilon * (best.abs() - b.abs());
                if gain > most {
                    (most, step) = (gain, (i, move_by));
                }
            }
            if violation <= tolerance || most <= 0.0 {
                break;
            }
            let (i, move_by) = step;
            self.beta[i] += move_by;
            let row = &self.kernel[i * n..(i + 1) * n];
            self.gradient.iter_mut().zip(row).for_each(|(g, k)| *g += move_by * k);
        }
    }
}

/// Fits the machine; examples that do not support it are dropped.
pub fn fit(kernel: Kernel, parameters: Parameters, z: &[Vec<f64>], y: &[f64]) -> Machine {
    let all: Vec<usize> = (0..z.len()).collect();
    let beta = solve(&kernel.matrix(z), &all, y, parameters);
    let terms = z.iter().cloned().zip(beta).filter(|t| t.1 != 0.0).collect();
    Machine { kernel, terms, offset: 0.0 }
}

/// C that are tried, in root mean squares of y; ascending.
const COSTS: [f64; 5] = [0.1, 0.3, 1.0, 4.0, 16.0];
/// ε that are tried, in root mean squares of y.
const TUBES: [f64; 3] = [0.1, 0.3, 0.6];
/// Violation of optimality at which a fold stops, in root mean squares of y: far below what tells two parameters
/// apart.
const FOLD_TOLERANCE: f64 = 1e-2;

/// The kernel, by its index, and parameters of least ten-fold cross-validation error, and that error. Every fold is
/// solved.
pub fn choose(kernels: &[Tabled], y: &[f64]) -> (usize, Parameters, f64) {
    let n = y.len();
    let count = n.max(1) as f64;
    let size = (y.iter().map(|v| v * v).sum::<f64>() / count).sqrt().max(1e-6);
    let mut best = (0, Parameters { c: size, epsilon: 0.1 * size }, f64::INFINITY);
    for (index, (_, kernel)) in kernels.iter().enumerate() {
        for epsilon in TUBES.map(|e| e * size) {
            let mut errors = [0.0; COSTS.len()];
            for fold in 0..FOLDS.min(n) {
                let kept: Vec<usize> = (0..n).filter(|i| i % FOLDS != fold).collect();
                let mut problem = Problem::new(kernel, &kept, y);
                for (error, cost) in errors.iter_mut().zip(COSTS) {
                    let parameters = Parameters { c: cost * size, epsilon };
                    problem.improve(parameters, FOLD_TOLERANCE * size);
                    for i in (fold..n).step_by(FOLDS) {
                        let guess: f64 =
                            kept.iter().zip(&problem.beta).map(|(&k, b)| b * kernel[(k, i)]).sum();
                        *error += (y[i] - guess).powi(2) / count;
                    }
                }
            }
            for (error, cost) in errors.into_iter().zip(COSTS) {
                if error < best.2 {
                    best = (index, Parameters { c: cost * size, epsilon }, error);
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
            (0..24).map(f64::from).map(|i| vec![(i * 0.7).sin(), (i * 1.3).cos()]).collect();
        let y = z
            .iter()
            .enumerate()
            .map(|(i, z)| 2.0 * z[0] * z[1] + 0.5 * z[0] + 0.1 * ((i * 7 % 5) as f64 - 2.0))
            .collect();
        (z, y)
    }

    fn objective(kernel: &DMatrix<f64>, beta: &[f64], y: &[f64], epsilon: f64) -> f64 {
        let b = nalgebra::DVector::from_row_slice(beta);
        0.5 * (b.transpose() * kernel * &b)[0]
            + beta.iter().zip(y).map(|(b, y)| epsilon * b.abs() - b * y).sum::<f64>()
    }

    /// Slow and obvious: each in turn, a step either way, until nothing helps.
    fn by_trying(kernel: &DMatrix<f64>, y: &[f64], p: Parameters) -> Vec<f64> {
        let n = y.len();
        let mut beta = vec![0.0; n];
        let mut step: f64 = 0.5;
        while step > 1e-5 {
            let mut improved = false;
            for i in 0..n {
                for sign in [1.0, -1.0] {
                    let mut tried = beta.clone();
                    tried[i] += sign * step;
                    if tried[i].abs() <= p.c
                        && objective(kernel, &tried, y, p.epsilon)
                            < objective(kernel, &beta, y, p.epsilon) - 1e-12
                    {
                        beta = tried;
                        improved = true;
                    }
                }
            }
            if !improved {
                step *= 0.5;
            }
        }
        beta
    }

    #[test]
    fn reaches_the_least_that_trying_reaches() {
        let (z, y) = data();
        let kernel = Kernel::Radial(0.9).matrix(&z);
        for p in [Parameters { c: 1.5, epsilon: 0.1 }, Parameters { c: 0.4, epsilon: 0.3 }] {
            let all: Vec<usize> = (0..z.len()).collect();
            let beta = solve(&kernel, &all, &y, p);
            assert!(beta.iter().all(|b| b.abs() <= p.c + 1e-12));
            let slow = by_trying(&kernel, &y, p);
            let (fast, slow) =
                (objective(&kernel, &beta, &y, p.epsilon), objective(&kernel, &slow, &y, p.epsilon));
            assert!(fast <= slow + 1e-3 * slow.abs(), "{fast} {slow}");
            // Optimality: who is inside the tube supports nothing, who is free lies on its edge.
            for i in 0..z.len() {
                let guess = (0..z.len()).map(|k| beta[k] * kernel[(k, i)]).sum::<f64>();
                let off = (y[i] - guess).abs();
                if beta[i] == 0.0 {
                    assert!(off <= p.epsilon + 2e-3, "{i}: {off}");
                } else if beta[i].abs() < p.c - 1e-9 {
                    assert!((off - p.epsilon).abs() < 2e-3, "{i}: {off}");
                }
            }
        }
    }

    #[test]
    fn a_start_from_a_smaller_box_ends_where_one_from_nothing_does() {
        let (z, y) = data();
        let kernel = Kernel::Radial(0.9).matrix(&z);
        let all: Vec<usize> = (0..z.len()).collect();
        let mut warm = Problem::new(&kernel, &all, &y);
        for c in [0.2, 1.0, 5.0] {
            let p = Parameters { c, epsilon: 0.1 };
            warm.improve(p, TOLERANCE);
            let cold = solve(&kernel, &all, &y, p);
            let (warm, cold) = (objective(&kernel, &warm.beta, &y, 0.1), objective(&kernel, &cold, &y, 0.1));
            assert!((warm - cold).abs() < 1e-3 * cold.abs(), "{c}: {warm} {cold}");
        }
    }

    #[test]
    fn keeps_fewer_vectors_with_a_wider_tube() {
        let (z, y) = data();
        let count = |epsilon| fit(Kernel::Radial(0.9), Parameters { c: 4.0, epsilon }, &z, &y).terms.len();
        assert!(count(0.4) < count(0.02), "{} {}", count(0.4), count(0.02));
    }
}
