//! Motion style transfer that runs on a microcontroller: no heap, no operating system, no panic.
#![cfg_attr(not(feature = "std"), no_std)]
#![forbid(unsafe_code)]

pub mod blob;
mod error;
pub mod math;
pub mod quaternion;

pub use error::{BlobError, ConfigError};
