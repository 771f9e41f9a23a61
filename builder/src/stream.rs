//! A clip through the core, frame by frame, on the host: what `translate`, `evaluate` and `gestus-sim run` share.

use std::time::Instant;

use gestus_core::{
    Config, ConfigError, Database, Digest, Observer, Pose, Report, Stylizer, blob::layout, knn::Neighbor,
    pose::Dofs, query::Feature,
};
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::motion::{Clip, Frame};

/// What the stylizer is asked for.
#[derive(Debug, Clone)]
pub struct Request {
    /// Parameters of the method.
    pub config: Config,
    /// Output style: numbers and weights.
    pub style: Vec<(u16, f32)>,
    /// The input's action, where it is known.
    pub action: Option<u16>,
    /// The input's style, where it is known.
    pub input_style: Option<u16>,
    /// Joint groups that the search leaves out.
    pub masked: Vec<u16>,
    /// Strength of joint groups, where it is not 1.
    pub strength: Vec<(u16, f32)>,
}

impl Request {
    /// One style, nothing known of the input.
    pub fn style(style: u16) -> Self {
        Self {
            config: Config::new(),
            style: vec![(style, 1.0)],
            action: None,
            input_style: None,
            masked: Vec::new(),
            strength: Vec::new(),
        }
    }
}

/// One frame of what came out.
#[derive(Debug, Clone)]
pub struct Step {
    /// The output pose.
    pub frame: Frame,
    /// What the core said.
    pub report: Report,
    /// Microseconds that the step took.
    pub micros: f64,
}

/// What came out of a stream.
#[derive(Debug, Clone)]
pub struct Streamed {
    /// One step a frame.
    pub steps: Vec<Step>,
    /// Digest over all output poses and time steps.
    pub digest: u32,
    /// Bytes of the stylizer.
    pub ram_bytes: usize,
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

    /// The output as a clip at a fixed rate: poses at their time stamps, resampled.
    pub fn clip(&self, like: &Clip, rate_hz: f64) -> Clip {
        let times = self.times();
        let end = times.last().copied().unwrap_or(0.0);
        let count = (end * rate_hz + 1e-6).floor() as usize + 1;
        let mut at = 0;
        let frames = (0..count)
            .map(|i| {
                let time = i as f64 / rate_hz;
                while at + 2 < times.len() && times[at + 1] <= time {
                    at += 1;
                }
                let Some(next) = self.steps.get(at + 1) else { return self.steps[at].frame.clone() };
                let span = times[at + 1] - times[at];
                let t = if span > 0.0 { ((time - times[at]) / span).clamp(0.0, 1.0) } else { 0.0 };
                crate::motion::interpolate(&self.steps[at].frame, &next.frame, t)
            })
            .collect();
        Clip { name: like.name.clone(), skeleton: like.skeleton.clone(), rate_hz, frames }
    }
}

/// Sees a step without knowing how many joints the stylizer has room for.
pub trait Watcher {
    /// The query, F numbers.
    fn query(&mut self, _feature: &[f32]) {}
    /// Neighbors of a class, nearest first.
    fn searched(&mut self, _class: usize, _neighbors: &[Neighbor], _mean_distance2: f32) {}
    /// Timing neighbors of a kept class and their weights.
    fn timed(&mut self, _class: usize, _rows: &[u16], _weights: &[f32]) {}
    /// `x[t]`, `x[t-1]`, `y[t-1]` and the prediction, D numbers each.
    fn predicted(&mut self, _x: &[f32], _x_prev: &[f32], _y_prev: &[f32], _predicted: &[f32]) {}
    /// The step is done.
    fn done(&mut self, _report: &Report) {}
}

impl Watcher for () {}

struct Adapter<'a, W: Watcher> {
    watcher: &'a mut W,
    features: usize,
    dofs: usize,
}

impl<const J: usize, W: Watcher> Observer<J> for Adapter<'_, W> {
    fn query(&mut self, feature: &Feature) {
        self.watcher.query(&feature[..self.features]);
    }
    fn searched(&mut self, class: usize, neighbors: &[Neighbor], mean_distance2: f32) {
        self.watcher.searched(class, neighbors, mean_distance2);
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
/// [`ConfigError`] where the request does not suit the database.
pub fn stream(
    database: &Database<'_>,
    clip: &Clip,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed, ConfigError> {
    let counts = database.counts();
    if counts.joints <= 22 && counts.classes <= 28 && request.config.neighborhood().0 <= 40 {
        run::<22, 40, 28>(database, clip, request, watcher)
    } else {
        run::<{ layout::MAX_JOINTS }, 64, 256>(database, clip, request, watcher)
    }
}

fn run<const J: usize, const K: usize, const C: usize>(
    database: &Database<'_>,
    clip: &Clip,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed, ConfigError> {
    let mut stylizer = Box::new(Stylizer::<J, K, C>::new(*database, request.config)?);
    stylizer.set_style(&request.style)?;
    stylizer.set_action(request.action)?;
    stylizer.set_input_style(request.input_style)?;
    for &group in &request.masked {
        stylizer.set_mask(group, false)?;
    }
    for &(group, strength) in &request.strength {
        stylizer.set_strength(group, strength)?;
    }
    let counts = database.counts();
    let mut output = Pose::<J>::IDENTITY;
    let mut digest = Digest::new();
    let mut steps = Vec::with_capacity(clip.frames.len());
    for frame in &clip.frames {
        let input = to_pose::<J>(frame);
        let mut adapter = Adapter { watcher, features: counts.features, dofs: counts.dofs };
        let start = Instant::now();
        let report = stylizer.step_observed(&input, &mut output, &mut adapter);
        let micros = start.elapsed().as_secs_f64() * 1e6;
        digest.add(&output, counts.joints, report.step_s);
        watcher.done(&report);
        steps.push(Step { frame: from_pose(&output, counts.joints), report, micros });
    }
    Ok(Streamed { steps, digest: digest.value(), ram_bytes: size_of::<Stylizer<'_, J, K, C>>() })
}

/// A frame as the core takes it.
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
    let rotation = |q: &[f32; 4]| {
        let [x, y, z, w] = q.map(f64::from);
        UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
    };
    Frame {
        root: Vector3::new(x, y, z),
        rotations: pose.rotations.iter().take(joints).map(rotation).collect(),
    }
}
