//! The sections of cycles with their knots, and of their outputs.

use gestus_core::blob::layout::{NONE, cycle};
use gestus_motion::corpus::Cycle;

use crate::pairing::Pairing;

/// Encodes the cycles, each with its clip and timeline, and their knots.
pub fn encode_cycles(cycles: &[(usize, Cycle)], clips: &[(usize, usize)]) -> (Vec<u8>, Vec<u8>) {
    let (mut bytes, mut knots) = (Vec::new(), Vec::new());
    for (clip, timeline) in cycles {
        let (first_row, rows) = clips[*clip];
        let start = first_row + (timeline.span().0.ceil().max(0.0) as usize).min(rows - 1);
        let mut record = [0; cycle::LENGTH];
        record[cycle::CLIP].copy_from_slice(&(*clip as u32).to_le_bytes());
        record[cycle::FIRST_KNOT].copy_from_slice(&((knots.len() / 4) as u32).to_le_bytes());
        record[cycle::KNOTS].copy_from_slice(&(timeline.knots.len() as u16).to_le_bytes());
        record[cycle::START].copy_from_slice(&(start as u32).to_le_bytes());
        bytes.extend(record);
        knots.extend(timeline.knots.iter().flat_map(|&k| (k as f32).to_le_bytes()));
    }
    (bytes, knots)
}

/// Encodes the outputs of every cycle in every style, then the second outputs if there are any.
pub fn encode(pairing: &Pairing, cycles: usize, styles: usize) -> Vec<u8> {
    // A first output may be missing; the second table has no missing entries.
    let tables = [(&pairing.outputs, true), (&pairing.second, false)];
    let pairs = tables.into_iter().filter(|(table, _)| !table.is_empty()).flat_map(|(table, may_lack)| {
        (0..cycles).flat_map(move |i| {
            let outputs = table.get(i);
            let missing = if may_lack { NONE } else { i as u16 };
            (0..styles).map(move |s| outputs.and_then(|o| o[s]).map_or(missing, |o| o as u16))
        })
    });
    pairs.flat_map(u16::to_le_bytes).collect()
}
