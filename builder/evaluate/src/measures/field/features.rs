//! Features of a second of motion, and a classifier of them: linear discriminant analysis, which anyone can recompute.

use gestus_core::blob::layout::dof;
use gestus_motion::{
    body::Body,
    clip::Clip,
    statistics::{mean, moments},
};
use nalgebra::{Cholesky, DMatrix, DVector};

use crate::metrics::centred;

/// Length of a window, seconds; windows begin every half of it.
const WINDOW_S: f64 = 1.0;
/// Part of the diagonal in the covariance of the classifier and of the Fréchet distance: there are fewer windows than
/// numbers would need.
const SHRINKAGE: f64 = 0.1;

/// The features of each window of a clip; one window where the clip is shorter. Of each joint: the mean of its hips-centred,
/// heading-aligned position (m), the position's standard deviation (m), its mean speed in that frame (m/s); then the root's
/// mean height (m), forward and sideways speed (m/s), and mean absolute yaw rate (rad/s). Shape `[windows][7 J + 4]`.
pub fn windows(body: &Body, clip: &Clip) -> Vec<DVector<f64>> {
    let rows = body.clip_dofs(clip);
    let poses: Vec<Vec<_>> = rows.iter().map(|r| centred(body, r)).collect();
    let length = ((WINDOW_S * clip.rate_hz).round() as usize).clamp(2, rows.len().max(2));
    let starts = (0..=rows.len().saturating_sub(length)).step_by((length / 2).max(1));
    starts
        .map(|start| {
            let inside = start..(start + length).min(rows.len());
            let mut features = Vec::with_capacity(7 * body.skeleton.joints() + 4);
            for j in 0..body.skeleton.joints() {
                for axis in 0..3 {
                    let (mean, deviation) = moments(inside.clone().map(|t| poses[t][j][axis]), 0.0);
                    features.extend([mean, deviation]);
                }
                let steps = inside.clone().skip(1).map(|t| (poses[t][j] - poses[t - 1][j]).norm());
                features.push(mean(steps) * clip.rate_hz);
            }
            let of = |f: &dyn Fn(&[f64]) -> f64| mean(inside.clone().map(|t| f(&rows[t])));
            features.extend([
                of(&|r| r[dof::HEIGHT]),
                of(&|r| r[dof::FORWARD]),
                of(&|r| r[dof::LEFT].abs()),
                of(&|r| r[dof::YAW].abs()),
            ]);
            DVector::from_vec(features)
        })
        .collect()
}

/// Linear discriminant analysis with one covariance for all classes, shrunk towards its diagonal; equal priors.
pub struct Classifier {
    /// Numbers of the classes.
    classes: Vec<usize>,
    /// `Σ⁻¹ μ` and `-½ μᵀ Σ⁻¹ μ` of each class.
    scores: Vec<(DVector<f64>, f64)>,
}

impl Classifier {
    /// From windows with their classes. `None` without two classes.
    pub fn of(examples: &[(usize, &DVector<f64>)]) -> Option<Self> {
        let mut classes: Vec<usize> = examples.iter().map(|e| e.0).collect();
        classes.sort_unstable();
        classes.dedup();
        if classes.len() < 2 {
            return None;
        }
        let mean_of = |class: usize| {
            let members = || examples.iter().filter(move |e| e.0 == class);
            let sum: DVector<f64> = members().map(|e| e.1.clone()).sum();
            sum / members().count() as f64
        };
        let means: Vec<DVector<f64>> = classes.iter().map(|&c| mean_of(c)).collect();
        let place = |class: usize| classes.iter().position(|&c| c == class).unwrap_or_default();
        let departures: Vec<DVector<f64>> = examples.iter().map(|(c, x)| *x - &means[place(*c)]).collect();
        let inverse = Cholesky::new(covariance(&departures))?;
        let scores = means
            .iter()
            .map(|mean| {
                let weights = inverse.solve(mean);
                let bias = -0.5 * mean.dot(&weights);
                (weights, bias)
            })
            .collect();
        Some(Self { classes, scores })
    }

    /// Log likelihood of each class, over the windows of a clip, up to a constant: mean of the windows.
    pub fn clip(&self, windows: &[DVector<f64>]) -> Vec<(usize, f64)> {
        let score =
            |(weights, bias): &(DVector<f64>, f64)| mean(windows.iter().map(|w| weights.dot(w) + bias));
        self.classes.iter().copied().zip(self.scores.iter().map(score)).collect()
    }
}

/// Covariance of departures from a mean, shrunk towards its diagonal.
fn covariance(departures: &[DVector<f64>]) -> DMatrix<f64> {
    let size = departures.first().map_or(0, DVector::len);
    let mut sum = DMatrix::zeros(size, size);
    for d in departures {
        sum.ger(1.0 / departures.len() as f64, d, d, 1.0);
    }
    let diagonal = sum.diagonal();
    sum *= 1.0 - SHRINKAGE;
    for i in 0..size {
        // A feature that never varies (a root's own position) says nothing.
        sum[(i, i)] = diagonal[i].max(1e-8);
    }
    sum
}

/// Fréchet distance of two sets of windows, each as a Gaussian (Heusel et al. 2017, of images):
/// `|μ₁ - μ₂|² + tr(Σ₁ + Σ₂ - 2 (Σ₁ Σ₂)^½)`, in features divided by their deviations in the second set.
pub fn frechet(ours: &[DVector<f64>], real: &[DVector<f64>]) -> Option<f64> {
    if ours.len() < 2 || real.len() < 2 {
        return None;
    }
    let size = real[0].len();
    let scale = DVector::from_fn(size, |i, _| moments(real.iter().map(|w| w[i]), 1e-4).1);
    let gaussian = |set: &[DVector<f64>]| {
        let set: Vec<DVector<f64>> = set.iter().map(|w| w.component_div(&scale)).collect();
        let mean: DVector<f64> = set.iter().sum::<DVector<f64>>() / set.len() as f64;
        let departures: Vec<DVector<f64>> = set.iter().map(|w| w - &mean).collect();
        (mean, covariance(&departures))
    };
    let ((m1, s1), (m2, s2)) = (gaussian(ours), gaussian(real));
    // tr (Σ₁ Σ₂)^½ = tr (Σ₁^½ Σ₂ Σ₁^½)^½, of a symmetric matrix.
    let root = s1.clone().symmetric_eigen();
    let half = &root.eigenvectors
        * DMatrix::from_diagonal(&root.eigenvalues.map(|v| v.max(0.0).sqrt()))
        * root.eigenvectors.transpose();
    let inner = (&half * &s2 * &half).symmetric_eigenvalues();
    let cross: f64 = inner.iter().map(|v| v.max(0.0).sqrt()).sum();
    Some(((m1 - m2).norm_squared() + s1.trace() + s2.trace() - 2.0 * cross).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(centre: [f64; 2], spread: f64) -> Vec<DVector<f64>> {
        let around = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        let at = |o: &[f64; 2]| DVector::from_vec(vec![centre[0] + spread * o[0], centre[1] + spread * o[1]]);
        around.iter().map(at).collect()
    }

    #[test]
    fn discriminants_tell_classes_apart_and_equal_sets_have_no_distance() {
        let (a, b) = (points([0.0, 0.0], 1.0), points([4.0, 1.0], 1.0));
        let examples: Vec<(usize, &DVector<f64>)> =
            a.iter().map(|w| (3, w)).chain(b.iter().map(|w| (7, w))).collect();
        let classifier = Classifier::of(&examples).unwrap();
        for (set, class) in [(&a, 3), (&b, 7)] {
            let best = classifier.clip(set).into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
            assert_eq!(best.0, class);
        }
        assert!(Classifier::of(&examples[..4]).is_none());
        assert!(frechet(&a, &a).unwrap() < 1e-9);
        // Equal spreads: the squared distance of the means, in deviations of the second set (√½ a dimension).
        let found = frechet(&a, &b).unwrap();
        assert!((found - 17.0 / 0.5).abs() < 1e-6, "{found}");
        assert!(frechet(&a[..1], &b).is_none());
    }
}
