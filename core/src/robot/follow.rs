//! Style and servos in one call a frame: a step of the stylizer, then the ticks of the robot that are due.
//!
//! Poses and ticks have rates of their own. A pose is shown for `step_s` seconds, and a tick takes
//! [`Robot::tick_s`](super::Robot::tick_s):
//!
//! ```text
//! ticks = whole number nearest to (owed + step_s) / tick_s      owed += step_s - ticks tick_s
//! ```
//!
//! What is owed is at most half a tick, so the robot keeps the stream's time, however long it is. Where rates are equal,
//! each step has one tick. The result is that of the separate calls, bit for bit.
//!
//! Cost: a step of the stylizer, and a tick of the drive for each that is due; 16 bytes beside the drive.

use super::{Drive, Driven};
use crate::{Report, Stylizer, body::pose::Pose, retarget::Map};

/// Most ticks of one step; further ones are left out. A robot with 1,000 ticks a second has 33 in a thirtieth of one.
pub const MAX_TICKS: u16 = 64;

/// The report of a step and of the ticks behind it.
#[derive(Debug, Clone, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[must_use = "it says whether the frame was degraded, and how far the robot lags"]
pub struct RobotStep {
    /// The stylizer's report.
    pub report: Report,
    /// The last tick's report; where no tick was due, that of the tick before.
    pub driven: Driven,
    /// Ticks that were due, 0 to [`MAX_TICKS`].
    pub ticks: u16,
}

/// A robot of up to `H` hinges that follows a stream of poses.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Follower<'r, const H: usize> {
    drive: Drive<'r, H>,
    driven: Driven,
    /// Time that has passed in the stream and not yet in ticks, seconds: within half a tick of zero.
    owed_s: f32,
}

impl<'r, const H: usize> Follower<'r, H> {
    /// A robot that is where its drive has it.
    pub const fn new(drive: Drive<'r, H>) -> Self {
        let driven = Driven { held: false, at_limit: 0, lag: 0.0, missing_m: 0.0 };
        Self { drive, driven, owed_s: 0.0 }
    }

    /// The hinges: their motions, targets and pulses.
    pub const fn drive(&self) -> &Drive<'r, H> {
        &self.drive
    }

    /// One tick towards a pose, whatever is due.
    pub fn tick<const J: usize>(&mut self, pose: &Pose<J>) -> Driven {
        self.driven = self.drive.step(pose);
        self.driven
    }

    /// The ticks that are due while a pose is shown for `step_s` seconds; one that is not positive and finite counts as
    /// 0. Calls `each` after every tick, to write its pulses. Returns their number, and the report of the last.
    pub fn follow<const J: usize>(
        &mut self,
        pose: &Pose<J>,
        step_s: f32,
        mut each: impl FnMut(&Drive<'r, H>, Driven),
    ) -> (u16, Driven) {
        let tick_s = self.drive.robot().tick_s();
        if step_s > 0.0 && step_s.is_finite() {
            self.owed_s += step_s;
        }
        let mut ticks = 0;
        while self.owed_s >= 0.5 * tick_s && ticks < MAX_TICKS {
            self.owed_s -= tick_s;
            ticks += 1;
            let driven = self.tick(pose);
            each(&self.drive, driven);
        }
        if self.owed_s > 0.5 * tick_s {
            self.owed_s = 0.0;
        }
        (ticks, self.driven)
    }

    /// Gives an input pose its style, and moves the hinges towards the result within their limits: one call a frame.
    ///
    /// `output` is the stylized pose, as [`Stylizer::step`] gives it. Before the first valid pose there is none, and the
    /// hinges keep their targets. `each` is called after every tick that is due, with
    /// the hinges' angles and pulses.
    pub fn step_robot<const J: usize, const K: usize, const C: usize>(
        &mut self,
        stylizer: &mut Stylizer<'_, J, K, C>,
        input: &Pose<J>,
        output: &mut Pose<J>,
        each: impl FnMut(&Drive<'r, H>, Driven),
    ) -> RobotStep {
        let report = stylizer.step(input, output);
        let pose = stylizer.last_output().unwrap_or(&Pose::INVALID);
        let (ticks, driven) = self.follow(pose, report.step_s, each);
        RobotStep { report, driven, ticks }
    }

    /// [`step_robot`](Self::step_robot) for poses of another skeleton, N joints. `between` holds the input on the
    /// database's skeleton.
    pub fn step_robot_mapped<const N: usize, const J: usize, const K: usize, const C: usize>(
        &mut self,
        stylizer: &mut Stylizer<'_, J, K, C>,
        (map, input): (&Map<'_>, &Pose<N>),
        between: &mut Pose<J>,
        output: &mut Pose<J>,
        each: impl FnMut(&Drive<'r, H>, Driven),
    ) -> RobotStep {
        map.to_target(input, between);
        self.step_robot(stylizer, between, output, each)
    }
}
