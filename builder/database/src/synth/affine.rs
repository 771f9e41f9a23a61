//! Exact pairs by rule: every output is an affine map of its input, dof by dof, on a warped timeline.
//!
//! With dofs `x` (rotation vectors relative to the mean rotations, [`Body`]) the output of a frame is
//!
//! ```text
//! y_d = a_d x_d + b_d          dw/dt = tempo (1 + bend cos(2π phase + shift))
//! ```
//!
//! with `a`, `b` drawn for each dof from the seed, and `w` the output's time. Ground velocities are scaled as
//! distances, yaw rates are kept. So the exact output of every input frame is known: its pose, its time and its time step.
//! Captured pairs have no such truth. The outputs are for measurement only: feet do not stay on the floor. Cost: one pass
//! over the frames.

use rand::Rng;

use crate::synth::noise::{normal, rng};
use gestus_core::blob::layout::dof;
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame, interpolate},
    corpus::{Corpus, Cycle, Example},
    landmarks::LandmarkError,
};

/// Knots of an output cycle: enough for a smooth warp to be linear between two.
const KNOTS: usize = 25;

/// Options: the size of the differences between outputs and inputs.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Seed of all random numbers.
    pub seed: u64,
    /// Name of the style of the outputs.
    pub style: String,
    /// Standard deviation of the scales around 1.
    pub scale: f64,
    /// Standard deviation of the offsets, radians.
    pub offset: f64,
    /// Mean output seconds for each input second.
    pub tempo: f64,
    /// Share by which tempo rises and falls in each cycle; below 1.
    pub bend: f64,
}

impl Default for Options {
    fn default() -> Self {
        let style = "affine".to_owned();
        Self { seed: 1, style, scale: 0.2, offset: 0.12, tempo: 1.15, bend: 0.25 }
    }
}

/// The map: a scale and an offset for each dof.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    /// Scales, shape `[D]`.
    pub scales: Vec<f64>,
    /// Offsets in radians, metres for the height. Shape `[D]`.
    pub offsets: Vec<f64>,
}

impl Map {
    /// A random map for a body.
    pub fn new(body: &Body, options: &Options) -> Self {
        let mut rng = rng(options.seed, 5);
        let dofs = body.dofs();
        let mut scales: Vec<f64> =
            (0..dofs).map(|_| (1.0 + options.scale * normal(&mut rng)).max(0.2)).collect();
        let mut offsets: Vec<f64> = (0..dofs).map(|_| options.offset * normal(&mut rng)).collect();
        // The heading is that of the hips line: what would turn it stays. A turn is a turn in every style.
        for d in [dof::TILT + 1, dof::TILT + 2, dof::YAW] {
            (scales[d], offsets[d]) = (1.0, 0.0);
        }
        for d in [dof::FORWARD, dof::LEFT] {
            offsets[d] = 0.0;
        }
        (scales[dof::HEIGHT], offsets[dof::HEIGHT]) = (1.0, 0.2 * offsets[dof::HEIGHT]);
        Self { scales, offsets }
    }

    /// The map of a frame's dofs.
    pub fn apply(&self, dofs: &[f64]) -> Vec<f64> {
        dofs.iter().zip(&self.scales).zip(&self.offsets).map(|((x, a), b)| a * x + b).collect()
    }
}

/// The exact output of every frame of an input clip.
#[derive(Debug, Clone)]
pub struct Answer {
    /// The pose, frame by frame of the input.
    pub frames: Vec<Frame>,
    /// Position of each input frame in the output clip, in frames; ascending from 0. Shape `[frames]`.
    pub positions: Vec<f64>,
    /// Output seconds from the frame before; those of the first frame are those of the second. Shape `[frames]`.
    pub steps_s: Vec<f64>,
}

/// Inputs and outputs with the truth about them.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// The inputs, then as many outputs in the style of the options, in the same order.
    pub corpus: Corpus,
    /// The exact outputs of the inputs.
    pub answers: Vec<Answer>,
    /// The body that the map is relative to: means over the inputs.
    pub body: Body,
    /// The map.
    pub map: Map,
}

/// Gives every clip of a style its exact output.
///
/// # Errors
/// [`LandmarkError`] if no legs are found in the skeleton.
pub fn pairs(corpus: &Corpus, style: usize, options: &Options) -> Result<Pairs, LandmarkError> {
    let inputs: Vec<Example> = corpus
        .examples
        .iter()
        .filter(|e| e.style == style)
        .map(|e| Example { style: 0, ..e.clone() })
        .collect();
    let name = corpus.styles.get(style).cloned().unwrap_or_default();
    let mut paired =
        Corpus { styles: vec![name, options.style.clone()], examples: inputs.clone(), ..corpus.clone() };
    let body = Body::of(&paired)?;
    let map = Map::new(&body, options);
    let shift = std::f64::consts::TAU * rng(options.seed, 6).random::<f64>();
    let mut answers = Vec::with_capacity(inputs.len());
    for input in &inputs {
        let answer = answer(input, &body, &map, options, shift);
        paired.examples.push(output(input, &answer, &options.style));
        answers.push(answer);
    }
    Ok(Pairs { corpus: paired, answers, body, map })
}

fn answer(input: &Example, body: &Body, map: &Map, options: &Options, shift: f64) -> Answer {
    let rate_hz = input.clip.rate_hz;
    let dofs = body.clip_dofs(&input.clip);
    let bend = options.bend.clamp(0.0, 0.9);
    let slope = |position: f64| {
        let phase = std::f64::consts::TAU * phase(&input.cycles, position);
        options.tempo * (1.0 + bend * (phase + shift).cos())
    };
    let (mut ground, mut heading) = ([0.0, 0.0], 0.0);
    if let Some(first) = input.clip.frames.first() {
        (ground, heading) = ([first.root.x, first.root.z], body.heading(first));
    }
    let mut answer = Answer { frames: Vec::new(), positions: Vec::new(), steps_s: Vec::new() };
    let mut position = 0.0;
    for (i, x) in dofs.iter().enumerate() {
        let y = map.apply(x);
        let step = slope((i.max(1) as f64) - 0.5);
        if i > 0 {
            position += step;
            let moved =
                about_y(heading) * nalgebra::Vector3::new(y[dof::LEFT], 0.0, y[dof::FORWARD]) / rate_hz;
            ground = [ground[0] + moved.x, ground[1] + moved.z];
            heading += y[dof::YAW] / rate_hz;
        }
        // The map may turn the hips line a little: the pose is turned back, so that velocities stay exact.
        let turned = body.heading(&body.pose(&y, ground, 0.0));
        answer.frames.push(body.pose(&y, ground, heading - turned));
        answer.positions.push(position);
        answer.steps_s.push(step / rate_hz);
    }
    answer
}

/// Phase of a frame within its cycle; the first and the last cycle are extrapolated.
fn phase(cycles: &[Cycle], position: f64) -> f64 {
    let started = cycles.iter().take_while(|c| c.span().0 <= position).count();
    cycles.get(started.saturating_sub(1)).map_or(0.0, |c| c.phase(position))
}

/// The output clip at the frame rate, with the contacts and cycles of the input.
fn output(input: &Example, answer: &Answer, style: &str) -> Example {
    let last = answer.frames.len().saturating_sub(1);
    let count = answer.positions.last().map_or(0, |&p| p as usize + 1);
    let mut frames = Vec::with_capacity(count);
    let mut contacts = Vec::with_capacity(count);
    for j in 0..count {
        let after = answer.positions.iter().take_while(|&&p| p <= j as f64).count().min(last).max(1);
        let (i, next) = (after - 1, after.min(last));
        let span = answer.positions[next] - answer.positions[i];
        let t = if span > 0.0 { ((j as f64 - answer.positions[i]) / span).clamp(0.0, 1.0) } else { 0.0 };
        frames.push(interpolate(&answer.frames[i], &answer.frames[next], t));
        contacts.push(input.contacts[if t < 0.5 { i } else { next }]);
    }
    let at = |position: f64| {
        // Cycles may reach a little beyond the frames: go on with the outer slopes.
        let i = (position.max(0.0) as usize).min(last.saturating_sub(1));
        let slope = answer.positions[(i + 1).min(last)] - answer.positions[i];
        answer.positions[i] + (position - i as f64) * slope
    };
    let cycles = input.cycles.iter().map(|cycle| {
        let knots = (0..KNOTS).map(|k| at(cycle.position(k as f64 / (KNOTS - 1) as f64)));
        Cycle { knots: knots.collect() }
    });
    let clip = Clip { name: format!("{}_{style}", input.clip.name), frames, ..input.clip.clone() };
    Example { clip, style: 1, contacts, cycles: cycles.collect(), ..input.clone() }
}
