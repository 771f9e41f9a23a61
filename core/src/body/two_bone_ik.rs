//! Inverse kinematics of a leg: two bones, in closed form.
//!
//! The ankle moves to a target. Only three joints turn: the knee, about the axis about which it is bent already, so that
//! it keeps its direction (a knee that the prediction bent slightly backwards is corrected); the hip, by the shortest arc
//! that brings the ankle to the target; and the ankle, so that the foot keeps its orientation in the world.
//!
//! ```text
//! cos φ = (d² - l₁² - l₂²) / (2 l₁ l₂)      φ: how far the knee is bent; d: from hip to target; l: the bones
//! ```
//!
//! Source: the analytic limb of Tolani, Goswami and Badler 2000, "Real-time inverse kinematics techniques for
//! anthropomorphic limbs", with the swivel angle left as it is; Kovar, Schreiner and Gleicher 2002, "Footskate cleanup
//! for motion capture editing", section 5.3. Cost: about 1,200 instructions a leg, kinematics included.

use crate::{
    blob::{Database, Leg},
    body::pose::Pose,
    math::{
        acos, atan2,
        quaternion::{self, IDENTITY, Quaternion, Vector, conjugate, multiply, rotate},
        sin_cos, sqrt,
        vector::{add, cross, dot, norm, subtract},
    },
};

/// Squared length below which a vector has no direction, metres² (or its square).
const NO_DIRECTION: f32 = 1e-12;

/// A limb that is bent by less than this to the wrong side is bent to the right one, radians.
const NEARLY_STRAIGHT: f32 = 0.35;

/// Where a leg is, in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Chain {
    /// Orientation of the joint above the hip joint.
    pub parent: Quaternion,
    /// Orientations of thigh, shin and foot.
    pub turns: [Quaternion; 3],
    /// The hip joint, metres.
    pub hip: Vector,
    /// The knee.
    pub knee: Vector,
    /// The ankle.
    pub ankle: Vector,
    /// The toes; the ankle where the skeleton has no toes.
    pub toe: Vector,
    /// A side axis of the body, from right to left: about which a straight knee bends.
    pub side: Vector,
}

impl Chain {
    /// A leg of a pose, by forward kinematics.
    #[inline(never)]
    pub fn of<const J: usize>(database: &Database<'_>, leg: &Leg, pose: &Pose<J>) -> Self {
        let turn = |joint: usize| pose.rotations.get(joint).copied().unwrap_or(IDENTITY);
        let offset = |joint: usize| database.joint(joint).offset;
        // From the hip joint up to the root: parents come before their children, so that this ends.
        let (mut parent, mut hip) = (IDENTITY, offset(leg.hip));
        let mut above = database.joint(leg.hip).parent;
        for _ in 0..J {
            let Some(joint) = above else { break };
            hip = rotate(turn(joint), hip);
            parent = multiply(turn(joint), parent);
            above = database.joint(joint).parent;
            hip = add(hip, if above.is_some() { offset(joint) } else { pose.position });
        }
        let thigh = multiply(parent, turn(leg.hip));
        let knee = add(hip, rotate(thigh, offset(leg.knee)));
        let shin = multiply(thigh, turn(leg.knee));
        let ankle = add(knee, rotate(shin, offset(leg.ankle)));
        let foot = multiply(shin, turn(leg.ankle));
        let toe = leg.toe.map_or(ankle, |toe| add(ankle, rotate(foot, offset(toe))));
        let side = rotate(turn(0), database.hips_line());
        Self { parent, turns: [thigh, shin, foot], hip, knee, ankle, toe, side }
    }

    /// Length of the stretched leg, metres.
    pub fn length(&self) -> f32 {
        norm(subtract(self.knee, self.hip)) + norm(subtract(self.ankle, self.knee))
    }

    /// The direction up, in the foot's own frame.
    pub fn up_in_foot(&self) -> Vector {
        rotate(conjugate(self.turns[2]), [0.0, 1.0, 0.0])
    }

    /// How far a point `height` metres over the one that the foot rolls about has moved on the ground since the direction
    /// up was further by `tipped` in the foot's own frame ([`up_in_foot`](Self::up_in_foot)): `[x, 0, z]`, metres.
    pub fn rolled(&self, tipped: Vector, height: f32) -> Vector {
        let [x, _, z] = rotate(self.turns[2], tipped);
        [height * x, 0.0, height * z]
    }

    /// Turns hip, knee and ankle of `pose`, which this is a leg of, so that the ankle lies at `target`, or as near to it
    /// as a leg of at most `reach` metres from hip to ankle comes.
    #[inline(never)]
    pub fn place<const J: usize>(&self, leg: &Leg, target: Vector, reach: f32, pose: &mut Pose<J>) {
        let [thigh, shin, foot] = self.turns;
        let (upper, lower) = (subtract(self.knee, self.hip), subtract(self.ankle, self.knee));
        let wanted = subtract(target, self.hip);
        let Some([swing, fold]) = bend(upper, lower, self.side, wanted, reach) else { return };
        let thigh = multiply(swing, thigh);
        let shin = multiply(swing, multiply(fold, shin));
        let turns = [
            (leg.hip, multiply(conjugate(self.parent), thigh)),
            (leg.knee, multiply(conjugate(thigh), shin)),
            (leg.ankle, multiply(conjugate(shin), foot)),
        ];
        for (joint, turn) in turns {
            if let (Some(slot), Some(turn)) = (pose.rotations.get_mut(joint), quaternion::normalize(turn)) {
                *slot = turn;
            }
        }
    }
}

/// Two bones that reach for a point: the fold of the lower one about the axis about which the limb is bent (about `side`
/// where it is straight, or bent a little to the other side), and the swing of the whole limb that follows it, both in
/// the world. `wanted` is seen from the limb's beginning; what is further than `reach` is pointed at. `None` where
/// there is nothing to reach with or for.
#[inline]
pub fn bend(
    upper: Vector,
    lower: Vector,
    side: Vector,
    wanted: Vector,
    reach: f32,
) -> Option<[Quaternion; 2]> {
    let (l1, l2) = (norm(upper), norm(lower));
    let distance = norm(wanted);
    if !(l1 > 1e-4 && l2 > 1e-4 && distance > 1e-4) {
        return None;
    }
    let shortest = crate::math::abs(l1 - l2) + 0.05 * (l1 + l2);
    let held = if distance > reach { reach } else { distance };
    let held = if held < shortest { shortest } else { held };

    let bent_about = cross(upper, lower);
    let bent = atan2(norm(bent_about), dot(upper, lower));
    // A limb that is straight, or a little bent to the wrong side, bends about its side: to the right one.
    let wrong = bent < NEARLY_STRAIGHT && dot(bent_about, side) < 0.0;
    let (bent_about, bent) = if wrong { (bent_about.map(|v| -v), -bent) } else { (bent_about, bent) };
    let axis = unit(bent_about).or(unit(side)).unwrap_or([1.0, 0.0, 0.0]);
    let bend = acos((held * held - l1 * l1 - l2 * l2) / (2.0 * l1 * l2));
    let fold = about(axis, bend - bent);
    let end = add(upper, rotate(fold, lower));
    Some([arc(end, wanted), fold])
}

/// Distance of two places, metres.
pub fn distance(a: Vector, b: Vector) -> f32 {
    norm(subtract(a, b))
}

#[inline(never)]
fn unit(v: Vector) -> Option<Vector> {
    let length2 = dot(v, v);
    (length2 > NO_DIRECTION).then(|| {
        let inverse = 1.0 / sqrt(length2);
        v.map(|x| x * inverse)
    })
}

/// The rotation about a unit axis.
pub(crate) fn about(axis: Vector, angle: f32) -> Quaternion {
    let (s, c) = sin_cos(0.5 * angle);
    [axis[0] * s, axis[1] * s, axis[2] * s, c]
}

/// The shortest rotation that takes the direction of `a` to that of `b`; none where there is no shortest one.
pub(crate) fn arc(a: Vector, b: Vector) -> Quaternion {
    // Of any length: what is too short for a direction is only told where both are of length 1.
    let inverse = 1.0 / sqrt(dot(a, a) * dot(b, b));
    let [x, y, z] = cross(a, b).map(|c| c * inverse);
    quaternion::normalize([x, y, z, dot(a, b) * inverse + 1.0]).unwrap_or(IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shortest_arc_turns_one_direction_into_the_other() {
        for (a, b) in [
            ([0.0, -1.0, 0.0], [0.3, -0.8, 0.2]),
            ([0.1, -0.7, 0.4], [0.1, -0.7, 0.4]),
            ([1.0, 0.0, 0.0], [0.0, 0.0, 2.0]),
            // A toy's finger, a crane's arm.
            ([0.004, 0.0, 0.0], [0.0, 0.003, 0.002]),
            ([0.0, 60.0, 0.0], [0.0, 45.0, 40.0]),
        ] {
            let turned = unit(rotate(arc(a, b), a)).unwrap();
            let wanted = unit(b).unwrap();
            assert!(norm(subtract(turned, wanted)) < 1e-6, "{a:?} {b:?} {turned:?}");
        }
        // Half a turn has no shortest way: the leg stays.
        assert_eq!(arc([0.0, 1.0, 0.0], [0.0, -1.0, 0.0]), IDENTITY);
    }

    #[test]
    fn a_knee_goes_through_straight_without_a_flip() {
        // A leg that goes from 0.15 rad bent backwards to as much bent forwards, its ankle lifted by 1 cm all the while.
        let side = [1.0, 0.0, 0.0];
        let mut last: Option<Vector> = None;
        for i in 0..=60 {
            let bent = 0.15 * (i as f32 / 30.0 - 1.0);
            let (upper, lower) = ([0.0, -0.4, 0.0], rotate(about(side, bent), [0.0, -0.4, 0.0]));
            let goal = add(add(upper, lower), [0.0, 0.01, 0.0]);
            let [swing, fold] = bend(upper, lower, side, goal, 0.8).unwrap();
            let (knee, end) = (rotate(swing, upper), rotate(multiply(swing, fold), lower));
            assert!(norm(subtract(add(knee, end), goal)) < 1e-4);
            assert!(cross(knee, end)[0] > 0.0, "bent by {bent}: the knee points back");
            if let Some(last) = last {
                assert!(norm(subtract(knee, last)) < 0.01, "bent by {bent}: the knee jumps");
            }
            last = Some(knee);
        }
        // One that is bent further to the other side keeps its direction.
        let (upper, lower) = ([0.0, -0.4, 0.0], rotate(about(side, -0.5), [0.0, -0.4, 0.0]));
        let goal = add(add(upper, lower), [0.0, 0.01, 0.0]);
        let [swing, fold] = bend(upper, lower, side, goal, 0.8).unwrap();
        assert!(cross(rotate(swing, upper), rotate(multiply(swing, fold), lower))[0] < 0.0);
    }
}
