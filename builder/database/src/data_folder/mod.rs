//! Data folders: labels by `gestus.toml` and file names, and reading of a corpus.

pub mod config;
pub mod load;
mod pattern;
pub mod split;
