//! The sections that the search reads: features and graph.

use crate::search::graph::ClassGraph;

/// Encodes the features of all captured frames.
pub fn encode_features(codes: &[Vec<i8>]) -> Vec<u8> {
    codes.iter().flatten().map(|&code| code as u8).collect()
}

/// Encodes the edges of all captured frames, class after class.
pub fn encode_graphs(graphs: &[ClassGraph]) -> Vec<u8> {
    graphs.iter().flat_map(|graph| graph.edges.iter().flatten()).flat_map(|edge| edge.to_le_bytes()).collect()
}
