//! Inverse kinematics of a leg: two bones, in closed form.
//!
//! The ankle moves to a target. Only three joints turn: the knee, about the axis about which it is bent already, so that
//! it keeps its direction, or towards straight about the hips' line; the hip, by the shortest arc that brings the ankle to
//! the target; and the ankle, so that the foot keeps its orientation in the world.
//!
//! Source: the analytic limb of Tolani, Goswami and Badler 2000, "Real-time inverse kinematics techniques for
//! anthropomorphic limbs", with the swivel angle left as it is; Kovar, Schreiner and Gleicher 2002, "Footskate cleanup
//! for motion capture editing", section 5.3. Cost: about 1,200 instructions a leg, kinematics included.

use crate::{
    blob::{Database, Leg},
    body::pose::Pose,
    math::{
        clamp, maximum, minimum,
        quaternion::{self, IDENTITY, Quaternion, Vector, conjugate, multiply, rotate},
        sqrt,
        vector::{add, cross, dot, norm, subtract, unit},
    },
};

/// Sine and cosine of the angle from which on a knee bends about its own axis, 20 degrees.
const BENT: [f32; 2] = [0.342, 0.94];

/// A limb is never folded nearer to its shortest length than this part of the length of both bones.
const MIN_FOLD: f32 = 0.05;

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
        let axis = hinge(upper, lower, self.side);
        let Some([swing, fold]) = bend(upper, lower, axis, wanted, reach) else { return };
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

/// The unit axis about which a leg of those bones bends: its own if the knee is bent by [`BENT`] or more. In a straight
/// leg the small angle between shin and thigh is that of the skeleton, often sideways: a knee bent about its axis would go to
/// one side, and to the other in the next frame. The nearer a knee is to straight, or if it is bent a little backwards, the
/// more it bends about `side`, a unit vector.
fn hinge(upper: Vector, lower: Vector, side: Vector) -> Vector {
    let inverse = 1.0 / sqrt(dot(upper, upper) * dot(lower, lower));
    let bend = cross(upper, lower).map(|v| v * inverse);
    let own = unit(bend).unwrap_or(side);
    if dot(upper, lower) * inverse < BENT[1] {
        return own;
    }
    let share = clamp(dot(bend, side) * (1.0 / BENT[0]), 0.0, 1.0);
    unit(core::array::from_fn(|i| side[i] + share * (own[i] - side[i]))).unwrap_or(side)
}

/// Two bones that reach for a point: the fold of the lower one about the unit `axis`, and the swing of the whole limb that
/// follows it, both in the world. `wanted` is relative to the limb's beginning. At a point further than `reach` the limb only
/// points; at one nearer than the difference of the bones' lengths and `MIN_FOLD` of their sum it stays at that distance.
/// `None` where there is nothing to reach with or for.
///
/// With `u` and `l` the bones and `k` the axis, the fold by θ brings the limb's end to the distance d where
///
/// ```text
/// a cos θ + b sin θ = c        a = u·l - (u·k)(l·k)        b = u·(k × l)        c = (d² - |u|² - |l|²) / 2 - (u·k)(l·k)
/// ```
///
/// Of its two solutions, `(cos θ, sin θ) ∝ (a c - b w, b c + a w)` with `w² = a² + b² - c²` bends to the axis's side.
#[inline]
pub fn bend(
    upper: Vector,
    lower: Vector,
    axis: Vector,
    wanted: Vector,
    reach: f32,
) -> Option<[Quaternion; 2]> {
    let (l1, l2) = (norm(upper), norm(lower));
    let distance = norm(wanted);
    if !(l1 > 1e-4 && l2 > 1e-4 && distance > 1e-4) {
        return None;
    }
    let shortest = crate::math::abs(l1 - l2) + MIN_FOLD * (l1 + l2);
    let held = minimum(reach, distance);
    let held = maximum(shortest, held);

    // In units of l1 l2, so that limbs of any size are as exact.
    let inverse = 1.0 / (l1 * l2);
    let along = dot(upper, axis) * dot(lower, axis);
    let a = (dot(upper, lower) - along) * inverse;
    let b = dot(upper, cross(axis, lower)) * inverse;
    let most = sqrt(a * a + b * b);
    let c = clamp((0.5 * (held * held - l1 * l1 - l2 * l2) - along) * inverse, -most, most);
    let w = sqrt((most - c) * (most + c));
    let (cos, sin) = (a * c - b * w, b * c + a * w);
    let [x, y, z] = axis.map(|v| v * sin);
    // Of half the angle, as in `arc`.
    let fold = quaternion::normalize([x, y, z, most * most + cos])?;
    let end = add(upper, rotate(fold, lower));
    Some([arc(end, wanted), fold])
}

/// The shortest rotation that takes the direction of `a` to that of `b`; none where there is no shortest one.
pub(crate) fn arc(a: Vector, b: Vector) -> Quaternion {
    // Works for vectors of any length. One that is too short to have a direction is recognised only where both have
    // length 1.
    let inverse = 1.0 / sqrt(dot(a, a) * dot(b, b));
    let [x, y, z] = cross(a, b).map(|c| c * inverse);
    quaternion::normalize([x, y, z, dot(a, b) * inverse + 1.0]).unwrap_or(IDENTITY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion::about;

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

    const SIDE: Vector = [1.0, 0.0, 0.0];

    /// Knee and end of a leg, of which each bone goes `aside` and the knee is bent by that angle, after it reaches for `goal`.
    fn reached(aside: f32, bent: f32, goal: impl Fn(Vector) -> Vector) -> [Vector; 3] {
        let (upper, lower) = ([aside, -0.4, 0.0], rotate(about(SIDE, bent), [-aside, -0.4, 0.0]));
        let goal = goal(add(upper, lower));
        let [swing, fold] = bend(upper, lower, hinge(upper, lower, SIDE), goal, 0.8).unwrap();
        let (knee, shin) = (rotate(swing, upper), rotate(multiply(swing, fold), lower));
        assert!(norm(subtract(add(knee, shin), goal)) < 2e-4, "{aside} {bent}");
        [knee, shin, upper]
    }

    #[test]
    fn a_knee_goes_through_straight_without_a_flip() {
        // From 0.15 rad bent backwards to as much bent forwards, the ankle lifted by 1 or 4 cm all the while. A bone that
        // goes aside by a centimetre put the knee aside by 10, now to the left and now to the right.
        for (aside, lift) in [(0.0, 0.01), (0.01, 0.04), (-0.01, 0.04)] {
            let mut last: Option<Vector> = None;
            for i in 0..=60 {
                let bent = 0.15 * (i as f32 / 30.0 - 1.0);
                let [knee, shin, _] = reached(aside, bent, |end| add(end, [0.0, lift, 0.0]));
                assert!(cross(knee, shin)[0] > 0.0, "bent by {bent}: the knee points back");
                assert!(crate::math::abs(knee[0]) < 0.03, "bent by {bent}: the knee is at {knee:?}");
                if let Some(last) = last.replace(knee) {
                    assert!(norm(subtract(knee, last)) < 0.01, "bent by {bent}: the knee jumps");
                }
            }
        }
        // One that is bent further to the other side keeps its direction.
        let [knee, shin, _] = reached(0.0, -0.5, |end| add(end, [0.0, 0.01, 0.0]));
        assert!(cross(knee, shin)[0] < 0.0);
    }

    #[test]
    fn a_leg_whose_ankle_is_there_already_stays() {
        for bent in [0.05, 0.2, 0.3, 0.5] {
            let [knee, _, upper] = reached(0.01, bent, |end| end);
            assert!(norm(subtract(knee, upper)) < 1e-3, "{bent}: {knee:?}");
        }
    }
}
