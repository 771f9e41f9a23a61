//! The space-warp stage of iterative motion warping (Hsu 2005, section 3.2).
//!
//! For each dof separately, a smooth scale `a` and offset `b` for every frame, by least squares against the other motion
//! under the time warp `W`: `|W(Ua + b) - y|^2 + |Fa|^2 + |Gb|^2` (eq. 1). `W` repeats rows, so `W'W` is diagonal
//! (the repetitions) and the normal equations (eq. 4) are tridiagonal in 2x2 blocks when `a_i` and `b_i` are
//! kept together. Gaussian elimination then costs O(frames).

use nalgebra::{Matrix2, Vector2};

/// Regularisation towards scale 1 and offset 0, for dofs that are constant.
const HOLD: f64 = 1e-6;

/// Scales and offsets of one dof, `[a, b]` for each frame.
///
/// `u`: the dof, `[frames]`; `counts`: repetitions, `[frames]`; `sums`: the sum of the lengthened `y` over each frame's
/// repetitions, `[frames]`; `weights`: of the squared differences of scale and offset from frame to frame.
pub fn fit(u: &[f64], counts: &[usize], sums: &[f64], weights: [f64; 2]) -> Vec<Vector2<f64>> {
    let frames = u.len();
    let smooth = Matrix2::new(weights[0], 0.0, 0.0, weights[1]);
    let mut diagonal: Vec<Matrix2<f64>> = Vec::with_capacity(frames);
    let mut right: Vec<Vector2<f64>> = Vec::with_capacity(frames);
    for i in 0..frames {
        let neighbors = usize::from(i > 0) + usize::from(i + 1 < frames);
        let r = counts[i] as f64;
        let data = Matrix2::new(u[i] * u[i], u[i], u[i], 1.0) * r;
        diagonal.push(data + smooth * neighbors as f64 + Matrix2::identity() * HOLD);
        right.push(Vector2::new(u[i] * sums[i] + HOLD, sums[i]));
    }
    // Block elimination; every block is positive definite thanks to the hold.
    let inverse = |m: &Matrix2<f64>| m.try_inverse().unwrap_or_else(Matrix2::zeros);
    // The diagonal becomes its own inverse, row by row.
    for i in 0..frames {
        if i > 0 {
            let factor = smooth * diagonal[i - 1];
            let (before, carried) = (factor * smooth, factor * right[i - 1]);
            diagonal[i] -= before;
            right[i] += carried;
        }
        diagonal[i] = inverse(&diagonal[i]);
    }
    let mut result = vec![Vector2::zeros(); frames];
    for i in (0..frames).rev() {
        let after = if i + 1 < frames { smooth * result[i + 1] } else { Vector2::zeros() };
        result[i] = diagonal[i] * (right[i] + after);
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    /// Eq. 4 as it is printed, with full matrices.
    #[test]
    fn solves_the_normal_equations_of_the_paper() {
        let u = [0.3, -1.0, 0.7, 2.0, 1.1];
        let counts = [2, 1, 4, 3, 2];
        let m = u.len();
        let n: usize = counts.iter().sum();
        let y = DVector::from_fn(n, |i, _| (i as f64 * 0.9).sin() + 0.2 * i as f64);
        let mut w = DMatrix::zeros(n, m);
        let (mut row, mut sums) = (0, vec![0.0; m]);
        for i in 0..m {
            for _ in 0..counts[i] {
                w[(row, i)] = 1.0;
                sums[i] += y[row];
                row += 1;
            }
        }
        let weights = [3.0, 5.0];
        let difference = |weight: f64| {
            DMatrix::from_fn(m - 1, m, |i, j| {
                weight.sqrt() * (f64::from(u8::from(j == i + 1)) - f64::from(u8::from(j == i)))
            })
        };
        let (f, g) = (difference(weights[0]), difference(weights[1]));
        let big_u = DMatrix::from_diagonal(&DVector::from_row_slice(&u));
        let wtw = w.transpose() * &w;
        let mut left = DMatrix::zeros(2 * m, 2 * m);
        left.view_mut((0, 0), (m, m)).copy_from(&(&big_u * &wtw * &big_u + f.transpose() * &f));
        left.view_mut((0, m), (m, m)).copy_from(&(&big_u * &wtw));
        left.view_mut((m, 0), (m, m)).copy_from(&(&wtw * &big_u));
        left.view_mut((m, m), (m, m)).copy_from(&(&wtw + g.transpose() * &g));
        let mut right = DVector::zeros(2 * m);
        right.rows_mut(0, m).copy_from(&(&big_u * w.transpose() * &y));
        right.rows_mut(m, m).copy_from(&(w.transpose() * &y));
        let truth = left.lu().solve(&right).unwrap();
        for (i, found) in fit(&u, &counts, &sums, weights).iter().enumerate() {
            assert!((found.x - truth[i]).abs() < 1e-4, "scale {i}: {} {}", found.x, truth[i]);
            assert!((found.y - truth[m + i]).abs() < 1e-4, "offset {i}: {} {}", found.y, truth[m + i]);
        }
    }

    #[test]
    fn a_dof_that_does_not_move_is_finite() {
        let fitted = fit(&[0.0; 4], &[2; 4], &[2.0; 4], [100.0; 2]);
        assert!(fitted.iter().all(|ab| (ab.x - 1.0).abs() < 1e-3 && (ab.y - 1.0).abs() < 1e-3));
    }
}
