//! Inverse kinematics of a robot's limb: a few steps of damped least squares over its hinges.
//!
//! With the error e (from tip to goal) and the Jacobian J (column i: axis i crossed with the vector from hinge i to tip),
//!
//! ```text
//! Δq = Jᵀ (J Jᵀ + λ² 1)⁻¹ e
//! ```
//!
//! a 3x3 system in closed form. The damping keeps a stretched limb stable: it points at a goal that is out of reach.
//! Angles stay in their ranges at every step. They start from the angles of [`hinges`](super::hinges), so that the limb
//! keeps the body's posture. Source: Wampler 1986; Nakamura and Hanafusa 1986. Cost: the forward kinematics of the
//! hinges, at most [`STEPS`] + 1 times.

use super::layout::MAX_LIMB_HINGES;
use crate::math::{
    clamp,
    quaternion::{self, Quaternion, Vector, about},
    vector::{add, cross, dot, subtract},
};

/// Steps at most.
pub const STEPS: usize = 4;
/// Largest change of an angle in a step, radians.
const STRIDE: f32 = 0.35;
/// Error at which the search stops, in units of the goal's distance.
const TOLERANCE: f32 = 1e-3;

/// A hinge of the limb.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Link {
    /// Position in the frame behind the one before, metres.
    pub offset: Vector,
    /// Rotation from that frame to its own, at angle zero.
    pub turn: Quaternion,
    /// Axis in its own frame.
    pub axis: Vector,
    /// Least and greatest angle, radians.
    pub range: (f32, f32),
    /// The angle, radians.
    pub angle: f32,
}

/// Changes the limb's angles so that its tip comes to `goal`. `before` is the orientation of the frame that the limb is
/// mounted on; `goal` is relative to the limb's first hinge, in the base's axes; `tip` is in the frame behind the last
/// hinge. Only the first [`MAX_LIMB_HINGES`] links are used. Returns the distance that is left, metres.
pub fn reach(links: &mut [Link], before: Quaternion, tip: Vector, goal: Vector) -> f32 {
    let length2 = dot(goal, goal);
    let mut missing = [0.0; 3];
    for step in 0..=STEPS {
        // Axes and positions, from the first hinge on.
        let mut columns = [[0.0f32; 3]; MAX_LIMB_HINGES];
        let mut places = [[0.0f32; 3]; MAX_LIMB_HINGES];
        let (mut turn, mut place) = (before, [0.0; 3]);
        for (i, ((link, column), at)) in links.iter().zip(&mut columns).zip(&mut places).enumerate() {
            if i > 0 {
                place = add(place, quaternion::rotate(turn, link.offset));
            }
            turn = quaternion::multiply(turn, link.turn);
            // A hinge with one angle takes no part.
            if link.range.0 < link.range.1 {
                *column = quaternion::rotate(turn, link.axis);
            }
            *at = place;
            turn = quaternion::multiply(turn, about(link.axis, link.angle));
        }
        let end = add(place, quaternion::rotate(turn, tip));
        missing = subtract(goal, end);
        let near = dot(missing, missing) <= TOLERANCE * TOLERANCE * length2;
        // NaN also ends the search.
        if near || step == STEPS || !dot(missing, missing).is_finite() {
            break;
        }
        let mut m = [[0.0f32; 3]; 3];
        for (column, at) in columns.iter_mut().zip(&places).take(links.len()) {
            *column = cross(*column, subtract(end, *at));
            let c = *column;
            for (row, a) in m.iter_mut().zip(c) {
                for (slot, b) in row.iter_mut().zip(c) {
                    *slot += a * b;
                }
            }
        }
        let damping = 0.01 * (m[0][0] + m[1][1] + m[2][2]) + 1e-9;
        m[0][0] += damping;
        m[1][1] += damping;
        m[2][2] += damping;
        let y = solve(m, missing);
        for (link, column) in links.iter_mut().zip(&columns) {
            let change = clamp(dot(*column, y), -STRIDE, STRIDE);
            link.angle = clamp(link.angle + change, link.range.0, link.range.1);
        }
    }
    crate::math::sqrt(dot(missing, missing))
}

/// The solution of a symmetric positive definite 3x3 system, by Cramer's rule.
fn solve(m: [[f32; 3]; 3], b: Vector) -> Vector {
    let [r0, r1, r2] = m;
    let determinant = dot(r0, cross(r1, r2));
    let inverse = if determinant > 1e-30 { 1.0 / determinant } else { 0.0 };
    // Symmetric: rows are columns.
    [dot(b, cross(r1, r2)) * inverse, dot(r0, cross(b, r2)) * inverse, dot(r0, cross(r1, b)) * inverse]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::quaternion::IDENTITY;

    /// Shoulder pitch and roll, elbow: an arm of 0.12 and 0.11 m that hangs.
    fn arm(angles: [f32; 3]) -> [Link; 3] {
        let link = |offset: Vector, axis: Vector, angle: f32| Link {
            offset,
            turn: IDENTITY,
            axis,
            range: (-2.5, 2.5),
            angle,
        };
        [
            link([0.0; 3], [1.0, 0.0, 0.0], angles[0]),
            link([0.0; 3], [0.0, 0.0, 1.0], angles[1]),
            link([0.0, -0.12, 0.0], [1.0, 0.0, 0.0], angles[2]),
        ]
    }

    const TIP: Vector = [0.0, -0.11, 0.0];

    fn end(links: &[Link]) -> Vector {
        let (mut turn, mut place) = (IDENTITY, [0.0; 3]);
        for link in links {
            place = add(place, quaternion::rotate(turn, link.offset));
            turn = quaternion::multiply(turn, about(link.axis, link.angle));
        }
        add(place, quaternion::rotate(turn, TIP))
    }

    #[test]
    fn near_goals_are_reached() {
        let goal = end(&arm([-0.9, 0.5, -0.8]));
        let mut links = arm([-0.6, 0.3, -1.1]);
        let missing = reach(&mut links, IDENTITY, TIP, goal);
        assert!(missing < 3e-3, "{missing} m: {links:?}");
        assert!(
            (missing - {
                let d = subtract(goal, end(&links));
                crate::math::sqrt(dot(d, d))
            })
            .abs()
                < 1e-5
        );
    }

    #[test]
    fn what_is_out_of_reach_is_pointed_at_within_the_ranges() {
        let mut links = arm([-0.2, 0.1, -0.3]);
        for _ in 0..10 {
            reach(&mut links, IDENTITY, TIP, [0.0, -0.3, 0.3]);
        }
        let end = end(&links);
        assert!((end[1] + end[2]).abs() < 0.04 && end[2] > 0.12, "{end:?}");
        assert!(links.iter().all(|l| l.angle.abs() <= 2.5));
    }

    #[test]
    fn nan_changes_nothing() {
        let mut links = arm([-0.2, 0.1, -0.3]);
        reach(&mut links, IDENTITY, TIP, [f32::NAN, 0.0, 0.0]);
        assert_eq!(links[0].angle, -0.2);
        assert_eq!(links[2].angle, -0.3);
    }
}
