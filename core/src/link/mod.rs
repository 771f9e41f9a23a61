//! The link between a board and a host: poses over a serial line that loses, doubles, cuts and corrupts bytes.
//!
//! The host sends requests and the board replies. Both are messages ([`Request`], [`Reply`]) in postcard, in frames that
//! end with a zero byte:
//!
//! ```text
//!  0x00 | COBS( version and direction | attempt | sequence | message      | CRC-32C ) | 0x00
//!       |       1 byte                | 1 byte  | u16      | postcard     | u32     |
//! ```
//!
//! COBS (Cheshire and Baker, "Consistent Overhead Byte Stuffing", 1999) removes zero bytes from a frame's content, so
//! that a receiver is synchronised again at the next zero. [`Receiver`] reads the line byte by byte in bounded memory;
//! [`Server`] is the board's end and owns only two buffers and some counters.
//!
//! A stylizer depends on the poses before, so that each pose has to be stepped exactly once. The host sends one request
//! at a time and repeats it, with the same sequence number, until the reply comes. The board executes a sequence number
//! once, and answers its repetitions with the reply that it has kept. `docs/LINK.md` is the specification.
//!
//! Cost: about 40 instructions a byte on a Cortex-M4F (CRC 10, COBS and postcard the rest); a pose of 22 joints is
//! some 380 bytes there and 440 back. RAM: two buffers of [`buffer_length`] bytes and less than 200 bytes of state.

mod board;
pub mod counter;
mod fault;
mod frame;
mod hinges;
mod message;
mod receiver;
mod robot;
mod server;
mod settings;

pub use board::{Board, Statistic};
pub use counter::LinkCounts;
pub use fault::Fault;
pub use frame::{
    Direction, Frame, Full, HEADER, Header, OVERHEAD, VERSION, buffer_length, robot_buffer_length,
};
pub use hinges::{DriveReport, HINGE_BYTES, HingeBuffer, RobotIdentity};
pub use message::{
    BriefReport, Identity, MAX_PAIRS, MAX_STAGES, PAGE, Pairs, PoseBuffer, PoseBytes, Reply, Request,
    StepReport, decode,
};
pub use receiver::{Damage, Received, Receiver};
pub use robot::Driver;
pub use server::Server;
