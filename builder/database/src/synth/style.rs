//! The eight styles: what each does to posture, amplitude, timing and roughness.
//!
//! Factors are against neutral. No style is an offset alone: an old walk is bent, and also short, slow, wide, uneven
//! in time and shaky.

use crate::synth::posture::{
    ABDUCT, ARMS, CHEST, ELBOW, FORWARD, HAND, HEAD, HEIGHT, Posture, RAISE, SPINE, SWING, TILT, TWIST,
    both_arms, posture,
};

/// Names of the styles, in the order of their indices.
pub const STYLES: [&str; 8] =
    ["neutral", "proud", "angry", "depressed", "strutting", "childlike", "old", "sexy"];

/// What a style does.
#[derive(Debug, Clone, Copy)]
pub struct Style {
    /// Duration of a cycle.
    pub period: f64,
    /// Length of a stride.
    pub stride: f64,
    /// Height of the swinging foot.
    pub lift: f64,
    /// Up and down of the hips.
    pub bounce: f64,
    /// Hips from side to side.
    pub sway: f64,
    /// Pelvis turning with the legs.
    pub yaw: f64,
    /// Pelvis dropping to the side of the swinging leg.
    pub list: f64,
    /// Chest turning against the legs.
    pub twist: f64,
    /// Arms swinging.
    pub swing: f64,
    /// Amplitude of jumps, punches and kicks.
    pub vigour: f64,
    /// Toes up at the strike, heel up at the end.
    pub roll: f64,
    /// Distance between the feet, added, metres.
    pub width_m: f64,
    /// Share of the cycle that a foot stands, added.
    pub duty: f64,
    /// Share by which the half cycle after the left strike is longer.
    pub limp: f64,
    /// Arms behind the legs, cycles.
    pub lag: f64,
    /// Durations of preparing, striking and recovering, in single actions.
    pub timing: [f64; 3],
    /// Noise on every joint, radians.
    pub rough: f64,
    /// Points of that noise in a cycle.
    pub tremor: f64,
    /// Differences from cycle to cycle: share of stride, duration and amplitudes.
    pub variability: f64,
    /// Posture of trunk and hips.
    trunk: &'static [(usize, f64)],
    /// Posture of both arms.
    arms: &'static [(usize, f64)],
}

const NEUTRAL: Style = Style {
    period: 1.0,
    stride: 1.0,
    lift: 1.0,
    bounce: 1.0,
    sway: 1.0,
    yaw: 1.0,
    list: 1.0,
    twist: 1.0,
    swing: 1.0,
    vigour: 1.0,
    roll: 1.0,
    width_m: 0.0,
    duty: 0.0,
    limp: 0.0,
    lag: 0.0,
    timing: [1.0, 1.0, 1.0],
    rough: 0.010,
    tremor: 3.0,
    variability: 0.03,
    trunk: &[],
    arms: &[],
};

const PROUD: Style = Style {
    period: 1.05,
    stride: 1.08,
    bounce: 1.3,
    twist: 1.3,
    swing: 1.15,
    roll: 1.1,
    vigour: 1.1,
    timing: [1.1, 0.95, 1.15],
    rough: 0.006,
    tremor: 2.0,
    variability: 0.02,
    trunk: &[(TILT, 0.03), (SPINE, -0.08), (CHEST, -0.14), (HEAD, -0.02), (HEIGHT, 0.005)],
    arms: &[(FORWARD, -0.15), (RAISE, 0.04), (ABDUCT, 0.12), (ELBOW, 0.05)],
    ..NEUTRAL
};

const ANGRY: Style = Style {
    period: 0.82,
    stride: 1.06,
    lift: 1.2,
    bounce: 0.9,
    yaw: 1.3,
    twist: 1.6,
    swing: 1.45,
    vigour: 1.25,
    roll: 1.15,
    width_m: 0.03,
    duty: -0.02,
    timing: [0.75, 0.75, 0.8],
    rough: 0.019,
    tremor: 5.0,
    variability: 0.05,
    trunk: &[(TILT, 0.06), (SPINE, 0.12), (CHEST, 0.08), (HEAD, 0.02), (HEIGHT, -0.015)],
    arms: &[(RAISE, 0.16), (FORWARD, 0.08), (ABDUCT, 0.22), (TWIST, 0.2), (ELBOW, 0.6), (HAND, 0.15)],
    ..NEUTRAL
};

const DEPRESSED: Style = Style {
    period: 1.32,
    stride: 0.74,
    lift: 0.6,
    bounce: 0.6,
    sway: 1.2,
    yaw: 0.6,
    list: 0.8,
    twist: 0.35,
    swing: 0.3,
    vigour: 0.7,
    roll: 0.6,
    duty: 0.03,
    lag: 0.05,
    timing: [1.5, 1.2, 1.35],
    rough: 0.008,
    tremor: 1.5,
    variability: 0.03,
    trunk: &[(TILT, 0.04), (SPINE, 0.18), (CHEST, 0.2), (HEAD, 0.42), (HEIGHT, -0.015)],
    arms: &[(RAISE, -0.05), (FORWARD, 0.22), (ABDUCT, -0.03), (TWIST, 0.25), (ELBOW, -0.05)],
    ..NEUTRAL
};

const STRUTTING: Style = Style {
    period: 1.16,
    stride: 1.02,
    lift: 1.3,
    bounce: 1.9,
    sway: 1.6,
    yaw: 1.3,
    list: 1.5,
    twist: 2.4,
    swing: 1.35,
    vigour: 1.05,
    roll: 1.1,
    width_m: 0.03,
    lag: 0.06,
    timing: [1.25, 0.9, 1.2],
    rough: 0.012,
    tremor: 2.0,
    variability: 0.045,
    trunk: &[(TILT, -0.04), (SPINE, -0.06), (CHEST, -0.06), (HEAD, 0.0)],
    arms: &[(FORWARD, -0.08), (ABDUCT, 0.3), (TWIST, 0.35), (ELBOW, 0.35)],
    ..NEUTRAL
};

const CHILDLIKE: Style = Style {
    period: 0.76,
    stride: 0.80,
    lift: 1.7,
    bounce: 2.0,
    sway: 1.3,
    yaw: 1.2,
    list: 1.3,
    twist: 1.5,
    swing: 1.6,
    vigour: 1.1,
    roll: 0.7,
    width_m: 0.04,
    duty: -0.03,
    timing: [0.8, 0.9, 0.9],
    rough: 0.028,
    tremor: 4.0,
    variability: 0.09,
    trunk: &[(TILT, 0.04), (SPINE, -0.05), (CHEST, 0.03), (HEAD, -0.12)],
    arms: &[(RAISE, 0.08), (ABDUCT, 0.42), (ELBOW, 0.25), (HAND, -0.3)],
    ..NEUTRAL
};

const OLD: Style = Style {
    period: 1.18,
    stride: 0.56,
    lift: 0.45,
    bounce: 0.5,
    sway: 1.5,
    yaw: 0.6,
    list: 0.7,
    twist: 0.5,
    swing: 0.45,
    vigour: 0.6,
    roll: 0.35,
    width_m: 0.06,
    duty: 0.05,
    limp: 0.05,
    timing: [1.4, 1.35, 1.5],
    rough: 0.026,
    tremor: 7.0,
    variability: 0.07,
    trunk: &[(TILT, 0.12), (SPINE, 0.22), (CHEST, 0.22), (HEAD, -0.22), (HEIGHT, -0.07)],
    arms: &[(RAISE, 0.06), (FORWARD, 0.2), (SWING, 0.1), (ABDUCT, 0.14), (TWIST, 0.3), (ELBOW, 0.65)],
    ..NEUTRAL
};

const SEXY: Style = Style {
    period: 1.10,
    stride: 0.96,
    lift: 0.9,
    sway: 1.9,
    yaw: 2.0,
    list: 2.6,
    twist: 1.2,
    swing: 0.9,
    vigour: 0.9,
    roll: 1.0,
    width_m: -0.10,
    duty: 0.01,
    lag: 0.03,
    timing: [1.2, 1.05, 1.25],
    rough: 0.007,
    tremor: 2.0,
    variability: 0.025,
    trunk: &[(TILT, 0.12), (SPINE, -0.16), (CHEST, -0.1), (HEAD, 0.06)],
    arms: &[(FORWARD, -0.12), (ABDUCT, 0.16), (TWIST, -0.2), (ELBOW, 0.1), (HAND, -0.35)],
    ..NEUTRAL
};

impl Style {
    /// The style of an index into [`STYLES`].
    pub fn of(index: usize) -> Self {
        [NEUTRAL, PROUD, ANGRY, DEPRESSED, STRUTTING, CHILDLIKE, OLD, SEXY][index.min(STYLES.len() - 1)]
    }

    /// How it holds the body.
    pub fn hold(&self) -> Posture {
        posture(self.trunk) + both_arms(self.arms)
    }

    /// How much of the noise reaches a channel: as rough as it is, in radians; hips in metres.
    pub fn roughness(&self, channel: usize) -> f64 {
        use super::posture::{AHEAD, LIST, SIDE, YAW};
        let weight = match channel {
            HEIGHT | SIDE | AHEAD => 0.1,
            TILT | YAW | LIST => 0.5,
            c if c >= ARMS[0] => [0.4, 0.4, 1.3, 1.0, 1.0, 1.4, 1.6][(c - ARMS[0]) % 7],
            _ => 1.0,
        };
        weight * self.rough
    }
}
