//! The interface of a server to its board.

use super::RobotIdentity;
use crate::{Observer, Pose, Report, robot::Driven};

/// Number ([`counter`](super::counter)) and value of a statistic.
pub type Statistic = (u16, u64);

/// A board: its name, its counts and its robot. It watches each step as an [`Observer`].
pub trait Board<const J: usize>: Observer<J> {
    /// Most hinges of a robot on the board, 0 without one. The server's buffers have to be long enough for them.
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
    /// [`Stage::NAMES`](crate::Stage::NAMES). Empty if the board does not count.
    fn stages(&self) -> &[u32] {
        &[]
    }

    /// The board's own statistic `index`, from 0; `None` after the last.
    fn statistic(&mut self, _index: u16) -> Option<Statistic> {
        None
    }

    /// Tells the drive of the board's robot where its hinges are: angles in radians, f32 little-endian, from the first
    /// hinge on; the angle nearest to zero in a hinge's range for those that are missing or NaN. Returns which robot it
    /// is; `None` without a robot.
    fn place(&mut self, _angles: &[[u8; 4]]) -> Option<RobotIdentity> {
        None
    }

    /// A tick of the robot towards a pose of the database's skeleton; `None` without a robot.
    fn drive(&mut self, _pose: &Pose<J>) -> Option<Driven> {
        None
    }

    /// The ticks of the robot that are due while a pose is shown for `step_s` seconds: their number, and the report of the
    /// last. `None` without a robot.
    fn follow(&mut self, _pose: &Pose<J>, _step_s: f32) -> Option<(u16, Driven)> {
        None
    }

    /// Angle in radians and pulse in microseconds of a hinge after the last tick; `None` after the last hinge.
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
