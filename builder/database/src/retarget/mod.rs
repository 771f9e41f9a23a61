//! Retargeting an incoming skeleton to the database's: identification of body parts, their anatomical frames, and the map
//! for the core.
//!
//! 1. [`identify`]: body parts by a map file ([`file`](mod@file)), names ([`parts`]) or [`shape`], and which side is
//!    left by its motion (`facing`);
//! 2. [`anatomy`]: a frame for each part, in its joint's axes;
//! 3. [`body`]: a skeleton with its parts, measured on a motion or on its rest pose (`rest`); [`map`]: the map between
//!    two bodies, encoded for `gestus_core::retarget`;
//! 4. [`check`]: a report as text and JSON.
//!
//! Source: Monzani, Baerlocher, Boulic and Thalmann 2000, which Xia 2015 (section 5.1) cites.

pub mod anatomy;
pub mod axis;
pub mod body;
pub mod check;
pub(crate) mod encode;
mod facing;
pub mod file;
pub mod identify;
pub mod kept;
pub mod map;
pub mod parts;
mod rest;
pub mod shape;
mod tree;
pub mod up;
mod world;

pub use body::MapError;
pub use file::{MapFile, MapFileError};
pub use identify::{IdentifyError, Parts};
pub use map::Retarget;
