//! Gestus off the board: the very same core, streamed on the host.

pub mod board;
pub mod link;
pub mod recording;
pub mod run;
pub mod view;
