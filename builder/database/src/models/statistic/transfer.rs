//! Transfers the style of one clip to another, for whole clips.
//!
//! 1. Iterative motion warping finds corresponding frames (section 4): the shorter clip is warped onto the longer.
//! 2. Mean and standard deviation of every joint are computed over the warped clips. The source's rotations are rotated by
//!    `q̄_s⁻¹ q̄_r` and scaled about `q̄_r` by `σ_r / σ_s` (section 5.4, eq. 7). The root's translation from frame to frame
//!    is scaled component by component (eq. 4), its yaw is kept (section 5.2).
//! 3. The warp is undone by slerp (section 6): the result has the source's timing.
//!
//! The map of step 2 is the same for every frame, so the warp and its inverse cancel except for interpolation errors. Only
//! the weights of the frames in the statistics depend on the warp. By default frames are weighted and mapped in place;
//! [`Options::literal`] warps the clips, and `evaluate transfer` compares the two. Euler angles are always warped.
//!
//! Then foot skate is cleaned up (section 6, [`crate::stream::cleanup`]) with the source's contacts, unless
//! [`Options::clean_up`] is off. Plants that the result does not have, as those of a walk that became a run, are let go.
//!
//! Cost: the warp, and two slerps per joint and frame.

use std::time::Instant;

use gestus_core::{
    blob::layout::dof,
    math::quaternion::{self, Quaternion},
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::models::{
    numbers::narrow,
    statistic::{
        euler,
        mean::{self, MAX_SCALE, Spread},
    },
};
use crate::{
    registration::{
        contact,
        floor::{self, Supports},
        warp::{
            self, Warp, WarpError,
            imw::{Config, imw},
        },
    },
    stream::{
        cleanup::{self, Limbs},
        footplants::Footplants,
        turn_limit::{FASTER, fastest, limited},
    },
};
use gestus_motion::{
    body::{Body, about_y, row_at},
    clip::{Clip, Frame},
    statistics::moments,
};

/// Clips whose lengths differ by a larger factor are resampled before warping, since the slope limit is two.
const NEAR: f64 = 1.8;

/// Options of a transfer.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Rounds from the recursive mean towards the geodesic one; 0: the paper's own.
    pub rounds: usize,
    /// Euler angles instead of quaternions: the variant that the paper holds against its own.
    pub euler: bool,
    /// Set frames into correspondence before statistics are taken.
    pub warp: bool,
    /// Take the clips through the warp and back, frame by frame.
    pub literal: bool,
    /// Take foot skate out at the end.
    pub clean_up: bool,
    /// Height of the source's floor, metres; found where not given.
    pub floor_m: Option<f64>,
}

impl Default for Options {
    fn default() -> Self {
        Self { rounds: 0, euler: false, warp: true, literal: false, clean_up: true, floor_m: None }
    }
}

/// Result of a transfer.
#[derive(Debug, Clone)]
pub struct Transferred {
    /// The clip, at the source's time.
    pub clip: Clip,
    /// Which foot stands: as in the source, less what the clean-up let go. Shape `[frames]`.
    pub contacts: Vec<[bool; 2]>,
    /// The source's footplants, and how many the clean-up let go; none without a clean-up.
    pub footplants: Footplants,
    /// Height of the source's floor, metres.
    pub floor_m: f64,
    /// Milliseconds that the correspondence took.
    pub warp_ms: f64,
    /// Milliseconds that statistics and transfer took.
    pub transfer_ms: f64,
    /// Milliseconds that the removal of foot skate took.
    pub clean_up_ms: f64,
}

/// Gives `source` the style of `reference`; both on the body's skeleton, and at one rate.
///
/// # Errors
/// [`WarpError`] if a clip has no frames.
pub fn transfer(
    body: &Body,
    source: &Clip,
    reference: &Clip,
    options: &Options,
) -> Result<Transferred, WarpError> {
    if source.frames.is_empty() || reference.frames.is_empty() {
        return Err(WarpError::Empty);
    }
    // Heights are compared over the floors.
    let floor_of = |clip: &Clip| floor::find(clip, &Supports::of_landmarks(clip, &body.landmarks)).height_m;
    let floor_m = options.floor_m.unwrap_or_else(|| floor_of(source));
    let (source, reference) = (&raised(source, -floor_m), &raised(reference, -floor_of(reference)));
    let (x, y) = (body.clip_dofs(source), body.clip_dofs(reference));
    let start = Instant::now();
    let (own, other) = if options.warp { correspond(&x, &y)? } else { straight(x.len(), y.len()) };
    let warp_ms = start.elapsed().as_secs_f64() * 1e3;

    let start = Instant::now();
    let headings: Vec<f64> = source.frames.iter().map(|f| body.heading(f)).collect();
    let (u, v) = (Turns::with(&headings, source), Turns::of(body, reference));
    let joints = body.skeleton.joints();
    let rotations: Vec<Vec<Quaternion>> = if options.literal || options.euler {
        let one = |j: usize| {
            let (a, b) = (u.warped(j, &own), v.warped(j, &other));
            let moved = if options.euler {
                euler::moved(&a, &b)
            } else {
                let map = Map::of(&spread(&a, options), &spread(&b, options));
                a.iter().map(|&q| map.apply(q)).collect()
            };
            back(&moved, &own, source.frames.len())
        };
        let by_joint: Vec<Vec<Quaternion>> = (0..joints).map(one).collect();
        (0..source.frames.len()).map(|t| by_joint.iter().map(|r| r[t]).collect()).collect()
    } else {
        let from = mean::spreads(&u.frames, &weights(&own, source.frames.len()), options.rounds);
        let to = mean::spreads(&v.frames, &weights(&other, reference.frames.len()), options.rounds);
        let maps: Vec<Map> = from.iter().zip(&to).map(|(a, b)| Map::of(a, b)).collect();
        u.frames.iter().map(|f| f.iter().zip(&maps).map(|(&q, map)| map.apply(q)).collect()).collect()
    };
    let root = root(&x, &y, &own, &other);
    let mut ground = source.frames[0].root;
    let mut frames = Vec::with_capacity(source.frames.len());
    for (t, &[height, forward, left]) in root.iter().enumerate() {
        if t > 0 {
            ground += about_y(headings[t - 1]) * Vector3::new(left, 0.0, forward) / source.rate_hz;
        }
        let mut turns: Vec<UnitQuaternion<f64>> = rotations[t].iter().map(|&q| wide(q)).collect();
        turns[0] = about_y(headings[t]) * turns[0];
        frames.push(Frame { root: Vector3::new(ground.x, height, ground.z), rotations: turns });
    }
    let transfer_ms = start.elapsed().as_secs_f64() * 1e3;
    let start = Instant::now();
    let mut contacts = contact::contacts(source, &body.landmarks);
    let mut footplants = Footplants::default();
    if let Some((limbs, stands)) = Limbs::of_clip(body, source).filter(|_| options.clean_up) {
        let window = (cleanup::WINDOW_S * source.rate_hz) as usize;
        let cleaned = cleanup::clean(&limbs, &frames, &stands, window, source.rate_hz);
        (frames, contacts, footplants) = (cleaned.frames, cleaned.stands, cleaned.footplants);
        let fastest_turn = fastest(&source.frames).max(fastest(&reference.frames));
        let limit = FASTER * fastest_turn;
        frames = limited(Clip { frames, ..source.clone() }, limit, &Vector3::y(), false).frames;
    }
    let clean_up_ms = start.elapsed().as_secs_f64() * 1e3;
    let clip = raised(&Clip { frames, ..source.clone() }, floor_m);
    Ok(Transferred { clip, contacts, footplants, floor_m, warp_ms, transfer_ms, clean_up_ms })
}

/// A clip lifted by a height.
fn raised(clip: &Clip, by_m: f64) -> Clip {
    let mut clip = clip.clone();
    clip.frames.iter_mut().for_each(|frame| frame.root.y += by_m);
    clip
}

/// Greatest distance of the recursive means of a clip's joints from the geodesic means, radians.
pub fn mean_offset(body: &Body, clip: &Clip) -> f64 {
    let turns = Turns::of(body, clip);
    let offset = |j: usize| {
        let all = turns.joint(j);
        let recursive = mean::recursive(all.iter().copied());
        f64::from(quaternion::angle(recursive, mean::geodesic(recursive, all.iter().copied(), 8)))
    };
    (0..body.skeleton.joints()).map(offset).fold(0.0, f64::max)
}

fn spread(rotations: &[Quaternion], options: &Options) -> Spread {
    mean::spread(rotations.iter().copied(), options.rounds)
}

/// The map of a joint: aligns the mean and scales the deviation.
struct Map {
    turn: Quaternion,
    mean: Quaternion,
    scale: f32,
}

impl Map {
    fn of(from: &Spread, to: &Spread) -> Self {
        let turn = quaternion::multiply(quaternion::conjugate(from.mean), to.mean);
        Self { turn, mean: to.mean, scale: (to.deviation / from.deviation).min(MAX_SCALE) }
    }

    fn apply(&self, q: Quaternion) -> Quaternion {
        mean::near_slerp(self.scale, self.mean, quaternion::multiply(q, self.turn))
    }
}

/// Weight of each frame: the number of positions at it; a position between two frames counts for both in part.
fn weights(positions: &[f64], frames: usize) -> Vec<f32> {
    let mut weights = vec![0.0; frames];
    for &p in positions {
        let i = (p.max(0.0) as usize).min(frames - 1);
        let t = (p - i as f64).clamp(0.0, 1.0) as f32;
        weights[i] += 1.0 - t;
        weights[(i + 1).min(frames - 1)] += t;
    }
    weights
}

/// Rotations of a clip as the core has them; the root's without its heading. Shape `[frames][joints]`.
struct Turns {
    frames: Vec<Vec<Quaternion>>,
}

impl Turns {
    fn of(body: &Body, clip: &Clip) -> Self {
        let headings: Vec<f64> = clip.frames.iter().map(|f| body.heading(f)).collect();
        Self::with(&headings, clip)
    }

    /// The same, of a clip whose headings are known.
    fn with(headings: &[f64], clip: &Clip) -> Self {
        let frame = |(f, heading): (&Frame, &f64)| {
            let mut all: Vec<Quaternion> = f.rotations.iter().map(narrow).collect();
            all[0] = narrow(&(about_y(-heading) * f.rotations[0]));
            all
        };
        Self { frames: clip.frames.iter().zip(headings).map(frame).collect() }
    }

    fn joint(&self, joint: usize) -> Vec<Quaternion> {
        self.frames.iter().map(|f| f[joint]).collect()
    }

    /// Rotations of a joint at positions of the clip.
    fn warped(&self, joint: usize, positions: &[f64]) -> Vec<Quaternion> {
        let all = self.joint(joint);
        positions.iter().map(|&p| at(&all, p)).collect()
    }
}

/// The rotation at a fractional frame index.
fn at(rotations: &[Quaternion], position: f64) -> Quaternion {
    let last = rotations.len() - 1;
    let i = (position.max(0.0) as usize).min(last);
    let t = (position - i as f64) as f32;
    if t < 1e-6 || i == last { rotations[i] } else { quaternion::slerp(t, rotations[i], rotations[i + 1]) }
}

/// Undoes the warp: rotations at `positions` of a clip, interpolated at its frames.
fn back(rotations: &[Quaternion], positions: &[f64], frames: usize) -> Vec<Quaternion> {
    inverse(positions, frames).into_iter().map(|position| at(rotations, position)).collect()
}

/// Height, forward and left velocity of every frame, scaled component by component (eq. 4).
fn root(x: &[Vec<f64>], y: &[Vec<f64>], own: &[f64], other: &[f64]) -> Vec<[f64; 3]> {
    let numbers = [dof::HEIGHT, dof::FORWARD, dof::LEFT].map(|d| {
        let at = |rows: &[Vec<f64>], positions: &[f64]| -> Vec<f64> {
            let one = |&p: &f64| {
                let i = (p.max(0.0) as usize).min(rows.len() - 1);
                let next = rows[(i + 1).min(rows.len() - 1)][d];
                rows[i][d] + (p - i as f64) * (next - rows[i][d])
            };
            positions.iter().map(one).collect()
        };
        let (from, from_sd) = moments(at(x, own).into_iter(), 1e-3);
        let (to, to_sd) = moments(at(y, other).into_iter(), 1e-3);
        let scale = (to_sd / from_sd).min(f64::from(MAX_SCALE));
        x.iter().map(|row| to + scale * (row[d] - from)).collect::<Vec<f64>>()
    });
    (0..x.len()).map(|t| [0, 1, 2].map(|k| numbers[k][t])).collect()
}

/// Corresponding positions in both clips, as many as the longer has frames.
fn correspond(x: &[Vec<f64>], y: &[Vec<f64>]) -> Result<(Vec<f64>, Vec<f64>), WarpError> {
    if x.len() > y.len() {
        let (other, own) = correspond(y, x)?;
        return Ok((own, other));
    }
    let [count, most] = warped(x.len(), y.len());
    let (u, v) = moving(&thinned(x, count), &thinned(y, most));
    let config = Config { tolerance: 3e-3, ..Config::default() };
    let warp = imw(&u, &v, &config)?.warp;
    let own = Warp { positions: inverse(&warp.positions, most) }.stretched(y.len(), count, x.len());
    Ok((own.positions, (0..y.len()).map(|k| k as f64).collect()))
}

/// Number of frames of a shorter and a longer clip for warping: the shorter one is lengthened if the slope limit requires
/// it.
fn warped(x: usize, y: usize) -> [usize; 2] {
    let most = y.min(warp::MAX_FRAMES);
    let near = (y as f64) < NEAR * x as f64;
    [if near { (x * most).div_ceil(y) } else { most }, most]
}

/// Rows for a warp, evenly spaced from the first to the last.
fn thinned(rows: &[Vec<f64>], count: usize) -> Vec<Vec<f64>> {
    let [last, end] = [rows.len() - 1, count.max(2) - 1].map(|n| n as f64);
    (0..count).map(|k| warp::shape(&row_at(rows, last * k as f64 / end))).collect()
}

/// Both motions standardised, without dofs that are constant in both.
fn moving(u: &[Vec<f64>], v: &[Vec<f64>]) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let deviation = |m: &[Vec<f64>], d: usize| moments(m.iter().map(move |r| r[d]), 0.0).1;
    let dofs = u.first().map_or(0, Vec::len);
    let mut kept: Vec<usize> =
        (0..dofs).filter(|&d| deviation(u, d).max(deviation(v, d)) >= warp::STILL).collect();
    if kept.is_empty() {
        kept = (0..dofs).collect();
    }
    let pick = |m: &[Vec<f64>]| -> Vec<Vec<f64>> {
        m.iter().map(|r| kept.iter().map(|&d| r[d]).collect()).collect()
    };
    warp::standardised(&pick(u), &pick(v))
}

/// Where in ascending positions each of the first frames lies.
fn inverse(positions: &[f64], frames: usize) -> Vec<f64> {
    let mut i = 0;
    (0..frames)
        .map(|j| {
            let j = j as f64;
            while i + 2 < positions.len() && positions[i + 1] <= j {
                i += 1;
            }
            let next = (i + 1).min(positions.len() - 1);
            let span = positions[next] - positions[i];
            i as f64 + if span > 0.0 { ((j - positions[i]) / span).clamp(0.0, 1.0) } else { 0.0 }
        })
        .collect()
}

fn straight(own: usize, other: usize) -> (Vec<f64>, Vec<f64>) {
    let all = |n: usize| (0..n).map(|k| k as f64).collect();
    (all(own), all(other))
}

fn wide(q: Quaternion) -> UnitQuaternion<f64> {
    let [x, y, z, w] = q.map(f64::from);
    // Of unit length already, but for the rounding of f32.
    UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z))
}

#[cfg(test)]
mod tests;
