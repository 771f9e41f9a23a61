//! The host's end of the link to a board ([`gestus_core::link`]).
//!
//! [`mod@line`] is the transport (a serial port, a socket, a pipe). [`client`] sends requests until they are answered.
//! [`session`] applies a request's settings and compares every reply, bit by bit, with that of the core on this
//! machine. [`mod@stream`] sends a clip through a session. Two modules test the protocol: [`noise`] injects faults into
//! a line, and [`loopback`] is a line in virtual time to a board in this process.

pub mod client;
pub mod command;
pub mod line;
pub mod loopback;
pub mod noise;
pub mod serve;
pub mod session;
pub mod stream;

pub use client::{Client, HostCounts, LinkError, RetryPolicy};
pub use line::Line;
