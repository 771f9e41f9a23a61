//! The methods of translation.

pub(crate) mod context;
pub(crate) mod engine;
pub mod linear;
pub mod mixture;
pub mod phase;
pub(crate) mod statistics;
pub mod work;
