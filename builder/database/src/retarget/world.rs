//! Poses in the world, and means over some of them.

use std::{iter::Sum, ops::Div};

use gestus_motion::clip::{Frame, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

use super::{
    identify::Parts,
    parts::{Part, Side},
};

/// World positions and orientations of the joints in one frame, metres, Y up.
pub(super) struct World {
    pub turns: Vec<UnitQuaternion<f64>>,
    pub places: Vec<Vector3<f64>>,
}

impl World {
    /// Poses a skeleton.
    pub fn of(skeleton: &Skeleton, frame: &Frame) -> Self {
        let (places, turns) = frame.world(skeleton);
        Self { turns, places }
    }

    /// Whether the body stands, sits or squats: its hips are high over a foot, or its trunk and a shin are upright.
    pub fn is_up(&self, parts: &Parts, leg_m: f64) -> bool {
        Side::BOTH.into_iter().any(|side| {
            let limb = [Part::UpperArm, Part::UpperLeg, Part::LowerLeg, Part::Foot];
            let [arm, hip, knee, ankle] = limb.map(|part| self.places[parts.get(part(side)).unwrap_or(0)]);
            let upright = |bone: Vector3<f64>| bone.y > 0.5 * bone.norm();
            hip.y - ankle.y > 0.6 * leg_m || (upright(arm - hip) && upright(knee - ankle))
        })
    }
}

/// Mean over some poses; 0 over none.
pub(super) fn mean_in<'a, T: Sum + Div<f64, Output = T>>(
    worlds: impl IntoIterator<Item = &'a World, IntoIter: ExactSizeIterator>,
    of: impl Fn(&World) -> T,
) -> T {
    let worlds = worlds.into_iter();
    let count = worlds.len().max(1) as f64;
    worlds.map(of).sum::<T>() / count
}

/// Mean of a vector of the world in some poses, as a joint sees it.
pub(super) fn seen_in<'a>(
    worlds: impl IntoIterator<Item = &'a World, IntoIter: ExactSizeIterator>,
    joint: usize,
    of: impl Fn(&World) -> Vector3<f64>,
) -> Vector3<f64> {
    mean_in(worlds, |w| w.turns[joint].inverse() * of(w))
}
