//! ε-insensitive support vector regression (paper 003, section 6; Drucker et al. 1997, Vapnik 1995).
//!
//! Differences smaller than ε cost nothing, larger ones their excess times C, so that most examples drop out and few
//! support vectors remain. In the dual, with `β = α⁺ - α⁻`:
//!
//! ```text
//! least ½ βᵀ K β - yᵀ β + ε Σ |β_i|,   -C <= β_i <= C,   Σ β_i = 0
//! ```
//!
//! Solved by sequential minimal optimisation: two variables at a time, the pair that violates optimality most, each
//! step in closed form (Platt 1999; working set of Keerthi et al. 2001, in the form of Chang and Lin's LIBSVM). It takes
//! the kernel matrix from outside, so that the folds of a cross-validation share it; that is why it is written here
//! and not taken from a crate. Cost: O(n) a step, some n to 100 n steps.

use nalgebra::DMatrix;

use super::ridge::{FOLDS, Kernel, Machine};

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

/// β and the offset for some of the examples of a kernel matrix.
pub fn solve(kernel: &DMatrix<f64>, of: &[usize], y: &[f64], parameters: Parameters) -> (Vec<f64>, f64) {
    let n = of.len();
    let Parameters { c, epsilon } = parameters;
    // 2 n variables: α⁺ with sign 1 and linear term ε - y, α⁻ with sign -1 and ε + y.
    let sign = |i: usize| if i < n { 1.0 } else { -1.0 };
    let mut alpha = vec![0.0f64; 2 * n];
    let mut gradient: Vec<f64> = (0..2 * n).map(|i| epsilon - sign(i) * y[of[i % n]]).collect();
    for _ in 0..200 * n.max(50) {
        // The pair that violates most: i may still move up along its sign, j down.
        let (mut up, mut down) = ((f64::NEG_INFINITY, 0), (f64::INFINITY, 0));
        for i in 0..2 * n {
            let value = -sign(i) * gradient[i];
            let (can_grow, can_shrink) = (alpha[i] < c, alpha[i] > 0.0);
            let (moves_up, moves_down) = if i < n { (can_grow, can_shrink) } else { (can_shrink, can_grow) };
            if moves_up && value > up.0 {
                up = (value, i);
            }
            if moves_down && value < down.0 {
                down = (value, i);
            }
        }
        if up.0 - down.0 < TOLERANCE {
            break;
        }
        let (i, j) = (up.1, down.1);
        let (a, b) = (of[i % n], of[j % n]);
        let curvature = (kernel[(a, a)] + kernel[(b, b)] - 2.0 * kernel[(a, b)]).max(1e-12);
        let room = |k: usize, along: f64| if along > 0.0 { c - alpha[k] } else { alpha[k] };
        let (along_i, along_j) = (sign(i), -sign(j));
        let step = ((up.0 - down.0) / curvature).min(room(i, along_i)).min(room(j, along_j));
        alpha[i] = (alpha[i] + along_i * step).clamp(0.0, c);
        alpha[j] = (alpha[j] + along_j * step).clamp(0.0, c);
        for t in 0..n {
            let change = step * (kernel[(of[t], a)] - kernel[(of[t], b)]);
            gradient[t] += change;
            gradient[n + t] -= change;
        }
    }
    // The offset: what free variables agree on, or the middle of what the others allow.
    let (mut sum, mut free, mut low, mut high) = (0.0, 0.0, f64::NEG_INFINITY, f64::INFINITY);
    for i in 0..2 * n {
        let value = -sign(i) * gradient[i];
        if alpha[i] > 0.0 && alpha[i] < c {
            sum += value;
            free += 1.0;
        } else if (alpha[i] <= 0.0) == (i < n) {
            low = f64::max(low, value);
        } else {
            high = f64::min(high, value);
        }
    }
    let offset = if free > 0.0 { sum / free } else { 0.5 * (low + high) };
    ((0..n).map(|i| alpha[i] - alpha[n + i]).collect(), if offset.is_finite() { offset } else { 0.0 })
}

/// Fits the machine; examples that do not support it are dropped.
pub fn fit(kernel: Kernel, parameters: Parameters, z: &[Vec<f64>], y: &[f64]) -> Machine {
    let all: Vec<usize> = (0..z.len()).collect();
    let (beta, offset) = solve(&kernel.matrix(z), &all, y, parameters);
    let terms = z.iter().cloned().zip(beta).filter(|t| t.1 != 0.0).collect();
    Machine { kernel, terms, offset }
}

/// Mean squared error of ten-fold cross-validation, every fold solved.
pub fn cross_validate(kernel: &DMatrix<f64>, y: &[f64], parameters: Parameters) -> f64 {
    let n = y.len();
    let mut sum = 0.0;
    for fold in 0..FOLDS.min(n) {
        let kept: Vec<usize> = (0..n).filter(|i| i % FOLDS != fold).collect();
        let (beta, offset) = solve(kernel, &kept, y, parameters);
        for i in (fold..n).step_by(FOLDS) {
            let guess: f64 = kept.iter().zip(&beta).map(|(&k, b)| b * kernel[(k, i)]).sum();
            sum += (y[i] - offset - guess).powi(2);
        }
    }
    sum / n as f64
}

/// The best kernel and parameters by cross-validation, and their error. C and ε are tried in standard deviations of y.
pub fn choose(kernels: &[Kernel], z: &[Vec<f64>], y: &[f64]) -> (Kernel, Parameters, f64) {
    let mut best = (f64::INFINITY, Kernel::Radial(1.0), Parameters { c: 1.0, epsilon: 0.1 });
    let n = y.len().max(1) as f64;
    let mean = y.iter().sum::<f64>() / n;
    let deviation = (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / n).sqrt().max(1e-6);
    for &kernel in kernels {
        let matrix = kernel.matrix(z);
        for c in [0.3, 1.0, 4.0, 16.0] {
            for epsilon in [0.1, 0.3] {
                let parameters = Parameters { c: c * deviation, epsilon: epsilon * deviation };
                let error = cross_validate(&matrix, y, parameters);
                if error < best.0 {
                    best = (error, kernel, parameters);
                }
            }
        }
    }
    (best.1, best.2, best.0)
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

    /// Slow and obvious: every pair in turn, the best step by trying, until nothing helps.
    fn by_trying(kernel: &DMatrix<f64>, y: &[f64], p: Parameters) -> Vec<f64> {
        let n = y.len();
        let mut beta = vec![0.0; n];
        let mut step: f64 = 0.5;
        while step > 1e-5 {
            let mut improved = false;
            for i in 0..n {
                for j in 0..n {
                    let mut tried = beta.clone();
                    tried[i] += step;
                    tried[j] -= step;
                    let within = i != j && tried[i] <= p.c && tried[j] >= -p.c;
                    if within
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
            let (beta, offset) = solve(&kernel, &all, &y, p);
            assert!(beta.iter().sum::<f64>().abs() < 1e-9);
            assert!(beta.iter().all(|b| b.abs() <= p.c + 1e-12));
            let slow = by_trying(&kernel, &y, p);
            let (fast, slow) =
                (objective(&kernel, &beta, &y, p.epsilon), objective(&kernel, &slow, &y, p.epsilon));
            assert!(fast <= slow + 1e-3 * slow.abs(), "{fast} {slow}");
            // Optimality: who is inside the tube supports nothing, who is free lies on its edge.
            for i in 0..z.len() {
                let guess = offset + (0..z.len()).map(|k| beta[k] * kernel[(k, i)]).sum::<f64>();
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
    fn keeps_fewer_vectors_with_a_wider_tube() {
        let (z, y) = data();
        let count = |epsilon| fit(Kernel::Radial(0.9), Parameters { c: 4.0, epsilon }, &z, &y).terms.len();
        assert!(count(0.4) < count(0.02), "{} {}", count(0.4), count(0.02));
    }
}
