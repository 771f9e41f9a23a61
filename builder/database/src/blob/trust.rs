//! The section of what input of each class is like.

use gestus_core::blob::TrustLimits;

/// Encodes it, class after class.
pub fn encode(classes: &[TrustLimits]) -> Vec<u8> {
    let numbers = |class: &TrustLimits| [class.far, class.speeds[0], class.speeds[1], class.turning];
    classes.iter().flat_map(numbers).flat_map(f32::to_le_bytes).collect()
}
