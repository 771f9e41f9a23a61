//! Walking, running and transitions between them.
//!
//! Canonical time counts cycles: the left foot strikes at whole numbers, the right at halves. Stride, duration and
//! all other parameters of a gait are scaled by the style and may change with canonical time. A transition is a walk whose
//! parameters become those of a run.

use gestus_motion::statistics::smoothstep;
use nalgebra::Vector3;

use crate::synth::{
    feet::{Stance, Swing},
    noise::Noise,
    plan::{Path, Timeline},
    posture::{
        ABDUCT, ARMS, CHANNELS, CHEST, ELBOW, HEAD, HEIGHT, LIST, Posture, SIDE, SPINE, SWING, TILT, YAW,
    },
    style::Style,
};

/// The numbers of a gait; metres, radians, seconds, shares of a cycle.
#[derive(Debug, Clone, Copy)]
pub struct Gait {
    /// Length of a cycle in time.
    pub period_s: f64,
    /// Length of a cycle on the ground.
    pub stride_m: f64,
    duty: f64,
    /// Distance between the ankles.
    pub width_m: f64,
    lift_m: f64,
    clearance_m: f64,
    land: f64,
    push: f64,
    place_m: f64,
    height_m: f64,
    bounce_m: f64,
    sway_m: f64,
    yaw: f64,
    list: f64,
    twist: f64,
    lean: f64,
    swing: f64,
    swing_middle: f64,
    abduct: f64,
    elbow: f64,
    elbow_swing: f64,
}

/// A walk at 1.2 m/s.
pub const WALK: Gait = Gait {
    period_s: 1.08,
    stride_m: 1.28,
    duty: 0.61,
    width_m: 0.15,
    lift_m: 0.03,
    clearance_m: 0.02,
    land: 0.32,
    push: 0.75,
    place_m: -0.04,
    height_m: -0.006,
    bounce_m: 0.008,
    sway_m: 0.02,
    yaw: 0.08,
    list: 0.04,
    twist: 0.10,
    lean: 0.03,
    swing: 0.36,
    swing_middle: 0.0,
    abduct: 0.10,
    elbow: 0.30,
    elbow_swing: 0.16,
};

/// A run at 2.8 m/s.
pub const RUN: Gait = Gait {
    period_s: 0.72,
    stride_m: 2.0,
    duty: 0.34,
    width_m: 0.07,
    lift_m: 0.13,
    clearance_m: 0.05,
    land: 0.06,
    push: 0.85,
    place_m: -0.04,
    height_m: -0.05,
    bounce_m: -0.04,
    sway_m: 0.008,
    yaw: 0.14,
    list: 0.05,
    twist: 0.24,
    lean: 0.12,
    swing: 0.52,
    swing_middle: -0.12,
    abduct: 0.16,
    elbow: 1.45,
    elbow_swing: 0.2,
};

impl Gait {
    /// Between two gaits.
    pub fn blend(&self, other: &Self, t: f64) -> Self {
        let m = |a: f64, b: f64| a + t * (b - a);
        Self {
            period_s: m(self.period_s, other.period_s),
            stride_m: m(self.stride_m, other.stride_m),
            duty: m(self.duty, other.duty),
            width_m: m(self.width_m, other.width_m),
            lift_m: m(self.lift_m, other.lift_m),
            clearance_m: m(self.clearance_m, other.clearance_m),
            land: m(self.land, other.land),
            push: m(self.push, other.push),
            place_m: m(self.place_m, other.place_m),
            height_m: m(self.height_m, other.height_m),
            bounce_m: m(self.bounce_m, other.bounce_m),
            sway_m: m(self.sway_m, other.sway_m),
            yaw: m(self.yaw, other.yaw),
            list: m(self.list, other.list),
            twist: m(self.twist, other.twist),
            lean: m(self.lean, other.lean),
            swing: m(self.swing, other.swing),
            swing_middle: m(self.swing_middle, other.swing_middle),
            abduct: m(self.abduct, other.abduct),
            elbow: m(self.elbow, other.elbow),
            elbow_swing: m(self.elbow_swing, other.elbow_swing),
        }
    }

    /// The gait in a style.
    pub fn styled(&self, style: &Style) -> Self {
        Self {
            period_s: self.period_s * style.period,
            stride_m: self.stride_m * style.stride,
            duty: self.duty + style.duty,
            width_m: (self.width_m + style.width_m).max(0.03),
            lift_m: self.lift_m * style.lift,
            clearance_m: self.clearance_m * style.lift,
            land: self.land * style.roll,
            push: self.push * style.roll.max(0.5),
            bounce_m: self.bounce_m * style.bounce,
            sway_m: self.sway_m * style.sway,
            yaw: self.yaw * style.yaw,
            list: self.list * style.list,
            twist: self.twist * style.twist,
            swing: self.swing * style.swing,
            ..*self
        }
    }
}

/// Content, which does not depend on style: pace, step size and turns, and the random variation of cycles.
#[derive(Debug, Clone)]
pub struct Content {
    /// Pace relative to the gait's.
    pub pace: f64,
    /// Step size relative to that of the pace.
    pub step: f64,
    /// Turn, radians a cycle.
    pub turn: f64,
    /// Slow drift of pace and turn, one channel each.
    pub drift: Noise,
    /// How a cycle differs from the next: stride, duration, lift, swing, twist, width.
    pub cycle: Noise,
    /// Noise on every channel, at all rates that styles ask for.
    pub rough: Noise,
}

/// A gait of a style with a content.
#[derive(Debug, Clone)]
pub struct Performer {
    /// The style.
    pub style: Style,
    /// What is done.
    pub content: Content,
    /// First gait.
    pub from: Gait,
    /// Last gait.
    pub to: Gait,
    /// Canonical times between which the first becomes the last.
    pub change: (f64, f64),
    /// Canonical times between which all going fades out.
    pub stop: (f64, f64),
}

impl Performer {
    /// The numbers of the gait at a canonical time, with what the cycle brings.
    pub fn gait(&self, at: f64) -> Gait {
        let change = smoothstep((at - self.change.0) / (self.change.1 - self.change.0));
        let mut gait = self.from.blend(&self.to, change).styled(&self.style);
        let pace = (self.content.pace + 0.05 * self.content.drift.at(0, at)).max(0.4);
        let varied = |channel: usize| 1.0 + self.style.variability * self.content.cycle.at(channel, at);
        let step = self.content.step * varied(0);
        gait.stride_m *= pace.powf(0.55) * step;
        gait.period_s *= pace.powf(-0.45) * self.content.step * varied(1);
        gait.lift_m *= varied(2).powi(3);
        gait.swing *= pace.powf(0.5) * varied(3).powi(3);
        gait.twist *= varied(4).powi(3);
        gait.width_m *= varied(5).powi(2);
        gait
    }

    /// 1 while going, 0 when stopped.
    pub fn going(&self, at: f64) -> f64 {
        1.0 - smoothstep((at - self.stop.0) / (self.stop.1 - self.stop.0))
    }

    /// The path.
    pub fn path(&self, start: f64, end: f64) -> Path {
        let turn = |at: f64| self.going(at) * (self.content.turn + 0.06 * self.content.drift.at(1, at));
        Path::integrate(start, end, |at| self.going(at) * self.gait(at).stride_m, turn)
    }

    /// Duration of the half cycle from a canonical time, seconds.
    pub fn half_s(&self, from: f64) -> f64 {
        let limp =
            if (2.0 * from).round().rem_euclid(2.0) < 0.5 { self.style.limp } else { -self.style.limp };
        0.5 * self.gait(from + 0.25).period_s * (1.0 + limp)
    }

    /// The timeline of whole and half cycles.
    pub fn timeline(&self, start: f64, end: f64) -> Timeline {
        let halves = (2.0 * (end - start)).round() as usize;
        Timeline::from_halves(start, (0..halves).map(|i| self.half_s(start + 0.5 * i as f64)))
    }

    /// The stances of a foot between two canonical times; the last one stays where the going stops.
    pub fn stances(&self, side: usize, start: f64, end: f64, path: &Path) -> Vec<Stance> {
        let sign = [1.0, -1.0][side];
        let mut stances = Vec::new();
        let mut from = start.floor() + 0.5 * side as f64;
        let last_strike = self.stop.1 - 0.2;
        while from < end.min(last_strike) {
            let gait = self.gait(from);
            let middle = from + 0.5 * gait.duty;
            let going = self.going(middle);
            let place = path.beside(middle, sign * 0.5 * gait.width_m, gait.place_m * going);
            let to = from + gait.duty;
            stances.push(Stance {
                from,
                flat: from + 0.13 * gait.duty,
                heel_off: from + 0.5 * gait.duty,
                to,
                place,
                yaw: path.at(middle).1 + sign * 0.09,
                land: gait.land * going,
                push: gait.push * self.going(to),
                swing: Swing {
                    lift_m: gait.lift_m,
                    shape: [2.0, 3.0],
                    clearance_m: gait.clearance_m,
                    throw: Vector3::zeros(),
                },
            });
            from += 1.0;
        }
        if from >= last_strike
            && let Some(last) = stances.last_mut()
        {
            (last.heel_off, last.to) = (f64::INFINITY, f64::INFINITY);
        }
        stances
    }

    /// Trunk and arms.
    pub fn posture(&self, at: f64) -> Posture {
        use std::f64::consts::TAU;
        let gait = self.gait(at);
        let going = self.going(at);
        let wave = |shift: f64| going * (TAU * (at - shift)).cos();
        let middle = 0.5 * gait.duty;
        let mut p = self.style.hold();
        p[HEIGHT] += going * gait.height_m + going * gait.bounce_m * (2.0 * TAU * (at - middle)).cos();
        p[SIDE] += gait.sway_m * wave(middle);
        p[TILT] += going * gait.lean;
        p[YAW] -= gait.yaw * wave(0.02);
        p[LIST] += gait.list * wave(middle - 0.12);
        p[SPINE] += going * 0.5 * gait.lean;
        p[SPINE + 1] += 0.5 * (gait.yaw + gait.twist) * wave(0.02);
        p[CHEST + 1] += 0.5 * (gait.yaw + gait.twist) * wave(0.04);
        p[SPINE + 2] -= 0.6 * gait.list * wave(middle - 0.10);
        p[CHEST + 2] -= 0.6 * gait.list * wave(middle - 0.08);
        p[HEAD + 1] -= 0.8 * gait.twist * wave(0.03);
        p[HEAD] -= going * gait.lean;
        for (arm, sign) in ARMS.into_iter().zip([1.0, -1.0]) {
            // Arms go against the legs: the left leg is in front at phase 0, the left arm behind.
            let forwards = -sign * wave(self.style.lag);
            let late = -sign * wave(self.style.lag + 0.04);
            p[arm + SWING] += going * gait.swing_middle + gait.swing * forwards;
            p[arm + ABDUCT] += 0.10 + going * (gait.abduct - 0.10);
            p[arm + ELBOW] += 0.25 + going * (gait.elbow - 0.25) + gait.elbow_swing * self.style.swing * late;
        }
        p
    }

    /// The style's share of the noise at a canonical time.
    pub fn roughness(&self, at: f64) -> Posture {
        // The noise has one point a unit: a style that trembles faster walks faster along it.
        let at = at * self.style.tremor;
        Posture::from_fn(|c, _| self.style.roughness(c) * self.content.rough.at(c, at))
    }
}

/// Random content: pace, step size, turn and variation of cycles, from canonical time `start` to `end`.
pub fn content(seed: u64, start: f64, end: f64) -> Content {
    use super::noise::{between, rng};
    let mut rng = rng(seed, 0);
    let turn = match (4.0 * between(&mut rng, 0.0, 1.0)) as usize {
        0 => between(&mut rng, 0.2, 0.5),
        1 => -between(&mut rng, 0.2, 0.5),
        _ => between(&mut rng, -0.08, 0.08),
    };
    let fastest = 8.0;
    Content {
        pace: between(&mut rng, 0.72, 1.25),
        step: between(&mut rng, 0.92, 1.08),
        turn,
        drift: Noise::new(seed, 1, 2, 0.25, start, end),
        cycle: Noise::new(seed, 2, 6, 1.0, start, end),
        rough: Noise::new(seed, 3, CHANNELS, 1.0, fastest * start.min(-1.0), fastest * end),
    }
}
