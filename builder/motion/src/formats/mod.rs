//! File formats: one module each.

pub mod bvh;
pub mod gltf;
pub mod npy;
pub mod urdf;
