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
        /// Angles in radians, f32 little-endian, from the first hinge on; zero for those that are missing.
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
        let [left, right] = report.contacts.map(u8::from);
        Self {
            step_s: report.step_s,
            contacts: left | right << 1,
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
        let [left, right] = report.contacts.map(u8::from);
        Self {
            step_s: report.step_s,
            predicted_step_s: report.predicted_step_s,
            distance2: report.distance2,
            visits: report.visits,
            bytes_read: report.bytes_read,
            contacts: left | right << 1,
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
            contacts: [self.contacts & 1 != 0, self.contacts & 2 != 0],
            step_s: self.step_s,
            predicted_step_s: self.predicted_step_s,
            ..Report::default()
        };
        report.classes = first(self.classes.iter().map(|&(class, proportion)| Share { class, proportion }));
        for (flag, _) in Degraded::NAMES {
            report.degraded.set(flag, self.degraded & u32::from(flag.bits()) != 0);
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
mod tests {
    use super::*;

    fn both_ways<'a, T: Serialize + Deserialize<'a> + PartialEq + core::fmt::Debug>(
        message: &T,
        bytes: &'a mut [u8],
    ) -> usize {
        let bytes: &'a [u8] = postcard::to_slice(message, bytes).expect("it fits");
        assert_eq!(decode::<T>(bytes).as_ref(), Some(message));
        for short in 0..bytes.len() {
            assert_eq!(decode::<T>(&bytes[..short]), None, "{message:?} cut to {short} bytes");
        }
        bytes.len()
    }

    #[test]
    fn every_message_goes_both_ways() {
        let pairs: Pairs = [(0, 0.5), (300, -1.0)].into_iter().collect();
        let mut buffer = PoseBuffer::<3>::new();
        let pose = buffer.pose(&Pose::IDENTITY, 2);
        let requests = [
            Request::Hello { session: u32::MAX },
            Request::Style(pairs.clone()),
            Request::Labels { action: Some(3), input_style: None },
            Request::Mask { group: 2, searched: true },
            Request::Strength(pairs.clone()),
            Request::Configure(pairs.clone()),
            Request::Reset,
            Request::Pose(pose),
            Request::Statistics { skip: 12 },
            Request::Robot { angles: &[1, 2, 3, 4] },
            Request::Drive,
            Request::GroupStyle { group: 1, weights: pairs },
            Request::StepRobot(pose),
        ];
        for (number, request) in requests.iter().enumerate() {
            let mut bytes = [0; 128];
            both_ways(request, &mut bytes);
            assert_eq!(usize::from(bytes[0]), number, "{request:?}");
        }
        let identity = Identity {
            board: "a board",
            build: "1",
            database: 1,
            rate_hz: 30.0,
            joints: 22,
            classes: 28,
            capacity: [22, 40, 28],
            ram_bytes: 24_304,
            buffer_bytes: 512,
        };
        let report = StepReport { classes: [(1, 0.5)].into_iter().collect(), ..StepReport::default() };
        let page = [(1, 2), (3, u64::MAX)].into_iter().collect();
        let replies = [
            Reply::Hello(identity),
            Reply::Done,
            Reply::Pose(pose, report),
            Reply::Statistics { more: true, page },
            Reply::Fault(Fault::Malformed),
            Reply::Robot(RobotIdentity { robot: 7, hinges: 16, capacity: 32, tick_s: 0.02 }),
            Reply::Drive(DriveReport {
                held: false,
                at_limit: 300,
                lag: 0.5,
                missing_m: 0.0,
                hinges: &[9; 12],
            }),
            Reply::StepRobot {
                step: BriefReport { step_s: 0.02, contacts: 3, degraded: 256 },
                ticks: 2,
                drive: DriveReport { held: true, at_limit: 1, lag: 0.5, missing_m: 0.0, hinges: &[9; 6] },
            },
        ];
        for (number, reply) in replies.iter().enumerate() {
            let mut bytes = [0; 160];
            both_ways(reply, &mut bytes);
            assert_eq!(usize::from(bytes[0]), number, "{reply:?}");
        }
    }

    #[test]
    fn poses_travel_bit_by_bit() {
        let mut pose = Pose::<4>::IDENTITY;
        pose.position = [-0.0, f32::NAN, 1e-40];
        pose.rotations[1] = [0.1, -0.2, 0.3, f32::from_bits(0x7f80_0001)];
        let mut buffer = PoseBuffer::new();
        let bytes = buffer.pose(&pose, 3);
        assert_eq!(bytes.joints(), Some(3));
        let mut back = Pose::<4>::IDENTITY;
        bytes.read(&mut back);
        let bits = |p: &Pose<4>| {
            let all = p.position.iter().chain(p.rotations[..3].as_flattened());
            all.map(|v| v.to_bits()).collect::<Vec<_, 16>>()
        };
        assert_eq!(bits(&back), bits(&pose));
        assert_eq!(PoseBytes { rotations: &[0; 17], ..bytes }.joints(), None);
    }

    #[test]
    fn the_longest_messages_fit_the_buffer() {
        const JOINTS: usize = 64;
        let pose = Pose::<JOINTS>::IDENTITY;
        let mut buffer = PoseBuffer::new();
        let report = StepReport {
            visits: u32::MAX,
            bytes_read: u32::MAX,
            degraded: u32::MAX,
            classes: [(u16::MAX, 1.0); MAX_KEPT].into_iter().collect(),
            stages: [u32::MAX; MAX_STAGES].into_iter().collect(),
            ..StepReport::default()
        };
        let mut frame = super::super::Frame::<2000>::new();
        let header = super::super::Header::request(1, 0).reply();
        for joints in [2, 8, 9, 12, 22, 64] {
            let reply = Reply::Pose(buffer.pose(&pose, joints), report.clone());
            let length = frame.write(header, &reply).expect("it fits").len();
            assert!(length <= super::super::buffer_length(joints), "{joints} joints: {length}");
        }
        let driven = crate::robot::Driven { held: true, at_limit: u16::MAX, lag: 1.1, missing_m: 1.1 };
        for hinges in [0, 20, 40, 41, 64] {
            let mut buffer = super::super::HingeBuffer::new();
            let report = buffer.report(&driven, |h| (h < hinges).then_some((1.1, u16::MAX)));
            assert_eq!(report.hinges().count(), hinges);
            let step = BriefReport { step_s: 1.1, contacts: 3, degraded: u32::MAX };
            for reply in [Reply::Drive(report), Reply::StepRobot { step, ticks: u16::MAX, drive: report }] {
                let length = frame.write(header, &reply).expect("it fits").len();
                assert!(length <= super::super::robot_buffer_length(hinges), "{hinges} hinges: {length}");
                // A robot of 40 hinges fits any buffer.
                assert!(hinges > 40 || length <= super::super::buffer_length(2), "{hinges} hinges: {length}");
            }
        }
        let page = [(u16::MAX, u64::MAX); PAGE].into_iter().collect();
        let length = frame.write(header, &Reply::Statistics { more: true, page }).expect("it fits").len();
        assert!(length <= super::super::buffer_length(2), "{length}");
        let pairs: Pairs = [(u16::MAX, 1.0); MAX_PAIRS].into_iter().collect();
        let length = frame.write(header, &Request::Style(pairs)).expect("it fits").len();
        assert!(length <= super::super::buffer_length(2), "{length}");
    }
}
