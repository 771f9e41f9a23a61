//! Models that need no frames at run time: from paired cycles to sections of the blob.
//!
//! [`correspond`] puts every frame of the input style beside its counterpart in an output style; [`lti`] estimates
//! linear time-invariant models from that (paper 001); [`statistic`] takes means and spreads of each style, which
//! need no pairs (paper 002). [`footplant`] finds, for both, the projection by which a foot is known to stand.

pub mod correspond;
pub mod footplant;
pub mod lti;
pub mod statistic;

/// Little-endian bytes of numbers, as f32.
pub(crate) fn floats(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect()
}

/// Mean and standard deviation of numbers; a deviation of at least `least`.
pub(crate) fn moments(values: impl Iterator<Item = f64> + Clone, least: f64) -> (f64, f64) {
    let count = values.clone().count().max(1) as f64;
    let mean = values.clone().sum::<f64>() / count;
    let variance = values.map(|v| (v - mean).powi(2)).sum::<f64>() / count;
    (mean, variance.sqrt().max(least))
}
