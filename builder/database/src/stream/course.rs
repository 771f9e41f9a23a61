//! Bodies that walk in place: their path over the ground is found from their feet, and removed from the output again.
//!
//! A standing foot does not move. If it does, and the hips do not, the body is held in place and walks in the opposite
//! direction:
//!
//! 1. In each frame the foot counts that moves most in the mean direction, weighted by how low and how level it moves:
//!    a foot that swings close to the floor moves the other way. The direction is the median over the clip, relative to
//!    the heading.
//! 2. A Gaussian over `SPEED_SMOOTHING_S` fills gaps during flight. The integral of the speed is the path.
//! 3. Feet that an animator has keyed change their speed within a step, and so does the path. The hips did not: this part
//!    is removed from the output, as much of it as the output has of the path ([`Unevenness`]).
//! 4. The output's own path is removed from its hips, so that their sway stays: smoothed over `PATH_SMOOTHING_S`, and
//!    ahead over `AHEAD_SMOOTHING_S`, since hips sway ahead in each step and aside in every second, and a short clip that
//!    is stylized in part changes its speed.
//!
//! A clip counts as in place if both feet carry it, if they move at `MIN_SPEED_M_S` or more and in one direction
//! relative to the heading, and if the hips move at most a quarter as fast and are above the knees. A body that
//! punches, kicks or dances on the spot steps to and fro; one that rolls moves its feet in all directions. A clip
//! shorter than a step may show one foot alone.

use std::str::FromStr;

use gestus_core::blob::Leg;
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame},
    statistics::{extent, gaussian, mean_or_zero, quantile, sorted},
};
use nalgebra::Vector3;

use crate::{retarget::body::is_brief, stream::looped::Round};

/// Least speed of feet that walk in place, m/s: the slowest walks have a quarter more, and clips in which a body stands half
/// as much at most.
const MIN_SPEED_M_S: f64 = 0.2;
/// Speed of a foot beyond any run, m/s: such a frame is wrong, or the body leaps.
const LEAP_M_S: f64 = 15.0;
/// Least speed of their mean velocity, in their mean speed: walks have 0.87 and more, acts on the spot 0.77 and less.
const MIN_DIRECTEDNESS: f64 = 0.8;
/// Greatest speed of the hips of a body in place, relative to that of its feet.
const MAX_HIP_SPEED_RATIO: f64 = 0.25;
/// Least height of the hips, relative to their greatest, of a body that walks in place: one that gets up or falls does not.
const MIN_HEIGHT_RATIO: f64 = 0.5;
/// Share of the frames in which some foot has to carry the body, and of these each foot: a run of games touches the ground
/// in two frames a step.
const MIN_CARRIED_SHARE: f64 = 0.08;
const MIN_FOOT_SHARE: f64 = 0.15;
/// Height of a foot above its standing height, metres, and its vertical speed, m/s, at which it counts for e⁻¹; at three
/// times as much it does not count.
const LOW_M: f64 = 0.015;
const LEVEL_M_S: f64 = 0.15;
/// The same in the foot's horizontal speed, where that is more: between two poses a fast foot comes down and leaves.
const LEVEL_RATIO: f64 = 0.12;
/// Speed below which feet have no direction, m/s: the rest in a body that stands is rounding, which differs from
/// machine to machine.
const STILL_M_S: f64 = 0.01;
/// Differences of heights, metres, and of speeds, m/s, that are noise of rounding.
const ROUNDING: f64 = 1e-6;
/// How much less a foot counts that is slower than usual: e to this power times its speed, in the usual.
const SLOWNESS_PENALTY: f64 = 4.0;
/// Least lift of an ankle that steps, metres: gaits have 0.07 and more, gestures 0.01 at most.
const STEP_M: f64 = 0.05;
/// Standard deviation of the Gaussian on the speed, seconds.
const SPEED_SMOOTHING_S: f64 = 0.08;
/// Standard deviation of the Gaussian that finds the path of the output, seconds: above a gait's sway.
const PATH_SMOOTHING_S: f64 = 0.5;
/// The same along the path, seconds: below a step.
const AHEAD_SMOOTHING_S: f64 = 0.2;
/// Greatest part of the course's unevenness that is removed: that of an output twice as fast.
const MAX_UNEVENNESS: f64 = 2.0;

/// Whether the hips of a clip move with its body.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Root {
    /// The body is held in place.
    InPlace,
    /// The hips move with the body.
    Motion,
}

impl FromStr for Root {
    type Err = String;

    fn from_str(word: &str) -> Result<Self, String> {
        match word {
            "in-place" => Ok(Self::InPlace),
            "motion" => Ok(Self::Motion),
            _ => Err("in-place or motion".into()),
        }
    }
}

/// The path of a body that walks in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// Its position in each frame relative to the first, metres on the ground.
    path: Vec<Vector3<f64>>,
    /// Its mean speed, m/s.
    pub speed_m_s: f64,
    /// Whether the caller stated it; found if not.
    pub stated: bool,
}

impl Course {
    /// The course of a clip on a body with those legs whose floor is at zero; `None` where its hips move as it does.
    pub fn find(clip: &Clip, body: &Body, legs: &[Leg; 2], stated: Option<Root>) -> Option<Self> {
        if stated == Some(Root::Motion) || clip.frames.len() < 3 {
            return None;
        }
        let feet = Feet::of(clip, body, legs);
        let velocity = feet.smoothed(SPEED_SMOOTHING_S * clip.rate_hz);
        let speed_m_s = mean_or_zero(velocity.iter().map(Vector3::norm));
        let carried: f64 = feet.shares.iter().sum();
        let both = feet.shares.iter().all(|&share| share > MIN_FOOT_SHARE * carried);
        let found = speed_m_s > MIN_SPEED_M_S
            && carried > MIN_CARRIED_SHARE
            && (both || is_brief(clip))
            && is_upright(clip, legs)
            && keeps_height(clip)
            && mean_as_seen(&velocity, clip, body).norm() > MIN_DIRECTEDNESS * speed_m_s
            && hips_speed(clip) < MAX_HIP_SPEED_RATIO * speed_m_s;
        if stated.is_none() && !found {
            return None;
        }
        let mut path = vec![Vector3::zeros()];
        for pair in velocity.windows(2) {
            path.push(path[path.len() - 1] + (pair[0] + pair[1]) * (0.5 / clip.rate_hz));
        }
        Some(Self { path, speed_m_s, stated: stated.is_some() })
    }

    /// What the path has beyond an even one, which is smooth.
    pub fn unevenness(&self, rate_hz: f64) -> Unevenness {
        Unevenness::of(&self.path, &smoothed(&self.path, PATH_SMOOTHING_S * rate_hz))
    }

    /// What the path has beyond a straight one in the frames of a round of a loop, which are `count` at another rate.
    pub fn unevenness_of(&self, round: &Round, count: usize) -> Unevenness {
        let end = count.saturating_sub(1).max(1) as f64;
        let frame = |k: usize| round.start as f64 + k as f64 / end * round.period as f64;
        let path: Vec<Vector3<f64>> = (0..count).map(|k| at(&self.path, frame(k))).collect();
        Unevenness::of(&path, &straight(&path))
    }

    /// Moves the clip along its course.
    pub fn apply(&self, clip: &mut Clip) {
        for (frame, path) in clip.frames.iter_mut().zip(&self.path) {
            frame.root += path;
        }
    }
}

/// What a course has beyond an even path, in each frame of the input.
#[derive(Debug, Clone, PartialEq)]
pub struct Unevenness {
    /// Metres on the ground.
    beyond: Vec<Vector3<f64>>,
    /// Length of the even path, metres.
    way_m: f64,
}

impl Unevenness {
    fn of(path: &[Vector3<f64>], even: &[Vector3<f64>]) -> Self {
        let beyond = path.iter().zip(even).map(|(path, even)| path - even).collect();
        Self { beyond, way_m: way_m(even) }
    }

    /// Removes it from the output's frames, as much as their path is of the course's. `source` is the input's frame of each,
    /// `rate_hz` the rate of both.
    pub fn remove(&self, frames: &mut [Frame], source: impl Fn(usize) -> f64, rate_hz: f64) {
        let roots: Vec<Vector3<f64>> = frames.iter().map(|f| flat(f.root, &Vector3::y())).collect();
        if self.beyond.is_empty() || frames.is_empty() {
            return;
        }
        let way_m = way_m(&smoothed(&roots, PATH_SMOOTHING_S * rate_hz));
        let share = (way_m / self.way_m.max(1e-6)).min(MAX_UNEVENNESS);
        for (t, frame) in frames.iter_mut().enumerate() {
            frame.root -= at(&self.beyond, source(t)) * share;
        }
    }
}

/// A path between two of its frames; its ends where there are none.
fn at(path: &[Vector3<f64>], frame: f64) -> Vector3<f64> {
    let last = path.len() - 1;
    let frame = frame.clamp(0.0, last as f64);
    let before = frame as usize;
    path[before].lerp(&path[(before + 1).min(last)], frame.fract())
}

/// Length of a path.
fn way_m(path: &[Vector3<f64>]) -> f64 {
    path.windows(2).map(|p| (p[1] - p[0]).norm()).sum()
}

/// The straight path between the ends of a path, whose mean is that of the path.
fn straight(path: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let last = path.len().saturating_sub(1);
    let line = |t: usize| path[0].lerp(&path[last], t as f64 / last.max(1) as f64);
    let sway = (0..path.len()).map(|t| path[t] - line(t)).sum::<Vector3<f64>>() / path.len().max(1) as f64;
    (0..path.len()).map(|t| line(t) + sway).collect()
}

/// Frames into which the root moves faster than any body: takes were joined there, or a pose is not of the motion.
pub fn leaps(clip: &Clip) -> Vec<usize> {
    let most = LEAP_M_S / clip.rate_hz;
    let pairs = clip.frames.windows(2).enumerate();
    pairs.filter(|(_, pair)| (pair[1].root - pair[0].root).norm() > most).map(|(t, _)| t + 1).collect()
}

/// Whether the body steps, in place or not: it is upright, and both feet are lifted and move about under the hips, as they do
/// not where a body stands and waves.
pub fn steps(clip: &Clip, legs: &[Leg; 2]) -> bool {
    let places = |ankle: usize| -> Vec<Vector3<f64>> {
        clip.frames
            .iter()
            .map(|frame| frame.positions(&clip.skeleton)[ankle] - flat(frame.root, &Vector3::y()))
            .collect()
    };
    let does = |leg: &Leg| {
        let places = places(leg.ankle);
        let speed_m_s = mean_or_zero(places.windows(2).map(|p| (p[1] - p[0]).norm() * clip.rate_hz));
        let heights = sorted(places.iter().map(|place| place.y));
        let [low, high] = [0.05, 0.95].map(|share| quantile(&heights, share).unwrap_or(0.0));
        high - low > STEP_M && speed_m_s > MIN_SPEED_M_S
    };
    is_upright(clip, legs) && legs.iter().all(does)
}

/// Whether the hips are above the knees, of which one may be lifted, in every frame.
fn is_upright(clip: &Clip, legs: &[Leg; 2]) -> bool {
    clip.frames.iter().all(|frame| {
        let places = frame.positions(&clip.skeleton);
        legs.iter().map(|leg| places[leg.hip].y - places[leg.knee].y).sum::<f64>() > 0.0
    })
}

/// Whether the hips are never much lower than at another time.
fn keeps_height(clip: &Clip) -> bool {
    let (low, high) = extent(clip.frames.iter().map(|frame| frame.root.y));
    low > MIN_HEIGHT_RATIO * high
}

/// Mean velocity as the body sees it, which turns.
fn mean_as_seen(velocity: &[Vector3<f64>], clip: &Clip, body: &Body) -> Vector3<f64> {
    let seen = clip.frames.iter().zip(velocity).map(|(frame, v)| about_y(-body.heading(frame)) * v);
    seen.sum::<Vector3<f64>>() / velocity.len() as f64
}

/// Mean speed of the hips over the ground, sway left out, m/s.
fn hips_speed(clip: &Clip) -> f64 {
    let roots: Vec<Vector3<f64>> = clip.frames.iter().map(|f| flat(f.root, &Vector3::y())).collect();
    let path = smoothed(&roots, PATH_SMOOTHING_S * clip.rate_hz);
    mean_or_zero(path.windows(2).map(|p| (p[1] - p[0]).norm() * clip.rate_hz))
}

/// The body's velocity by the foot that carries it.
struct Feet {
    /// In each frame, where a foot carries it: metres a second, and how much that counts.
    velocity: Vec<Option<(Vector3<f64>, f64)>>,
    /// Share of the frames in which the left and the right foot carry it.
    shares: [f64; 2],
}

impl Feet {
    fn of(clip: &Clip, body: &Body, legs: &[Leg; 2]) -> Self {
        let count = clip.frames.len();
        let places: Vec<_> = clip.frames.iter().map(|f| f.positions(&clip.skeleton)).collect();
        let headings: Vec<f64> = clip.frames.iter().map(|f| body.heading(f)).collect();
        // What each foot says of the body's velocity, where it is low and level.
        let said = |t: usize, leg: &Leg| -> Option<(Vector3<f64>, f64)> {
            let (from, to) = (t.saturating_sub(1), (t + 1).min(count - 1));
            let over = |joint: usize, i: usize| places[t][joint].y - f64::from(leg.heights[i]);
            let carrier = leg.toe.filter(|&toe| over(toe, 1) < over(leg.ankle, 0) + ROUNDING);
            let height = carrier.map_or(over(leg.ankle, 0), |toe| over(toe, 1)).max(0.0) / LOW_M;
            let joint = carrier.unwrap_or(leg.ankle);
            let moved = (places[to][joint] - places[from][joint]) * clip.rate_hz / (to - from).max(1) as f64;
            let over_ground = flat(moved, &Vector3::y());
            let level = moved.y.abs() / LEVEL_M_S.max(LEVEL_RATIO * over_ground.norm());
            let weight = (-height.powi(2) - level.powi(2)).exp();
            let stands = height < 3.0 && level < 3.0 && over_ground.norm() < LEAP_M_S;
            stands.then_some((-over_ground, weight))
        };
        let all: Vec<_> = (0..count).map(|t| [0, 1].map(|side| said(t, &legs[side]))).collect();
        let seen = |axis: usize| {
            let local = all.iter().zip(&headings).flat_map(|(said, &heading)| {
                let carries = said.iter().flatten().filter(|(_, weight)| *weight > 0.3);
                carries.map(move |(v, _)| (about_y(-heading) * v)[axis])
            });
            quantile(&sorted(local), 0.5).unwrap_or(0.0)
        };
        let seen = Vector3::new(seen(0), 0.0, seen(2));
        let direction = if seen.norm() < STILL_M_S { Vector3::zeros() } else { seen };
        let mut carried = [0usize; 2];
        let velocity = all.iter().zip(&headings).map(|(said, &heading)| {
            let along = about_y(heading) * direction;
            let side = match said {
                [Some((left, _)), Some((right, _))] => usize::from((right - left).dot(&along) > ROUNDING),
                [left, _] => usize::from(left.is_none()),
            };
            let (velocity, weight) = said[side]?;
            carried[side] += 1;
            // Coming down and leaving it is slower than the body.
            let speed = velocity.dot(&along) / along.norm_squared().max(1e-6);
            Some((velocity, weight * (SLOWNESS_PENALTY * (speed - 1.0).clamp(-2.0, 0.5)).exp()))
        });
        let velocity = velocity.collect();
        Self { velocity, shares: carried.map(|frames| frames as f64 / count as f64) }
    }

    /// The velocity in every frame.
    fn smoothed(&self, sigma: f64) -> Vec<Vector3<f64>> {
        let last = self.velocity.len() - 1;
        let at = |t: usize, sigma: f64| {
            let reach = (4.0 * sigma).ceil() as usize;
            let (mut sum, mut total) = (Vector3::zeros(), 0.0);
            for s in t.saturating_sub(reach)..=(t + reach).min(last) {
                let Some((velocity, counts)) = self.velocity[s] else { continue };
                let weight = counts * (-0.5 * ((s as f64 - t as f64) / sigma).powi(2)).exp();
                sum += velocity * weight;
                total += weight;
            }
            (total > 1e-4).then(|| sum / total)
        };
        // Wider where a flight is long.
        (0..=last)
            .map(|t| (0..6).find_map(|k| at(t, sigma * 2f64.powi(k))).unwrap_or_else(Vector3::zeros))
            .collect()
    }
}

/// Removes the path of a clip and puts its hips over `place`; `hips` is where its root sees them. A loop's path is straight
/// from its first to its last pose.
pub fn put_in_place(
    clip: &mut Clip,
    hips: &Vector3<f64>,
    up: &Vector3<f64>,
    place: &Vector3<f64>,
    looped: bool,
) {
    let roots: Vec<Vector3<f64>> = clip.frames.iter().map(|f| flat(over(f, hips), up)).collect();
    if roots.is_empty() {
        return;
    }
    // The hips' mean is over the place.
    let path = if looped { straight(&roots) } else { followed(&roots, clip.rate_hz) };
    let place = flat(*place, up);
    for (frame, path) in clip.frames.iter_mut().zip(path) {
        frame.root += place - path;
    }
}

/// Mean place of a clip's hips, which are there as its root sees them.
pub fn place(clip: &Clip, hips: &Vector3<f64>) -> Vector3<f64> {
    clip.frames.iter().map(|f| over(f, hips)).sum::<Vector3<f64>>() / clip.frames.len().max(1) as f64
}

/// The middle of the hip joints: the root of some rigs is on the ground, and a body that leans swings them about it.
fn over(frame: &Frame, hips: &Vector3<f64>) -> Vector3<f64> {
    frame.root + frame.rotations[0] * hips
}

/// What lies on the ground of a vector.
fn flat(v: Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
    v - up * up.dot(&v)
}

/// The path below the sway of a body.
fn followed(path: &[Vector3<f64>], rate_hz: f64) -> Vec<Vector3<f64>> {
    let [wide, ahead] = [PATH_SMOOTHING_S, AHEAD_SMOOTHING_S].map(|s| smoothed(path, s * rate_hz));
    let last = path.len() - 1;
    let at = |t: usize| {
        let direction = wide[(t + 1).min(last)] - wide[t.saturating_sub(1)];
        let along = direction.try_normalize(STILL_M_S / rate_hz).unwrap_or_else(Vector3::zeros);
        wide[t] + along * along.dot(&(ahead[t] - wide[t]))
    };
    (0..=last).map(at).collect()
}

/// A Gaussian over a path that goes on beyond its ends as it came, turned by half: a straight line stays.
fn smoothed(path: &[Vector3<f64>], sigma: f64) -> Vec<Vector3<f64>> {
    let last = path.len() as isize - 1;
    let at = |t: isize| -> Vector3<f64> {
        let (first, end) = (path[0], path[last as usize]);
        match t {
            t if t < 0 => first * 2.0 - path[(-t).min(last) as usize],
            t if t > last => end * 2.0 - path[(2 * last - t).max(0) as usize],
            t => path[t as usize],
        }
    };
    let reach = ((3.0 * sigma).ceil() as isize).min(last);
    let kernel = gaussian(reach, sigma);
    let total: f64 = kernel.iter().sum();
    (0..=last)
        .map(|t| kernel.iter().zip(-reach..).map(|(k, i)| at(t + i) * (k / total)).sum::<Vector3<f64>>())
        .collect()
}
