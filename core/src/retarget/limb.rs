//! Inverse kinematics of a limb of two bones (hip, knee, ankle or shoulder, elbow, wrist) in world space. Knees and
//! elbows keep the axis about which they are bent. [`crate::body::two_bone_ik`] does the trigonometry.

use crate::{
    body::two_bone_ik,
    math::{
        quaternion::{self, IDENTITY, Quaternion, Vector},
        vector::{cross, distance, dot, norm, subtract, unit},
    },
};

/// Longest reach in units of the limb's length. In a straight limb the plane of the bend is undefined, and near it a
/// millimetre of reach changes the knee by degrees.
const STRAIGHT: f32 = 0.9999;
/// Sine of the bend below which its plane is taken to be undefined: 100 times the rounding error.
const NO_BEND: f32 = 1e-4;

/// Where the end of limb `target` has to be, relative to its beginning, to point as `source` does and be bent as much:
/// the source's reach, scaled by length.
pub fn scaled_reach(source: [Vector; 3], target: [Vector; 3]) -> Vector {
    let length = |[a, b, c]: [Vector; 3]| distance(a, b) + distance(b, c);
    let whole = length(source);
    let scale = if whole > 1e-6 { length(target) / whole } else { 0.0 };
    subtract(source[2], source[0]).map(|v| v * scale)
}

/// World rotations of the upper and the lower bone that bring the limb's end to `goal`, which is relative to its
/// beginning. `upper` and `lower` are the bones before the rotation. If they are in line the limb bends about `side`, or
/// about any axis perpendicular to the limb if there is no `side`. A limb that is too short points at the goal.
pub fn bend(upper: Vector, lower: Vector, side: Option<Vector>, goal: Vector) -> [Quaternion; 2] {
    let [x, y, z] = upper;
    let any = if crate::math::abs(x) < crate::math::abs(y) { [0.0, z, -y] } else { [-z, 0.0, x] };
    let side = side.map_or(any, |side| {
        // Across the limb: about another axis its end would also move aside.
        let along = dot(side, upper) / dot(upper, upper);
        subtract(side, upper.map(|v| along * v))
    });
    let inverse = 1.0 / (norm(upper) * norm(lower));
    let bent = cross(upper, lower).map(|v| v * inverse);
    let bends = if norm(bent) > NO_BEND { bent } else { side };
    let Some(axis) = unit(bends) else { return [IDENTITY; 2] };
    let whole = norm(upper) + norm(lower);
    match two_bone_ik::bend(upper, lower, axis, goal, STRAIGHT * whole) {
        Some([swing, fold]) => [swing, quaternion::multiply(swing, fold)],
        None => [IDENTITY; 2],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::math::vector::add;

    fn scaled(a: Vector, s: f32) -> Vector {
        a.map(|v| v * s)
    }

    #[test]
    fn the_end_reaches_every_goal_within_reach_and_bones_keep_their_lengths() {
        let (upper, lower) = ([0.05, -0.38, 0.1], [0.0, -0.36, -0.15]);
        for goal in
            [[0.0, -0.6, 0.0], [0.3, -0.5, 0.2], [-0.2, -0.3, -0.1], [0.1, 0.5, 0.3], [0.0, -0.77, 0.01]]
        {
            let [a, b] = bend(upper, lower, None, goal);
            let end = add(quaternion::rotate(a, upper), quaternion::rotate(b, lower));
            assert!(norm(subtract(end, goal)) < 2e-4, "{goal:?}: {end:?}");
            assert!(quaternion::is_unit(a) && quaternion::is_unit(b));
        }
    }

    #[test]
    fn the_knee_stays_on_its_side() {
        let (upper, lower) = ([0.0, -0.4, 0.1], [0.0, -0.38, -0.12]);
        for goal in [[0.0, -0.7, 0.0], [0.0, -0.6, 0.2], [0.1, -0.65, -0.2]] {
            let [a, _] = bend(upper, lower, None, goal);
            let knee = quaternion::rotate(a, upper);
            let beside = subtract(knee, scaled(goal, dot(knee, goal) / dot(goal, goal)));
            assert!(beside[2] > 0.0, "{goal:?}: the knee is at {knee:?}");
        }
    }

    #[test]
    fn a_goal_out_of_reach_straightens_the_limb_towards_it() {
        let [a, b] = bend([0.0, -0.4, 0.1], [0.0, -0.4, -0.1], None, [2.0, 0.0, 0.0]);
        let end = add(quaternion::rotate(a, [0.0, -0.4, 0.1]), quaternion::rotate(b, [0.0, -0.4, -0.1]));
        assert!(end[1].abs() < 1e-3 && end[2].abs() < 1e-3 && end[0] > 0.82, "{end:?}");
    }

    #[test]
    fn a_straight_knee_bends_backwards() {
        let lengths = [0.4, 0.38];
        // A leg straight down, and legs that point to the side and ahead; the body faces +Z, its left is +X.
        for [x, y, z] in [[0.0_f32, -1.0, 0.0], [0.17, -0.985, 0.0], [-0.17, -0.985, 0.0], [0.0, -0.94, 0.34]]
        {
            let bone = |l: f32| [x * l, y * l, z * l];
            let (upper, lower) = (bone(lengths[0]), bone(lengths[1]));
            let goal = scaled(add(upper, lower), 0.98);
            let [a, b] = bend(upper, lower, Some([0.3, 0.0, 0.0]), goal);
            let (knee, end) = (quaternion::rotate(a, upper), quaternion::rotate(b, lower));
            let off = norm(subtract(add(knee, end), goal));
            assert!(off < 2e-4, "{upper:?}: {off}");
            let beside = subtract(knee, scaled(goal, dot(knee, goal) / dot(goal, goal)));
            assert!(beside[2] > 0.05 && beside[0].abs() < 1e-3, "the knee of {upper:?} goes to {beside:?}");
        }
    }

    #[test]
    fn nothing_comes_of_nothing() {
        for (upper, goal) in
            [([0.0; 3], [0.1, 0.2, 0.3]), ([0.0, 0.4, 0.0], [0.0; 3]), ([0.0, 0.4, 0.0], [f32::NAN; 3])]
        {
            assert_eq!(bend(upper, [0.0, 0.3, 0.1], None, goal), [IDENTITY; 2]);
        }
    }

    #[test]
    fn a_limb_in_place_is_left_alone() {
        let (upper, lower) = ([0.05, -0.38, 0.1], [0.0, -0.36, -0.15]);
        for turn in bend(upper, lower, None, add(upper, lower)) {
            assert!(turn[3] > 0.999_999, "{turn:?}");
        }
    }
}
