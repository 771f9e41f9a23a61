//! Gestus off the board: the very same core, streamed on the host.

pub mod board;
pub mod faults;
pub mod link;
pub mod parts;
pub mod recording;
pub mod run;
pub mod view;
