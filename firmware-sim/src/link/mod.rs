//! The host's end of the link to a board ([`gestus_core::link`]).
//!
//! [`mod@line`] is where bytes go and come (a serial port, a socket, a pipe), [`client`] asks and repeats until it is
//! answered, [`session`] applies a request's settings and compares every answer with the core on this machine, bit by
//! bit, and [`mod@stream`] sends a clip through it. [`noise`] is a line's faults by specification, and [`loopback`] a board in this process, in
//! virtual time: what the protocol is tested with.

pub mod client;
pub mod command;
pub mod line;
pub mod loopback;
pub mod noise;
pub mod serve;
pub mod session;
pub mod stream;

pub use client::{Client, HostCounts, LinkError, Patience};
pub use line::Line;
