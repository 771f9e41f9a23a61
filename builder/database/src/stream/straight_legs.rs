//! Placing an ankle of a leg that is nearly straight.
//!
//! The core's inverse kinematics bends a knee about the axis about which it is bent. The shin of a straight leg is only off
//! its thigh as the bones are, often to one side: the axis of that lies across the knee's own, and a leg that has to bend by
//! some centimetres would put its knee aside, now to the left and now to the right. Such a leg is bent about the hips' line
//! first, as far as it has to; the core then has only to swing it.

use gestus_core::{Pose, blob::Leg, body::two_bone_ik::Chain, math::quaternion};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// A knee that is bent by more knows its axis, radians: that of the core's inverse kinematics.
const BENT: f64 = 0.35;
/// Least bend, radians, from which on rounding does not decide which way a knee is bent.
const LEAST: f64 = 0.02;

/// Turns hip, knee and ankle of `pose` so that the ankle lies at `target`, or as near to it as a leg of at most `reach`
/// metres comes.
pub(super) fn place<const J: usize>(
    chain: &Chain,
    leg: &Leg,
    target: [f32; 3],
    reach: f32,
    pose: &mut Pose<J>,
) {
    let bent = bent(chain, target, reach).unwrap_or(*chain);
    bent.place(leg, target, reach, pose);
}

/// The leg, bent or stretched about its hinge as far as the target asks; `None` where its own axis will do.
fn bent(chain: &Chain, target: [f32; 3], reach: f32) -> Option<Chain> {
    let [hip, knee, ankle, target, side] =
        [chain.hip, chain.knee, chain.ankle, target, chain.side].map(|v| Vector3::from(v.map(f64::from)));
    let (upper, lower) = (knee - hip, ankle - knee);
    let own = Unit::try_new(upper.cross(&lower), 1e-9);
    let angle = upper.angle(&lower);
    let side = Unit::try_new(side, 1e-6)?;
    let agrees = own.map_or(0.0, |own| own.dot(&side));
    if angle >= BENT {
        return None;
    }
    // From the hips' line to its own axis as it bends.
    let share = agrees.max(0.0) * angle / BENT;
    let axis = own.map_or(side, |own| Unit::new_normalize(own.lerp(&side, 1.0 - share)));
    // |upper + turned lower| = distance, in the plane across the axis.
    let distance = (target - hip).norm().min(f64::from(reach));
    let along = upper.dot(&axis) * lower.dot(&axis);
    let (a, b) = (upper.dot(&lower) - along, upper.dot(&axis.cross(&lower)));
    let asked = 0.5 * (distance.powi(2) - upper.norm_squared() - lower.norm_squared()) - along;
    let bend = (asked / a.hypot(b).max(1e-12)).clamp(-1.0, 1.0).acos().max(LEAST);
    let turn = UnitQuaternion::from_axis_angle(&axis, b.atan2(a) + bend);
    let float = |v: Vector3<f64>| [v.x as f32, v.y as f32, v.z as f32];
    let [thigh, shin, foot] = chain.turns;
    let shin = quaternion::multiply(turn.coords.map(|v| v as f32).into(), shin);
    Some(Chain { turns: [thigh, shin, foot], ankle: float(knee + turn * lower), ..*chain })
}

#[cfg(test)]
mod tests {
    use gestus_core::math::quaternion::{IDENTITY, rotate};

    use super::*;

    const LEG: Leg = Leg { hip: 1, knee: 2, ankle: 3, toe: None, heights: [0.0; 2], rolls: [0.0; 2] };
    const DOWN: f32 = -0.4;

    /// A leg whose knee is 1 cm to the left of it, and bent by that angle, radians.
    fn leg(bend: f32) -> Chain {
        let (upper, aside) = ([0.01, DOWN, 0.0], [-0.01, DOWN, 0.0]);
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), bend);
        let lower = rotate(turn.coords.into(), aside);
        let ankle = std::array::from_fn(|i| upper[i] + lower[i]);
        let turns = [IDENTITY, turn.coords.into(), IDENTITY];
        let (hip, side) = ([0.0; 3], [1.0, 0.0, 0.0]);
        Chain { parent: IDENTITY, turns, hip, knee: upper, ankle, toe: ankle, side }
    }

    /// Where knee and ankle of the posed leg are.
    fn places(pose: &Pose<4>) -> [Vector3<f32>; 2] {
        let knee = Vector3::from(rotate(pose.rotations[1], [0.01, DOWN, 0.0]));
        let shin = quaternion::multiply(pose.rotations[1], pose.rotations[2]);
        [knee, knee + Vector3::from(rotate(shin, [-0.01, DOWN, 0.0]))]
    }

    /// The core's axis is across the knee's here: it put the knee aside by 10 cm, once to the left and once to the right.
    #[test]
    fn a_knee_that_goes_through_straight_stays_before_its_leg() {
        let mut last = None;
        for bend in -30..=30 {
            let chain = leg(0.005 * bend as f32);
            let target = [0.0, 2.0 * DOWN + 0.04, 0.0];
            let mut pose = Pose::<4>::IDENTITY;
            place(&chain, &LEG, target, 1.0, &mut pose);
            let [knee, ankle] = places(&pose);
            assert!((ankle - Vector3::from(target)).norm() < 1e-4, "{bend}: {ankle}");
            assert!(knee.x.abs() < 0.03 && knee.z > 0.1, "{bend}: {knee}");
            if let Some(last) = last.replace(knee) {
                assert!((knee - last).norm() < 0.01, "{bend}: {last} to {knee}");
            }
        }
    }

    #[test]
    fn a_leg_whose_ankle_is_there_already_stays() {
        for bend in [0.05, 0.2, 0.3, 0.5] {
            let chain = leg(bend);
            let mut pose = Pose::<4>::IDENTITY;
            place(&chain, &LEG, chain.ankle, 1.0, &mut pose);
            let [knee, _] = places(&pose);
            assert!((knee - Vector3::from(chain.knee)).norm() < 1e-3, "{bend}: {knee}");
        }
    }
}
