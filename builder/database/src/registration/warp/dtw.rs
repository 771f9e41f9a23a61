//! Dynamic time warping with the local constraints of Sakoe and Chiba as numbered by Rabiner and Juang, for comparison.
//!
//! `D[i][j] = min over steps (di, dj) of D[i - di][j - dj] + (di + dj) c[i][j]`, from corner to corner. Cost: O(m n).

use crate::registration::warp::{Warp, WarpError, check, costs};

/// Allowed steps of a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Constraint {
    /// Type I: (1,0), (1,1), (0,1). Any slope.
    TypeI,
    /// Type III: (2,1), (1,1), (1,2). Slopes of 1/2 to 2.
    TypeIII,
}

impl Constraint {
    const fn steps(self) -> [(usize, usize); 3] {
        match self {
            Self::TypeI => [(1, 1), (1, 0), (0, 1)],
            Self::TypeIII => [(1, 1), (2, 1), (1, 2)],
        }
    }
}

/// Warps `u` onto `y`; both are `[frames x dofs]`.
///
/// # Errors
/// [`WarpError`] for motions that can't be compared.
pub fn dtw(u: &[Vec<f64>], y: &[Vec<f64>], constraint: Constraint) -> Result<Warp, WarpError> {
    check(u, y)?;
    Ok(along(&path(&costs(u, y), constraint)?, u.len()))
}

/// The path of least cost through a table [m x n].
///
/// # Errors
/// [`WarpError::Lengths`] if the constraint allows no path.
pub fn path(costs: &[Vec<f64>], constraint: Constraint) -> Result<Vec<(usize, usize)>, WarpError> {
    let (m, n) = (costs.len(), costs.first().map_or(0, Vec::len));
    if m == 0 || n == 0 {
        return Err(WarpError::Empty);
    }
    let steps = constraint.steps();
    let mut best = vec![vec![f64::INFINITY; n]; m];
    let mut taken = vec![vec![0_u8; n]; m];
    best[0][0] = 2.0 * costs[0][0];
    for i in 0..m {
        for j in 0..n {
            for (k, &(di, dj)) in steps.iter().enumerate() {
                if i < di || j < dj {
                    continue;
                }
                let cost = best[i - di][j - dj] + (di + dj) as f64 * costs[i][j];
                if cost < best[i][j] {
                    best[i][j] = cost;
                    taken[i][j] = k as u8;
                }
            }
        }
    }
    if !best[m - 1][n - 1].is_finite() {
        return Err(WarpError::Lengths { from: m, to: n, slope: 2 });
    }
    let mut path = vec![(m - 1, n - 1)];
    let (mut i, mut j) = (m - 1, n - 1);
    while (i, j) != (0, 0) {
        let (di, dj) = steps[usize::from(taken[i][j])];
        (i, j) = (i - di, j - dj);
        path.push((i, j));
    }
    path.reverse();
    Ok(path)
}

/// The warp along a path: the mean of all frames that a frame is matched with, linear for frames that are skipped.
fn along(path: &[(usize, usize)], frames: usize) -> Warp {
    let mut met = vec![(0.0, 0.0); frames];
    for &(i, j) in path {
        met[i].0 += j as f64;
        met[i].1 += 1.0;
    }
    let mut positions: Vec<f64> = Vec::with_capacity(frames);
    for i in 0..frames {
        let mean = |i: usize| met[i].0 / met[i].1;
        // A step passes over one frame at most.
        positions.push(if met[i].1 > 0.0 { mean(i) } else { 0.5 * (mean(i - 1) + mean(i + 1)) });
    }
    Warp { positions }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn least(costs: &[Vec<f64>], constraint: Constraint, i: usize, j: usize) -> f64 {
        if (i, j) == (0, 0) {
            return 2.0 * costs[0][0];
        }
        let mut best = f64::INFINITY;
        for (di, dj) in constraint.steps() {
            if i >= di && j >= dj {
                best = best.min(least(costs, constraint, i - di, j - dj) + (di + dj) as f64 * costs[i][j]);
            }
        }
        best
    }

    #[test]
    fn is_the_best_of_all_paths() {
        let table: Vec<Vec<f64>> =
            (0..6).map(|i| (0..7).map(|j| ((i * 31 + j * 17 + i * j * 7) % 23) as f64).collect()).collect();
        for constraint in [Constraint::TypeI, Constraint::TypeIII] {
            let path = path(&table, constraint).unwrap();
            let mut cost = 2.0 * table[0][0];
            for w in path.windows(2) {
                cost += (w[1].0 - w[0].0 + w[1].1 - w[0].1) as f64 * table[w[1].0][w[1].1];
            }
            assert_eq!(cost, least(&table, constraint, 5, 6));
        }
    }

    #[test]
    fn type_three_refuses_steep_lengths() {
        let u = vec![vec![0.0]; 5];
        let y = vec![vec![0.0]; 12];
        assert!(matches!(dtw(&u, &y, Constraint::TypeIII), Err(WarpError::Lengths { .. })));
        assert!(dtw(&u, &y, Constraint::TypeI).is_ok());
    }
}
