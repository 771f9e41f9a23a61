//! Numbers, vectors and rotations.

pub(crate) mod fixed;
pub mod quaternion;
mod scalar;
pub(crate) mod vector;

pub use vector::distance;

pub use scalar::*;
