//! ε-insensitive support vector regression (paper 003, section 6; Drucker et al. 1997, Vapnik 1995).
//!
//! Differences smaller than ε cost nothing, larger ones their excess times C, so that most examples drop out and few
//! support vectors remain. In the dual, with `β = α⁺ - α⁻`:
//!
//! ```text
//! least ½ βᵀ K β - yᵀ β + ε Σ |β_i|,   -C <= β_i <= C,   Σ β_i = 0
//! ```
//!
//! Solved by sequential minimal optimisation: two variables at a time, each step in closed form (Platt 1999). Of the
//! pair the first violates optimality most, and the second promises the largest decrease with it (Fan, Chen and Lin,
//! "Working Set Selection Using Second Order Information", JMLR 2005). It takes the kernel matrix from outside, so
//! that the folds of a cross-validation share it, and starts from the solution for a smaller C, which is inside the
//! box of a larger one; that is why it is written here and not taken from a crate. Cost: O(n) a step, some n to 100 n
//! steps.

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
    let mut problem = Problem::new(kernel, of, y);
    let offset = problem.improve(parameters, TOLERANCE);
    (problem.beta, offset)
}

/// A problem and the best β so far.
struct Problem {
    /// Rows of the kernel matrix, one after the other.
    kernel: Vec<f64>,
    y: Vec<f64>,
    beta: Vec<f64>,
    /// `K β - y`.
    gradient: Vec<f64>,
}

impl Problem {
    fn new(kernel: &DMatrix<f64>, of: &[usize], y: &[f64]) -> Self {
        let y: Vec<f64> = of.iter().map(|&i| y[i]).collect();
        Self {
            kernel: of.iter().flat_map(|&i| of.iter().map(move |&j| kernel[(i, j)])).collect(),
            beta: vec![0.0; y.len()],
            gradient: y.iter().map(|v| -v).collect(),
            y,
        }
    }

    /// Goes on to the optimum of parameters whose C is no less than the last one's; gives the offset.
    fn improve(&mut self, Parameters { c, epsilon }: Parameters, tolerance: f64) -> f64 {
        let n = self.y.len();
        // How steeply the objective falls where β_i grows, and where it shrinks; the tube turns over at 0.
        let up = |b: f64, g: f64| if b < 0.0 { epsilon - g } else { -epsilon - g };
        let down = |b: f64, g: f64| if b > 0.0 { -epsilon - g } else { epsilon - g };
        for _ in 0..200 * n.max(50) {
            let mut first = (f64::NEG_INFINITY, 0);
            let mut least = f64::INFINITY;
            for (i, (&b, &g)) in self.beta.iter().zip(&self.gradient).enumerate() {
                if b < c && up(b, g) > first.0 {
                    first = (up(b, g), i);
                }
                if b > -c {
                    least = least.min(down(b, g));
                }
            }
            if first.0 - least < tolerance {
                break;
            }
            let i = first.1;
            let row = &self.kernel[i * n..(i + 1) * n];
            let mut second = (0.0, i, 1.0);
            for (j, (&b, &g)) in self.beta.iter().zip(&self.gradient).enumerate() {
                let gain = first.0 - down(b, g);
                if b > -c && gain > 0.0 && j != i {
                    let curvature = (row[i] + self.kernel[j * n + j] - 2.0 * row[j]).max(1e-12);
                    if gain * gain / curvature > second.0 {
                        second = (gain * gain / curvature, j, gain / curvature);
                    }
                }
            }
            let (_, j, wanted) = second;
            if j == i {
                break;
            }
            let (b_i, b_j) = (self.beta[i], self.beta[j]);
            // No further than to the box's side, or to 0, where the slope changes.
            let room_i = if b_i < 0.0 { -b_i } else { c - b_i };
            let room_j = if b_j > 0.0 { b_j } else { c + b_j };
            let step = wanted.min(room_i).min(room_j);
            self.beta[i] = if step == room_i && b_i < 0.0 { 0.0 } else { b_i + step };
            self.beta[j] = if step == room_j && b_j > 0.0 { 0.0 } else { b_j - step };
            let (row_i, row_j) = (&self.kernel[i * n..(i + 1) * n], &self.kernel[j * n..(j + 1) * n]);
            for ((g, a), b) in self.gradient.iter_mut().zip(row_i).zip(row_j) {
                *g += step * (a - b);
            }
        }
        // The offset: what free variables agree on, or the middle of what the others allow.
        let (mut sum, mut free, mut low, mut high) = (0.0, 0.0, f64::NEG_INFINITY, f64::INFINITY);
        for (&b, &g) in self.beta.iter().zip(&self.gradient) {
            if b != 0.0 && b.abs() < c {
                sum += up(b, g);
                free += 1.0;
                continue;
            }
            if b < c {
                low = low.max(up(b, g));
            }
            if b > -c {
                high = high.min(down(b, g));
            }
        }
        let offset = if free > 0.0 { sum / free } else { 0.5 * (low + high) };
        if offset.is_finite() { offset } else { 0.0 }
    }
}

/// Fits the machine; examples that do not support it are dropped.
pub fn fit(kernel: Kernel, parameters: Parameters, z: &[Vec<f64>], y: &[f64]) -> Machine {
    let all: Vec<usize> = (0..z.len()).collect();
    let (beta, offset) = solve(&kernel.matrix(z), &all, y, parameters);
    let terms = z.iter().cloned().zip(beta).filter(|t| t.1 != 0.0).collect();
    Machine { kernel, terms, offset }
}

/// C that are tried, in standard deviations of y; ascending.
const COSTS: [f64; 4] = [0.3, 1.0, 4.0, 16.0];
/// ε that are tried, in standard deviations of y.
const TUBES: [f64; 2] = [0.1, 0.3];
/// Violation of optimality at which a fold stops, in standard deviations of y: far below what tells two parameters
/// apart.
const FOLD_TOLERANCE: f64 = 1e-2;

/// The kernel, by its index, and parameters of least ten-fold cross-validation error, and that error. Every fold is
/// solved.
pub fn choose(matrices: &[&DMatrix<f64>], y: &[f64]) -> (usize, Parameters, f64) {
    let n = y.len();
    let count = n.max(1) as f64;
    let mean = y.iter().sum::<f64>() / count;
    let deviation = (y.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / count).sqrt().max(1e-6);
    let mut best = (0, Parameters { c: deviation, epsilon: 0.1 * deviation }, f64::INFINITY);
    for (index, kernel) in matrices.iter().enumerate() {
        for epsilon in TUBES.map(|e| e * deviation) {
            let mut errors = [0.0; COSTS.len()];
            for fold in 0..FOLDS.min(n) {
                let kept: Vec<usize> = (0..n).filter(|i| i % FOLDS != fold).collect();
                let mut problem = Problem::new(kernel, &kept, y);
                for (error, cost) in errors.iter_mut().zip(COSTS) {
                    let parameters = Parameters { c: cost * deviation, epsilon };
                    let offset = problem.improve(parameters, FOLD_TOLERANCE * deviation);
                    for i in (fold..n).step_by(FOLDS) {
                        let guess: f64 =
                            kept.iter().zip(&problem.beta).map(|(&k, b)| b * kernel[(k, i)]).sum();
                        *error += (y[i] - offset - guess).powi(2) / count;
                    }
                }
            }
            for (error, cost) in errors.into_iter().zip(COSTS) {
                if error < best.2 {
                    best = (index, Parameters { c: cost * deviation, epsilon }, error);
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
    fn a_start_from_a_smaller_box_ends_where_one_from_nothing_does() {
        let (z, y) = data();
        let kernel = Kernel::Radial(0.9).matrix(&z);
        let all: Vec<usize> = (0..z.len()).collect();
        let mut warm = Problem::new(&kernel, &all, &y);
        for c in [0.2, 1.0, 5.0] {
            let p = Parameters { c, epsilon: 0.1 };
            let offset = warm.improve(p, TOLERANCE);
            let (cold, other) = solve(&kernel, &all, &y, p);
            let (warm, cold) = (objective(&kernel, &warm.beta, &y, 0.1), objective(&kernel, &cold, &y, 0.1));
            assert!((warm - cold).abs() < 1e-3 * cold.abs(), "{c}: {warm} {cold}");
            assert!((offset - other).abs() < 0.01, "{c}: {offset} {other}");
        }
    }

    #[test]
    fn keeps_fewer_vectors_with_a_wider_tube() {
        let (z, y) = data();
        let count = |epsilon| fit(Kernel::Radial(0.9), Parameters { c: 4.0, epsilon }, &z, &y).terms.len();
        assert!(count(0.4) < count(0.02), "{} {}", count(0.4), count(0.02));
    }
}
