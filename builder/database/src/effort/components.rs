//! The content of a fragment in a few numbers: its first principal components at a fixed length (Torresani 2006, section 6,
//! which uses two or three).

use nalgebra::{DMatrix, SymmetricEigen};

use crate::effort::fragment::Fragment;
use gestus_motion::{
    body::row_at,
    statistics::{dot, mean},
};

/// Frames of a resampled fragment.
pub const LENGTH: usize = 32;
/// Components kept.
pub const KEPT: usize = 3;
/// Most fragments that the components are computed from.
const SAMPLE: usize = 300;

/// Principal components of fragments resampled to [`LENGTH`].
#[derive(Debug, Clone)]
pub struct Components {
    mean: Vec<f64>,
    /// Unit vectors, divided by the standard deviation of their coefficient. Shape `[kept][LENGTH · C]`.
    directions: Vec<Vec<f64>>,
}

/// A fragment's content at `LENGTH` uniform times, concatenated.
pub fn stretched(content: &[Vec<f64>]) -> Vec<f64> {
    let last = (content.len() - 1) as f64;
    (0..LENGTH).flat_map(|k| row_at(content, last * k as f64 / (LENGTH - 1) as f64)).collect()
}

impl Components {
    /// The components of some fragments; empty without fragments. Uses the matrix of inner products, which is smaller than
    /// the covariance matrix.
    pub fn of(fragments: &[Fragment]) -> Self {
        let every = fragments.len().div_ceil(SAMPLE).max(1);
        let rows: Vec<Vec<f64>> = fragments.iter().step_by(every).map(|f| stretched(&f.content)).collect();
        let count = rows.len();
        if count == 0 {
            return Self { mean: Vec::new(), directions: Vec::new() };
        }
        let width = rows.first().map_or(0, Vec::len);
        let mean: Vec<f64> = (0..width).map(|c| mean(rows.iter().map(|r| r[c]))).collect();
        let centred: Vec<Vec<f64>> =
            rows.iter().map(|r| r.iter().zip(&mean).map(|(v, m)| v - m).collect()).collect();
        let gram = DMatrix::from_fn(count, count, |i, j| dot(&centred[i], &centred[j]));
        let eigen = SymmetricEigen::new(gram);
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let directions = order
            .into_iter()
            .take(KEPT)
            .filter(|&i| eigen.eigenvalues[i] > 1e-9)
            .map(|i| {
                // Unit length needs one root of the eigenvalue, unit variance of the coefficient another.
                let scale = (count as f64).sqrt() / eigen.eigenvalues[i];
                let mut direction = vec![0.0; width];
                for (row, weight) in centred.iter().zip(eigen.eigenvectors.column(i).iter()) {
                    direction.iter_mut().zip(row).for_each(|(d, v)| *d += weight * v * scale);
                }
                direction
            })
            .collect();
        Self { mean, directions }
    }

    /// Coefficients of a fragment, of unit variance over the fragments that they were found from.
    pub fn coefficients(&self, fragment: &Fragment) -> Vec<f64> {
        let row = stretched(&fragment.content);
        let project =
            |d: &Vec<f64>| d.iter().zip(&row).zip(&self.mean).map(|((d, v), m)| d * (v - m)).sum::<f64>();
        self.directions.iter().map(project).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effort::fragment::Span;

    #[test]
    fn finds_the_plane_that_fragments_lie_in() {
        // Two shapes mixed by known coefficients, at lengths of their own.
        let shape = |x: f64, a: f64, b: f64| vec![3.0 * a * (5.0 * x).sin() + 1.0, b * (4.0 * x).cos()];
        let mixes: Vec<(f64, f64)> =
            (0..12).map(|i| ((f64::from(i) * 1.7).sin(), (f64::from(i) * 2.9).cos())).collect();
        let fragments: Vec<Fragment> = mixes
            .iter()
            .enumerate()
            .map(|(i, &(a, b))| {
                let n = 40 + i;
                let content = (0..n).map(|k| shape(k as f64 / (n - 1) as f64, a, b)).collect();
                Fragment {
                    span: Span { clip: String::new(), from: 0, to: n },
                    action: 0,
                    style: 0,
                    rows: Vec::new(),
                    content,
                }
            })
            .collect();
        let components = Components::of(&fragments);
        let found: Vec<Vec<f64>> = fragments.iter().map(|f| components.coefficients(f)).collect();
        let strong: Vec<f64> = found.iter().map(|c| c[0]).collect();
        let variance = strong.iter().map(|v| v * v).sum::<f64>() / 12.0;
        assert!((variance - 1.0).abs() < 1e-6, "{variance}");
        // The first component is the larger shape's coefficient, up to its sign, mean and scale.
        let correlation =
            gestus_motion::statistics::correlation(&strong, &mixes.iter().map(|m| m.0).collect::<Vec<_>>());
        assert!(correlation.abs() > 0.99, "{correlation}");
    }
}
