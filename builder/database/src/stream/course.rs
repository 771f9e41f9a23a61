//! Bodies that walk in place: their way over the ground, found from their feet, and taken off the output again.
//!
//! A standing foot does not move. Where it does, and the hips do not, the body is held in place and goes the opposite way:
//!
//! 1. In each frame that foot counts which says most of the mean direction, the more the lower and the more level it moves:
//!    a foot that swings close to the floor goes the other way. The direction is the median over the clip, as the body sees
//!    it.
//! 2. A Gaussian over `SMOOTHED_S` fills what flight leaves open. Its integral is the way.
//! 3. The output's own way, smoothed over `WAY_S`, is taken off its hips, so that their sway stays.
//!
//! A clip is taken to be in place if both feet carry it, they move at `LEAST_M_S` or more and in one direction as the body
//! sees it, the hips at a quarter of that or less, and these are above the knees. Who punches, kicks or dances on the spot
//! steps to and fro; who rolls flings the feet.

use std::str::FromStr;

use gestus_core::blob::Leg;
use gestus_motion::{
    body::{Body, about_y},
    clip::Clip,
    statistics::{mean_or_zero, quantile, sorted},
};
use nalgebra::Vector3;

/// Least speed of feet that walk in place, m/s: the slowest walks have a quarter more, and clips in which a body stands half
/// as much at most.
const LEAST_M_S: f64 = 0.2;
/// Least speed of their mean velocity, in their mean speed: walks have 0.87 and more, acts on the spot 0.77 and less.
const DIRECTED: f64 = 0.8;
/// Speed of the hips of a body in place, in that of its feet.
const HIPS: f64 = 0.25;
/// Share of the frames in which some foot has to carry the body, and of these each foot: a run of games touches the ground
/// in two frames a step.
const LEAST_CARRIED: f64 = 0.08;
const LEAST_SHARE: f64 = 0.15;
/// Height of a foot above its standing height, metres, and its vertical speed, m/s, at which it counts for e⁻¹; at three
/// times as much it does not count.
const LOW_M: f64 = 0.015;
const LEVEL_M_S: f64 = 0.15;
/// The same in the foot's horizontal speed, where that is more: between two poses a fast foot comes down and leaves.
const LEVEL: f64 = 0.12;
/// Speed below which feet have no direction, m/s: what is left of a body that stands is noise of rounding, which differs from
/// machine to machine.
const STILL_M_S: f64 = 0.01;
/// Differences of heights, metres, and of speeds, m/s, that are noise of rounding.
const SAME: f64 = 1e-6;
/// How much less a foot counts that is slower than usual: e to this power times its speed, in the usual.
const SHARP: f64 = 4.0;
/// Standard deviation of the Gaussian on the speed, seconds.
const SMOOTHED_S: f64 = 0.08;
/// Standard deviation of the Gaussian that takes the way out of the output, seconds: above a gait's sway.
const WAY_S: f64 = 0.5;

/// Whether the hips of a clip move as its body does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Root {
    /// The body is held in place.
    InPlace,
    /// The hips move as the body does.
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

/// The way of a body that is held in place.
#[derive(Debug, Clone, PartialEq)]
pub struct Course {
    /// How far it has come in each frame, metres on the ground.
    way: Vec<Vector3<f64>>,
    /// Its mean speed, m/s.
    pub speed_m_s: f64,
    /// Whether it was told, and not found.
    pub told: bool,
}

impl Course {
    /// The course of a clip on a body with those legs whose floor is at zero; `None` where its hips move as it does.
    pub fn find(clip: &Clip, body: &Body, legs: &[Leg; 2], told: Option<Root>) -> Option<Self> {
        if told == Some(Root::Motion) || clip.frames.len() < 3 {
            return None;
        }
        let feet = Feet::of(clip, body, legs);
        let velocity = feet.smoothed(SMOOTHED_S * clip.rate_hz);
        let speed_m_s = mean_or_zero(velocity.iter().map(Vector3::norm));
        let carried: f64 = feet.shares.iter().sum();
        let found = speed_m_s > LEAST_M_S
            && carried > LEAST_CARRIED
            && feet.shares.iter().all(|&share| share > LEAST_SHARE * carried)
            && is_upright(clip, legs)
            && mean_as_seen(&velocity, clip, body).norm() > DIRECTED * speed_m_s
            && hips_speed(clip) < HIPS * speed_m_s;
        if told.is_none() && !found {
            return None;
        }
        let mut way = vec![Vector3::zeros()];
        for pair in velocity.windows(2) {
            way.push(way[way.len() - 1] + (pair[0] + pair[1]) * (0.5 / clip.rate_hz));
        }
        Some(Self { way, speed_m_s, told: told.is_some() })
    }

    /// Moves the clip along its course.
    pub fn go(&self, clip: &mut Clip) {
        for (frame, way) in clip.frames.iter_mut().zip(&self.way) {
            frame.root += way;
        }
    }
}

/// Whether the hips are above the knees, of which one may be lifted, in every frame.
fn is_upright(clip: &Clip, legs: &[Leg; 2]) -> bool {
    clip.frames.iter().all(|frame| {
        let places = frame.positions(&clip.skeleton);
        legs.iter().map(|leg| places[leg.hip].y - places[leg.knee].y).sum::<f64>() > 0.0
    })
}

/// Mean velocity as the body sees it, which turns.
fn mean_as_seen(velocity: &[Vector3<f64>], clip: &Clip, body: &Body) -> Vector3<f64> {
    let seen = clip.frames.iter().zip(velocity).map(|(frame, v)| about_y(-body.heading(frame)) * v);
    seen.sum::<Vector3<f64>>() / velocity.len() as f64
}

/// Mean speed of the hips over the ground, sway left out, m/s.
fn hips_speed(clip: &Clip) -> f64 {
    let roots: Vec<Vector3<f64>> = clip.frames.iter().map(|f| flat(f.root, &Vector3::y())).collect();
    let way = smoothed(&roots, WAY_S * clip.rate_hz);
    mean_or_zero(way.windows(2).map(|p| (p[1] - p[0]).norm() * clip.rate_hz))
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
            let carrier = leg.toe.filter(|&toe| over(toe, 1) < over(leg.ankle, 0) + SAME);
            let height = carrier.map_or(over(leg.ankle, 0), |toe| over(toe, 1)).max(0.0) / LOW_M;
            let joint = carrier.unwrap_or(leg.ankle);
            let moved = (places[to][joint] - places[from][joint]) * clip.rate_hz / (to - from).max(1) as f64;
            let over_ground = flat(moved, &Vector3::y());
            let level = moved.y.abs() / LEVEL_M_S.max(LEVEL * over_ground.norm());
            let weight = (-height.powi(2) - level.powi(2)).exp();
            (height < 3.0 && level < 3.0).then_some((-over_ground, weight))
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
                [Some((left, _)), Some((right, _))] => usize::from((right - left).dot(&along) > SAME),
                [left, _] => usize::from(left.is_none()),
            };
            let (velocity, weight) = said[side]?;
            carried[side] += 1;
            // Coming down and leaving it is slower than the body.
            let speed = velocity.dot(&along) / along.norm_squared().max(1e-6);
            Some((velocity, weight * (SHARP * (speed - 1.0).clamp(-2.0, 0.5)).exp()))
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

/// Takes the way out of a clip and puts its hips over `place`. A loop's way is straight from its first to its last pose.
pub fn hold(clip: &mut Clip, up: &Vector3<f64>, place: &Vector3<f64>, looped: bool) {
    let roots: Vec<Vector3<f64>> = clip.frames.iter().map(|f| flat(f.root, up)).collect();
    let Some(last) = roots.len().checked_sub(1) else { return };
    let way = if looped {
        let straight = |t: usize| roots[0].lerp(&roots[last], t as f64 / last.max(1) as f64);
        // The hips' mean is over the place.
        let sway = (0..=last).map(|t| roots[t] - straight(t)).sum::<Vector3<f64>>() / (last + 1) as f64;
        (0..=last).map(|t| straight(t) + sway).collect()
    } else {
        smoothed(&roots, WAY_S * clip.rate_hz)
    };
    let place = flat(*place, up);
    for (frame, way) in clip.frames.iter_mut().zip(way) {
        frame.root += place - way;
    }
}

/// Mean place of a clip's hips.
pub fn place(clip: &Clip) -> Vector3<f64> {
    clip.frames.iter().map(|f| f.root).sum::<Vector3<f64>>() / clip.frames.len().max(1) as f64
}

/// What lies on the ground of a vector.
fn flat(v: Vector3<f64>, up: &Vector3<f64>) -> Vector3<f64> {
    v - up * up.dot(&v)
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
    let kernel: Vec<f64> =
        (-reach..=reach).map(|i| (-0.5 * (i as f64 / sigma.max(1e-9)).powi(2)).exp()).collect();
    let total: f64 = kernel.iter().sum();
    (0..=last)
        .map(|t| kernel.iter().zip(-reach..).map(|(k, i)| at(t + i) * (k / total)).sum::<Vector3<f64>>())
        .collect()
}
