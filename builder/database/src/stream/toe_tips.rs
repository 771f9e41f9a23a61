//! Tips of toes that are kept out of the floor.
//!
//! Inverse kinematics hold ankles and toe joints; what lies beyond the toe joint moves as in the input. A style that rolls
//! over the toes further than the input does pushes their tips into the floor. The toe joint then bends up, in the plane
//! of the toes, until the tip is on the floor again: as toes do.

use gestus_motion::{
    binding::Binding,
    clip::{Clip, Skeleton},
    statistics::extent,
};
use nalgebra::{Unit, UnitQuaternion, Vector3};

use crate::retarget::{
    Retarget,
    parts::{Part, Side},
};

/// Depth below the input's lowest at which a tip stays, metres: that of feet.
const DEEP_M: f64 = 0.01;
/// Greatest angle that toes are bent by, radians.
const MAX_BEND_RAD: f64 = 1.0;

/// The toes of a foot.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Toes {
    joint: usize,
    /// Their end in the joint's frame, metres.
    tip: Vector3<f64>,
    /// Height along up that it stays above, metres.
    least_m: f64,
}

/// The toes of a body, as far as it has joints for them that end somewhere.
#[derive(Debug, Clone, PartialEq)]
pub struct ToeTips {
    up: Vector3<f64>,
    feet: Vec<Toes>,
}

impl ToeTips {
    /// Those of a clip's body, whose floor is at `floor_m` along `up`.
    pub fn of(binding: &Binding, map: &Retarget, clip: &Clip, up: Vector3<f64>, floor_m: f64) -> Self {
        let toes = |side| {
            let joint = map.source.parts.get(Part::Toes(side))?;
            let tip = tip(&clip.skeleton, joint, &binding.tips(joint))?;
            let (lowest, _) = extent(clip.frames.iter().map(|frame| {
                let (places, turns) = frame.world(&clip.skeleton);
                (places[joint] + turns[joint] * tip).dot(&up)
            }));
            Some(Toes { joint, tip, least_m: lowest.min(floor_m) - DEEP_M })
        };
        Self { up, feet: Side::BOTH.into_iter().filter_map(toes).collect() }
    }

    /// Bends the toes of a clip that are in the floor.
    pub fn raise(&self, clip: &mut Clip) {
        for frame in &mut clip.frames {
            let (places, turns) = frame.world(&clip.skeleton);
            for toes in &self.feet {
                let along = turns[toes.joint] * toes.tip;
                let length = along.norm();
                let [now, least] = [along.dot(&self.up), toes.least_m - places[toes.joint].dot(&self.up)]
                    .map(|height| (height / length).clamp(-1.0, 1.0).asin());
                let Some(axis) = Unit::try_new(along.cross(&self.up), 1e-9 * length) else { continue };
                if now < least {
                    let bend = UnitQuaternion::from_axis_angle(&axis, (least - now).min(MAX_BEND_RAD));
                    let own = turns[toes.joint];
                    frame.rotations[toes.joint] = frame.rotations[toes.joint] * own.inverse() * bend * own;
                }
            }
        }
    }
}

/// The end of the toes: the furthest joint on them, or the furthest of the ends that the file states.
fn tip(skeleton: &Skeleton, toes: usize, stated: &[Vector3<f64>]) -> Option<Vector3<f64>> {
    let joints = (0..skeleton.joints()).filter(|&j| skeleton.parents[j] == Some(toes));
    let furthest = |tips: &mut dyn Iterator<Item = Vector3<f64>>| {
        tips.filter(|tip| tip.norm() > 1e-3).max_by(|a, b| a.norm().total_cmp(&b.norm()))
    };
    furthest(&mut joints.map(|j| skeleton.offsets[j])).or_else(|| furthest(&mut stated.iter().copied()))
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use gestus_motion::clip::Frame;

    use super::*;

    /// An ankle that carries toes, 10 cm of them behind their joint; the ankle is 12 cm high.
    fn foot(pitches: &[[f64; 2]]) -> Clip {
        let skeleton = Skeleton {
            names: ["ankle", "toes"].map(String::from).to_vec(),
            parents: vec![None, Some(0)],
            offsets: vec![Vector3::zeros(), Vector3::new(0.0, 0.0, 0.15)],
        };
        let frame = |&[ankle, toes]: &[f64; 2]| Frame {
            root: Vector3::new(0.0, 0.12, 0.0),
            rotations: [ankle, toes]
                .map(|pitch| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pitch))
                .to_vec(),
        };
        let frames = pitches.iter().map(frame).collect();
        Clip { name: "foot".into(), skeleton: Arc::new(skeleton), rate_hz: 30.0, frames }
    }

    #[test]
    fn tips_in_the_floor_are_bent_up_to_it_and_others_stay() {
        let (up, tip) = (Vector3::y(), Vector3::new(0.0, 0.0, 0.1));
        let tips = ToeTips { up, feet: vec![Toes { joint: 1, tip, least_m: -DEEP_M }] };
        // Flat, on tiptoe with bent toes, on tiptoe, and turned aside as well.
        let given = foot(&[[0.0, 0.0], [0.8, -0.8], [0.8, 0.0], [0.8, 0.3]]);
        let mut raised = given.clone();
        raised.frames[3].rotations[0] =
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.9) * raised.frames[3].rotations[0];
        let before = raised.clone();
        tips.raise(&mut raised);
        assert_eq!(raised.frames[..2], given.frames[..2]);
        for (frame, before) in raised.frames.iter().zip(&before.frames).skip(2) {
            let height = |frame: &Frame| {
                let (places, turns) = frame.world(&given.skeleton);
                (places[1] + turns[1] * tip).y
            };
            assert!(height(before) < -0.05 && (height(frame) + DEEP_M).abs() < 1e-9, "{}", height(frame));
            assert_eq!(frame.rotations[0], before.rotations[0]);
            // It bends, and neither twists nor turns aside.
            let across = frame.world(&given.skeleton).1[1] * Vector3::x();
            assert!(across.y.abs() < 1e-9, "{across}");
        }
        // A foot that is deep in the floor is not bent backwards.
        let mut deep = foot(&[[0.8, 0.0]]);
        deep.frames[0].root.y = -0.5;
        let given = deep.clone();
        tips.raise(&mut deep);
        assert!(deep.frames[0].angle_to(&given.frames[0]) <= MAX_BEND_RAD + 1e-9);
    }

    #[test]
    fn the_tip_is_the_furthest_joint_or_what_the_file_states() {
        let clip = foot(&[[0.0, 0.0]]);
        let stated = [Vector3::new(0.0, 0.0, 0.07), Vector3::zeros()];
        assert_eq!(tip(&clip.skeleton, 1, &stated), Some(stated[0]));
        assert_eq!(tip(&clip.skeleton, 0, &stated), Some(Vector3::new(0.0, 0.0, 0.15)));
        assert_eq!(tip(&clip.skeleton, 1, &[]), None);
    }
}
