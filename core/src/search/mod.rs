//! Finds the nearest frames of every class: the last few poses become a query, and the query finds neighbors.

pub(crate) mod dot;
pub mod found;
pub mod graph;
pub mod metric;
pub mod query;
pub(crate) mod top_k;
pub(crate) mod visited;
