//! A joint's rotation as the angles of up to three hinges, about arbitrary axes, in chain order.
//!
//! The axes a1, a2, a3 are those of the hinges at angle zero, in the frame of the link before them. The rotation of the
//! link behind them is a product of exponentials. For the wanted rotation T and a vector v behind the hinges,
//!
//! ```text
//! e(a1 q1) e(a2 q2) v = w       =>  a1·e(a2 q2) v = a1·w  =  A + B cos q2 + C sin q2      two solutions
//!                                   q1 = angle about a1 from e(a2 q2) v to w
//! ```
//!
//! Three hinges: v = a3 (the third doesn't move it), w = T a3, and q3 is the rotation about a3 that is left. Two hinges:
//! v is the bone, which is aimed along w. One hinge: the angle about a1 that brings v nearest to w. The axes need not be
//! orthogonal; a rotation out of reach is approximated. If v comes to lie along a1 (gimbal lock), q1 is undetermined:
//! it keeps its last value, and q3 compensates.
//!
//! Source: Paden 1986, subproblems 1 and 2, in Murray, Li and Sastry 1994, section 3.3; Davenport angles. Cost: five
//! arc tangents and cosines at most.

use crate::math::{
    abs, acos, atan2,
    quaternion::{self, Quaternion, Vector, about},
    sqrt,
    vector::{cross, dot, norm},
};

/// Angle about `axis` from `v` to `w`, and how well it is determined: the product of their distances from the axis.
fn angle(axis: Vector, v: Vector, w: Vector) -> (f32, f32) {
    let along = dot(axis, v) * dot(axis, w);
    let (x, y) = (dot(v, w) - along, dot(axis, cross(v, w)));
    (atan2(y, x), sqrt(x * x + y * y))
}

/// The hinges of a joint: axes at zero in the frame of the link before, unit vectors, in chain order.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hinges {
    /// How many, 1 to 3.
    pub count: usize,
    /// Axes; those beyond `count` are not used.
    pub axes: [Vector; 3],
    /// For one or two hinges: the direction that they aim, at angle zero, in the frame of the link before.
    pub pointed: Vector,
    /// Least and greatest angle of each, radians.
    pub ranges: [(f32, f32); 3],
}

/// Below this an angle is undetermined (gimbal lock): sine squared of 2 degrees.
const LOCK: f32 = 1.2e-3;

impl Hinges {
    /// Angles for a wanted rotation, relative to the hinges' zero; `last` are those of the tick before. Each is within its
    /// range. Radians.
    pub fn solve(&self, turn: Quaternion, last: [f32; 3]) -> [f32; 3] {
        let [a1, a2, a3] = self.axes;
        let pointed = if self.count == 3 { a3 } else { self.pointed };
        let wanted = quaternion::rotate(turn, pointed);
        if self.count <= 1 {
            let (q, certainty) = angle(a1, pointed, wanted);
            let q = if certainty > LOCK { q } else { last[0] };
            return [self.nearest(0, q, last[0]), 0.0, 0.0];
        }
        // A + B cos q2 + C sin q2 = a1·w
        let a = dot(a1, a2) * dot(a2, pointed);
        let (b, c) = (dot(a1, pointed) - a, dot(a1, cross(a2, pointed)));
        let size = sqrt(b * b + c * c);
        if size < 1e-4 {
            // Two parallel axes: one hinge.
            let (q, _) = angle(a1, pointed, wanted);
            return [self.nearest(0, q, last[0]), self.hold(1, last[1]), self.hold(2, last[2])];
        }
        let middle = atan2(c, b);
        let half = acos((dot(a1, wanted) - a) / size);
        let one = self.finish(turn, wanted, pointed, middle + half, last);
        let other = self.finish(turn, wanted, pointed, middle - half, last);
        if other.1 < one.1 { other.0 } else { one.0 }
    }

    /// Completes the angles for a second one, and gives their cost: mostly how far they are out of range, then the change
    /// since the tick before.
    fn finish(
        &self,
        turn: Quaternion,
        wanted: Vector,
        pointed: Vector,
        q2: f32,
        last: [f32; 3],
    ) -> ([f32; 3], f32) {
        let [a1, a2, a3] = self.axes;
        let free2 = near(q2, last[1]);
        let q2 = self.nearest(1, q2, last[1]);
        let second = about(a2, q2);
        let (free1, certainty) = angle(a1, quaternion::rotate(second, pointed), wanted);
        let free1 = if certainty > LOCK { near(free1, last[0]) } else { last[0] };
        let q1 = self.nearest(0, free1, last[0]);
        let mut cost = 10.0 * (abs(free2 - q2) + abs(free1 - q1)) + abs(q1 - last[0]) + abs(q2 - last[1]);
        let mut q3 = 0.0;
        if self.count == 3 {
            // The rotation that the first two leave: its twist about the third axis.
            let before = quaternion::multiply(about(a1, q1), second);
            let rest = quaternion::multiply(quaternion::conjugate(before), turn);
            let part = [rest[0], rest[1], rest[2]];
            let free3 = near(2.0 * atan2(dot(part, a3), rest[3]), last[2]);
            q3 = self.nearest(2, free3, last[2]);
            // Beside the twist nothing is left, but where the first angle is held: there both are as near to the last ones.
            cost += 10.0 * abs(free3 - q3) + abs(q3 - last[2]) + 2.0 * norm(cross(part, a3));
        }
        ([q1, q2, q3], cost)
    }

    /// An angle, moved by whole turns next to the last one and clamped to the range.
    fn nearest(&self, hinge: usize, q: f32, last: f32) -> f32 {
        self.hold(hinge, near(q, last))
    }

    fn hold(&self, hinge: usize, q: f32) -> f32 {
        let (low, high) = self.ranges.get(hinge).copied().unwrap_or((0.0, 0.0));
        if q >= low && q <= high {
            return q;
        }
        // It may be in range a whole turn away.
        for other in [q - core::f32::consts::TAU, q + core::f32::consts::TAU] {
            if other >= low && other <= high {
                return other;
            }
        }
        crate::math::clamp(q, low, high)
    }
}

/// `q` moved by at most two whole turns to within half a turn of `last`.
fn near(q: f32, last: f32) -> f32 {
    use core::f32::consts::{PI, TAU};
    let mut q = q;
    for _ in 0..2 {
        if q - last > PI {
            q -= TAU;
        } else if last - q > PI {
            q += TAU;
        }
    }
    q
}

#[cfg(test)]
mod tests {
    use super::*;

    const FREE: [(f32, f32); 3] = [(-3.2, 3.2); 3];

    fn unit(v: Vector) -> Vector {
        let n = sqrt(dot(v, v));
        [v[0] / n, v[1] / n, v[2] / n]
    }

    fn product(axes: [Vector; 3], q: [f32; 3]) -> Quaternion {
        let [a, b, c] = [0, 1, 2].map(|i| about(axes[i], q[i]));
        quaternion::multiply(quaternion::multiply(a, b), c)
    }

    fn apart(a: Quaternion, b: Quaternion) -> f32 {
        let d = quaternion::between(a, b);
        sqrt(dot(d, d))
    }

    #[test]
    fn three_hinges_in_any_order_and_skew_give_every_turn_of_theirs_back() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let skew = unit([0.3, 1.0, 0.2]);
        for axes in [
            [x, y, z],
            [z, x, y],
            [y, x, z],
            [z, y, x],
            [x, y, x],
            [y, skew, x],
            [skew, x, unit([0.0, 0.5, 1.0])],
        ] {
            for q in
                [[0.4, -0.3, 0.8], [-1.2, 0.7, 0.1], [0.0, 0.5, 0.0], [1.5, -0.9, -1.4], [0.1, 1.2, -0.1]]
            {
                let hinges = Hinges { count: 3, axes, pointed: x, ranges: FREE };
                let wanted = product(axes, q);
                let found = hinges.solve(wanted, q);
                let off = apart(product(axes, found), wanted);
                assert!(off < 2e-3, "{axes:?} {q:?}: {found:?}, {off} rad off");
                // Beginning near the angles that made it, it is those that are found.
                assert!((0..3).all(|i| (found[i] - q[i]).abs() < 5e-3), "{axes:?} {q:?}: {found:?}");
            }
        }
    }

    #[test]
    fn two_hinges_point_and_one_turns() {
        let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let bone = [0.0, 0.0, 1.0];
        let hinges = Hinges { count: 2, axes: [y, x, x], pointed: bone, ranges: FREE };
        for wanted in [unit([0.4, 0.2, 0.9]), unit([-0.8, -0.5, 0.3])] {
            let turn = crate::body::two_bone_ik::arc(bone, wanted);
            let q = hinges.solve(turn, [0.0; 3]);
            let got = quaternion::rotate(quaternion::multiply(about(y, q[0]), about(x, q[1])), bone);
            assert!(dot(got, wanted) > 0.999_99, "{wanted:?}: {got:?}");
        }
        let one = Hinges { count: 1, axes: [y, x, x], pointed: bone, ranges: FREE };
        assert!((one.solve(about(y, 0.7), [0.0; 3])[0] - 0.7).abs() < 1e-4);
    }

    #[test]
    fn gimbal_lock_neither_jumps_nor_breaks() {
        let (x, y, z) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]);
        let axes = [z, x, z];
        let hinges = Hinges { count: 3, axes, pointed: y, ranges: FREE };
        let mut last = [0.3, 0.2, -0.1];
        // Through the lock, where the first and the third axis are one.
        for i in 0..200 {
            let tilt = 0.2 - 0.002 * i as f32;
            let wanted = product(axes, [0.3, tilt, -0.1]);
            let q = hinges.solve(wanted, last);
            assert!(apart(product(axes, q), wanted) < 0.04, "step {i}: {q:?}");
            assert!((0..3).all(|k| (q[k] - last[k]).abs() < 0.1), "step {i}: from {last:?} to {q:?}");
            last = q;
        }
    }

    #[test]
    fn ranges_are_kept_and_nan_does_no_harm() {
        let ranges = [(-0.5, 0.5), (-0.2, 0.9), (-0.1, 0.1)];
        let axes = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        for count in 1..=3 {
            let hinges = Hinges { count, axes, pointed: [0.0, -1.0, 0.0], ranges };
            for turn in [product(axes, [2.0, -2.0, 1.0]), [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]] {
                let q = hinges.solve(turn, [0.0; 3]);
                assert!((0..count).all(|i| q[i] >= ranges[i].0 && q[i] <= ranges[i].1), "{q:?}");
            }
        }
    }
}
