//! Keeps a body still that stands still.
//!
//! The prediction for a constant pose is the motion of its neighbors, which walk on. Where the input stands, the output
//! therefore keeps its offset from the input:
//!
//! ```text
//! a  = max(ω, v / 0.2 m) / ω₀                  ω: fastest joint, rad/s; v: root, m/s; ω₀: Config::still_speed
//! s* = clamp((3 - a) / 2, 0, 1)                1 at speed ω₀, 0 at three times that
//! v' = x + (1 - s) (v - x)                     speeds of the root
//! y' = y + s (x + (y'[t-1] - x[t-1]) - y)      joints, tilt and height
//! ```
//!
//! y and v are the output after strength. s approaches s* within 0.2 s for the root and 0.5 s for the joints, and returns to
//! 0 within 0.2 s. A constant input gives a constant output, and a motion as small as breathing passes unchanged. After a
//! change of style, strength, labels or mask the joints follow the prediction for another second. The prediction that
//! is fed back to the method does not change.
//!
//! Cost: a comparison a frame; while the body stands, some operations a dof.

use super::speed_limit::Fastest;
use crate::{
    blob::layout::dof,
    math::{abs, clamp, maximum, sqrt},
};

/// Time in which the root comes to rest, seconds.
const SPEED_S: f32 = 0.2;
/// Time in which the joints come to rest, seconds.
const POSTURE_S: f32 = 0.5;
/// Time in which both return to the prediction, seconds.
const RELEASE_S: f32 = 0.2;
/// Time for which the joints still follow the prediction after a change of settings, seconds.
const CHANGE_S: f32 = 1.0;
/// Travel of the root that counts as much as one radian of a joint, metres.
const METRES_PER_RADIAN: f32 = 0.2;
/// Multiple of [`Config::still_speed`](crate::Config::still_speed) at which a body certainly moves.
const MOVING_RATIO: f32 = 3.0;

/// How still the body stands.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Stillness {
    /// s of the root, 0 to 1.
    speed: f32,
    /// s of the joints, 0 to 1; below 0 while a change of settings takes effect.
    posture: f32,
}

impl Stillness {
    /// The state of a moving body.
    pub const fn new() -> Self {
        Self { speed: 0.0, posture: 0.0 }
    }

    /// Lets the joints follow the prediction for a while after a change of settings.
    pub fn settings_changed(&mut self) {
        self.posture = -CHANGE_S / POSTURE_S;
    }

    /// Measures an input frame with dofs `x`. `height_prev` is the root's height `seconds` before, and `fastest` the
    /// joint that turned most since then. `speed` is ω₀ in rad/s; 0 turns the function off.
    pub fn observe(&mut self, x: &[f32], height_prev: f32, fastest: &Fastest, seconds: f32, speed: f32) {
        let at = |d: usize| x.get(d).copied().unwrap_or(0.0);
        let turning = abs(at(dof::YAW)) * seconds;
        let travel = [at(dof::FORWARD) * seconds, at(dof::LEFT) * seconds, at(dof::HEIGHT) - height_prev];
        let travel2 = travel.iter().fold(0.0, |sum, w| sum + w * w) / (METRES_PER_RADIAN * METRES_PER_RADIAN);
        let of_root = maximum(travel2, turning * turning);
        let max2 = maximum(fastest.change2, of_root);
        let (standing, moving) = (speed * seconds, MOVING_RATIO * speed * seconds);
        // Most bodies move, and need no square root.
        let still = if max2 < moving * moving {
            clamp((moving - sqrt(max2)) / (moving - standing), 0.0, 1.0)
        } else {
            0.0
        };
        let release = seconds / RELEASE_S;
        self.speed += clamp(still - self.speed, -release, seconds / SPEED_S);
        self.posture += clamp(still - self.posture, -release, seconds / POSTURE_S);
    }

    /// Whether [`apply`](Self::apply) would change the output.
    pub fn is_engaged(&self) -> bool {
        self.speed > 0.0 || self.posture > 0.0
    }

    /// True where the output keeps its posture entirely, and so its contacts.
    pub fn is_still(&self) -> bool {
        self.posture >= 1.0
    }

    /// Moves the output towards the input plus `offset`, which is `y'[t-1] - x[t-1]`. All slices are `[dofs]`.
    #[inline(never)]
    pub fn apply(&self, x: &[f32], offset: &[f32], output: &mut [f32]) {
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
