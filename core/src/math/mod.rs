//! Numbers, vectors and rotations.

pub mod quaternion;
mod scalar;
pub(crate) mod vector;

pub use scalar::*;
