//! The section of dofs.

/// Encodes the quantisation step and the scale of each dof, and behind them its range in the captured frames.
pub fn encode(steps: &[f32], scales: &[f32], ranges: &[[f32; 2]]) -> Vec<u8> {
    let records = steps.iter().zip(scales).flat_map(|(step, scale)| [*step, *scale]);
    records.chain(ranges.iter().copied().flatten()).flat_map(f32::to_le_bytes).collect()
}
