//! A session with a board. Settings and poses go to the board and to the core on this machine, and every reply is
//! compared bit by bit.

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
use serde::{Serialize, Serializer};

use super::{
    client::{Client, HostCounts, LinkError, RetryPolicy},
    line::Line,
    loopback::Loopback,
    noise::Noise,
    serve::BoardFn,
};

/// How a board identifies itself: an [`Identity`] that owns its names. Those of an `Identity` lie in the client's buffer,
/// which the next reply overwrites, and a session outlives many.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct BoardIdentity {
    /// Name of the board.
    pub board: String,
    /// Build of its firmware.
    pub build: String,
    /// Identity of its database.
    #[serde(serialize_with = "hexadecimal")]
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

fn hexadecimal<S: Serializer>(identity: &u32, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(&format_args!("{identity:08x}"))
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

/// A step on the board and on this machine.
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
    /// Every bit of pose and report is the same. Instruction counts are not compared: this machine has none.
    pub same: bool,
    /// Time from the first byte of the request to the last of the reply, on the line's clock.
    pub round_trip: Duration,
}

/// A tick of a robot.
#[derive(Debug, Clone, PartialEq)]
pub struct Driven {
    /// Angles in radians and pulses in microseconds, hinge by hinge.
    pub hinges: Vec<(f32, u16)>,
    /// No valid pose has come yet: the robot keeps its targets.
    pub held: bool,
    /// Hinges whose target is at an end of their range.
    pub at_limit: u16,
    /// Largest distance between a hinge and its target, radians.
    pub lag: f32,
    /// Largest distance by which a target misses a hand's or foot's position in the pose, metres.
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

/// A board, and its twin on this machine, which gets the same requests.
pub struct Session<'t, L> {
    board: Client<L>,
    twin: Client<Loopback<&'t mut BoardFn<'t>>>,
    identity: BoardIdentity,
    joints: usize,
    buffer: Box<PoseBuffer<MAX_JOINTS>>,
    /// The robot of both, if there is one.
    robot: Option<RobotIdentity>,
    /// Steps and ticks of the robot are one request.
    in_one_call: bool,
    /// The twin's last tick.
    last: Option<Driven>,
}

impl<'t, L: Line> Session<'t, L> {
    /// Begins a session with a board and its twin ([`with_board`](super::serve::with_board)).
    ///
    /// # Errors
    /// [`LinkError`], a board that has another database, and one whose buffers are too short for its poses.
    pub fn begin(mut board: Client<L>, twin: &'t mut BoardFn<'t>, database: &Database<'_>) -> Result<Self> {
        let identity = BoardIdentity::from(board.hello()?);
        if identity.database != database.identity() {
            bail!(LinkError::Database { board: identity.database, file: database.identity() });
        }
        let joints = database.counts().joints;
        let (need, have) = (buffer_length(joints), usize::from(identity.buffer_bytes));
        if have < need {
            bail!(LinkError::Buffers { have, need });
        }
        let mut twin = Client::new(Loopback::new(twin, Noise::default()), 1, RetryPolicy::default());
        twin.hello()?;
        Ok(Self {
            board,
            twin,
            identity,
            joints,
            buffer: Box::default(),
            robot: None,
            in_one_call: false,
            last: None,
        })
    }

    /// Checks that the board has this robot, and sets the angles of its hinges, radians, on the board and on the twin.
    /// From then on [`stream`](super::stream::stream) drives it.
    ///
    /// # Errors
    /// [`LinkError`], and a board that has another robot or none.
    pub fn find_robot(&mut self, robot: &Robot<'_>, angles: &[f32]) -> Result<RobotIdentity> {
        let bytes: Vec<u8> = angles.iter().flat_map(|a| a.to_le_bytes()).collect();
        let request = Request::Robot { angles: &bytes };
        let found = match self.board.call(&request).context("the board's robot")? {
            Reply::Robot(found) => found,
            _ => bail!(LinkError::Unreadable),
        };
        if found.robot != robot.identity() {
            bail!(
                "the board's robot is {:08x}, the file's {:08x}: flash the board with this file, or give the file that it was flashed with",
                found.robot,
                robot.identity()
            );
        }
        self.twin.call(&request)?;
        self.robot = Some(found);
        Ok(found)
    }

    /// Ticks the robot on the board and on the twin, towards the last output pose.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn drive(&mut self) -> Result<Driven, LinkError> {
        let mut driven = driven(&mut self.board)?;
        driven.same = driven.bits() == self::driven(&mut self.twin)?.bits();
        Ok(driven)
    }

    /// From now on [`stream`](super::stream::stream) sends a pose and the robot's ticks behind it as one request.
    pub fn step_in_one_call(&mut self) {
        self.in_one_call = true;
    }

    /// Steps one pose and the robot's ticks that are due: in one request on the board, in separate ones on the twin, which
    /// has to come to the same report and hinges bit by bit. The pose stays on the board, and is the twin's here. Ticks
    /// before the last are the twin's too.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn step_robot(&mut self, input: &Pose<MAX_JOINTS>) -> Result<(Stepped, Vec<Driven>), LinkError> {
        let bytes = self.buffer.pose(input, self.joints);
        let began = self.board.line().now();
        let (step, ticks, mut last) = match self.board.call(&Request::StepRobot(bytes))? {
            Reply::StepRobot { step, ticks, drive } => (step, ticks, Driven::of(&drive)),
            _ => return Err(LinkError::Unreadable),
        };
        let round_trip = self.board.line().now() - began;
        let (pose, report) = self::step(&mut self.twin, &Request::Pose(bytes))?;
        let mut driven = (0..ticks).map(|_| driven(&mut self.twin)).collect::<Result<Vec<_>, _>>()?;
        self.last = driven.last().cloned().or(self.last.take());
        last.same = self.last.as_ref().is_none_or(|twin| twin.bits() == last.bits());
        let same = last.same
            && step.step_s.to_bits() == report.step_s.to_bits()
            && (step.contacts, step.degraded) == (report.contacts, report.degraded);
        if let Some(slot) = driven.last_mut() {
            *slot = last;
        }
        let (host_pose, host_report) = (pose, report.clone());
        Ok((Stepped { pose, report, host_pose, host_report, same, round_trip }, driven))
    }

    /// Joints of a pose.
    pub(super) fn joints(&self) -> usize {
        self.joints
    }

    /// True after [`step_in_one_call`](Self::step_in_one_call).
    pub(super) fn in_one_call(&self) -> bool {
        self.in_one_call && self.robot.is_some()
    }

    /// The robot, after [`find_robot`](Self::find_robot).
    pub(super) fn robot(&self) -> Option<RobotIdentity> {
        self.robot
    }

    /// The board's identity.
    pub fn identity(&self) -> &BoardIdentity {
        &self.identity
    }

    /// The client that is connected to the board.
    pub fn board(&mut self) -> &mut Client<L> {
        &mut self.board
    }

    /// What the client has counted on the line.
    pub fn counts(&self) -> HostCounts {
        self.board.counts()
    }

    /// Applies a setting on the board and on the twin.
    ///
    /// # Errors
    /// [`LinkError`]; a refusal is the board's.
    pub fn set(&mut self, setting: &Request<'_>) -> Result<(), LinkError> {
        self.board.set(setting)?;
        self.twin.set(setting)
    }

    /// Applies a request's settings on the board and on the twin: parameters, style, labels, masks, strengths, styles
    /// of joint groups.
    ///
    /// # Errors
    /// A setting that the board refuses; the message says what to do about it.
    pub fn apply(&mut self, request: &stream::Request) -> Result<()> {
        let [_, capacity, _] = self.identity.capacity;
        let k = request.config.k;
        if k > capacity {
            bail!("the board's capacity is {capacity} neighbors a class, not {k}: give --k {capacity}");
        }
        for setting in settings(request)? {
            self.set(&setting).with_context(|| format!("setting {} on the board", name(&setting)))?;
        }
        Ok(())
    }

    /// Steps one pose on the board and on the twin.
    ///
    /// # Errors
    /// [`LinkError`].
    pub fn step(&mut self, input: &Pose<MAX_JOINTS>) -> Result<Stepped, LinkError> {
        let request = Request::Pose(self.buffer.pose(input, self.joints));
        let began = self.board.line().now();
        let (pose, report) = step(&mut self.board, &request)?;
        let round_trip = self.board.line().now() - began;
        let (host_pose, host_report) = step(&mut self.twin, &request)?;
        let same = bits(&pose, self.joints).eq(bits(&host_pose, self.joints))
            && StepReport { stages: host_report.stages.clone(), ..report.clone() } == host_report
            && report.step_s.to_bits() == host_report.step_s.to_bits();
        Ok(Stepped { pose, report, host_pose, host_report, same, round_trip })
    }
}

fn driven<L: Line>(client: &mut Client<L>) -> Result<Driven, LinkError> {
    match client.call(&Request::Drive)? {
        Reply::Drive(report) => Ok(Driven::of(&report)),
        _ => Err(LinkError::Unreadable),
    }
}

fn step<L: Line>(
    client: &mut Client<L>,
    request: &Request<'_>,
) -> Result<(Pose<MAX_JOINTS>, StepReport), LinkError> {
    match client.call(request)? {
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

/// The settings of a request, as messages of the link.
///
/// # Errors
/// More styles than a message holds, and settings that only a host supports.
pub fn settings(request: &stream::Request) -> Result<VecDeque<Request<'static>>> {
    if request.bounds.is_some() {
        bail!(
            "--timing bounded works with `translate` and `run` only: on a board use --timing free or --timing sync"
        );
    }
    let mut settings = VecDeque::new();
    let pairs = |pairs: &[(u16, f32)], what: &str| -> Result<Pairs> {
        Pairs::from_slice(pairs)
            .map_err(|_| anyhow::anyhow!("{} {what} are too many: a message holds {MAX_PAIRS}", pairs.len()))
    };
    for some in parameters(&request.config).chunks(MAX_PAIRS) {
        settings.push_back(Request::Configure(pairs(some, "parameters")?));
    }
    settings.push_back(Request::Style(pairs(&request.style, "styles")?));
    settings.push_back(Request::Labels { action: request.action, input_style: request.input_style });
    for &group in &request.masked {
        settings.push_back(Request::Mask { group, searched: false });
    }
    if !request.strength.is_empty() {
        settings.push_back(Request::Strength(pairs(&request.strength, "strengths")?));
    }
    for (group, weights) in &request.group_styles {
        settings.push_back(Request::GroupStyle { group: *group, weights: pairs(weights, "styles")? });
    }
    Ok(settings)
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

/// Statistics by name; those that only this board has are named by their number.
pub fn named(statistics: &[(u16, u64)]) -> Vec<(String, u64)> {
    let name = |number| counter::name(number).map_or_else(|| format!("own_{number}"), str::to_owned);
    statistics.iter().map(|&(number, value)| (name(number), value)).collect()
}
