//! Streams a clip through the core on the host, frame by frame, for `translate`, `evaluate` and `gestus-sim run`.

pub mod beginning;
pub(crate) mod body_mapping;
mod capacities;
pub mod cleanup;
pub mod course;
pub mod crowd;
pub mod far;
pub mod footplants;
pub mod input;
mod left_alone;
pub mod looped;
pub mod reading;
mod repair;
mod standing;
mod toe_tips;
pub mod trace;
pub mod translate;
pub(crate) mod turn_limit;
pub mod verdict;

use gestus_core::{
    Config, ConfigError, Database, Digest, Observer, Pose, Report, Stage, Stylizer,
    body::pose::Dofs,
    output::retime::{Bounds, Retimer, Tick},
    search::{found::Found, query::Feature},
};
use nalgebra::Vector3;

pub use body_mapping::is_same_body;

use crate::with_capacities;
use gestus_motion::clip::{Clip, Frame, rotation};

/// Most classes of a database for streaming on the host.
pub const MOST_CLASSES: usize = 256;
/// Most neighbors of a stylizer on the host.
pub const MOST_NEIGHBORS: usize = 64;

/// Settings of a stylizer for a stream.
#[derive(Debug, Clone)]
pub struct Request {
    /// Parameters of the method.
    pub config: Config,
    /// Output style: numbers and weights.
    pub style: Vec<(u16, f32)>,
    /// The input's action, if known.
    pub action: Option<u16>,
    /// The input's style, if known.
    pub input_style: Option<u16>,
    /// Joint groups that the search ignores.
    pub masked: Vec<u16>,
    /// Strength of joint groups, if not 1.
    pub strength: Vec<(u16, f32)>,
    /// Output styles of joint groups that have their own: numbers and weights.
    pub group_styles: Vec<(u16, Vec<(u16, f32)>)>,
    /// Bounds of the output's lead and lag; with bounds, the output is retimed to one pose per tick.
    pub bounds: Option<Bounds>,
}

impl Request {
    /// One style, with an unlabelled input.
    pub fn style(style: u16) -> Self {
        Self {
            config: Config::new(),
            style: vec![(style, 1.0)],
            action: None,
            input_style: None,
            masked: Vec::new(),
            strength: Vec::new(),
            group_styles: Vec::new(),
            bounds: None,
        }
    }

    /// Numbers of output styles with weight: in the body's mix, and in each joint group's own mix. Each costs one unpacking
    /// and regression per frame.
    pub fn mixes(&self, groups: usize) -> Vec<usize> {
        let own = |group: usize| {
            let set = self.group_styles.iter().rfind(|(g, _)| usize::from(*g) == group);
            set.map(|(_, weights)| weights).filter(|weights| !weights.is_empty()).unwrap_or(&self.style)
        };
        let mut mixes: Vec<&Vec<(u16, f32)>> = Vec::new();
        for mix in (0..groups).map(own) {
            if !mixes.contains(&mix) {
                mixes.push(mix);
            }
        }
        let weighted = |mix: &Vec<(u16, f32)>| mix.iter().filter(|(_, weight)| *weight > 0.0).count();
        mixes.into_iter().map(weighted).collect()
    }
}

/// One frame of output.
#[derive(Debug, Clone)]
pub struct Step {
    /// The output pose.
    pub frame: Frame,
    /// The core's report.
    pub report: Report,
    /// Microseconds that the step took.
    pub micros: f64,
}

/// The output of a stream.
#[derive(Debug, Clone)]
pub struct Streamed {
    /// One step per frame.
    pub steps: Vec<Step>,
    /// Digest over all output poses and time steps.
    pub digest: u32,
    /// Size of the stylizer, bytes.
    pub ram_bytes: usize,
    /// One pose per tick, if the request has bounds.
    pub retimed: Option<Retimed>,
}

/// A retimed stream: as many poses as the input, at the input's rate.
#[derive(Debug, Clone)]
pub struct Retimed {
    /// One pose per tick.
    pub frames: Vec<Frame>,
    /// The report of each tick.
    pub ticks: Vec<Tick>,
    /// Delay of a live stream by its lead, seconds. In a file, poses have their inputs' times.
    pub latency_s: f32,
    /// Seconds between ticks.
    pub tick_s: f64,
}

impl Retimed {
    /// Time at which each input frame's pose is shown, seconds from the first, and `None` behind the last tick.
    pub fn shown_at(&self, rate_hz: f64) -> Vec<Option<f64>> {
        let places: Vec<f64> =
            self.ticks.iter().enumerate().map(|(k, t)| k as f64 - f64::from(t.lag_s) * rate_hz).collect();
        (0..self.ticks.len())
            .map(|n| {
                let n = n as f64;
                let k = places.iter().position(|&p| p >= n - 1e-6)?;
                let Some(before) = k.checked_sub(1) else { return Some(0.0) };
                let span = (places[k] - places[before]).max(1e-9);
                Some((before as f64 + (n - places[before]) / span) / rate_hz)
            })
            .collect()
    }
}

impl Streamed {
    /// Time of each output pose, seconds from the first.
    pub fn times(&self) -> Vec<f64> {
        let mut time = 0.0;
        self.steps
            .iter()
            .enumerate()
            .map(|(i, s)| {
                if i > 0 {
                    time += f64::from(s.report.step_s);
                }
                time
            })
            .collect()
    }

    /// The output poses, at [`times`](Self::times).
    pub fn frames(&self) -> Vec<Frame> {
        self.steps.iter().map(|s| s.frame.clone()).collect()
    }

    /// The output as a clip at a fixed rate: resampled from the poses at their times, or tick by tick if the stream was
    /// retimed.
    pub fn clip(&self, like: &Clip, rate_hz: f64) -> Clip {
        if let Some(retimed) = &self.retimed {
            let frames = retimed.frames.clone();
            let clip = Clip {
                name: like.name.clone(),
                skeleton: like.skeleton.clone(),
                rate_hz: like.rate_hz,
                frames,
            };
            return clip.resampled(rate_hz);
        }
        let frames = self.steps.iter().map(|step| &step.frame);
        let frames = gestus_motion::clip::at_times(&frames.collect::<Vec<_>>(), &self.times(), rate_hz);
        Clip { name: like.name.clone(), skeleton: like.skeleton.clone(), rate_hz, frames }
    }
}

/// Observes a step, whatever the stylizer's capacity of joints.
pub trait Watcher {
    /// A step begins, with [`Stage::Rest`].
    fn begin(&mut self) {}
    /// From here on the work is of that stage.
    fn stage(&mut self, _stage: Stage) {}
    /// The query, F numbers.
    fn query(&mut self, _feature: &[f32]) {}
    /// What was found of a class.
    fn searched(&mut self, _class: usize, _found: &Found<'_>) {}
    /// Timing neighbors of a kept class and their weights.
    fn timed(&mut self, _class: usize, _rows: &[u16], _weights: &[f32]) {}
    /// `x[t]`, `x[t-1]`, `y[t-1]` and the prediction, D numbers each.
    fn predicted(&mut self, _x: &[f32], _x_prev: &[f32], _y_prev: &[f32], _predicted: &[f32]) {}
    /// The end of a step.
    fn done(&mut self, _report: &Report) {}
}

impl Watcher for () {}

struct Adapter<'a, W: Watcher> {
    watcher: &'a mut W,
    features: usize,
    dofs: usize,
}

impl<const J: usize, W: Watcher> Observer<J> for Adapter<'_, W> {
    #[inline(always)]
    fn stage(&mut self, stage: Stage) {
        self.watcher.stage(stage);
    }
    fn query(&mut self, feature: &Feature) {
        self.watcher.query(&feature[..self.features]);
    }
    fn searched(&mut self, class: usize, found: &Found<'_>) {
        self.watcher.searched(class, found);
    }
    fn timed(&mut self, class: usize, rows: &[u16], weights: &[f32]) {
        self.watcher.timed(class, rows, weights);
    }
    fn predicted(&mut self, x: &Dofs<J>, x_prev: &Dofs<J>, y_prev: &Dofs<J>, predicted: &Dofs<J>) {
        let cut = |dofs: &Dofs<J>| dofs.as_flattened()[..self.dofs].to_vec();
        self.watcher.predicted(&cut(x), &cut(x_prev), &cut(y_prev), &cut(predicted));
    }
}

/// Streams a clip, which has to be at the database's rate and on its joints.
///
/// # Errors
/// [`ConfigError`] if the request does not fit the database.
pub fn stream(
    database: &Database<'_>,
    clip: &Clip,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed, ConfigError> {
    stream_with_labels(database, clip, request, &[], watcher)
}

/// [`stream`] with changes of the action label: the first frame and the action of each, ascending.
///
/// # Errors
/// As [`stream`].
pub fn stream_with_labels(
    database: &Database<'_>,
    clip: &Clip,
    request: &Request,
    actions: &[(usize, u16)],
    watcher: &mut impl Watcher,
) -> Result<Streamed, ConfigError> {
    with_capacities!(database.counts(), request.config.k, J, K, C =>
        run::<J, K, C>(database, clip, request, actions, watcher))
}

fn run<const J: usize, const K: usize, const C: usize>(
    database: &Database<'_>,
    clip: &Clip,
    request: &Request,
    actions: &[(usize, u16)],
    watcher: &mut impl Watcher,
) -> Result<Streamed, ConfigError> {
    let mut stylizer = Box::new(Stylizer::<J, K, C>::new(*database, request.config)?);
    stylizer.set_style(&request.style)?;
    stylizer.set_labels(request.action, request.input_style)?;
    for &group in &request.masked {
        stylizer.set_mask(group, false)?;
    }
    for &(group, strength) in &request.strength {
        stylizer.set_strength(group, strength)?;
    }
    for (group, weights) in &request.group_styles {
        stylizer.set_group_style(*group, weights)?;
    }
    let counts = database.counts();
    let mut output = Pose::<J>::IDENTITY;
    let mut playback = request.bounds.map(|b| Playback::<J>::new(database, b)).transpose()?;
    let mut digest = Digest::new();
    let mut steps = Vec::with_capacity(clip.frames.len());
    for (t, frame) in clip.frames.iter().enumerate() {
        if let Some(&(_, action)) = actions.iter().find(|a| a.0 == t) {
            stylizer.set_action(Some(action))?;
        }
        let input = to_pose::<J>(frame);
        watcher.begin();
        let mut adapter = Adapter { watcher, features: counts.features, dofs: counts.dofs };
        let (report, micros) = timed(|| stylizer.step_observed(&input, &mut output, &mut adapter));
        watcher.done(&report);
        digest.add(&output, counts.joints, report.step_s);
        if let Some(playback) = &mut playback {
            playback.push(&output, report.step_s, counts.joints);
        }
        steps.push(Step { frame: from_pose(&output, counts.joints), report, micros });
    }
    let retimed = playback.map(|p| p.finish(&output, steps.len(), counts.joints));
    Ok(Streamed { steps, digest: digest.value(), ram_bytes: size_of::<Stylizer<'_, J, K, C>>(), retimed })
}

/// The result of some work, and the microseconds that it took: 0 in a wasm module, which has no clock.
fn timed<T>(work: impl FnOnce() -> T) -> (T, f64) {
    #[cfg(target_family = "wasm")]
    return (work(), 0.0);
    #[cfg(not(target_family = "wasm"))]
    {
        let start = std::time::Instant::now();
        let result = work();
        (result, start.elapsed().as_secs_f64() * 1e6)
    }
}

/// Poses that a retimer on the host keeps: enough for bounds of seconds at usual rates.
pub(crate) const RETIMER_POSES: usize = 512;

/// A retimer and its output.
struct Playback<const J: usize> {
    retimer: Box<Retimer<J, RETIMER_POSES>>,
    frames: Vec<Frame>,
    ticks: Vec<Tick>,
    step_s: f32,
}

impl<const J: usize> Playback<J> {
    fn new(database: &Database<'_>, bounds: Bounds) -> Result<Self, ConfigError> {
        let millihz = (f64::from(database.rate_hz()) * 1000.0).round() as u32;
        let retimer = Box::new(Retimer::new(millihz, millihz, bounds)?);
        Ok(Self { retimer, frames: Vec::new(), ticks: Vec::new(), step_s: 1.0 / database.rate_hz() })
    }

    fn push(&mut self, pose: &Pose<J>, step_s: f32, joints: usize) {
        self.retimer.push(pose, step_s);
        while self.retimer.is_due() {
            let mut output = Pose::IDENTITY;
            self.ticks.push(self.retimer.tick(&mut output));
            self.frames.push(from_pose(&output, joints));
        }
    }

    /// Ends the stream: the last pose is held until all poses are output, and the delay of a live stream is removed.
    fn finish(mut self, last: &Pose<J>, count: usize, joints: usize) -> Retimed {
        let latency_s = self.retimer.latency_s();
        let delay = (latency_s / self.step_s).round() as usize;
        for _ in 0..delay {
            self.push(last, self.step_s, joints);
        }
        Retimed {
            frames: self.frames.into_iter().skip(delay).take(count).collect(),
            ticks: self.ticks.into_iter().skip(delay).take(count).collect(),
            latency_s,
            tick_s: f64::from(self.step_s),
        }
    }
}

/// A frame as a pose of the core.
pub fn to_pose<const J: usize>(frame: &Frame) -> Pose<J> {
    let mut pose = Pose::IDENTITY;
    pose.position = [frame.root.x as f32, frame.root.y as f32, frame.root.z as f32];
    for (slot, q) in pose.rotations.iter_mut().zip(&frame.rotations) {
        *slot = [q.i as f32, q.j as f32, q.k as f32, q.w as f32];
    }
    pose
}

/// A pose of the core as a frame.
pub fn from_pose<const J: usize>(pose: &Pose<J>, joints: usize) -> Frame {
    let [x, y, z] = pose.position.map(f64::from);
    Frame {
        root: Vector3::new(x, y, z),
        rotations: pose.rotations.iter().take(joints).copied().map(rotation).collect(),
    }
}
