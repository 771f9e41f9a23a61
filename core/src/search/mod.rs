//! The nearest frames of every class: from the last few poses to a query, and from the query to neighbors.

pub(crate) mod dot;
pub mod found;
pub mod graph;
pub mod metric;
pub mod query;
pub(crate) mod top_k;
pub(crate) mod visited;
