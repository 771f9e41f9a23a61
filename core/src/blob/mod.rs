//! The blob: one flat image that the builder writes and the stylizer reads in place.
pub mod crc;
pub mod layout;
mod manifest;
pub mod read;

pub use manifest::{Manifest, Names};
