//! Plans of the feet: positions and times of stances, and the swings between them.
//!
//! In stance a foot rolls over its heel until it is flat, rests, then rolls over its ball with flat toes. What touches the
//! floor never moves. It counts as contact from the moment the ball is down until the foot leaves the floor. In swing the
//! ankle follows a cubic Hermite curve between stances, with the velocities of both ends, raised by `vᵃ(1-v)ᵇ` and by
//! as much as the sole needs to stay clear of the floor.

use nalgebra::Vector3;

use crate::synth::{
    posture::{Foot, about_x, sole_height},
    skeleton::{ANKLE_HEIGHT_M, BALL, HEEL},
};
use gestus_motion::{
    body::about_y,
    statistics::{hermite, smoothstep},
};

/// A step length of canonical time for derivatives.
const TINY: f64 = 1e-4;

/// A swing to the next stance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Swing {
    /// Height of the ankle's raise, metres.
    pub lift_m: f64,
    /// Exponents a and b of the raise.
    pub shape: [f64; 2],
    /// Clearance of the sole in the middle, metres.
    pub clearance_m: f64,
    /// Additional displacement in the middle (kicks), metres in the world.
    pub throw: Vector3<f64>,
}

/// A stance, in canonical time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stance {
    /// First touch.
    pub from: f64,
    /// Ball down.
    pub flat: f64,
    /// Heel off.
    pub heel_off: f64,
    /// Last touch.
    pub to: f64,
    /// Ground position (x, z) below the ankle of the flat foot, metres.
    pub place: [f64; 2],
    /// Heading of the foot.
    pub yaw: f64,
    /// Toes up at the first touch, radians.
    pub land: f64,
    /// Heel up at the last touch, radians.
    pub push: f64,
    /// The swing to the next stance.
    pub swing: Swing,
}

impl Stance {
    /// A foot that stands flat all the time.
    pub fn still(place: [f64; 2], yaw: f64) -> Self {
        let swing = Swing { lift_m: 0.08, shape: [2.0, 3.0], clearance_m: 0.02, throw: Vector3::zeros() };
        let (from, to) = (f64::NEG_INFINITY, f64::INFINITY);
        Self { from, flat: from, heel_off: to, to, place, yaw, land: 0.0, push: 0.0, swing }
    }

    /// The foot at a moment of the stance.
    fn foot(&self, at: f64) -> Foot {
        let turn = about_y(self.yaw);
        let flat = Vector3::new(self.place[0], ANKLE_HEIGHT_M, self.place[1]);
        if at < self.flat {
            let left = (self.flat - at) / (self.flat - self.from).max(1e-9);
            let pitch = -self.land * left.powi(2);
            let ankle = flat + turn * (HEEL - about_x(pitch) * HEEL);
            Foot { ankle, yaw: self.yaw, pitch, bend: 0.0 }
        } else if at > self.heel_off {
            let gone = (at - self.heel_off) / (self.to - self.heel_off).max(1e-9);
            let pitch = self.push * gone.powi(2);
            let ankle = flat + turn * (BALL - about_x(pitch) * BALL);
            Foot { ankle, yaw: self.yaw, pitch, bend: pitch }
        } else {
            Foot { ankle: flat, yaw: self.yaw, pitch: 0.0, bend: 0.0 }
        }
    }
}

/// A foot at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Planned {
    /// Where it is, without the throw.
    pub foot: Foot,
    /// Its ball is down.
    pub planted: bool,
    /// Any part of its sole is on the floor: from the first touch of the heel to the last of the toes.
    pub touches: bool,
    /// How far it is thrown from there, metres.
    pub throw: Vector3<f64>,
}

/// The foot at a canonical time, from its stances in order.
pub fn foot_at(stances: &[Stance], at: f64) -> Planned {
    let next = stances.iter().position(|s| s.from > at).unwrap_or(stances.len());
    let standing = |stance: &Stance| Planned {
        foot: stance.foot(at),
        planted: at >= stance.flat && at <= stance.to,
        touches: at >= stance.from && at <= stance.to,
        throw: Vector3::zeros(),
    };
    if next == 0 {
        return Planned { planted: false, touches: false, ..standing(&stances[0]) };
    }
    let last = &stances[next - 1];
    if at <= last.to || next == stances.len() {
        return standing(last);
    }
    swing(last, &stances[next], at)
}

fn swing(last: &Stance, next: &Stance, at: f64) -> Planned {
    let span = next.from - last.to;
    let v = (at - last.to) / span;
    let (off, on) = (last.foot(last.to), next.foot(next.from));
    let (before, after) = (last.foot(last.to - TINY), next.foot(next.from + TINY));
    let [h0, g0, h1, g1] = hermite(v);
    let rate = span / TINY;
    let mut ankle = off.ankle * h0
        + (off.ankle - before.ankle) * rate * g0
        + on.ankle * h1
        + (after.ankle - on.ankle) * rate * (0.25 * g1);
    // The foot meets the floor faster than it can have been turned: a quarter of that speed carries over.
    let pitch = off.pitch * h0
        + (off.pitch - before.pitch) * rate * g0
        + on.pitch * h1
        + (after.pitch - on.pitch) * rate * (0.25 * g1);
    let bend = off.bend * (1.0 - smoothstep(2.0 * v));
    let yaw = off.yaw + (on.yaw - off.yaw) * smoothstep(v);
    let [a, b] = last.swing.shape;
    let peak = a / (a + b);
    let hump = (v / peak).powf(a) * ((1.0 - v) / (1.0 - peak)).powf(b);
    ankle.y += last.swing.lift_m * hump;
    let mut foot = Foot { ankle, yaw, pitch, bend };
    let clear = last.swing.clearance_m * 16.0 * (v * (1.0 - v)).powi(2);
    let lacking = clear - sole_height(&foot);
    foot.ankle.y += 0.5 * (lacking + lacking.hypot(clear));
    let thrown = (4.0 * v * (1.0 - v)).powi(3);
    Planned { foot, planted: false, touches: false, throw: last.swing.throw * thrown }
}
