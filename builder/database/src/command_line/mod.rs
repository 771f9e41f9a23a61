//! Shared by the commands `gestus` and `gestus-sim`: options of a stylizer, checks of output files, progress.

pub mod options;
pub mod outputs;
pub mod parameters;
pub mod progress;
pub mod stylizer_args;
