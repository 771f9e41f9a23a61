//! Clips that are loops: their last pose goes over into the first.
//!
//! 1. The loop is the clip, whether or not it repeats its first pose at its end, or else a part of it whose ends are near to
//!    each other, the longer the better ([`Round::find`]).
//! 2. What the ends differ by is spread over the loop, each round begins where and as the last one ended, and the stream
//!    runs through as many rounds as it takes to settle ([`repeated`]).
//! 3. Of the output the last round is kept; what is left between its ends is spread as well ([`last`]). Its length is
//!    rounded to whole frames, by the time step.
//!
//! Place and heading of the ends may differ: a loop with root motion goes on. A turn of less than 15 degrees is none, and is
//! taken out; so is that of a part of a clip.

use gestus_motion::{
    body::{Body, about_y, wrap},
    clip::{Clip, Frame, slerp},
    statistics::{quantile, sorted},
};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::stream::Streamed;

/// Greatest mean distance of the joints of two poses that can be one, metres.
const MEET_M: f64 = 0.06;
/// Poses nearer than this are one, metres.
const SAME_M: f64 = 0.01;
/// Turn of a clip that is a loop which is taken out, radians; what turns further goes on turning.
const STRAIGHT: f64 = 0.26;
/// What a turn counts for in the search of a loop, metres of distance for a radian.
const TURN_M: f64 = 0.1;
/// What a loop counts for that is no longer than nothing, against one that is the whole clip, metres of distance.
const LENGTH_M: f64 = 0.03;
/// Shortest loop, seconds.
const SHORTEST_S: f64 = 0.3;
/// Most poses of a clip that are compared with one another.
const COMPARED: usize = 240;
/// Seconds that a stream takes to settle.
const SETTLED_S: f64 = 4.0;

/// A clip without a loop.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LoopError {
    /// Too few frames.
    #[error("--loop: the clip is {seconds:.2} s long, a loop takes {SHORTEST_S} s at least")]
    Short {
        /// Length of the clip.
        seconds: f64,
    },
    /// Poses that do not come back.
    #[error(
        "--loop: no pose of the clip comes back: the two nearest are {cm:.1} cm apart (mean of the joints), and {limit:.0} cm \
         can be closed: give a clip of a cycle, or leave out --loop",
        limit = MEET_M * 100.0
    )]
    NoReturn {
        /// Distance of the nearest poses.
        cm: f64,
    },
}

/// One round of a loop: its first frame and its length in frames of the clip in which it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// The first frame.
    pub start: usize,
    /// Frames from the first pose to where it comes back.
    pub period: usize,
    /// Whether the pose that comes back is left out at the clip's end.
    open: bool,
    /// Whether its turn is taken out.
    straight: bool,
    /// Distance of the two ends, centimetres, mean of the joints.
    pub gap_cm: f64,
}

/// A turn about Y and a way on the ground.
#[derive(Debug, Clone, Copy)]
struct Step {
    turn: UnitQuaternion<f64>,
    way: Vector3<f64>,
}

impl Step {
    /// The step from one pose to another.
    fn between(body: &Body, from: &Frame, to: &Frame) -> Self {
        let turn = about_y(wrap(body.heading(to) - body.heading(from)));
        let way = to.root - turn * from.root;
        Self { turn, way: Vector3::new(way.x, 0.0, way.z) }
    }

    fn apply(&self, frame: &Frame) -> Frame {
        let mut frame = frame.clone();
        frame.root = self.turn * frame.root + self.way;
        frame.rotations[0] = self.turn * frame.rotations[0];
        frame
    }
}

impl Round {
    /// The loop in a clip.
    ///
    /// # Errors
    /// [`LoopError`] where no pose comes back.
    pub fn find(clip: &Clip, body: &Body) -> Result<Self, LoopError> {
        let count = clip.frames.len();
        let least = ((SHORTEST_S * clip.rate_hz).ceil() as usize).max(3);
        if count <= least {
            return Err(LoopError::Short { seconds: clip.duration_s() });
        }
        let shapes: Vec<Vec<Vector3<f64>>> = clip.frames.iter().map(|f| shape(body, f)).collect();
        let headings: Vec<f64> = clip.frames.iter().map(|f| body.heading(f)).collect();
        let gap = |a: usize, b: usize| apart(&shapes[a], &shapes[b]);
        let turn = |a: usize, b: usize| wrap(headings[b] - headings[a]).abs();
        let last = count - 1;
        let steps = sorted((0..last).map(|t| gap(t, t + 1)));
        let step = quantile(&steps, 0.5).unwrap_or(0.0);
        let ends = gap(0, last);
        if ends < SAME_M.max(0.5 * step) {
            let straight = turn(0, last) < STRAIGHT;
            return Ok(Self { start: 0, period: last, open: false, straight, gap_cm: 100.0 * ends });
        }
        // One step before it comes back.
        if ends < (2.0 * step).min(MEET_M) && gap(0, last - 1) > ends && gap(1, last) > ends {
            let straight = turn(0, last) < STRAIGHT;
            return Ok(Self { start: 0, period: count, open: true, straight, gap_cm: 0.0 });
        }
        let stride = count.div_ceil(COMPARED);
        // Its cost, and that of its ends alone.
        let mut best = (f64::INFINITY, f64::INFINITY, 0, 0);
        for start in (0..last - least).step_by(stride) {
            for end in (start + least..last).step_by(stride) {
                // As they are and as they move.
                let distance = 0.5 * (gap(start, end) + gap(start + 1, end + 1)) + TURN_M * turn(start, end);
                let cost = distance + LENGTH_M * (1.0 - (end - start) as f64 / count as f64);
                if cost < best.0 {
                    best = (cost, distance, start, end);
                }
            }
        }
        let (_, distance, start, end) = best;
        if distance > MEET_M {
            return Err(LoopError::NoReturn { cm: 100.0 * distance.min(ends) });
        }
        let gap_cm = 100.0 * gap(start, end);
        Ok(Self { start, period: end - start, open: false, straight: true, gap_cm })
    }

    /// The round on the joints of its body, closed, at another rate: a whole number of frames and the first pose again.
    pub fn cut(&self, clip: &Clip, body: &Body, rate_hz: f64) -> Clip {
        let mut frames = self.frames(clip);
        let last = frames.len() - 1;
        if self.open {
            frames[last] = self.next(&frames[..last], body);
        }
        self.resampled(clip, closed(body, self.straightened(body, frames)), rate_hz)
    }

    /// The same round on other joints, of which only the rotations below the root are closed.
    pub fn cut_rotations(&self, clip: &Clip, rate_hz: f64) -> Clip {
        let mut frames = self.frames(clip);
        let (first, last) = (frames[0].clone(), frames.len() - 1);
        let end = frames[last].clone();
        for (k, frame) in frames.iter_mut().enumerate() {
            spread(
                &mut frame.rotations[1..],
                &end.rotations[1..],
                &first.rotations[1..],
                k as f64 / last as f64,
            );
        }
        self.resampled(clip, frames, rate_hz)
    }

    /// The clip's frames from the first pose to where it comes back, or the first in its place.
    fn frames(&self, clip: &Clip) -> Vec<Frame> {
        let mut frames: Vec<Frame> =
            clip.frames.iter().skip(self.start).take(self.period + 1).cloned().collect();
        if self.open {
            frames.push(frames[0].clone());
        }
        frames
    }

    fn resampled(&self, clip: &Clip, frames: Vec<Frame>, rate_hz: f64) -> Clip {
        let count = ((self.period as f64 / clip.rate_hz * rate_hz).round() as usize).max(2);
        let whole = Clip { frames, ..clip.clone() };
        let frames = (0..=count).map(|k| whole.at(k as f64 * self.period as f64 / count as f64)).collect();
        Clip { frames, rate_hz, ..whole }
    }

    /// Frames whose last one faces as the first does: the turn is taken out evenly, of the way too.
    fn straightened(&self, body: &Body, mut frames: Vec<Frame>) -> Vec<Frame> {
        if !self.straight {
            return frames;
        }
        let last = frames.len() - 1;
        let turned = wrap(body.heading(&frames[last]) - body.heading(&frames[0]));
        let (mut before, mut root) = (frames[0].root, frames[0].root);
        for (k, frame) in frames.iter_mut().enumerate() {
            let back = about_y(-turned * k as f64 / last as f64);
            root += back * (frame.root - before);
            before = frame.root;
            frame.root = root;
            frame.rotations[0] = back * frame.rotations[0];
        }
        frames
    }

    /// Where the first pose is after a round, if the clip ends one frame earlier: as far from its last frame as the mean of
    /// its last and first steps.
    fn next(&self, frames: &[Frame], body: &Body) -> Frame {
        let last = frames.len() - 1;
        let local = |a: &Frame, b: &Frame| {
            let heading = body.heading(a);
            (wrap(body.heading(b) - heading), about_y(-heading) * (b.root - a.root))
        };
        let (first, end) = (local(&frames[0], &frames[1]), local(&frames[last - 1], &frames[last]));
        let heading = body.heading(&frames[last]);
        let root = frames[last].root + about_y(heading) * (first.1 + end.1) * 0.5;
        let turn = about_y(heading + 0.5 * (first.0 + end.0) - body.heading(&frames[0]));
        let mut next = frames[0].clone();
        next.root = Vector3::new(root.x, next.root.y, root.z);
        next.rotations[0] = turn * next.rotations[0];
        next
    }
}

/// A clip that is one round, run through again and again: all rounds, with the first pose of the next one at the end.
pub fn repeated(round: &Clip, body: &Body) -> Clip {
    let last = round.frames.len() - 1;
    let step = Step::between(body, &round.frames[0], &round.frames[last]);
    let mut frames = Vec::with_capacity(rounds(round) * last + 1);
    let mut now: Vec<Frame> = round.frames[..last].to_vec();
    for _ in 0..rounds(round) {
        frames.extend(now.iter().cloned());
        now.iter_mut().for_each(|frame| *frame = step.apply(frame));
    }
    frames.push(now[0].clone());
    Clip { frames, ..round.clone() }
}

/// Rounds that a stream runs through: those in which it settles, and the last.
fn rounds(round: &Clip) -> usize {
    1 + ((SETTLED_S / round.duration_s().max(1e-3)).ceil() as usize).clamp(2, 64)
}

/// Keeps the last round of the output of [`repeated`] and closes it.
pub fn last(streamed: &mut Streamed, found: &Round, round: &Clip, body: &Body) {
    let period = round.frames.len() - 1;
    let from = streamed.steps.len() - 1 - period;
    streamed.steps.drain(..from);
    let frames = streamed.frames();
    for (step, frame) in streamed.steps.iter_mut().zip(closed(body, found.straightened(body, frames))) {
        step.frame = frame;
    }
    streamed.steps[period].report.contacts = streamed.steps[0].report.contacts;
    streamed.steps[period].report.held = streamed.steps[0].report.held;
    // A whole number of frames, and a hair more than less.
    let length = streamed.times()[period] * round.rate_hz;
    let scale = (length.round().max(1.0) / length.max(1e-6)) * (1.0 + 1e-6);
    for step in &mut streamed.steps[1..] {
        step.report.step_s = (f64::from(step.report.step_s) * scale) as f32;
    }
    if let Some(retimed) = &mut streamed.retimed {
        retimed.frames.drain(..from);
        retimed.ticks.drain(..from);
        retimed.frames = closed(body, found.straightened(body, retimed.frames.clone()));
    }
}

/// Frames of which the last is the first pose again, elsewhere: the difference is spread over all.
fn closed(body: &Body, frames: Vec<Frame>) -> Vec<Frame> {
    let last = frames.len() - 1;
    let end = &frames[last];
    let goal = Step::between(body, &frames[0], end).apply(&frames[0]);
    let close = |(k, frame): (usize, &Frame)| {
        let share = k as f64 / last as f64;
        let mut frame = frame.clone();
        frame.root += (goal.root - end.root) * share;
        spread(&mut frame.rotations, &end.rotations, &goal.rotations, share);
        frame
    };
    frames.iter().enumerate().map(close).collect()
}

/// Adds a share of the turns from `end` to `goal`.
fn spread(
    rotations: &mut [UnitQuaternion<f64>],
    end: &[UnitQuaternion<f64>],
    goal: &[UnitQuaternion<f64>],
    share: f64,
) {
    for (rotation, (end, goal)) in rotations.iter_mut().zip(end.iter().zip(goal)) {
        *rotation *= slerp(&UnitQuaternion::identity(), &(end.inverse() * goal), share);
    }
}

/// Places of the joints over the ground below the root, as the body sees them.
fn shape(body: &Body, frame: &Frame) -> Vec<Vector3<f64>> {
    let turn = about_y(-body.heading(frame));
    let ground = Vector3::new(frame.root.x, 0.0, frame.root.z);
    frame.positions(&body.skeleton).into_iter().map(|p| turn * (p - ground)).collect()
}

/// Mean distance of the joints of two shapes, metres.
fn apart(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    a.iter().zip(b).map(|(p, q)| (p - q).norm()).sum::<f64>() / a.len().max(1) as f64
}
