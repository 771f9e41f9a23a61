//! Single actions from standing: jump, punch and kick.
//!
//! An act has its own time x from 0 to 1 in twelve equal parts: five to prepare, two to strike (or fly), five to
//! recover. A style stretches each of the three differently, scales the movement and adds its posture. Parts are
//! linear in time, so the correspondence of an act in any two styles is known exactly.

use nalgebra::Vector3;

use crate::synth::{
    feet::{Stance, Swing},
    noise::{between, rng},
    plan::{Path, STAND_M},
    posture::{
        ABDUCT, AHEAD, ARMS, CHEST, ELBOW, FORWARD, HEAD, HEIGHT, LIST, Posture, SIDE, SPINE, SWING, TILT,
        TWIST, YAW,
    },
    skeleton::{ANKLE_HEIGHT_M, HIP_DROP_M, SHIN_M, THIGH_M},
    style::Style,
};
use gestus_motion::{body::about_y, statistics::smoothstep};

/// Units of canonical time that an act takes: twelve halves.
pub const UNITS: f64 = 6.0;
/// Acceleration of gravity, metres a second squared.
const GRAVITY: f64 = 9.81;
/// When the strike begins and ends.
const STRIKE: (f64, f64) = (5.0 / 12.0, 7.0 / 12.0);

/// Kinds of acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Both feet off the floor, forwards.
    Jump,
    /// The right fist forwards, with a step of the left foot.
    Punch,
    /// The right foot forwards.
    Kick,
}

/// An act of a style with its content.
#[derive(Debug, Clone, Copy)]
pub struct Act {
    kind: Kind,
    style: Style,
    /// Amplitude by content and style.
    strength: f64,
    /// Height and turn of the movement.
    aim: [f64; 2],
    /// Differences of the twelve durations, seeds of the parts.
    tempo: [f64; 12],
    /// Canonical time at which it starts.
    start: f64,
}

/// A channel's values at moments of the act, with no speed at each.
type Keys = &'static [(usize, &'static [(f64, f64)])];

const LEFT: usize = ARMS[0];
const RIGHT: usize = ARMS[1];

const JUMP: Keys = &[
    (TILT, &[(0.05, 0.0), (0.27, 0.45), (0.42, 0.05), (0.5, 0.1), (0.6, 0.15), (0.72, 0.4), (1.0, 0.0)]),
    (SPINE, &[(0.05, 0.0), (0.27, 0.3), (0.42, -0.1), (0.5, 0.0), (0.72, 0.25), (1.0, 0.0)]),
    (HEAD, &[(0.05, 0.0), (0.27, -0.4), (0.45, 0.0), (0.72, -0.3), (1.0, 0.0)]),
    (LEFT + SWING, &[(0.02, 0.0), (0.25, -0.9), (0.44, 1.6), (0.58, 0.9), (0.75, 0.3), (1.0, 0.0)]),
    (RIGHT + SWING, &[(0.02, 0.0), (0.25, -0.9), (0.44, 1.6), (0.58, 0.9), (0.75, 0.3), (1.0, 0.0)]),
    (LEFT + ELBOW, &[(0.05, 0.0), (0.3, 0.3), (0.44, 0.1), (0.75, 0.5), (1.0, 0.0)]),
    (RIGHT + ELBOW, &[(0.05, 0.0), (0.3, 0.3), (0.44, 0.1), (0.75, 0.5), (1.0, 0.0)]),
    (LEFT + ABDUCT, &[(0.3, 0.0), (0.5, 0.25), (0.75, 0.25), (1.0, 0.0)]),
    (RIGHT + ABDUCT, &[(0.3, 0.0), (0.5, 0.25), (0.75, 0.25), (1.0, 0.0)]),
];

const PUNCH: Keys = &[
    (HEIGHT, &[(0.0, 0.0), (0.2, -0.06), (0.35, -0.07), (0.5, -0.05), (0.75, -0.05), (1.0, 0.0)]),
    (AHEAD, &[(0.15, 0.0), (0.33, -0.05), (0.5, 0.1), (0.65, 0.06), (1.0, 0.0)]),
    (TILT, &[(0.1, 0.0), (0.5, 0.12), (1.0, 0.0)]),
    (YAW, &[(0.1, 0.0), (0.36, -0.28), (0.5, 0.28), (0.65, 0.1), (1.0, 0.0)]),
    (SPINE + 1, &[(0.1, 0.0), (0.36, -0.2), (0.5, 0.22), (0.7, 0.0)]),
    (CHEST + 1, &[(0.1, 0.0), (0.36, -0.3), (0.5, 0.35), (0.7, 0.05), (1.0, 0.0)]),
    (HEAD + 1, &[(0.1, 0.0), (0.36, 0.7), (0.5, -0.7), (0.7, -0.1), (1.0, 0.0)]),
    (
        RIGHT + SWING,
        &[(0.0, 0.0), (0.2, 0.5), (0.36, -0.15), (0.5, 1.45), (0.54, 1.45), (0.72, 0.5), (1.0, 0.0)],
    ),
    (
        RIGHT + ELBOW,
        &[(0.0, 0.0), (0.2, 1.7), (0.36, 1.95), (0.5, -0.2), (0.54, -0.2), (0.72, 1.6), (1.0, 0.0)],
    ),
    (RIGHT + ABDUCT, &[(0.2, 0.0), (0.36, 0.25), (0.5, 0.0)]),
    (RIGHT + TWIST, &[(0.1, 0.0), (0.25, 0.3), (0.42, 0.3), (0.5, 0.1), (0.75, 0.3), (1.0, 0.0)]),
    (RIGHT + FORWARD, &[(0.36, -0.1), (0.5, 0.35), (0.7, 0.0)]),
    (LEFT + SWING, &[(0.0, 0.0), (0.2, 0.7), (0.36, 0.95), (0.5, 0.3), (0.72, 0.6), (1.0, 0.0)]),
    (LEFT + ELBOW, &[(0.0, 0.0), (0.2, 1.6), (0.36, 1.3), (0.5, 1.8), (0.72, 1.6), (1.0, 0.0)]),
    (LEFT + TWIST, &[(0.1, 0.0), (0.25, 0.4), (0.75, 0.4), (1.0, 0.0)]),
];

const KICK: Keys = &[
    (SIDE, &[(0.02, 0.0), (0.22, 0.085), (0.78, 0.085), (0.97, 0.0)]),
    (HEIGHT, &[(0.0, 0.0), (0.25, -0.03), (0.5, -0.01), (0.8, -0.03), (1.0, 0.0)]),
    (TILT, &[(0.15, 0.0), (0.5, -0.28), (0.8, 0.05), (1.0, 0.0)]),
    (LIST, &[(0.2, 0.0), (0.5, -0.1), (0.8, 0.0)]),
    (YAW, &[(0.15, 0.0), (0.35, -0.15), (0.5, 0.3), (0.8, 0.0)]),
    (SPINE, &[(0.2, 0.0), (0.5, 0.15), (0.8, 0.05), (1.0, 0.0)]),
    (CHEST + 1, &[(0.15, 0.0), (0.5, -0.25), (0.8, 0.0)]),
    (HEAD, &[(0.2, 0.0), (0.5, 0.12), (0.8, 0.0)]),
    (LEFT + SWING, &[(0.05, 0.0), (0.35, 0.2), (0.5, 0.9), (0.72, 0.5), (1.0, 0.0)]),
    (LEFT + ELBOW, &[(0.0, 0.0), (0.3, 1.2), (0.72, 1.0), (1.0, 0.0)]),
    (RIGHT + SWING, &[(0.05, 0.0), (0.35, 0.5), (0.5, -0.5), (0.72, 0.2), (1.0, 0.0)]),
    (RIGHT + ELBOW, &[(0.0, 0.0), (0.3, 1.0), (0.5, 0.4), (0.72, 0.8), (1.0, 0.0)]),
    (RIGHT + ABDUCT, &[(0.2, 0.0), (0.5, 0.35), (0.8, 0.1), (1.0, 0.0)]),
    (LEFT + ABDUCT, &[(0.2, 0.0), (0.5, 0.2), (0.8, 0.1), (1.0, 0.0)]),
];

fn keyed(points: &[(f64, f64)], x: f64) -> f64 {
    let after = points.iter().take_while(|p| p.0 <= x).count();
    match (after.checked_sub(1).map(|i| points[i]), points.get(after)) {
        (Some((x0, y0)), Some(&(x1, y1))) => y0 + (y1 - y0) * smoothstep((x - x0) / (x1 - x0)),
        (Some((_, y)), None) | (None, Some(&(_, y))) => y,
        (None, None) => 0.0,
    }
}

impl Act {
    /// An act that starts at a canonical time.
    pub fn new(seed: u64, kind: Kind, style: Style, start: f64) -> Self {
        let mut rng = rng(seed, 4);
        let strength = between(&mut rng, 0.8, 1.15) * style.vigour;
        let aim = [between(&mut rng, -1.0, 1.0), between(&mut rng, -1.0, 1.0)];
        let tempo = [(); 12].map(|()| between(&mut rng, -1.0, 1.0));
        Self { kind, style, strength, aim, tempo, start }
    }

    /// Height of a jump's flight, metres.
    fn jump_m(&self) -> f64 {
        0.24 * self.strength.powi(2)
    }

    /// Length of a jump or a step, metres.
    fn way_m(&self) -> f64 {
        let reach = 1.0 + 0.2 * self.aim[0];
        match self.kind {
            Kind::Jump => 0.7 * self.strength * reach,
            Kind::Punch => 0.20 * self.strength * reach,
            Kind::Kick => 0.0,
        }
    }

    /// Durations of the twelve parts, seconds.
    pub fn durations(&self) -> [f64; 12] {
        let base = match self.kind {
            Kind::Jump => [0.145, (8.0 * self.jump_m() / GRAVITY).sqrt() / 2.0, 0.13],
            Kind::Punch => [0.135, 0.14, 0.13],
            Kind::Kick => [0.12, 0.13, 0.13],
        };
        let mut durations = [0.0; 12];
        for (i, duration) in durations.iter_mut().enumerate() {
            let part = usize::from(i >= 5) + usize::from(i >= 7);
            // Nobody flies slower than gravity lets them.
            let flight = self.kind == Kind::Jump && part == 1;
            let style = if flight { 1.0 } else { self.style.timing[part] };
            let varied = if flight { 0.0 } else { 0.04 + self.style.variability };
            *duration = base[part] * style * (1.0 + varied * self.tempo[i]);
        }
        durations
    }

    /// Own time at a canonical time: 0 before, 1 behind.
    fn own(&self, at: f64) -> f64 {
        ((at - self.start) / UNITS).clamp(0.0, 1.0)
    }

    fn canonical(&self, own: f64) -> f64 {
        self.start + UNITS * own
    }

    /// Speed along the path, metres a unit of canonical time.
    pub fn speed(&self, at: f64) -> f64 {
        let x = self.own(at);
        let (from, to) = match self.kind {
            Kind::Jump => (0.36, 0.64),
            _ => (0.22, 0.52),
        };
        self.way_m() * hump((x - from) / (to - from)) / ((to - from) * UNITS)
    }

    /// Turn along the path, radians a unit of canonical time.
    pub fn turn(&self, at: f64) -> f64 {
        let angle = if self.kind == Kind::Jump { 0.3 * self.aim[1] } else { 0.0 };
        angle * hump((self.own(at) - 0.38) / 0.24) / (0.24 * UNITS)
    }

    /// Takes the feet from where they stand through the act. Both must stand.
    pub fn step(&self, feet: &mut [Vec<Stance>; 2], path: &Path) {
        let still = |stances: &[Stance]| *stances.last().expect("a foot stands before it acts");
        let swing = |lift_m: f64, throw| Swing { lift_m, shape: [2.0, 2.0], clearance_m: 0.03, throw };
        match self.kind {
            Kind::Jump => {
                for stances in feet.iter_mut() {
                    let last = still(stances);
                    let (off, on) = (self.canonical(STRIKE.0), self.canonical(STRIKE.1));
                    let ([x, z], heading) = path.at(self.start);
                    let (_, landed) = path.at(on + 0.1 * UNITS);
                    // Where the foot stands under the body, and the same place at the end.
                    let own = about_y(-heading) * Vector3::new(last.place[0] - x, 0.0, last.place[1] - z);
                    let place = path.beside(on + 0.1 * UNITS, own.x, own.z);
                    let raise = Swing { shape: [1.0, 1.0], ..swing(self.jump_m() + 0.06, Vector3::zeros()) };
                    leave(stances, self.canonical(0.30), off, 0.75, raise);
                    stances.push(Stance {
                        from: on,
                        flat: self.canonical(0.62),
                        place,
                        yaw: last.yaw + landed - heading,
                        ..Stance::still(place, 0.0)
                    });
                }
            }
            Kind::Punch => {
                // A step in front of where the body will be.
                let last = still(&feet[0]);
                let from = self.canonical(0.44);
                let place = path.beside(self.canonical(1.0), 0.09, 0.12);
                leave(
                    &mut feet[0],
                    self.canonical(0.2),
                    self.canonical(0.26),
                    0.2,
                    swing(0.05, Vector3::zeros()),
                );
                feet[0].push(Stance { from, flat: from, ..Stance::still(place, last.yaw) });
            }
            Kind::Kick => {
                let last = still(&feet[1]);
                // In front of the hip joint, as far as a leg reaches at that height.
                let ([x, z], heading) = path.at(self.canonical(0.5));
                let height = (0.55 + 0.06 * self.aim[0]) * (0.35 + 0.65 * self.strength);
                let drop = STAND_M - HIP_DROP_M - ANKLE_HEIGHT_M - height;
                let away = ((0.96 * (THIGH_M + SHIN_M)).powi(2) - drop.powi(2)).max(0.04).sqrt();
                let target = about_y(heading + 0.2 * self.aim[1]) * Vector3::new(-0.03, 0.0, away);
                let throw = Vector3::new(x + target.x - last.place[0], height, z + target.z - last.place[1]);
                leave(&mut feet[1], self.canonical(0.2), self.canonical(0.28), 0.5, swing(0.16, throw));
                let from = self.canonical(0.78);
                feet[1].push(Stance { from, flat: from, ..Stance::still(last.place, last.yaw) });
            }
        }
    }

    /// Trunk and arms, on top of the style's posture.
    pub fn posture(&self, at: f64) -> Posture {
        let x = self.own(at);
        let keys = match self.kind {
            Kind::Jump => JUMP,
            Kind::Punch => PUNCH,
            Kind::Kick => KICK,
        };
        let mut p = Posture::zeros();
        // Small acts are small in all; balance is not.
        let amplitude = 0.35 + 0.65 * self.strength;
        for &(channel, points) in keys {
            p[channel] += keyed(points, x) * if channel == SIDE { 1.0 } else { amplitude };
        }
        match self.kind {
            Kind::Jump => p[HEIGHT] += self.jump_height(x),
            Kind::Punch => {
                let there = smoothstep((x - 0.36) / 0.14) * (1.0 - smoothstep((x - 0.54) / 0.18));
                p[RIGHT + SWING] += 0.2 * self.aim[0] * there;
                p[CHEST + 1] += 0.15 * self.aim[1] * there;
            }
            Kind::Kick => {}
        }
        p
    }

    /// Crouch, push, flight and landing: a parabola in the air, and a quadratic on either side of it.
    fn jump_height(&self, x: f64) -> f64 {
        let (crouch, tiptoe) = (0.24 * (0.4 + 0.6 * self.strength), 0.07);
        let (low, deep) = (0.26, 0.73);
        if x < low {
            -crouch * smoothstep(x / low)
        } else if x < STRIKE.0 {
            (crouch + tiptoe) * ((x - low) / (STRIKE.0 - low)).powi(2) - crouch
        } else if x < STRIKE.1 {
            let t = (x - STRIKE.0) / (STRIKE.1 - STRIKE.0);
            tiptoe * (1.0 - smoothstep(t)) + 4.0 * self.jump_m() * t * (1.0 - t)
        } else if x < deep {
            let t = (x - STRIKE.1) / (deep - STRIKE.1);
            -0.9 * crouch * (1.0 - (1.0 - t).powi(2))
        } else {
            -0.9 * crouch * (1.0 - smoothstep((x - deep) / (1.0 - deep)))
        }
    }
}

/// Speed at a share of the time of a movement from rest to rest over a distance of 1.
fn hump(t: f64) -> f64 {
    if (0.0..1.0).contains(&t) { 30.0 * (t * (1.0 - t)).powi(2) } else { 0.0 }
}

/// Ends the last stance of a foot.
fn leave(stances: &mut [Stance], heel_off: f64, to: f64, push: f64, swing: Swing) {
    if let Some(last) = stances.last_mut() {
        (last.heel_off, last.to, last.push, last.swing) = (heel_off, to, push, swing);
    }
}
