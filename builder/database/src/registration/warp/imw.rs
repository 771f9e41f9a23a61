//! Iterative motion warping (Hsu 2005, section 3).
//!
//! Minimises `|W(Ua + b) - y|^2 + |Fa|^2 + |Gb|^2` (eq. 1) alternately over the time warp `W` over all dofs at once
//! ([`repeat`]), and over scale `a` and offset `b` of each dof ([`space`]). Each stage
//! finds its global optimum, so the objective never increases; iteration stops when it no longer decreases. The
//! differential time warp is the repetition vector divided by the slope limit (section 3.4); its integral is the
//! [`Warp`].
//!
//! Cost of an iteration: O(m n (dofs + s^3)) for m frames onto n; about ten iterations.

use crate::registration::warp::{Warp, WarpError, check, costs_within, repeat, space};

/// Settings, with the paper's values as defaults (section 5.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// Slope limit `s`: slopes of the warp lie between `1/s` and `s`.
    pub slope: usize,
    /// Weight of the smoothness of scales and of offsets.
    pub weights: [f64; 2],
    /// Most iterations.
    pub iterations: usize,
    /// Least relative decrease of the objective for another iteration.
    pub tolerance: f64,
}

impl Default for Config {
    fn default() -> Self {
        Self { slope: 2, weights: [100.0, 100.0], iterations: 50, tolerance: 1e-6 }
    }
}

/// Result of iterative motion warping.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// Position in the second motion of each frame of the first.
    pub warp: Warp,
    /// Differential time warp: frames of the second motion for each frame of the first, 1/s to s.
    pub differential: Vec<f64>,
    /// The first motion under its space warp, not yet warped in time. Shape `[frames x dofs]`.
    pub warped: Vec<Vec<f64>>,
    /// The objective after each time warp; never increases except by rounding.
    pub objective: Vec<f64>,
}

/// Warps `u` onto `y`; both are `[frames x dofs]`, and begin and end at the same moments.
///
/// # Errors
/// [`WarpError`] for motions that can't be compared.
pub fn imw(u: &[Vec<f64>], y: &[Vec<f64>], config: &Config) -> Result<Solution, WarpError> {
    check(u, y)?;
    let slope = config.slope.max(1);
    let dofs = u[0].len();
    let mut warped = u.to_vec();
    let mut roughness = 0.0;
    let mut objective: Vec<f64> = Vec::new();
    let mut counts;
    loop {
        let table = costs_within(&warped, y, slope);
        counts = repeat::repetitions(&table, slope)?;
        let reached = repeat::cost(&table, slope, &counts) + roughness;
        let settled = objective.last().is_some_and(|&last| reached > last * (1.0 - config.tolerance));
        objective.push(reached);
        if settled || objective.len() >= config.iterations.max(1) {
            break;
        }
        roughness = 0.0;
        for d in 0..dofs {
            let column: Vec<f64> = u.iter().map(|row| row[d]).collect();
            let sums = sums(y, d, &counts, slope);
            let fitted = space::fit(&column, &counts, &sums, config.weights);
            for (i, ab) in fitted.iter().enumerate() {
                warped[i][d] = ab.x * column[i] + ab.y;
            }
            for pair in fitted.windows(2) {
                let step = pair[1] - pair[0];
                roughness += config.weights[0] * step.x * step.x + config.weights[1] * step.y * step.y;
            }
        }
    }
    let differential = counts.iter().map(|&r| r as f64 / slope as f64).collect();
    Ok(Solution { warp: integrate(&counts, slope), differential, warped, objective })
}

/// Sums of the lengthened `y` over each frame's repetitions: `W'y` of eq. 4.
fn sums(y: &[Vec<f64>], dof: usize, counts: &[usize], slope: usize) -> Vec<f64> {
    let mut j = 0;
    counts
        .iter()
        .map(|&r| {
            j += r;
            (j - r..j).map(|j| y[j / slope][dof]).sum()
        })
        .collect()
}

/// The time warp from the repetitions: each frame lies in the middle of its own.
fn integrate(counts: &[usize], slope: usize) -> Warp {
    let mut start = 0.0;
    let positions = counts
        .iter()
        .map(|&r| {
            let middle = start + 0.5 * r as f64;
            start += r as f64;
            middle / slope as f64 - 0.5
        })
        .collect();
    Warp { positions }
}
