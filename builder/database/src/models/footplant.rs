//! Detection of foot contacts by a projection of features: discriminant analysis of two classes (Hsu 2005,
//! section 4.5, "Annotation"; Duda, Hart, Stork 2000, section 3.8).
//!
//! The direction `w = S_w⁻¹ (m₁ - m₀)` separates standing from moving frames best. Along it each class is a univariate
//! Gaussian, and the boundary is where both are equally likely. Each foot has its own projection.

use nalgebra::{DMatrix, DVector};

use gestus_motion::statistics::{dot, moments};

/// A projection and its boundary: a foot is in contact if the projection is greater.
#[derive(Debug, Clone, PartialEq)]
pub struct Footplant {
    /// Weights of the features.
    pub projection: Vec<f64>,
    /// The boundary.
    pub boundary: f64,
}

/// Fits one foot: `features` `[frames][n]` and whether the foot stands in each frame.
///
/// If fewer than two frames are of one class, the result is constant: always, or never, in contact.
pub fn fit(features: &[Vec<f64>], stands: &[bool]) -> Footplant {
    let n = features.first().map_or(0, Vec::len);
    let count = |which: bool| stands.iter().filter(|&&s| s == which).count();
    let (standing, moving) = (count(true), count(false));
    let constant =
        Footplant { projection: vec![0.0; n], boundary: if standing > moving { -1.0 } else { 1.0 } };
    if standing < 2 || moving < 2 || n == 0 {
        return constant;
    }
    let mean = |which: bool| {
        let mut sum = DVector::<f64>::zeros(n);
        for (row, _) in features.iter().zip(stands).filter(|(_, s)| **s == which) {
            sum += DVector::from_column_slice(row);
        }
        sum / count(which) as f64
    };
    let (up, down) = (mean(false), mean(true));
    let mut centred = DMatrix::zeros(n, features.len());
    for (k, (row, &stands)) in features.iter().zip(stands).enumerate() {
        let own = if stands { &down } else { &up };
        centred.set_column(k, &(DVector::from_column_slice(row) - own));
    }
    let mut within = &centred * centred.transpose() / features.len() as f64;
    // Features that hardly move, or move as others do, must not decide.
    let ridge = 1e-4 * within.trace() / n as f64 + 1e-12;
    for i in 0..n {
        within[(i, i)] += ridge;
    }
    let Some(factor) = within.cholesky() else { return constant };
    let w = factor.solve(&(&down - &up));
    let w = &w / w.norm().max(1e-12);
    let along = |which: bool| {
        let values: Vec<f64> = features
            .iter()
            .zip(stands)
            .filter(|(_, s)| **s == which)
            .map(|(row, _)| dot(row, w.iter()))
            .collect();
        moments(values.into_iter(), 1e-9)
    };
    let share = standing as f64 / (standing + moving) as f64;
    let boundary = boundary(along(false), along(true), share);
    Footplant { projection: w.iter().copied().collect(), boundary }
}

/// The point between the means of two Gaussians at which they are equal, weighted by their shares.
fn boundary((low, low_sd): (f64, f64), (high, high_sd): (f64, f64), share: f64) -> f64 {
    let density = |x: f64, mean: f64, sd: f64| -0.5 * ((x - mean) / sd).powi(2) - sd.ln();
    let misfit =
        |x: f64| density(x, high, high_sd) + share.ln() - density(x, low, low_sd) - (1.0 - share).ln();
    let (mut a, mut b) = (low, high);
    for _ in 0..60 {
        let middle = 0.5 * (a + b);
        if misfit(middle) > 0.0 { b = middle } else { a = middle }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// F1 of a footplant on frames with known contacts, counting standing frames.
    fn f1(plant: &Footplant, features: &[Vec<f64>], stands: &[bool]) -> f64 {
        let (mut hit, mut missed, mut wrong) = (0.0, 0.0, 0.0);
        for (row, &stands) in features.iter().zip(stands) {
            let value = dot(row, &plant.projection);
            match (value > plant.boundary, stands) {
                (true, true) => hit += 1.0,
                (false, true) => missed += 1.0,
                (true, false) => wrong += 1.0,
                (false, false) => {}
            }
        }
        if hit > 0.0 { 2.0 * hit / (2.0 * hit + missed + wrong) } else { 0.0 }
    }

    #[test]
    fn finds_the_direction_that_parts_the_classes() {
        // Noise along (1, 1) is large, the classes differ along (1, -1).
        let mut rows = Vec::new();
        let mut stands = Vec::new();
        for k in 0..400 {
            let noise = ((k * 37 % 101) as f64 / 101.0 - 0.5) * 20.0;
            let small = ((k * 53 % 97) as f64 / 97.0 - 0.5) * 0.5;
            let standing = k % 4 == 0;
            let side = if standing { 1.0 } else { -1.0 };
            rows.push(vec![noise + side + small, noise - side]);
            stands.push(standing);
        }
        let plant = fit(&rows, &stands);
        assert!(f1(&plant, &rows, &stands) > 0.999);
        assert!((plant.projection[0] + plant.projection[1]).abs() < 0.1, "{plant:?}");
        assert!(plant.boundary.abs() < 0.5, "{plant:?}");
    }

    #[test]
    fn one_class_alone_is_always_or_never() {
        let rows = vec![vec![1.0], vec![2.0], vec![3.0]];
        assert_eq!(f1(&fit(&rows, &[true; 3]), &rows, &[true; 3]), 1.0);
        assert_eq!(f1(&fit(&rows, &[false; 3]), &rows, &[true; 3]), 0.0);
    }

    #[test]
    fn the_boundary_is_where_both_are_equally_likely() {
        let at = boundary((0.0, 1.0), (4.0, 2.0), 0.5);
        let density = |x: f64, m: f64, s: f64| (-0.5 * ((x - m) / s).powi(2)).exp() / s;
        assert!((density(at, 0.0, 1.0) - density(at, 4.0, 2.0)).abs() < 1e-9);
        assert!((boundary((0.0, 1.0), (2.0, 1.0), 0.5) - 1.0).abs() < 1e-9);
    }
}
