//! The sections that the search reads: features and graph.

use gestus_core::{blob::layout::distances::FALLS, search::metric::Weights};

use crate::search::graph::ClassGraph;

/// Encodes the features of all captured frames.
pub fn encode_features(codes: &[Vec<i8>]) -> Vec<u8> {
    codes.iter().flatten().map(|&code| code as u8).collect()
}

/// Encodes how fast distances fall, and the weighted squared length of every captured frame's feature; `scales` in metres
/// a code.
pub fn encode_distances(falls: &[f32; FALLS], codes: &[Vec<i8>], scales: &[f64]) -> Vec<u8> {
    let weights = Weights::new(scales.iter().map(|&scale| scale as f32));
    let norms = codes.iter().map(|codes| weights.norm2(&codes.iter().map(|&c| c as u8).collect::<Vec<_>>()));
    falls.iter().flat_map(|fall| fall.to_le_bytes()).chain(norms.flat_map(u32::to_le_bytes)).collect()
}

/// Encodes the edges of all captured frames, class after class.
pub fn encode_graphs(graphs: &[ClassGraph]) -> Vec<u8> {
    graphs.iter().flat_map(|graph| graph.edges.iter().flatten()).flat_map(|edge| edge.to_le_bytes()).collect()
}
