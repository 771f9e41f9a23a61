//! Two bones that reach for a point: hip, knee, ankle or shoulder, elbow, wrist. Knees and elbows keep the axis about
//! which they are bent; the limb of [`crate::ik`], turned in the world.

use crate::{
    ik,
    quaternion::{self, IDENTITY, Quaternion, Vector},
    vector::{cross, dot, norm, subtract},
};

/// A limb's reach in units of its length may not come nearer to straight than this: there the plane of its bend is
/// lost, and a millimetre more of reach takes degrees of the knee.
const STRAIGHT: f32 = 0.9999;

/// Where a limb `ours` has to reach, seen from its beginning, to point where `theirs` does and be bent as much:
/// their reach scaled by length.
pub fn scaled_reach(theirs: [Vector; 3], ours: [Vector; 3]) -> Vector {
    let length = |[a, b, c]: [Vector; 3]| ik::distance(a, b) + ik::distance(b, c);
    let whole = length(theirs);
    let scale = if whole > 1e-6 { length(ours) / whole } else { 0.0 };
    subtract(theirs[2], theirs[0]).map(|v| v * scale)
}

/// Turns of the upper and the lower bone, in the world, that bring the limb's end to `goal`, seen from its beginning.
/// `upper` and `lower` are the bones as they are. Out of reach: the limb points there, as long as it can be.
pub fn bend(upper: Vector, lower: Vector, goal: Vector) -> [Quaternion; 2] {
    // Any axis across will do for a straight limb: it needs none while the goal keeps it straight.
    let [x, y, z] = upper;
    let side = if crate::math::abs(x) < crate::math::abs(y) { [0.0, z, -y] } else { [-z, 0.0, x] };
    // It stays bent to the side that it is bent to.
    let side = if dot(cross(upper, lower), side) < 0.0 { side.map(|v| -v) } else { side };
    let whole = norm(upper) + norm(lower);
    match ik::bend(upper, lower, side, goal, STRAIGHT * whole) {
        Some([swing, fold]) => [swing, quaternion::multiply(swing, fold)],
        None => [IDENTITY; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::vector::add;

    fn scaled(a: Vector, s: f32) -> Vector {
        a.map(|v| v * s)
    }

    #[test]
    fn the_end_reaches_every_goal_within_reach_and_bones_keep_their_lengths() {
        let (upper, lower) = ([0.05, -0.38, 0.1], [0.0, -0.36, -0.15]);
        for goal in
            [[0.0, -0.6, 0.0], [0.3, -0.5, 0.2], [-0.2, -0.3, -0.1], [0.1, 0.5, 0.3], [0.0, -0.77, 0.01]]
        {
            let [a, b] = bend(upper, lower, goal);
            let end = add(quaternion::rotate(a, upper), quaternion::rotate(b, lower));
            assert!(norm(subtract(end, goal)) < 2e-4, "{goal:?}: {end:?}");
            assert!(quaternion::is_unit(a) && quaternion::is_unit(b));
        }
    }

    #[test]
    fn the_knee_stays_on_its_side() {
        let (upper, lower) = ([0.0, -0.4, 0.1], [0.0, -0.38, -0.12]);
        for goal in [[0.0, -0.7, 0.0], [0.0, -0.6, 0.2], [0.1, -0.65, -0.2]] {
            let [a, _] = bend(upper, lower, goal);
            let knee = quaternion::rotate(a, upper);
            let beside = subtract(knee, scaled(goal, dot(knee, goal) / dot(goal, goal)));
            assert!(beside[2] > 0.0, "{goal:?}: the knee is at {knee:?}");
        }
    }

    #[test]
    fn a_goal_out_of_reach_straightens_the_limb_towards_it() {
        let [a, b] = bend([0.0, -0.4, 0.1], [0.0, -0.4, -0.1], [2.0, 0.0, 0.0]);
        let end = add(quaternion::rotate(a, [0.0, -0.4, 0.1]), quaternion::rotate(b, [0.0, -0.4, -0.1]));
        assert!(end[1].abs() < 1e-3 && end[2].abs() < 1e-3 && end[0] > 0.82, "{end:?}");
    }

    #[test]
    fn nothing_comes_of_nothing() {
        for (upper, goal) in
            [([0.0; 3], [0.1, 0.2, 0.3]), ([0.0, 0.4, 0.0], [0.0; 3]), ([0.0, 0.4, 0.0], [f32::NAN; 3])]
        {
            assert_eq!(bend(upper, [0.0, 0.3, 0.1], goal), [IDENTITY; 2]);
        }
    }

    #[test]
    fn a_limb_in_place_is_left_alone() {
        let (upper, lower) = ([0.05, -0.38, 0.1], [0.0, -0.36, -0.15]);
        for turn in bend(upper, lower, add(upper, lower)) {
            assert!(turn[3] > 0.999_999, "{turn:?}");
        }
    }
}
