//! The messages of host and board.
//!
//! The order of the variants and fields is the wire format: append, never insert, and raise
//! [`VERSION`](super::VERSION) if an older host or board would misread the new message.

use heapless::Vec;
use serde::{Deserialize, Serialize};

use super::{DriveReport, Fault, RobotIdentity, board::Statistic};
use crate::{
    Degraded, Pose, Report,
    methods::weights::{MAX_KEPT, Share},
    report::{pack_feet, unpack_feet},
};

/// Most pairs of a number and a value in a message.
pub const MAX_PAIRS: usize = 20;
/// Most stages of a step whose instructions a report contains.
pub const MAX_STAGES: usize = 8;
/// Most statistics in one reply.
pub const PAGE: usize = 12;

/// Numbers and values: styles and their weights, groups and their strengths, parameters.
pub type Pairs = Vec<(u16, f32), MAX_PAIRS>;

/// A message from the host.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Request<'a> {
    /// Starts a session: resets every setting and the stream. Reply: [`Reply::Hello`].
    Hello {
        /// A random number of the session, which tells a new session from a repeated request.
        session: u32,
    },
    /// Output styles and their weights. Reply, as for all settings: [`Reply::Done`].
    Style(Pairs),
    /// Labels of the input; `None` if unknown.
    Labels {
        /// Its action.
        action: Option<u16>,
        /// Its style.
        input_style: Option<u16>,
    },
    /// Whether the search uses a joint group.
    Mask {
        /// The group.
        group: u16,
        /// True if it is used.
        searched: bool,
    },
    /// Joint groups and their strengths of style.
    Strength(Pairs),
    /// [`parameters`](crate::config::parameters) and their values; the others stay.
    Configure(Pairs),
    /// Starts a new stream; settings stay.
    Reset,
    /// One step. Reply: [`Reply::Pose`].
    #[serde(borrow)]
    Pose(PoseBytes<'a>),
    /// A page of statistics. Reply: [`Reply::Statistics`].
    Statistics {
        /// How many to skip.
        skip: u16,
    },
    /// Where the robot's hinges are, as its servos report it. Reply: [`Reply::Robot`].
    Robot {
        /// Angles in radians, f32 little-endian, from the first hinge on; the angle nearest to zero in a hinge's range for
        /// those that are missing or NaN.
        #[serde(borrow)]
        angles: &'a [u8],
    },
    /// A tick of the robot towards the last output pose. Reply: [`Reply::Drive`].
    Drive,
    /// A separate output style of a joint group. Reply: [`Reply::Done`].
    GroupStyle {
        /// The group.
        group: u16,
        /// Styles and their weights; if empty, the group takes the body's style.
        weights: Pairs,
    },
    /// One step, and the robot's ticks that are due: the work of [`Pose`](Self::Pose) and of as many
    /// [`Drive`](Self::Drive)s. Reply: [`Reply::StepRobot`].
    #[serde(borrow)]
    StepRobot(PoseBytes<'a>),
}

/// A message from the board.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Reply<'a> {
    /// The board's identity. A new session has begun.
    #[serde(borrow)]
    Hello(Identity<'a>),
    /// The setting is in force.
    Done,
    /// The output pose, and the report of the step.
    Pose(PoseBytes<'a>, StepReport),
    /// A page of statistics: numbers ([`counter`](super::counter)) and values.
    Statistics {
        /// True if more follow.
        more: bool,
        /// The statistics of this page.
        page: Vec<Statistic, PAGE>,
    },
    /// The request was refused, and why.
    Fault(Fault),
    /// The robot's identity.
    Robot(RobotIdentity),
    /// The report of the robot's tick.
    #[serde(borrow)]
    Drive(DriveReport<'a>),
    /// The report of a step, and the hinges after its ticks; the pose stays on the board.
    StepRobot {
        /// The step.
        step: BriefReport,
        /// Ticks that were due.
        ticks: u16,
        /// The last of them.
        #[serde(borrow)]
        drive: DriveReport<'a>,
    },
}

/// What a robot's host needs of a [`Report`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct BriefReport {
    /// [`Report::step_s`].
    pub step_s: f32,
    /// Bit 0: the left foot stands; bit 1: the right one.
    pub contacts: u8,
    /// Bits of [`Report::degraded`].
    pub degraded: u32,
}

impl BriefReport {
    /// The report of a step.
    pub fn new(report: &Report) -> Self {
        Self {
            step_s: report.step_s,
            contacts: pack_feet(report.contacts),
            degraded: u32::from(report.degraded.bits()),
        }
    }
}

/// A board's name, firmware and database.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Identity<'a> {
    /// The board.
    pub board: &'a str,
    /// The build of its firmware.
    pub build: &'a str,
    /// [`Database::identity`](crate::Database::identity).
    pub database: u32,
    /// Frames a second of the stream.
    pub rate_hz: f32,
    /// Joints of a pose.
    pub joints: u16,
    /// Classes of the database.
    pub classes: u16,
    /// The stylizer's capacities J, K and C.
    pub capacity: [u16; 3],
    /// Bytes of the stylizer.
    pub ram_bytes: u32,
    /// Bytes of a link buffer: the longest frame that the board takes and sends.
    pub buffer_bytes: u16,
}

/// A pose as it is sent: metres and quaternions `[x, y, z, w]`, binary32, little-endian.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseBytes<'a> {
    /// Root position.
    pub position: [f32; 3],
    /// Joint rotations, 16 bytes a joint.
    pub rotations: &'a [u8],
}

impl PoseBytes<'_> {
    /// Joints of the pose; `None` if the last joint is incomplete.
    pub fn joints(&self) -> Option<usize> {
        let (joints, rest) = self.rotations.as_chunks::<16>();
        rest.is_empty().then_some(joints.len())
    }

    /// Copies the pose bit by bit. Further joints of `pose` keep their values.
    pub fn read<const J: usize>(&self, pose: &mut Pose<J>) {
        pose.position = self.position;
        for (slots, bytes) in pose.rotations.iter_mut().zip(self.rotations.as_chunks::<16>().0) {
            for (slot, value) in slots.iter_mut().zip(bytes.as_chunks::<4>().0) {
                *slot = f32::from_le_bytes(*value);
            }
        }
    }
}

/// Buffer of a pose's bytes.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PoseBuffer<const J: usize>([[u8; 16]; J]);

impl<const J: usize> PoseBuffer<J> {
    /// A buffer for J joints.
    pub const fn new() -> Self {
        Self([[0; 16]; J])
    }

    /// The first `joints` joints of a pose, bit by bit.
    pub fn pose(&mut self, pose: &Pose<J>, joints: usize) -> PoseBytes<'_> {
        for (bytes, rotation) in self.0.iter_mut().zip(&pose.rotations) {
            for (slot, value) in bytes.as_chunks_mut::<4>().0.iter_mut().zip(rotation) {
                *slot = value.to_le_bytes();
            }
        }
        PoseBytes {
            position: pose.position,
            rotations: self.0.get(..joints).unwrap_or(&self.0).as_flattened(),
        }
    }
}

impl<const J: usize> Default for PoseBuffer<J> {
    fn default() -> Self {
        Self::new()
    }
}

/// A [`Report`] as it is sent.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct StepReport {
    /// [`Report::step_s`].
    pub step_s: f32,
    /// [`Report::predicted_step_s`].
    pub predicted_step_s: f32,
    /// [`Report::distance2`].
    pub distance2: f32,
    /// [`Report::visits`].
    pub visits: u32,
    /// [`Report::bytes_read`].
    pub bytes_read: u32,
    /// Bit 0: the left foot stands; bit 1: the right one.
    pub contacts: u8,
    /// Bits of [`Report::degraded`].
    pub degraded: u32,
    /// Classes and proportions, largest first.
    pub classes: Vec<(u16, f32), MAX_KEPT>,
    /// Instructions of the step by stage, as [`Board::stages`](super::Board::stages) counts them; empty if it
    /// does not.
    pub stages: Vec<u32, MAX_STAGES>,
}

impl StepReport {
    /// The report of a step, and the board's counts of it.
    pub fn new(report: &Report, stages: &[u32]) -> Self {
        Self {
            step_s: report.step_s,
            predicted_step_s: report.predicted_step_s,
            distance2: report.distance2,
            visits: report.visits,
            bytes_read: report.bytes_read,
            contacts: pack_feet(report.contacts),
            degraded: u32::from(report.degraded.bits()),
            classes: first(report.classes.iter().map(|s| (s.class, s.proportion))),
            stages: first(stages.iter().copied()),
        }
    }

    /// The report that was sent, without flags that this core does not know.
    pub fn report(&self) -> Report {
        let mut report = Report {
            distance2: self.distance2,
            visits: self.visits,
            bytes_read: self.bytes_read,
            contacts: unpack_feet(self.contacts),
            step_s: self.step_s,
            predicted_step_s: self.predicted_step_s,
            ..Report::default()
        };
        report.classes = first(self.classes.iter().map(|&(class, proportion)| Share { class, proportion }));
        for (flag, _) in Degraded::NAMES {
            report.degraded.add_if(self.degraded & u32::from(flag.bits()) != 0, flag);
        }
        report
    }
}

/// The first `M` items. (`collect` panics if there are more.)
fn first<T, const M: usize>(items: impl Iterator<Item = T>) -> Vec<T, M> {
    let mut list = Vec::new();
    for item in items.take(M) {
        let _ = list.push(item);
    }
    list
}

/// Decodes a message; `None` if the bytes are not exactly one message.
pub fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Option<T> {
    match postcard::take_from_bytes(bytes) {
        Ok((message, [])) => Some(message),
        _ => None,
    }
}

#[cfg(test)]
mod tests;
