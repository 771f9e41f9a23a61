//! The section of the timing metric.

use gestus_core::blob::layout::timing;

/// Encodes the dofs of the metric, each with its weight and that of its change.
pub fn encode(entries: &[(usize, f64, f64)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for &(dof, pose, change) in entries {
        let mut record = [0; timing::LENGTH];
        record[timing::DOF].copy_from_slice(&(dof as u16).to_le_bytes());
        record[timing::POSE].copy_from_slice(&(pose as f32).to_le_bytes());
        record[timing::CHANGE].copy_from_slice(&(change as f32).to_le_bytes());
        bytes.extend(record);
    }
    bytes
}
