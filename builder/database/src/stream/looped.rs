//! Clips that are loops: their last pose continues with the first.
//!
//! 1. The loop is the whole clip, with or without its first pose repeated at the end, or else the part of it whose ends are
//!    close together, the longer the better ([`Round::find`]).
//! 2. The difference of the ends is spread over the loop. Each round begins where the last one ended, and the stream repeats
//!    the loop until it has settled ([`repeated`]).
//! 3. The last round of the output is kept, and the remaining difference of its ends is spread over it ([`last`]). Its
//!    length is rounded to whole frames by scaling the time step.
//!
//! Place and heading of the ends may differ: a loop with root motion moves on. A turn of less than 15 degrees is
//! removed, as is that of a part of a clip.

use std::fmt;

use gestus_motion::{
    body::{Body, about_y, wrap},
    clip::{Clip, Frame, joint_distance, slerp},
    statistics::{quantile, sorted},
};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::stream::Streamed;

/// Greatest gap between the ends of a loop that can be closed, metres: mean distance of the joints.
const MAX_GAP_M: f64 = 0.06;
/// Greatest distance of the ends of a clip that lacks its last step, relative to that.
const MAX_STEP_RATIO: f64 = 0.6;
/// Distance below which two poses count as the same, metres.
const SAME_POSE_M: f64 = 0.01;
/// Greatest turn of a whole clip that is removed, radians. A clip that turns further keeps turning.
const MAX_REMOVED_TURN_RAD: f64 = 0.26;
/// Weight of a turn in the search of a loop: metres of distance for a radian.
const TURN_WEIGHT_M: f64 = 0.1;
/// Penalty of a very short loop relative to the whole clip in the search, metres of distance.
const LENGTH_WEIGHT_M: f64 = 0.03;
/// How far the body has to move between the ends of a loop, relative to the mean distance of any two poses of the clip:
/// a pose that is held does not come back.
const MIN_MOVED_RATIO: f64 = 0.5;
/// Greatest gap between the ends relative to that: a slow body that is still near its first pose has not come back.
const MAX_GAP_RATIO: f64 = 0.5;
/// Shortest loop, seconds.
const MIN_LOOP_S: f64 = 0.3;
/// Greatest number of poses of a clip that are compared with one another.
const MAX_COMPARED_POSES: usize = 240;
/// Time that a stream takes to settle, seconds.
const SETTLE_S: f64 = 4.0;

/// A clip without a loop.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum LoopError {
    /// Too few frames.
    #[error("--loop: the clip is {seconds:.2} s long, a loop takes {MIN_LOOP_S} s at least")]
    Short {
        /// Length of the clip.
        seconds: f64,
    },
    /// No pose recurs.
    #[error(
        "--loop: no pose of the clip comes back: the two nearest, and those that follow them, are {cm:.1} cm apart (mean of the \
         joints) and face {degrees:.0} degrees apart, which counts as {turn:.1} cm: {limit:.0} cm in all can be closed. Give a \
         clip of a cycle, or leave out --loop",
        turn = degrees.to_radians() * TURN_WEIGHT_M * 100.0,
        limit = MAX_GAP_M * 100.0
    )]
    NoReturn {
        /// Distance of the nearest poses.
        cm: f64,
        /// Angle between their headings.
        degrees: f64,
    },
    /// The body hardly moves between poses that are near.
    #[error(
        "--loop: no pose of the clip comes back: its ends are {cm:.1} cm apart (mean of the joints), and the body moves too \
         little between them, or between any two near poses: give a clip of a cycle, or leave out --loop"
    )]
    Still {
        /// Distance of the clip's ends.
        cm: f64,
    },
}

/// One round of a loop: its first frame and its length in frames of the clip in which it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Round {
    /// The first frame.
    pub start: usize,
    /// Frames from the first pose to its recurrence.
    pub period: usize,
    /// Whether the clip ends one frame before the first pose recurs.
    open: bool,
    /// Whether its turn is removed.
    straight: bool,
    /// Distance of the two ends, centimetres: mean over the joints.
    pub gap_cm: f64,
}

impl fmt::Display for Round {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (first, last) = (self.start + 1, self.start + self.period);
        write!(
            f,
            "The loop is frames {first} to {last} of the clip; its ends are {:.1} cm apart.",
            self.gap_cm
        )
    }
}

/// A rigid motion on the ground: a turn about Y and a shift.
#[derive(Debug, Clone, Copy)]
struct GroundMotion {
    turn: UnitQuaternion<f64>,
    shift: Vector3<f64>,
}

impl GroundMotion {
    /// The motion from one pose to another.
    fn between(body: &Body, from: &Frame, to: &Frame) -> Self {
        let turn = about_y(wrap(body.heading(to) - body.heading(from)));
        let shift = to.root - turn * from.root;
        Self { turn, shift: Vector3::new(shift.x, 0.0, shift.z) }
    }

    fn inverse(&self) -> Self {
        let turn = self.turn.inverse();
        Self { turn, shift: turn * -self.shift }
    }

    fn apply(&self, frame: &Frame) -> Frame {
        let mut frame = frame.clone();
        frame.root = self.turn * frame.root + self.shift;
        frame.rotations[0] = self.turn * frame.rotations[0];
        frame
    }
}

impl Round {
    /// The loop in a clip.
    ///
    /// # Errors
    /// [`LoopError`] if no pose recurs.
    pub fn find(clip: &Clip, body: &Body) -> Result<Self, LoopError> {
        let count = clip.frames.len();
        let least = ((MIN_LOOP_S * clip.rate_hz).ceil() as usize).max(3);
        if count <= least {
            return Err(LoopError::Short { seconds: clip.duration_s() });
        }
        let mut positions: Vec<Vec<Vector3<f64>>> =
            clip.frames.iter().map(|f| body.local_positions(f)).collect();
        // Where the clip would go on to.
        let next = positions[count - 1].iter().zip(&positions[count - 2]).map(|(b, a)| b * 2.0 - a);
        positions.push(next.collect());
        let headings: Vec<f64> = clip.frames.iter().map(|f| body.heading(f)).collect();
        let gap = |a: usize, b: usize| joint_distance(&positions[a], &positions[b]);
        let turn = |a: usize, b: usize| wrap(headings[b] - headings[a]).abs();
        let last = count - 1;
        let steps = sorted((0..last).map(|t| gap(t, t + 1)));
        let step = quantile(&steps, 0.5).unwrap_or(0.0);
        let ends = gap(0, last);
        if ends < SAME_POSE_M.max(0.5 * step) {
            let straight = turn(0, last) < MAX_REMOVED_TURN_RAD;
            return Ok(Self { start: 0, period: last, open: false, straight, gap_cm: 100.0 * ends });
        }
        let stride = count.div_ceil(MAX_COMPARED_POSES);
        let compared = || (0..count).step_by(stride);
        let pairs = compared().flat_map(|a| compared().map(move |b| (a, b)));
        let spread = pairs.map(|(a, b)| gap(a, b)).sum::<f64>() / (compared().count() as f64).powi(2);
        // The clip ends one frame before the first pose recurs. A quick body moves far between two frames.
        let a_step_away = ends < 2.0 * step && gap(0, last - 1) > ends && gap(1, last) > ends;
        if a_step_away && ends < MAX_GAP_M.max(MAX_STEP_RATIO * spread) {
            let straight = turn(0, last) < MAX_REMOVED_TURN_RAD;
            return Ok(Self { start: 0, period: count, open: true, straight, gap_cm: 0.0 });
        }
        // The least cost, the distance of its ends, and its first and last frame.
        let mut best = (f64::INFINITY, f64::INFINITY, 0, 0);
        for start in (0..last - least).step_by(stride) {
            let mut moved = (start..start + least).map(|t| gap(start, t)).fold(0.0, f64::max);
            for end in (start + least..last).step_by(stride).chain([last]) {
                let left = gap(start, end);
                moved = moved.max(left);
                if moved < MIN_MOVED_RATIO * spread || left > MAX_GAP_RATIO * moved {
                    continue;
                }
                // Compares poses and velocities.
                let distance = 0.5 * (left + gap(start + 1, end + 1)) + TURN_WEIGHT_M * turn(start, end);
                let cost = distance + LENGTH_WEIGHT_M * (1.0 - (end - start) as f64 / count as f64);
                if cost < best.0 {
                    best = (cost, distance, start, end);
                }
            }
        }
        let (_, distance, start, end) = best;
        if distance.is_infinite() {
            return Err(LoopError::Still { cm: 100.0 * ends });
        }
        if distance > MAX_GAP_M {
            let turned = turn(start, end);
            let cm = 100.0 * (distance - TURN_WEIGHT_M * turned);
            return Err(LoopError::NoReturn { cm, degrees: turned.to_degrees() });
        }
        let gap_cm = 100.0 * gap(start, end);
        Ok(Self { start, period: end - start, open: false, straight: true, gap_cm })
    }

    /// The round on its body's joints, closed, at another rate: a whole number of frames, and the first pose again.
    pub fn cut(&self, clip: &Clip, body: &Body, rate_hz: f64) -> Clip {
        let mut frames = self.frames(clip);
        let last = frames.len() - 1;
        if self.open {
            frames[last] = self.next(&frames[..last], body);
        }
        self.resampled(clip, close_gap(body, self.straightened(body, frames)), rate_hz)
    }

    /// The same round on other joints. Only the rotations below the root are closed.
    pub fn cut_rotations(&self, clip: &Clip, rate_hz: f64) -> Clip {
        let mut frames = self.frames(clip);
        let (first, last) = (frames[0].clone(), frames.len() - 1);
        let end = frames[last].clone();
        for (k, frame) in frames.iter_mut().enumerate() {
            add_turn_share(
                &mut frame.rotations[1..],
                &end.rotations[1..],
                &first.rotations[1..],
                k as f64 / last as f64,
            );
        }
        self.resampled(clip, frames, rate_hz)
    }

    /// The clip's frames from the first pose to its recurrence, which is the first pose if the clip ends before it.
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

    /// Removes the turn from the frames evenly, from rotations and path, so that the last faces as the first does.
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

    /// The first pose after a round, if the clip ends one frame before: placed by the mean of the last and the first step.
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

/// Repeats a clip that is one round: all rounds, and the first pose of the next one.
pub fn repeated(round: &Clip, body: &Body) -> Clip {
    let last = round.frames.len() - 1;
    let step = GroundMotion::between(body, &round.frames[0], &round.frames[last]);
    let mut frames = Vec::with_capacity(rounds(round) * last + 1);
    let mut now: Vec<Frame> = round.frames[..last].to_vec();
    for _ in 0..rounds(round) {
        frames.extend(now.iter().cloned());
        now.iter_mut().for_each(|frame| *frame = step.apply(frame));
    }
    frames.push(now[0].clone());
    Clip { frames, ..round.clone() }
}

/// Number of rounds of a stream: those in which it settles, and one more.
fn rounds(round: &Clip) -> usize {
    1 + ((SETTLE_S / round.duration_s().max(1e-3)).ceil() as usize).clamp(2, 64)
}

/// Keeps the last round of the output of [`repeated`] and closes it.
pub fn last(streamed: &mut Streamed, found: &Round, round: &Clip, body: &Body) {
    let period = round.frames.len() - 1;
    let from = streamed.steps.len() - 1 - period;
    streamed.steps.drain(..from);
    let frames = streamed.frames();
    let closed = |frames| put_back(close_gap(body, found.straightened(body, frames)), round, body);
    for (step, frame) in streamed.steps.iter_mut().zip(closed(frames)) {
        step.frame = frame;
    }
    streamed.steps[period].report.contacts = streamed.steps[0].report.contacts;
    streamed.steps[period].report.held = streamed.steps[0].report.held;
    // A whole number of frames; the factor guards against rounding down.
    let length = streamed.times()[period] * round.rate_hz;
    let scale = (length.round().max(1.0) / length.max(1e-6)) * (1.0 + 1e-6);
    for step in &mut streamed.steps[1..] {
        step.report.step_s = (f64::from(step.report.step_s) * scale) as f32;
    }
    if let Some(retimed) = &mut streamed.retimed {
        retimed.frames.drain(..from);
        retimed.ticks.drain(..from);
        retimed.frames = closed(std::mem::take(&mut retimed.frames));
    }
}

/// Puts the last round of [`repeated`] to where the first one is: the rounds before moved it, and so did their style.
fn put_back(mut frames: Vec<Frame>, round: &Clip, body: &Body) -> Vec<Frame> {
    let back = GroundMotion::between(body, &round.frames[0], &round.frames[round.frames.len() - 1]).inverse();
    for _ in 1..rounds(round) {
        frames.iter_mut().for_each(|frame| *frame = back.apply(frame));
    }
    let off = beginning(&round.frames) - beginning(&frames);
    frames.iter_mut().for_each(|frame| frame.root += Vector3::new(off.x, 0.0, off.z));
    frames
}

/// Where a round begins, sway left out: the mean place of a body that stays.
fn beginning(frames: &[Frame]) -> Vector3<f64> {
    let last = frames.len() - 1;
    let (first, end) = (frames[0].root, frames[last].root);
    let sway = |(k, frame): (usize, &Frame)| frame.root - first.lerp(&end, k as f64 / last as f64);
    first + frames.iter().enumerate().map(sway).sum::<Vector3<f64>>() / frames.len() as f64
}

/// Closes the gap between the last frame and the first pose, which may be elsewhere: spreads the difference over all frames.
fn close_gap(body: &Body, frames: Vec<Frame>) -> Vec<Frame> {
    let last = frames.len() - 1;
    let end = &frames[last];
    let goal = GroundMotion::between(body, &frames[0], end).apply(&frames[0]);
    let close = |(k, frame): (usize, &Frame)| {
        let share = k as f64 / last as f64;
        let mut frame = frame.clone();
        frame.root += (goal.root - end.root) * share;
        add_turn_share(&mut frame.rotations, &end.rotations, &goal.rotations, share);
        frame
    };
    frames.iter().enumerate().map(close).collect()
}

/// Adds a share, 0 to 1, of the turns from `end` to `goal`.
fn add_turn_share(
    rotations: &mut [UnitQuaternion<f64>],
    end: &[UnitQuaternion<f64>],
    goal: &[UnitQuaternion<f64>],
    share: f64,
) {
    for (rotation, (end, goal)) in rotations.iter_mut().zip(end.iter().zip(goal)) {
        *rotation *= slerp(&UnitQuaternion::identity(), &(end.inverse() * goal), share);
    }
}
