//! From a plan in canonical time to an example at the frame rate.
//!
//! A plan says, for every canonical time, where the path is, how trunk and arms are held and where the feet are; and a
//! timeline says when that is. The same content in another style is another plan over the same canonical time, so
//! that which moment corresponds to which is known by construction.
//!
//! The hips ride as high as their posture wants and as low as both legs need to reach their feet: the limit is eroded
//! and then smoothed over the same width, so that the smooth curve never rises above it and no planted foot is pulled
//! off its place. Cost: about 100 evaluations of the plan a cycle, and one a frame.

use std::sync::Arc;

use nalgebra::Vector3;

use crate::synth::{
    feet::{Stance, foot_at},
    posture::{self, AHEAD, HEIGHT, Posture, SIDE, hips_rotation},
    skeleton::{ANKLE_HEIGHT_M, HIP_DROP_M, SHIN_M, THIGH_M, joint},
};
use gestus_motion::{
    clip::{Clip, Skeleton},
    corpus::{Cycle, Example},
};

/// Part of the leg's length that hips may ask for.
const STRETCH: f64 = 0.988;
/// Height of the root with both feet below it and legs as straight as they get, metres.
pub const STAND_M: f64 = ANKLE_HEIGHT_M + STRETCH * (THIGH_M + SHIN_M) + HIP_DROP_M;
/// Points of canonical time at which the height of the hips is worked out, a unit.
const GRID: f64 = 96.0;
/// Half width of erosion and smoothing, in those points.
const RADIUS: isize = 6;

/// Where the path leads, by canonical time.
#[derive(Debug, Clone)]
pub struct Path {
    start: f64,
    points: Vec<[f64; 3]>,
}

impl Path {
    const STEPS: f64 = 128.0;

    /// The path along which one goes with `speed` (metres a unit of canonical time) and `turn` (radians a unit),
    /// from the origin and heading 0 at canonical time 0.
    pub fn integrate(start: f64, end: f64, speed: impl Fn(f64) -> f64, turn: impl Fn(f64) -> f64) -> Self {
        let count = ((end - start) * Self::STEPS).ceil() as usize + 2;
        let mut points = Vec::with_capacity(count);
        let (mut x, mut z, mut heading) = (0.0, 0.0, 0.0);
        for i in 0..count {
            points.push([x, z, heading]);
            let middle = start + (i as f64 + 0.5) / Self::STEPS;
            let (step, turned) = (speed(middle) / Self::STEPS, turn(middle) / Self::STEPS);
            let along: f64 = heading + 0.5 * turned;
            x += step * along.sin();
            z += step * along.cos();
            heading += turned;
        }
        let mut path = Self { start, points };
        let ([x, z], heading) = path.at(0.0);
        let (sin, cos) = heading.sin_cos();
        for p in &mut path.points {
            let (dx, dz) = (p[0] - x, p[1] - z);
            *p = [dx * cos - dz * sin, dx * sin + dz * cos, p[2] - heading];
        }
        path
    }

    /// Ground position (x, z) and heading.
    pub fn at(&self, canonical: f64) -> ([f64; 2], f64) {
        let x = ((canonical - self.start) * Self::STEPS).clamp(0.0, (self.points.len() - 1) as f64);
        let i = (x as usize).min(self.points.len() - 2);
        let t = x - i as f64;
        let mix = |k: usize| self.points[i][k] + t * (self.points[i + 1][k] - self.points[i][k]);
        ([mix(0), mix(1)], mix(2))
    }

    /// Ground position beside and ahead of the path: `left` and `ahead` in metres.
    pub fn beside(&self, canonical: f64, left: f64, ahead: f64) -> [f64; 2] {
        let ([x, z], heading) = self.at(canonical);
        let (sin, cos) = heading.sin_cos();
        [x + left * cos + ahead * sin, z - left * sin + ahead * cos]
    }
}

/// When each canonical time is: linear between knots.
#[derive(Debug, Clone)]
pub struct Timeline {
    /// Canonical time and seconds, both ascending.
    pub knots: Vec<(f64, f64)>,
}

impl Timeline {
    /// From the duration of each half unit of canonical time, seconds.
    pub fn from_halves(start: f64, durations: impl IntoIterator<Item = f64>) -> Self {
        let (mut canonical, mut seconds) = (start, 0.0);
        let mut knots = vec![(canonical, seconds)];
        for duration in durations {
            canonical += 0.5;
            seconds += duration;
            knots.push((canonical, seconds));
        }
        Self { knots }
    }

    /// Seconds at a canonical time.
    pub fn seconds(&self, canonical: f64) -> f64 {
        self.interpolate(canonical, |k| k)
    }

    /// Canonical time at a number of seconds.
    pub fn canonical(&self, seconds: f64) -> f64 {
        self.interpolate(seconds, |(c, s)| (s, c))
    }

    fn interpolate(&self, x: f64, axes: impl Fn((f64, f64)) -> (f64, f64)) -> f64 {
        let inner = &self.knots[1..self.knots.len() - 1];
        let i = inner.iter().take_while(|&&k| axes(k).0 <= x).count();
        let ((x0, y0), (x1, y1)) = (axes(self.knots[i]), axes(self.knots[i + 1]));
        y0 + (x - x0) / (x1 - x0) * (y1 - y0)
    }
}

/// All that happens, by canonical time.
pub struct Plan {
    /// When.
    pub timeline: Timeline,
    /// First and last canonical time that is shown.
    pub shown: (f64, f64),
    /// Canonical times of each cycle's knots.
    pub cycles: Vec<Vec<f64>>,
    /// Where.
    pub path: Path,
    /// The stances of both feet.
    pub feet: [Vec<Stance>; 2],
    /// How.
    pub posture: Box<dyn Fn(f64) -> Posture>,
}

impl Plan {
    /// The example at that rate. Its name, action and style are for the caller to set.
    pub fn render(&self, skeleton: &Arc<Skeleton>, rate_hz: f64) -> Example {
        let from = self.shown.0;
        let heights = self.heights(skeleton);
        let start = self.timeline.seconds(from);
        let mut frames = Vec::new();
        let mut contacts = Vec::new();
        for at in self.moments(rate_hz) {
            let posture = (self.posture)(at);
            let heading = self.path.at(at).1;
            let [x, z] = self.path.beside(at, posture[SIDE], posture[AHEAD]);
            let grid = ((at - from) * GRID).clamp(0.0, (heights.len() - 2) as f64);
            let (low, t) = (grid as usize, grid.fract());
            let height = heights[low] + t * (heights[low + 1] - heights[low]);
            let planned = [0, 1].map(|side: usize| foot_at(&self.feet[side], at));
            let feet = planned.map(|p| posture::Foot { ankle: p.foot.ankle + p.throw, ..p.foot });
            frames.push(posture::pose(skeleton, &posture, Vector3::new(x, height, z), heading, &feet));
            contacts.push(planned.map(|p| p.planted));
        }
        let cycles = self
            .cycles
            .iter()
            .map(|knots| Cycle {
                knots: knots.iter().map(|&k| (self.timeline.seconds(k) - start) * rate_hz).collect(),
            })
            .collect();
        let clip = Clip { name: String::new(), skeleton: skeleton.clone(), rate_hz, frames };
        Example { clip, action: 0, style: 0, contacts, cycles, take: String::new(), licence: String::new() }
    }

    /// The canonical time of each frame at that rate.
    fn moments(&self, rate_hz: f64) -> impl Iterator<Item = f64> + '_ {
        let (from, to) = self.shown;
        let start = self.timeline.seconds(from);
        let count = ((self.timeline.seconds(to) - start) * rate_hz + 1e-6).floor() as usize + 1;
        (0..count).map(move |i| self.timeline.canonical(start + i as f64 / rate_hz))
    }

    /// Which foot touches the floor with any part of its sole in each frame, left and right.
    pub fn touches(&self, rate_hz: f64) -> Vec<[bool; 2]> {
        self.moments(rate_hz)
            .map(|at| [0, 1].map(|side: usize| foot_at(&self.feet[side], at).touches))
            .collect()
    }

    /// Heights of the hips on the grid, metres.
    fn heights(&self, skeleton: &Skeleton) -> Vec<f64> {
        let (from, to) = self.shown;
        let count = ((to - from) * GRID).ceil() as isize + 2;
        let edge = 2 * RADIUS;
        let limits: Vec<f64> = (-edge..count + edge)
            .map(|i| {
                let at = from + i as f64 / GRID;
                let posture = (self.posture)(at);
                let [x, z] = self.path.beside(at, posture[SIDE], posture[AHEAD]);
                let hips = hips_rotation(&posture, self.path.at(at).1);
                let reach = STRETCH * (THIGH_M + SHIN_M);
                let wanted = STAND_M + posture[HEIGHT];
                (0..2).fold(wanted, |height, side| {
                    let hip = hips * skeleton.offsets[joint::UPPER_LEG[side]];
                    let ankle = foot_at(&self.feet[side], at).foot.ankle;
                    let away = (x + hip.x - ankle.x).hypot(z + hip.z - ankle.z);
                    height.min(ankle.y - hip.y + (reach.powi(2) - away.powi(2)).max(0.04).sqrt())
                })
            })
            .collect();
        let eroded = windows(&limits, |w| w.iter().copied().fold(f64::INFINITY, f64::min));
        // A triangle of the same half width.
        windows(&eroded, |w| {
            let weight = |i: usize| (RADIUS + 1 - (i as isize - RADIUS).abs()) as f64;
            let total: f64 = (0..w.len()).map(weight).sum();
            w.iter().enumerate().map(|(i, h)| weight(i) * h).sum::<f64>() / total
        })
    }
}

fn windows(values: &[f64], of: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    values.windows(2 * RADIUS as usize + 1).map(of).collect()
}
