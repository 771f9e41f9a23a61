//! A board with a robot: poses become the hinges' angles and pulses, which the host receives.
//!
//! A [`Driver`] is a [`Board`] around another one. It holds the [`Drive`] of a robot, and with every
//! [`Request::Drive`](super::Request::Drive) moves the hinges one tick towards the last pose of the stylizer. The robot's
//! ticks and the stream's frames have rates of their own, and the host times both; with
//! [`Request::StepRobot`](super::Request::StepRobot) the board counts the ticks that are due. Boards without a robot
//! contain none of this code.
//!
//! Cost: the drive (`docs/experiments/boards.md`, "Around a step"), and six bytes a hinge on the line.

use super::{Board, RobotIdentity, board::Statistic};
use crate::{
    ConfigError, Database, Observer, Pose, Report, Stage,
    body::pose::Dofs,
    error::saturating_u16,
    robot::{Drive, Driven, Follower, Robot},
    search::{found::Found, query::Feature},
};

/// A board with a robot of up to `H` hinges.
#[derive(Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Driver<'r, B, const H: usize> {
    board: B,
    robot: Follower<'r, H>,
}

impl<'r, B, const H: usize> Driver<'r, B, H> {
    /// The robot on the board, each hinge at the angle in its range that is nearest to zero.
    ///
    /// # Errors
    /// [`ConfigError`] if the robot was made for another database, or has more hinges than `H`.
    pub fn new(board: B, robot: Robot<'r>, database: &Database<'_>) -> Result<Self, ConfigError> {
        robot.fits(database, H)?;
        Ok(Self { board, robot: Follower::new(Drive::new(robot, &[])?) })
    }

    /// The robot's drive.
    pub fn drive(&self) -> &Drive<'r, H> {
        self.robot.drive()
    }
}

impl<B: Observer<J>, const J: usize, const H: usize> Observer<J> for Driver<'_, B, H> {
    #[inline(always)]
    fn stage(&mut self, stage: Stage) {
        self.board.stage(stage);
    }

    fn query(&mut self, feature: &Feature) {
        self.board.query(feature);
    }

    fn searched(&mut self, class: usize, found: &Found<'_>) {
        self.board.searched(class, found);
    }

    fn timed(&mut self, class: usize, rows: &[u16], weights: &[f32]) {
        self.board.timed(class, rows, weights);
    }

    fn predicted(&mut self, x: &Dofs<J>, x_prev: &Dofs<J>, y_prev: &Dofs<J>, predicted: &Dofs<J>) {
        self.board.predicted(x, x_prev, y_prev, predicted);
    }
}

impl<B: Board<J>, const J: usize, const H: usize> Board<J> for Driver<'_, B, H> {
    const HINGES: usize = H;

    fn name(&self) -> &str {
        self.board.name()
    }

    fn build(&self) -> &str {
        self.board.build()
    }

    fn begin(&mut self) {
        self.board.begin();
    }

    fn end(&mut self, report: &Report) {
        self.board.end(report);
    }

    fn stages(&self) -> &[u32] {
        self.board.stages()
    }

    fn statistic(&mut self, index: u16) -> Option<Statistic> {
        self.board.statistic(index)
    }

    fn place(&mut self, angles: &[[u8; 4]]) -> Option<RobotIdentity> {
        let robot = self.robot.drive().robot();
        let mut given = [f32::NAN; H];
        for (slot, &bytes) in given.iter_mut().zip(angles) {
            *slot = f32::from_le_bytes(bytes);
        }
        // It was accepted before, with as many hinges.
        if let Ok(drive) = Drive::new(robot, &given) {
            self.robot = Follower::new(drive);
        }
        Some(RobotIdentity {
            robot: robot.identity(),
            hinges: saturating_u16(robot.hinges()),
            capacity: saturating_u16(H),
            tick_s: robot.tick_s(),
        })
    }

    fn drive(&mut self, pose: &Pose<J>) -> Option<Driven> {
        Some(self.robot.tick(pose))
    }

    fn follow(&mut self, pose: &Pose<J>, step_s: f32) -> Option<(u16, Driven)> {
        Some(self.robot.follow(pose, step_s, |_, _| {}))
    }

    fn hinge(&self, hinge: usize) -> Option<(f32, u16)> {
        let drive = self.robot.drive();
        Some((drive.motions().get(hinge)?.position, drive.pulse(hinge)))
    }
}
