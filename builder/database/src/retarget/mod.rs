//! An incoming skeleton to the database's: which joint is which body part, how each lies in its joint's axes, and
//! the map that the core reads.
//!
//! 1. [`identify`]: parts by a file ([`file`](mod@file)), by names ([`parts`]), by [`shape`];
//! 2. [`anatomy`]: a frame for each part, in its joint's axes;
//! 3. [`body`]: a skeleton with its parts; [`map`]: two of them as a table for `gestus_core::retarget`;
//! 4. [`check`]: all of it in words.
//!
//! Source: Monzani, Baerlocher, Boulic and Thalmann 2000, named by Xia 2015, section 4.

pub mod anatomy;
pub mod body;
pub mod check;
mod encode;
pub mod file;
pub mod identify;
pub mod map;
pub mod parts;
pub mod shape;

pub use body::MapError;
pub use file::{MapFile, MapFileError};
pub use identify::{IdentifyError, Parts};
pub use map::Retarget;
