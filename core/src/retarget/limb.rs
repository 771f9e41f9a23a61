//! Two bones that reach for a point: hip, knee, ankle or shoulder, elbow, wrist.
//!
//! The law of cosines gives where the middle joint lies along the way to the goal, and how far beside it; the side
//! is the one where it is already, so that knees and elbows keep their direction:
//!
//! ```text
//! x = (l1² - l2² + d²) / 2d      y = √(l1² - x²)      middle = x g + y u,   u ⟂ g, towards the middle joint
//! ```
//!
//! Each bone is then turned by the shortest arc. Cost: four roots and three divisions, no trigonometry.

use crate::{
    math::{clamp, sqrt},
    quaternion::{self, IDENTITY, Quaternion, Vector},
};

/// A limb's reach in units of its length may not come nearer to straight than this: there the plane of its bend is
/// lost, and a millimetre more of reach takes degrees of the knee.
const STRAIGHT: f32 = 0.9999;

fn dot(a: Vector, b: Vector) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn scaled(a: Vector, s: f32) -> Vector {
    [a[0] * s, a[1] * s, a[2] * s]
}

fn sub(a: Vector, b: Vector) -> Vector {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn norm(a: Vector) -> f32 {
    sqrt(dot(a, a))
}

/// The shortest rotation from the direction of `a` to that of `b`; none where either has no direction.
pub fn arc(a: Vector, b: Vector) -> Quaternion {
    let w = sqrt(dot(a, a) * dot(b, b)) + dot(a, b);
    let [x, y, z] = cross(a, b);
    let length2 = x * x + y * y + z * z + w * w;
    // Tiny vectors, opposite ones (any axis would do, and none is right), and NaN.
    let usable = length2 > 1e-16 && length2 < 1e16;
    if !usable {
        return IDENTITY;
    }
    let inverse = 1.0 / sqrt(length2);
    [x * inverse, y * inverse, z * inverse, w * inverse]
}

/// Where a limb `ours` has to reach, seen from its beginning, to point where `theirs` does and be bent as much:
/// their reach scaled by length.
pub fn scaled_reach(theirs: [Vector; 3], ours: [Vector; 3]) -> Vector {
    let length = |[a, b, c]: [Vector; 3]| norm(sub(b, a)) + norm(sub(c, b));
    let scale = length(ours) / length(theirs).max_or(1e-6);
    scaled(sub(theirs[2], theirs[0]), scale)
}

/// `f32::max` without its two zeros.
trait MaxOr {
    fn max_or(self, least: f32) -> f32;
}

impl MaxOr for f32 {
    fn max_or(self, least: f32) -> f32 {
        if self > least { self } else { least }
    }
}

/// Turns of the upper and the lower bone, in the world, that bring the limb's end to `goal`, seen from its beginning.
/// `upper` and `lower` are the bones as they are. Out of reach: the limb points there, as long as it can be.
pub fn bend(upper: Vector, lower: Vector, goal: Vector) -> [Quaternion; 2] {
    let (l1, l2) = (norm(upper), norm(lower));
    let distance = norm(goal);
    let whole = l1 + l2;
    // A limb without bones, a goal at its root, or NaN: nothing to do.
    let usable = l1 > 1e-4 && l2 > 1e-4 && distance > 1e-3 && distance < 1e4;
    if !usable {
        return [IDENTITY; 2];
    }
    let direction = scaled(goal, 1.0 / distance);
    let folded = crate::math::abs(l1 - l2) + 1e-4 * whole;
    let reach = clamp(distance, folded, STRAIGHT * whole);
    let along = (l1 * l1 - l2 * l2 + reach * reach) / (2.0 * reach);
    let beside = sqrt(l1 * l1 - along * along);
    // Towards the middle joint, off the line from the beginning to the present end: its place in the bend's plane.
    let line = [upper[0] + lower[0], upper[1] + lower[1], upper[2] + lower[2]];
    let aim = arc(line, direction);
    let middle = quaternion::rotate(aim, upper);
    let off = sub(middle, scaled(direction, dot(middle, direction)));
    let width = norm(off);
    // Straight limbs have no plane, and need none while the goal keeps them straight; any plane is better than NaN.
    let side = if width > 1e-5 * whole {
        scaled(off, 1.0 / width)
    } else {
        let other = if crate::math::abs(direction[1]) < 0.9 { [0.0, 1.0, 0.0] } else { [0.0, 0.0, 1.0] };
        let off = sub(other, scaled(direction, dot(other, direction)));
        scaled(off, 1.0 / norm(off).max_or(1e-6))
    };
    let new_upper: Vector = [0, 1, 2].map(|i| along * at(direction, i) + beside * at(side, i));
    let new_lower = sub(scaled(direction, reach), new_upper);
    [turned(aim, upper, new_upper), turned(aim, lower, new_lower)]
}

fn at(v: Vector, i: usize) -> f32 {
    v.get(i).copied().unwrap_or(0.0)
}

/// The turn to the new direction, by way of the limb's own: so that the bones' twist goes along.
fn turned(aim: Quaternion, bone: Vector, new: Vector) -> Quaternion {
    quaternion::multiply(arc(quaternion::rotate(aim, bone), new), aim)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plus(a: Vector, b: Vector) -> Vector {
        [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
    }

    #[test]
    fn the_end_reaches_every_goal_within_reach_and_bones_keep_their_lengths() {
        let (upper, lower) = ([0.05, -0.38, 0.1], [0.0, -0.36, -0.15]);
        for goal in
            [[0.0, -0.6, 0.0], [0.3, -0.5, 0.2], [-0.2, -0.3, -0.1], [0.1, 0.5, 0.3], [0.0, -0.77, 0.01]]
        {
            let [a, b] = bend(upper, lower, goal);
            let end = plus(quaternion::rotate(a, upper), quaternion::rotate(b, lower));
            assert!(norm(sub(end, goal)) < 2e-4, "{goal:?}: {end:?}");
            assert!(quaternion::is_unit(a) && quaternion::is_unit(b));
        }
    }

    #[test]
    fn the_knee_stays_on_its_side() {
        let (upper, lower) = ([0.0, -0.4, 0.1], [0.0, -0.38, -0.12]);
        for goal in [[0.0, -0.7, 0.0], [0.0, -0.6, 0.2], [0.1, -0.65, -0.2]] {
            let [a, _] = bend(upper, lower, goal);
            let knee = quaternion::rotate(a, upper);
            let beside = sub(knee, scaled(goal, dot(knee, goal) / dot(goal, goal)));
            assert!(beside[2] > 0.0, "{goal:?}: the knee is at {knee:?}");
        }
    }

    #[test]
    fn a_goal_out_of_reach_straightens_the_limb_towards_it() {
        let [a, b] = bend([0.0, -0.4, 0.1], [0.0, -0.4, -0.1], [2.0, 0.0, 0.0]);
        let end = plus(quaternion::rotate(a, [0.0, -0.4, 0.1]), quaternion::rotate(b, [0.0, -0.4, -0.1]));
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
        for turn in bend(upper, lower, plus(upper, lower)) {
            assert!(turn[3] > 0.999_999, "{turn:?}");
        }
    }
}
