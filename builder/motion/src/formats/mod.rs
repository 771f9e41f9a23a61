//! One codec a file format.

pub mod bvh;
pub mod gltf;
pub mod npy;
pub mod urdf;
