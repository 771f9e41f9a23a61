//! Data for the search: features of a window of poses, a graph of nearest neighbors, groups of joints.

pub mod falls;
pub mod features;
pub mod graph;
pub mod groups;
pub mod trust_limits;
