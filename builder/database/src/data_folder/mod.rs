//! A folder of clips: what its `gestus.toml` and file names say, and the corpus that is read from it.

pub mod config;
pub mod load;
mod pattern;
