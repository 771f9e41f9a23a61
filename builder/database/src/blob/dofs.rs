//! The section of dofs.

/// Encodes the quantisation step and the scale of each dof.
pub fn encode(steps: &[f32], scales: &[f32]) -> Vec<u8> {
    steps.iter().zip(scales).flat_map(|(step, scale)| [*step, *scale]).flat_map(f32::to_le_bytes).collect()
}
