//! Numbers that several models need.

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
