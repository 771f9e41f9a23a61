//! A body that stands still.
//!
//! What is predicted for a pose that does not change is the motion of its neighbors, which walk on. So where the input
//! stands, the output keeps the place that it has beside the input:
//!
//! ```text
//! a  = max(ω, v / 0.2 m) / ω₀                  fastest joint, rad/s, and root, m/s, over Config::still_speed
//! s* = clamp((3 - a) / 2, 0, 1)                1 at that speed, 0 at three times that
//! v' = x + (1 - s) (v - x)                     speeds of the root
//! y' = y + s (x + (y'[t-1] - x[t-1]) - y)      joints, tilt and height
//! ```
//!
//! with y, v the output after strength, and s on its way to s*: [`SPEED_S`] for the root, [`POSTURE_S`] for joints, and
//! [`RELEASE_S`] back for both. No motion in is no motion out, and a motion as small as breath passes as it is. A change
//! of style, strength, labels or mask lets the joints follow the prediction for [`CHANGE_S`] more. What is fed back to
//! the method stays unchanged.
//!
//! Cost: a comparison a frame; while the body stands some operations a dof.

use super::speed_limit::Fastest;
use crate::{
    blob::layout::dof,
    math::{abs, clamp, sqrt},
};

/// Time in which the root comes to rest, seconds.
pub const SPEED_S: f32 = 0.2;
/// Time in which the joints come to rest, seconds.
pub const POSTURE_S: f32 = 0.5;
/// Time in which both go on with the prediction again, seconds.
pub const RELEASE_S: f32 = 0.2;
/// How much longer the joints follow the prediction after a change of settings, seconds.
pub const CHANGE_S: f32 = 1.0;
/// Speed of the root that counts as much as a joint that turns by 1 rad/s, m/s.
const ROOT: f32 = 0.2;
/// How often the speed of a body that stands one moves that certainly does not.
const MOVES: f32 = 3.0;

/// How still the body stands.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Stillness {
    /// Part of the root's speed that is the input's, 0 to 1.
    speed: f32,
    /// Part of the posture that is kept, 0 to 1; below 0 while a change of settings is on its way.
    posture: f32,
}

impl Stillness {
    /// A body that moves.
    pub const fn new() -> Self {
        Self { speed: 0.0, posture: 0.0 }
    }

    /// The settings have changed: the joints go on with the prediction for a while.
    pub fn settings_changed(&mut self) {
        self.posture = -CHANGE_S / POSTURE_S;
    }

    /// Measures a frame of the input: its dofs, those `seconds` ago, and the joint that turned most between. `speed` is
    /// that of a joint of a body that stands, rad/s; 0 for none.
    pub fn see(&mut self, x: &[f32], height_prev: f32, fastest: &Fastest, seconds: f32, speed: f32) {
        let at = |d: usize| x.get(d).copied().unwrap_or(0.0);
        let turning = abs(at(dof::YAW)) * seconds;
        let way = [at(dof::FORWARD) * seconds, at(dof::LEFT) * seconds, at(dof::HEIGHT) - height_prev];
        let way2 = way.iter().fold(0.0, |sum, w| sum + w * w) / (ROOT * ROOT);
        let of_root = if way2 > turning * turning { way2 } else { turning * turning };
        let most2 = if fastest.apart2 > of_root { fastest.apart2 } else { of_root };
        let (stands, moves) = (speed * seconds, MOVES * speed * seconds);
        // Almost every body moves.
        let still = if most2 < moves * moves {
            clamp((moves - sqrt(most2)) / (moves - stands), 0.0, 1.0)
        } else {
            0.0
        };
        let release = seconds / RELEASE_S;
        self.speed += clamp(still - self.speed, -release, seconds / SPEED_S);
        self.posture += clamp(still - self.posture, -release, seconds / POSTURE_S);
    }

    /// Whether anything of the output is kept.
    pub fn is_engaged(&self) -> bool {
        self.speed > 0.0 || self.posture > 0.0
    }

    /// True where nothing changes: contacts are those of before.
    pub fn stands(&self) -> bool {
        self.posture >= 1.0
    }

    /// Keeps the output's place beside the input: `offset` is `y'[t-1] - x[t-1]`.
    #[inline(never)]
    pub fn keep(&self, x: &[f32], offset: &[f32], output: &mut [f32]) {
        let posture = clamp(self.posture, 0.0, 1.0);
        for (d, ((output, &x), &offset)) in output.iter_mut().zip(x).zip(offset).enumerate() {
            let (part, offset) = match d {
                dof::FORWARD | dof::LEFT | dof::YAW => (self.speed, 0.0),
                _ => (posture, offset),
            };
            *output += part * (x + offset - *output);
        }
    }
}
