//! Statistics of numbers in `f64`. Sums run in the order of the values, so that the same values give the same bits.

use std::{
    iter::Sum,
    ops::{Div, Mul},
};

/// Rises from 0 to 1 as `t` does, level at both ends and beyond them.
pub fn smoothstep(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Weights of a cubic Hermite curve at `t` from 0 to 1: of the first value, its slope, the second value and its slope.
pub fn hermite(t: f64) -> [f64; 4] {
    let (t2, t3) = (t * t, t * t * t);
    [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t, 3.0 * t2 - 2.0 * t3, t3 - t2]
}

/// Mean; not a number where there are no values.
pub fn mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = sum(values);
    sum / count as f64
}

/// Mean; 0 where there are no values.
pub fn mean_or_zero(values: impl IntoIterator<Item = f64>) -> f64 {
    let (sum, count) = sum(values);
    sum / count.max(1) as f64
}

fn sum(values: impl IntoIterator<Item = f64>) -> (f64, usize) {
    let mut count = 0;
    // The sum of nothing is -0.
    let sum = values.into_iter().inspect(|_| count += 1).sum::<f64>() + 0.0;
    (sum, count)
}

/// Variance, with n in the denominator; not a number where there are no values.
pub fn variance(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let middle = mean(values.clone());
    mean(values.map(|v| (v - middle).powi(2)))
}

/// Mean and standard deviation, with n in the denominator. The deviation is at least `least`.
pub fn moments(values: impl Iterator<Item = f64> + Clone, least: f64) -> (f64, f64) {
    let middle = mean_or_zero(values.clone());
    let variance = mean_or_zero(values.map(|v| (v - middle).powi(2)));
    (middle, variance.sqrt().max(least))
}

/// Values in ascending order.
pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut sorted: Vec<f64> = values.into_iter().collect();
    sorted.sort_by(f64::total_cmp);
    sorted
}

/// The quantile of ascending values at a share from 0 to 1: the value at that place, rounded down, and not an
/// interpolation. `None` where there are no values.
pub fn quantile(ascending: &[f64], share: f64) -> Option<f64> {
    ascending.get((share * ascending.len().saturating_sub(1) as f64) as usize).copied()
}

/// The median: the middle of the values, or the mean of the two in the middle. `None` where there are no values.
pub fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    let ascending = sorted(values);
    let upper = *ascending.get(ascending.len() / 2)?;
    let lower = ascending[(ascending.len() - 1) / 2];
    Some(0.5 * (lower + upper))
}

/// Least and greatest value; infinities where there are no values.
pub fn extent(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)))
}

/// Inner product.
pub fn dot<'a>(a: impl IntoIterator<Item = &'a f64>, b: impl IntoIterator<Item = &'a f64>) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Squared distance of two rows of numbers.
pub fn distance2(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// Pearson's correlation; 0 where one side does not vary.
pub fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (ma, mb) = (mean_or_zero(a.iter().copied()), mean_or_zero(b.iter().copied()));
    let dot = |x: &[f64], mx: f64, y: &[f64], my: f64| -> f64 {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum()
    };
    let scale = (dot(a, ma, a, ma) * dot(b, mb, b, mb)).sqrt();
    if scale > 0.0 { dot(a, ma, b, mb) / scale } else { 0.0 }
}

/// Spearman's rank correlation: Pearson's of the ranks, ties sharing theirs.
pub fn rank_correlation(a: &[f64], b: &[f64]) -> f64 {
    correlation(&ranks(a), &ranks(b))
}

fn ranks(values: &[f64]) -> Vec<f64> {
    values
        .iter()
        .map(|v| {
            let below = values.iter().filter(|o| *o < v).count() as f64;
            let equal = values.iter().filter(|o| *o == v).count() as f64;
            below + 0.5 * (equal - 1.0)
        })
        .collect()
}

/// Weights of a Gaussian of standard deviation `sigma` at the whole numbers from `-reach` to `reach`.
pub fn gaussian(reach: isize, sigma: f64) -> Vec<f64> {
    (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma.max(1e-9)).powi(2)).exp()).collect()
}

/// Values under a Gaussian of standard deviation `sigma`, in values; the first and the last go on beyond the ends.
pub fn smooth<T: Copy + Mul<f64, Output = T> + Div<f64, Output = T> + Sum>(
    values: &[T],
    sigma: f64,
) -> Vec<T> {
    let reach = (3.0 * sigma).ceil() as isize;
    let weights = gaussian(reach, sigma);
    let (total, last) = (weights.iter().sum::<f64>(), values.len() as isize - 1);
    let at = |t: isize| values[t.clamp(0, last) as usize];
    (0..=last).map(|t| weights.iter().zip(-reach..).map(|(w, i)| at(t + i) * *w).sum::<T>() / total).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_constant_stays_under_the_gaussian_and_a_peak_spreads() {
        assert!(smooth(&[-2.0; 9], 1.5).iter().all(|v: &f64| (v + 2.0).abs() < 1e-12));
        let peak = smooth(&[0.0, 0.0, 1.0, 0.0, 0.0], 1.0);
        assert!(peak[2] < 1.0 && peak[2] > peak[1] && peak[1] > peak[0] && peak[1] == peak[3], "{peak:?}");
        assert_eq!(smooth(&[1.0, 2.0], 0.0), [1.0, 2.0]);
    }

    #[test]
    fn means_of_nothing_are_no_number_or_zero() {
        assert!(mean([]).is_nan());
        assert_eq!(mean_or_zero([]), 0.0);
        assert_eq!(moments([].into_iter(), 0.1), (0.0, 0.1));
    }

    #[test]
    fn moments_divide_by_the_count() {
        let values = [1.0, 2.0, 3.0, 6.0];
        assert_eq!(moments(values.into_iter(), 0.0), (3.0, 3.5f64.sqrt()));
        assert_eq!(variance(values.into_iter()), 3.5);
    }

    #[test]
    fn quantiles_are_values() {
        let ascending = sorted([4.0, 1.0, 3.0, 2.0, 5.0]);
        assert_eq!([0.0, 0.05, 0.95, 1.0].map(|q| quantile(&ascending, q)), [1.0, 1.0, 4.0, 5.0].map(Some));
        assert_eq!(quantile(&[], 0.5), None);
        assert_eq!((median([3.0, 1.0, 2.0]), median([4.0, 1.0, 2.0, 3.0])), (Some(2.0), Some(2.5)));
        assert_eq!((median([7.0]), median([])), (Some(7.0), None));
        assert!(mean_or_zero([]).is_sign_positive());
    }

    #[test]
    fn ranks_are_what_counts() {
        assert!((rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[0.1, 0.2, 5.0, 99.0]) - 1.0).abs() < 1e-12);
        assert!(
            (rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[1.0, 1.0, 2.0, 2.0]) - 0.894_427_191).abs() < 1e-6
        );
        assert!((rank_correlation(&[1.0, 2.0, 3.0], &[3.0, 2.0, 1.0]) + 1.0).abs() < 1e-12);
        assert_eq!(rank_correlation(&[1.0, 2.0], &[5.0, 5.0]), 0.0);
    }
}
