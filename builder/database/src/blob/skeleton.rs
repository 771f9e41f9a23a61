//! The section of the skeleton.

use gestus_core::blob::layout::joint;
use gestus_motion::body::Body;

use crate::search::groups::Groups;

/// Encodes the joints and the trailer behind them.
pub fn encode(body: &Body, groups: &Groups) -> Vec<u8> {
    let mut bytes = Vec::new();
    for j in 0..body.skeleton.joints() {
        let mut record = [0; joint::LENGTH];
        record[joint::PARENT] = body.skeleton.parents[j].map_or(joint::ROOT, |p| p as u8);
        record[joint::GROUP] = groups.of_joint[j] as u8;
        let mean = body.means[j].coords;
        let numbers = body.skeleton.offsets[j].iter().chain(mean.iter()).map(|&v| v as f32);
        for (slot, value) in record[joint::OFFSET.start..].chunks_exact_mut(4).zip(numbers) {
            slot.copy_from_slice(&value.to_le_bytes());
        }
        bytes.extend(record);
    }
    let mut trailer = [0; joint::TRAILER];
    for (slot, value) in trailer[joint::HIPS_LINE].chunks_exact_mut(4).zip(body.hips_line.iter()) {
        slot.copy_from_slice(&(*value as f32).to_le_bytes());
    }
    for (slot, &toe) in trailer[joint::TOES].iter_mut().zip(&body.landmarks.toes) {
        *slot = toe as u8;
    }
    bytes.extend(trailer);
    bytes
}
