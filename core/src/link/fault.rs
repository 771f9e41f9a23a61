//! The errors with which a board replies.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::ConfigError;

/// Why a request was refused. The order is the wire format.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// There is no session: the board has restarted, or the host has sent no [`Request::Hello`](super::Request::Hello).
    NoSession,
    /// The frame is of another version of the protocol.
    Version {
        /// The version that the board speaks.
        need: u8,
        /// The frame's version.
        have: u8,
    },
    /// The message can't be decoded, or the board does not know it.
    Malformed,
    /// The pose has another number of joints than the database.
    Joints {
        /// Joints of the database.
        need: u16,
        /// Joints of the pose.
        have: u16,
    },
    /// The stylizer refuses the setting; the one before stays in force.
    Refused(ConfigError),
    /// The reply is longer than the board's buffer.
    Overlong,
    /// The board has no robot.
    NoRobot,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoSession => {
                f.write_str("the board has no session, since it has restarted: start the stream again")
            }
            Self::Version { need, have } => write!(
                f,
                "the board uses version {need} of the protocol, the host version {have}: install host and firmware of one release"
            ),
            Self::Malformed => f.write_str(
                "the board can't read the message: its firmware may be older; install host and firmware of one release",
            ),
            Self::Joints { need, have } => {
                write!(f, "the pose has {have} joints, the board's database {need}: use the board's database")
            }
            Self::Refused(error) => error.fmt(f),
            Self::NoRobot => f.write_str(
                "the board has no robot: build its firmware with one, and flash the robot's tables for its database",
            ),
            Self::Overlong => {
                f.write_str("the reply is longer than the board's buffer: build its firmware with a larger one")
            }
        }
    }
}

impl core::error::Error for Fault {}

impl From<ConfigError> for Fault {
    fn from(error: ConfigError) -> Self {
        Self::Refused(error)
    }
}
