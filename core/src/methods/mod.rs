//! The methods of translation.

pub(crate) mod context;
pub mod linear;
pub mod mixture;
pub(crate) mod statistics;
