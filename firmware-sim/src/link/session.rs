//! A clip through a board, and through the core on this machine beside it: every answer is compared, bit by bit.

use std::{
    collections::VecDeque,
    time::{Duration, Instant},
};

use anyhow::{Context, Result, bail};
use gestus_builder::{
    motion::Clip,
    stream::{Request as Wish, Step, Streamed, from_pose, to_pose},
};
use gestus_core::{
    Config, Database, Digest, Pose,
    blob::layout::MAX_JOINTS,
    link::{Identity, MAX_PAIRS, Pairs, PoseBuffer, Reply, Request, StepReport, counter, parameter},
};

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

/// A board, and a twin of it on this machine that is told the same.
pub struct Session<'t, L> {
    board: Client<L>,
    twin: Client<Loopback<&'t mut BoardFn<'t>>>,
    identity: BoardIdentity,
    joints: usize,
    buffer: Box<PoseBuffer<MAX_JOINTS>>,
}

impl<'t, L: Line> Session<'t, L> {
    /// Says hello to a board and to its twin ([`with_board`](super::serve::with_board)).
    ///
    /// # Errors
    /// [`LinkError`], and a board whose database is another one.
    pub fn begin(mut board: Client<L>, twin: &'t mut BoardFn<'t>, database: &Database<'_>) -> Result<Self> {
        let identity = BoardIdentity::from(board.hello()?);
        if identity.database != database.identity() {
            bail!(
                "the board's database is {:08x}, the file's {:08x}: flash the board with this file, or name the one that it has",
                identity.database,
                database.identity()
            );
        }
        let mut twin = Client::new(Loopback::new(twin, Noise::default()), 1, Patience::default());
        twin.hello()?;
        Ok(Self { board, twin, identity, joints: database.counts().joints, buffer: Box::default() })
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
    pub fn wish(&mut self, wish: &Wish) -> Result<()> {
        let [_, most, _] = self.identity.capacity;
        let (k, _) = wish.config.neighborhood();
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
pub fn requests(wish: &Wish) -> Result<VecDeque<Request<'static>>> {
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
    parameter::NAMES
        .iter()
        .filter_map(|&(number, _)| Some((number, parameter::value(config, number)?)))
        .collect()
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

/// A clip that went through a board.
#[derive(Debug, Clone)]
pub struct Linked {
    /// The board's output. `micros` of a step are those of its round trip.
    pub streamed: Streamed,
    /// Digest of this machine's output.
    pub host_digest: u32,
    /// Frames that differ in any bit.
    pub differing: usize,
    /// The first of them.
    pub first_difference: Option<usize>,
    /// Instructions of each step by stage, where the board counts them.
    pub stages: Vec<Vec<u32>>,
    /// Frames whose answer came after the next one was due, where the stream kept the rate.
    pub late: usize,
}

impl Linked {
    /// Instructions of each step in total, ascending; none where the board does not count.
    pub fn instructions(&self) -> Vec<u64> {
        let mut totals: Vec<u64> = self
            .stages
            .iter()
            .filter(|stages| !stages.is_empty())
            .map(|stages| stages.iter().copied().map(u64::from).sum())
            .collect();
        totals.sort_unstable();
        totals
    }
}

/// Streams a clip, which has to be at the database's rate and on its joints. With `pace` a frame is sent when it is
/// due; else as soon as the one before is answered. `progress` hears of each frame.
///
/// # Errors
/// [`LinkError`], with the frame at which it happened.
pub fn stream<L: Line>(
    session: &mut Session<'_, L>,
    clip: &Clip,
    pace: bool,
    mut progress: impl FnMut(),
) -> Result<Linked> {
    let joints = session.joints;
    let (mut digest, mut host_digest) = (Digest::new(), Digest::new());
    let (mut steps, mut stages) = (Vec::with_capacity(clip.frames.len()), Vec::new());
    let (mut differing, mut first_difference, mut late) = (0, None, 0);
    let start = Instant::now();
    for (t, frame) in clip.frames.iter().enumerate() {
        let due = Duration::from_secs_f64(t as f64 / clip.rate_hz);
        if pace {
            std::thread::sleep(due.saturating_sub(start.elapsed()));
        }
        let stepped = session.step(&to_pose(frame)).with_context(|| format!("frame {t}"))?;
        if pace && start.elapsed() > due + Duration::from_secs_f64(1.0 / clip.rate_hz) {
            late += 1;
        }
        if !stepped.same {
            differing += 1;
            first_difference.get_or_insert(t);
        }
        digest.add(&stepped.pose, joints, stepped.report.step_s);
        host_digest.add(&stepped.host_pose, joints, stepped.host_report.step_s);
        stages.push(stepped.report.stages.to_vec());
        steps.push(Step {
            frame: from_pose(&stepped.pose, joints),
            report: stepped.report.report(),
            micros: stepped.round_trip.as_secs_f64() * 1e6,
        });
        progress();
    }
    let ram_bytes = session.identity.ram_bytes as usize;
    Ok(Linked {
        streamed: Streamed { steps, digest: digest.value(), ram_bytes, retimed: None },
        host_digest: host_digest.value(),
        differing,
        first_difference,
        stages,
        late,
    })
}

/// Statistics by name; a board's own by number.
pub fn named(statistics: &[(u16, u64)]) -> Vec<(String, u64)> {
    let name = |number| counter::name(number).map_or_else(|| format!("own_{number}"), str::to_owned);
    statistics.iter().map(|&(number, value)| (name(number), value)).collect()
}
