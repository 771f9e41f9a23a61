//! Why a board did not do what it was asked.

use core::fmt;

use serde::{Deserialize, Serialize};

use crate::ConfigError;

/// Why a request was not carried out. The order is the wire format.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Fault {
    /// There is no session: the board has started anew, or nobody has said hello.
    NoSession,
    /// The frame is of another version of the protocol.
    Version {
        /// The version that the board speaks.
        need: u8,
        /// The frame's version.
        have: u8,
    },
    /// The message can't be decoded, or is none that the board knows.
    Malformed,
    /// The pose has not the database's joints.
    Joints {
        /// Joints of the database.
        need: u16,
        /// Joints of the pose.
        have: u16,
    },
    /// The stylizer refuses the setting; the one before stays in force.
    Refused(ConfigError),
    /// The answer is longer than the board's buffer.
    Overlong,
    /// No robot hangs on the board.
    NoRobot,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoSession => {
                f.write_str("the board knows of no session: it has started anew; start the stream again")
            }
            Self::Version { need, have } => write!(
                f,
                "the board speaks version {need} of the protocol, this is {have}: take host and firmware of one release"
            ),
            Self::Malformed => f.write_str(
                "the board can't read the message: its firmware may be older; take host and firmware of one release",
            ),
            Self::Joints { need, have } => {
                write!(f, "the pose has {have} joints, the board's database {need}: use the board's database")
            }
            Self::Refused(error) => error.fmt(f),
            Self::NoRobot => f.write_str(
                "the board has no robot: build its firmware with one, and flash the robot's tables for its database",
            ),
            Self::Overlong => {
                f.write_str("the answer is longer than the board's buffer: build its firmware with a larger one")
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
