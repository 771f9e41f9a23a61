//! The section of feet.

use gestus_core::blob::layout::foot;
use gestus_motion::{body::Body, corpus::Example};

use crate::registration::contact;

/// Encodes the legs, the heights of ankles and toes above the floor in a standing foot, and how the foot rolls.
pub fn encode(body: &Body, examples: &[&Example]) -> Vec<u8> {
    let marks = &body.landmarks;
    let heights = contact::sole_heights(examples, marks);
    let rolls = contact::rolls(examples, marks, heights);
    let mut bytes = Vec::new();
    for side in [0, 1] {
        let mut record = [0; foot::LENGTH];
        record[foot::HIP] = marks.hip_joints[side] as u8;
        record[foot::KNEE] = marks.knees[side] as u8;
        record[foot::ANKLE] = marks.feet[side] as u8;
        let toes = marks.toes[side] != marks.feet[side];
        record[foot::TOE] = if toes { marks.toes[side] as u8 } else { foot::NO_TOE };
        let [ankle, toe] = heights[side].map(|h| h as f32);
        record[foot::ANKLE_HEIGHT].copy_from_slice(&ankle.to_le_bytes());
        record[foot::TOE_HEIGHT].copy_from_slice(&if toes { toe } else { 0.0 }.to_le_bytes());
        let [ankle, toe] = rolls[side].map(|r| (r / f64::from(foot::ROLL_STEP_M)).round() as u16);
        record[foot::ANKLE_ROLL].copy_from_slice(&ankle.to_le_bytes());
        record[foot::TOE_ROLL].copy_from_slice(&if toes { toe } else { 0 }.to_le_bytes());
        bytes.extend(record);
    }
    bytes
}
