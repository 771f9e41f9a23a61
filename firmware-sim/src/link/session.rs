//! A session with a board: settings and poses go to it and to the core on this machine, and every answer is compared, bit
//! by bit.

use std::{collections::VecDeque, time::Duration};

use anyhow::{Context, Result, bail};
use gestus_core::{
    Config, Database, Pose,
    blob::layout::MAX_JOINTS,
    config::parameters,
    link::{
        DriveReport, Identity, MAX_PAIRS, Pairs, PoseBuffer, Reply, Request, RobotIdentity, StepReport,
        buffer_length, counter,
    },
    robot::Robot,
};
use gestus_database::stream;

use super::{
    client::{Client, HostCounts, LinkError, Patience},
    line::Line,
    loopback::Loopback,
    noise::Noise,
    serve::BoardFn,
};

/// Who answered.
#[derive(Debug, Clone, PartialEq)]
pub struct BoardIdentity {
    /// The board.
    pub board: String,
    /// The build of its firmware.
    pub build: String,
    /// Identity of its database.
    pub database: u32,
    /// Frames a second.
    pub rate_hz: f32,
    /// Joints.
    pub joints: u16,
    /// Classes.
    pub classes: u16,
    /// The stylizer's capacities J, K and C.
    pub capacity: [u16; 3],
    /// Bytes of the stylizer.
    pub ram_bytes: u32,
    /// Bytes of a link buffer.
    pub buffer_bytes: u16,
}

impl From<Identity<'_>> for BoardIdentity {
    fn from(identity: Identity<'_>) -> Self {
        Self {
            board: identity.board.to_owned(),
            build: identity.build.to_owned(),
            database: identity.database,
            rate_hz: identity.rate_hz,
            joints: identity.joints,
            classes: identity.classes,
            capacity: identity.capacity,
            ram_bytes: identity.ram_bytes,
            buffer_bytes: identity.buffer_bytes,
        }
    }
}

impl std::fmt::Display for BoardIdentity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [j, k, c] = self.capacity;
        write!(
            f,
            "{} ({}): database {:08x}, {} joints, {} classes, {} Hz; Stylizer<{j}, {k}, {c}> of {} bytes",
            self.board, self.build, self.database, self.joints, self.classes, self.rate_hz, self.ram_bytes
        )
    }
}

/// What a step gave, on the board and on this machine.
#[derive(Debug, Clone)]
pub struct Stepped {
    /// The board's pose.
    pub pose: Pose<MAX_JOINTS>,
    /// The board's report.
    pub report: StepReport,
    /// This machine's pose.
    pub host_pose: Pose<MAX_JOINTS>,
    /// This machine's report.
    pub host_report: StepReport,
    /// Every bit of pose and report is the same, but for the instruction counts, which this machine has not.
    pub same: bool,
    /// From the first byte of the request to the last of the answer, on the line's clock.
    pub round_trip: Duration,
}

/// A tick of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Angles in radians and pulses in microseconds, hinge by hinge.
    pub hinges: Vec<(f32, u16)>,
    /// The pose was none, or there is none yet: the robot goes on to where it was going.
    pub held: bool,
    /// Hinges whose target is at an end of their range.
    pub at_limit: u16,
    /// Largest distance between a hinge and its target, radians.
    pub lag: f32,
    /// Largest way that a hand or foot is away from where it should be, as a target, metres.
    pub missing_m: f32,
    /// Every bit is the same on this machine.
    pub same: bool,
}

impl Driven {
    fn of(report: &DriveReport<'_>) -> Self {
        let DriveReport { held, at_limit, lag, missing_m, .. } = *report;
        Self { hinges: report.hinges().collect(), held, at_limit, lag, missing_m, same: true }
    }

    fn bits(&self) -> impl PartialEq + use<> {
        let hinges: Vec<(u32, u16)> = self.hinges.iter().map(|&(a, p)| (a.to_bits(), p)).collect();
        (hinges, self.held, self.at_limit, self.lag.to_bits(), self.missing_m.to_bits())
    }
}

/// A board, and a twin of it on this machine that is told the same.
pub struct Session<'t, L> {
    board: Client<L>,
    twin: Client<Loopback<&'t mut BoardFn<'t>>>,
    identity: BoardIdentity,
    joints: usize,
    buffer: Box<PoseBuffer<MAX_JOINTS>>,
    /// The robot on both, where there is one.
    robot: Option<RobotIdentity>,
}

impl<'t, L: Line> Session<'t, L> {
    /// Says hello to a board and to its twin ([`with_board`](super::serve::with_board)).
    ///
    /// # Errors
    /// [`LinkError`], and a board whose database is another one, or whose buffers are too short for its poses.
    pub fn begin(mut board: Client<L>, twin: &'t mut BoardFn<'t>, database: &Database<'_>) -> Result<Self> {
        let identity = BoardIdentity::from(board.hello()?);
        if identity.database != database.identity() {
            bail!(
                "the board's database is {:08x}, the file's {:08x}: flash the board with this file, or name the one that it has",
                identity.database,
                database.identity()
            );
        }
        let joints = database.counts().joints;
        has_room(&identity, joints)?;
        let mut twin = Client::new(Loopback::new(twin, Noise::default()), 1, Patience::default());
        twin.hello()?;
        Ok(Self { board, twin, identity, joints, buffer: Box::default(), robot: None })
    }

    /// Finds the robot of those tables on the board, and puts its hinges at these angles, radians, at both ends. From
    /// then on [`stream`] drives it.
    ///
    /// # Errors
    /// [`LinkError`], and a board whose robot is another one, or that has none.
    pub fn find_robot(&mut self, robot: &Robot<'_>, angles: &[f32]) -> Result<RobotIdentity> {
        let bytes: Vec<u8> = angles.iter().flat_map(|a| a.to_le_bytes()).collect();
        let request = Request::Robot { angles: &bytes };
        let found = match self.board.ask(&request).context("the board's robot")? {
            Reply::Robot(found) => found,
            _ => bail!(LinkError::Unreadable),
        };
        if found.robot != robot.identity() {
            bail!(
                "the board's robot is {:08x}, the file's {:08x}: flash the board with these tables, or name those that it has",
                found.robot,
                robot.identity()
            );
        }
        self.twin.ask(&request)?;
        self.robot = Some(found);
        Ok(found)
    }

    /// A tick of the robot at both ends, towards the pose that was put out last.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn drive(&mut self) -> Result<Driven, LinkError> {
        let mut driven = driven(&mut self.board)?;
        driven.same = driven.bits() == self::driven(&mut self.twin)?.bits();
        Ok(driven)
    }

    /// Joints of a pose.
    pub(super) fn joints(&self) -> usize {
        self.joints
    }

    /// The robot on both, where [`find_robot`](Self::find_robot) found one.
    pub(super) fn robot(&self) -> Option<RobotIdentity> {
        self.robot
    }

    /// Who answered.
    pub fn identity(&self) -> &BoardIdentity {
        &self.identity
    }

    /// The client that speaks with the board.
    pub fn board(&mut self) -> &mut Client<L> {
        &mut self.board
    }

    /// What was counted of the line.
    pub fn counts(&self) -> HostCounts {
        self.board.counts()
    }

    /// Puts a setting in force at both ends.
    ///
    /// # Errors
    /// [`LinkError`]; a refusal is the board's.
    pub fn set(&mut self, setting: &Request<'_>) -> Result<(), LinkError> {
        self.board.set(setting)?;
        self.twin.set(setting)
    }

    /// Puts a wish in force at both ends: parameters, style, labels, masks, strengths, styles of joint groups.
    ///
    /// # Errors
    /// What the board refuses, with what to do about it.
    pub fn wish(&mut self, wish: &stream::Request) -> Result<()> {
        let [_, most, _] = self.identity.capacity;
        let k = wish.config.k;
        if k > most {
            bail!("{} neighbors a class are more than the board has room for: give --k {most}", k);
        }
        for request in requests(wish)? {
            self.set(&request).with_context(|| format!("the board refuses {}", name(&request)))?;
        }
        Ok(())
    }

    /// One pose through both.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn step(&mut self, input: &Pose<MAX_JOINTS>) -> Result<Stepped, LinkError> {
        let request = Request::Pose(self.buffer.pose(input, self.joints));
        let began = self.board.line().now();
        let (pose, report) = ask(&mut self.board, &request)?;
        let round_trip = self.board.line().now() - began;
        let (host_pose, host_report) = ask(&mut self.twin, &request)?;
        let same = bits(&pose, self.joints).eq(bits(&host_pose, self.joints))
            && StepReport { stages: host_report.stages.clone(), ..report.clone() } == host_report
            && report.step_s.to_bits() == host_report.step_s.to_bits();
        Ok(Stepped { pose, report, host_pose, host_report, same, round_trip })
    }
}

fn driven<L: Line>(client: &mut Client<L>) -> Result<Driven, LinkError> {
    match client.ask(&Request::Drive)? {
        Reply::Drive(report) => Ok(Driven::of(&report)),
        _ => Err(LinkError::Unreadable),
    }
}

fn ask<L: Line>(
    client: &mut Client<L>,
    request: &Request<'_>,
) -> Result<(Pose<MAX_JOINTS>, StepReport), LinkError> {
    match client.ask(request)? {
        Reply::Pose(bytes, report) => {
            let mut pose = Pose::IDENTITY;
            bytes.read(&mut pose);
            Ok((pose, report))
        }
        _ => Err(LinkError::Unreadable),
    }
}

fn bits(pose: &Pose<MAX_JOINTS>, joints: usize) -> impl Iterator<Item = u32> + '_ {
    pose.position.iter().chain(pose.rotations[..joints].as_flattened()).map(|v| v.to_bits())
}

/// The settings of a wish, as requests.
///
/// # Errors
/// More styles than a message holds, and what only a host does.
pub fn requests(wish: &stream::Request) -> Result<VecDeque<Request<'static>>> {
    if wish.bounds.is_some() {
        bail!(
            "--timing bounded is for translate and run: a board answers each pose with one, on free or sync time"
        );
    }
    let mut requests = VecDeque::new();
    let pairs = |pairs: &[(u16, f32)], what: &str| -> Result<Pairs> {
        Pairs::from_slice(pairs)
            .map_err(|_| anyhow::anyhow!("{} {what} are more than the {MAX_PAIRS} of a message", pairs.len()))
    };
    for some in parameters(&wish.config).chunks(MAX_PAIRS) {
        requests.push_back(Request::Configure(pairs(some, "parameters")?));
    }
    requests.push_back(Request::Style(pairs(&wish.style, "styles")?));
    requests.push_back(Request::Labels { action: wish.action, input_style: wish.input_style });
    for &group in &wish.masked {
        requests.push_back(Request::Mask { group, searched: false });
    }
    if !wish.strength.is_empty() {
        requests.push_back(Request::Strength(pairs(&wish.strength, "strengths")?));
    }
    for (group, weights) in &wish.group_styles {
        requests.push_back(Request::GroupStyle { group: *group, weights: pairs(weights, "styles")? });
    }
    Ok(requests)
}

fn parameters(config: &Config) -> Vec<(u16, f32)> {
    (0..).map_while(|number| Some((number, parameters::value(config, number)?))).collect()
}

fn name(request: &Request<'_>) -> &'static str {
    match request {
        Request::Configure(_) => "the parameters",
        Request::Style(_) => "the style",
        Request::Labels { .. } => "the labels",
        Request::Mask { .. } => "the mask",
        Request::Strength(_) => "the strengths",
        Request::GroupStyle { .. } => "the style of a joint group",
        _ => "the setting",
    }
}

/// A board whose buffers are too short drops poses without a word, or steps them and can't answer: it is told before a
/// stream begins.
fn has_room(board: &BoardIdentity, joints: usize) -> Result<()> {
    let (need, have) = (buffer_length(joints), board.buffer_bytes);
    if usize::from(have) < need {
        bail!(
            "the link's buffers on the board have {have} bytes, and poses of {joints} joints take {need}: build its firmware with longer ones (docs/LINK.md, \"Memory\")"
        );
    }
    Ok(())
}

/// Statistics by name; a board's own by number.
pub fn named(statistics: &[(u16, u64)]) -> Vec<(String, u64)> {
    let name = |number| counter::name(number).map_or_else(|| format!("own_{number}"), str::to_owned);
    statistics.iter().map(|&(number, value)| (name(number), value)).collect()
}
