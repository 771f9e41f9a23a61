//! Gestus off the board: the very same core, streamed on the host.

pub mod recording;
pub mod run;
pub mod view;
