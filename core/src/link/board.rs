//! What a server wants from the board it runs on.

use super::RobotIdentity;
use crate::{Observer, Pose, Report, robot::Driven};

/// Number ([`counter`](super::counter)) and value of a statistic.
pub type Statistic = (u16, u64);

/// A board: who it is, and what it counts. It watches each step as an [`Observer`].
pub trait Board<const J: usize>: Observer<J> {
    /// Hinges that the board has room for, where a robot may hang on it: they have a part in how long the server's
    /// buffers have to be.
    const HINGES: usize = 0;

    /// Name of the board, at most 32 bytes: `mps2-an386`.
    fn name(&self) -> &str;

    /// Build of the firmware, at most 64 bytes: version, target, features.
    fn build(&self) -> &str;

    /// A step begins.
    fn begin(&mut self) {}

    /// A step has ended.
    fn end(&mut self, _report: &Report) {}

    /// Instructions of the last step by stage, at most [`MAX_STAGES`](super::MAX_STAGES), in the order of
    /// [`Stage::NAMES`](crate::Stage::NAMES). Empty where the board does not count.
    fn stages(&self) -> &[u32] {
        &[]
    }

    /// The board's own statistic `index`, counted from 0; `None` behind the last.
    fn statistic(&mut self, _index: u16) -> Option<Statistic> {
        None
    }

    /// Puts the hinges of the board's robot where they are: angles in radians, f32 little-endian, from the first hinge
    /// on; those that are missing, or no numbers, at zero. Says which robot it is; `None` where there is none.
    fn place(&mut self, _angles: &[[u8; 4]]) -> Option<RobotIdentity> {
        None
    }

    /// A tick of the robot towards a pose of the database's skeleton; `None` where there is none.
    fn drive(&mut self, _pose: &Pose<J>) -> Option<Driven> {
        None
    }

    /// Angle in radians and pulse in microseconds of a hinge after the last tick; `None` behind the last hinge.
    fn hinge(&self, _hinge: usize) -> Option<(f32, u16)> {
        None
    }
}

/// No board: a server in a test, or on a host.
impl<const J: usize> Board<J> for () {
    fn name(&self) -> &str {
        "host"
    }

    fn build(&self) -> &str {
        env!("CARGO_PKG_VERSION")
    }
}
