//! The firmware's core on the host: streams, the link to a board, emulated boards, and estimates for real parts.

pub mod board;
pub mod clip_args;
pub mod faults;
pub mod link;
pub mod parts;
pub mod recording;
pub mod run;
pub mod view;
