//! Data folders: labels by `gestus.toml` and file names, reading of a corpus, and what of it makes a database.

pub mod balance;
pub mod config;
mod floors;
pub mod left_out;
mod licence;
pub mod load;
mod pattern;
pub mod rig;
mod size;
mod skeletons;
mod spelling;
pub mod split;
mod worlds;
