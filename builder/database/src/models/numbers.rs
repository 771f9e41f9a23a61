//! Numbers that several models need.

/// Little-endian bytes of numbers, as f32.
pub(crate) fn floats(numbers: impl IntoIterator<Item = f64>) -> Vec<u8> {
    numbers.into_iter().flat_map(|v| (v as f32).to_le_bytes()).collect()
}
