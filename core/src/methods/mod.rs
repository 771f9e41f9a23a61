//! The methods, which predict the output of a frame, and what they share.

pub(crate) mod context;
pub(crate) mod engine;
#[cfg(feature = "lti")]
pub mod linear;
#[cfg(feature = "mar")]
pub mod mixture;
#[cfg(feature = "phase")]
pub mod phase;
#[cfg(any(feature = "mar", feature = "phase"))]
mod settling;
#[cfg(feature = "statistic")]
pub(crate) mod statistics;
pub mod weights;
pub mod work;
