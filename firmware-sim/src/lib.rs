//! The firmware's core on the host: streams, the link to a board, and emulated boards. Estimates for real parts are in
//! `gestus_database::parts`, since the builder makes databases by them.

pub mod board;
pub mod clip_args;
pub mod faults;
pub mod link;
pub mod recording;
pub mod run;
pub mod view;
