//! Alignment: two fragments have the same content if dynamic time warping brings their poses near each other.
//!
//! `SSD(i, j) = min over paths w of Σ_n |X_i(p(n)) - X_j(q(n))|²`, from the first frames to the last, by steps of
//! (1, 0), (1, 1) and (0, 1) (Torresani 2006, eqs. 3 to 5). Unlike in
//! [`warp::dtw`](crate::registration::warp::dtw), a diagonal step counts once, as in the paper. Cost: O(m n D) time,
//! O(m n) memory.

use gestus_motion::statistics::distance2;

/// The best path of two fragments.
#[derive(Debug, Clone, PartialEq)]
pub struct Alignment {
    /// Frames of the one and of the other, step by step.
    pub path: Vec<(usize, usize)>,
    /// Sum of squared differences along it, in squared units of the dofs.
    pub ssd: f64,
}

impl Alignment {
    /// Root mean square difference of a dof along the path, radians. It does not depend on the length of the fragments or
    /// the number of joints, so a threshold applies to it.
    pub fn distance(&self, dofs: usize) -> f64 {
        (self.ssd / (self.path.len() * dofs.max(1)) as f64).sqrt()
    }
}

/// Default distance below which fragments have the same content, radians.
pub const THRESHOLD_RAD: f64 = 0.25;

/// Aligns two fragments, `[frames][C]` each.
///
/// # Panics
/// If a fragment has no frames.
pub fn align(a: &[Vec<f64>], b: &[Vec<f64>]) -> Alignment {
    let (m, n) = (a.len(), b.len());
    let mut best = vec![f64::INFINITY; m * n];
    let mut came = vec![0u8; m * n];
    for i in 0..m {
        for j in 0..n {
            let mut least = if (i, j) == (0, 0) { 0.0 } else { f64::INFINITY };
            // The diagonal first: of equal paths the shorter.
            for (k, (di, dj)) in [(1, 1), (1, 0), (0, 1)].into_iter().enumerate() {
                if i >= di && j >= dj && best[(i - di) * n + j - dj] < least {
                    least = best[(i - di) * n + j - dj];
                    came[i * n + j] = k as u8;
                }
            }
            best[i * n + j] = least + distance2(&a[i], &b[j]);
        }
    }
    let (mut i, mut j) = (m - 1, n - 1);
    let mut path = vec![(i, j)];
    while (i, j) != (0, 0) {
        let (di, dj) = [(1, 1), (1, 0), (0, 1)][usize::from(came[i * n + j])];
        (i, j) = (i - di, j - dj);
        path.push((i, j));
    }
    path.reverse();
    Alignment { path, ssd: best[m * n - 1] }
}

/// Distance of two fragments' contents, radians.
pub fn distance(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    align(a, b).distance(a[0].len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn signal(n: usize, f: impl Fn(f64) -> f64) -> Vec<Vec<f64>> {
        (0..n).map(|i| i as f64 / (n - 1) as f64).map(|x| vec![f(x), (3.0 * x).cos()]).collect()
    }

    /// Every path, one after the other.
    fn least(a: &[Vec<f64>], b: &[Vec<f64>], i: usize, j: usize) -> f64 {
        let here = distance2(&a[i], &b[j]);
        let before = [(1, 1), (1, 0), (0, 1)]
            .into_iter()
            .filter(|&(di, dj)| i >= di && j >= dj)
            .map(|(di, dj)| least(a, b, i - di, j - dj))
            .reduce(f64::min);
        here + before.unwrap_or(0.0)
    }

    #[test]
    fn is_the_least_of_all_paths() {
        let (a, b) = (signal(6, |x| (5.0 * x).sin()), signal(8, |x| (5.0 * x * x).sin() + 0.1));
        let alignment = align(&a, &b);
        assert!((alignment.ssd - least(&a, &b, 5, 7)).abs() < 1e-12);
        let along: f64 = alignment.path.iter().map(|&(i, j)| distance2(&a[i], &b[j])).sum();
        assert!((alignment.ssd - along).abs() < 1e-12);
        assert_eq!((alignment.path[0], alignment.path[alignment.path.len() - 1]), ((0, 0), (5, 7)));
    }

    #[test]
    fn timing_does_not_count_and_content_does() {
        let even = signal(60, |x| (6.0 * x).sin());
        let warped: Vec<Vec<f64>> = (0..80)
            .map(|i| f64::from(i) / 79.0)
            .map(|x| x * x)
            .map(|x| vec![(6.0 * x).sin(), (3.0 * x).cos()])
            .collect();
        let other = signal(60, |x| (9.0 * x).cos());
        assert!(distance(&even, &warped) < 0.05, "{}", distance(&even, &warped));
        assert!(distance(&even, &other) > 0.25, "{}", distance(&even, &other));
    }
}
