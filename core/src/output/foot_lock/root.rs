//! How the foot lock moves the root: it follows the feet over the ground and in height, and the hips drop where a held foot
//! stretches its leg.

use super::foot::{Foot, Slide, heights_over_floor, lower_of, reach};
use crate::{
    blob::Leg,
    body::two_bone_ik::Chain,
    math::{
        clamp, exp, maximum, minimum,
        quaternion::Vector,
        sqrt,
        vector::{add, subtract},
    },
};

/// Time at the start of a stream for which the root follows standing feet, seconds.
const START_S: f32 = 0.25;
/// Rate of the spring that moves the root's height, 1/s.
const ROOT_RATE: f32 = 6.0;
/// Greatest drop of the hips for a stretched leg, metres.
const HIP_DROP_M: f32 = 0.04;
/// Time constant with which the hips rise again, seconds.
const HIP_DROP_S: f32 = 0.15;
/// Greatest speed of the drop, m/s.
const HIP_DROP_SPEED: f32 = 0.5;
/// Greatest speed with which held feet pull the root over the ground, m/s.
const PULL_SPEED: f32 = 2.0;

/// A leg, and whether it stands.
pub(super) struct Standing<'a> {
    pub leg: &'a Leg,
    pub chain: &'a Chain,
    /// Height of the floor under its foot, metres.
    pub floor_m: f32,
    pub stands: bool,
}

/// What the lock adds to the predicted root, and its state between frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct RootShift {
    /// How much higher the root is than predicted, metres.
    pub lift: f32,
    /// Rate of change of `lift`, m/s.
    rise: f32,
    /// Drop of the hips for a stretched leg, metres, 0 or less.
    pub hip_drop: f32,
    /// Offset of the root from its prediction on the ground, x and z, metres.
    shift: [f32; 2],
    /// Time for which a foot has stood in this stream, seconds, at most [`START_S`].
    stood_s: f32,
}

impl RootShift {
    pub const NONE: Self = Self { lift: 0.0, rise: 0.0, hip_drop: 0.0, shift: [0.0; 2], stood_s: 0.0 };

    /// Whether the root is moved at all.
    pub fn is_engaged(&self) -> bool {
        [self.lift, self.rise, self.hip_drop, self.shift[0], self.shift[1]].iter().any(|v| *v != 0.0)
    }

    /// Adds the offset on the ground to the position of a predicted root.
    pub fn apply_shift(&self, root: &mut Vector) {
        *root = add(*root, [self.shift[0], 0.0, self.shift[1]]);
    }

    /// How far the root has to move in this frame so that it follows its feet, x and z, metres.
    ///
    /// The root follows all of the slide in the first frame, half in the second, and none after [`START_S`]: at the start
    /// nothing better is known.
    pub fn follow_feet(&mut self, slid: Slide, step_s: f32) -> [f32; 2] {
        let Slide { x, feet, z } = slid;
        if feet == 0.0 || self.stood_s >= START_S {
            return [0.0; 2];
        }
        self.stood_s = clamp(self.stood_s + step_s, 1e-3, START_S);
        let part = clamp(step_s / self.stood_s, 0.0, 1.0);
        let most = PULL_SPEED * step_s;
        [x, z].map(|way| part * clamp(way / feet, -most, most))
    }

    /// Moves the root on the ground by x and z, metres; held feet stay in place.
    pub fn move_on_ground(&mut self, feet: &mut [Foot; 2], [x, z]: [f32; 2], root: &mut Vector) {
        self.shift = [self.shift[0] + x, self.shift[1] + z];
        *root = add(*root, [x, 0.0, z]);
        for foot in feet.iter_mut().filter(|foot| foot.is_held()) {
            foot.offset = subtract(foot.offset, [x, 0.0, z]);
        }
    }

    /// Moves the root's lift towards the mean height at which the standing feet are on the floor.
    pub fn update_lift(&mut self, legs: [Standing<'_>; 2], step_s: f32, on: bool) {
        let (mut sum, mut count) = (0.0, 0.0);
        for Standing { leg, chain, floor_m, stands } in legs {
            if stands {
                sum -= lower_of(heights_over_floor(leg, chain, floor_m));
                count += 1.0;
            }
        }
        // No foot on the ground: the root keeps its lift.
        let aloft = if on { self.lift } else { 0.0 };
        let target = if count > 0.0 { sum / count } else { aloft };
        // Stable at any frame rate: a step of the spring is at most half a radian.
        let rate = clamp(ROOT_RATE, 0.0, 0.5 / clamp(step_s, 1e-3, 10.0));
        self.rise += step_s * (rate * rate * (target - self.lift) - 2.0 * rate * self.rise);
        self.lift += step_s * self.rise;
    }

    /// Drops the hips at once where a held foot stretches its leg, and raises them again slowly. Returns true where the drop
    /// is not enough.
    pub fn drop_hips(&mut self, feet: &[Foot; 2], chains: &[Chain; 2], step_s: f32) -> bool {
        let mut need = 0.0;
        for (foot, chain) in feet.iter().zip(chains).filter(|(foot, _)| foot.is_held()) {
            let way = subtract(add(chain.ankle, foot.offset), chain.hip);
            let reach = reach(chain);
            // How far the ankle can be below the hip joint at this distance on the ground.
            let below = sqrt(reach * reach - way[0] * way[0] - way[2] * way[2]);
            let down = way[1] + below;
            need = minimum(down, need);
        }
        let goes = clamp(need, self.hip_drop - HIP_DROP_SPEED * step_s, 0.0);
        let goes = maximum(-HIP_DROP_M, goes);
        let risen = self.hip_drop * exp(-step_s / HIP_DROP_S);
        self.hip_drop = minimum(goes, risen);
        need < self.hip_drop
    }

    /// How far the root has to move on the ground, x and z, metres, so that held feet are within reach after the drop.
    pub fn way_into_reach(&self, feet: &[Foot; 2], chains: &[Chain; 2], step_s: f32) -> [f32; 2] {
        let mut way = [0.0; 2];
        for (foot, chain) in feet.iter().zip(chains).filter(|(foot, _)| foot.is_held()) {
            let hip = add(chain.hip, [way[0], self.hip_drop, way[1]]);
            let [x, y, z] = subtract(add(chain.ankle, foot.offset), hip);
            let (reach, distance) = (reach(chain), sqrt(x * x + z * z));
            let over = distance - sqrt(reach * reach - y * y);
            if over > 0.0 {
                let part = clamp(over, 0.0, PULL_SPEED * step_s) / distance;
                way = [way[0] + x * part, way[1] + z * part];
            }
        }
        way
    }
}
