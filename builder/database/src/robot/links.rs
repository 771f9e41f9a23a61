//! Anatomical frames of a robot's links.
//!
//! With all hinges at zero the robot stands upright with flat feet, facing forward; its limbs may point anywhere. Frames
//! are found in that pose by the same rules as a skeleton's ([`crate::retarget::anatomy`]): Y along the bone, X along the
//! axis of knee or elbow in the direction in which they bend.

use gestus_core::robot::layout::MAX_LIMB_HINGES;
use gestus_motion::formats::urdf::Robot;
use nalgebra::{Isometry3, Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::{
    retarget::{
        body::Body,
        parts::{Part, Side},
    },
    robot::assign::{Assigned, Assignment},
};

/// An arm or leg with a target for its end.
pub(super) struct Limb {
    pub joints: (usize, usize),
    pub hinges: (usize, usize),
    pub scale: f64,
    pub tip: Vector3<f64>,
    pub leg: bool,
}

/// Positions and anatomical frames of the links, with all hinges at zero.
pub(super) struct Links {
    pub places: Vec<Isometry3<f64>>,
    /// From anatomical axes to the link's, for the last hinge of a group.
    pub frames: Vec<Option<UnitQuaternion<f64>>>,
    /// End of each limb: in the base's axes.
    tips: std::collections::BTreeMap<Part, Vector3<f64>>,
}

impl Links {
    pub fn of(robot: &Robot, assignment: &Assignment, axes: UnitQuaternion<f64>) -> Self {
        let count = robot.hinges.len();
        let places = robot.places(&vec![0.0; count]);
        let mut this = Self { places, frames: vec![None; count], tips: Default::default() };
        let group = |part: Part| assignment.groups.iter().find(|g| g.part == part);
        for g in &assignment.groups {
            let last = g.hinges[g.hinges.len() - 1];
            let upright = this.places[last].rotation.inverse() * axes;
            this.frames[last] = Some(upright);
        }
        for (leg, chain) in chains() {
            let (Some(upper), Some(lower)) = (group(chain[0]), group(chain[1])) else { continue };
            let tip = this.tip(robot, lower, group(chain[2]), upper);
            this.tips.insert(chain[2], tip);
            this.limb(robot, upper, lower, tip, !leg, axes);
            // A hand lies as its lower arm does.
            if let (false, Some(hand)) = (leg, group(chain[2])) {
                let (from, to) = (lower.hinges[lower.hinges.len() - 1], hand.hinges[hand.hinges.len() - 1]);
                let relative = this.places[to].rotation.inverse() * this.places[from].rotation;
                this.frames[to] = this.frames[from].map(|f| relative * f);
            }
        }
        this
    }

    /// The end of a limb: the next group, a fixed link behind it, or one length of the upper bone further.
    fn tip(&self, robot: &Robot, lower: &Assigned, end: Option<&Assigned>, upper: &Assigned) -> Vector3<f64> {
        let last = lower.hinges[lower.hinges.len() - 1];
        if let Some(end) = end {
            return self.places[end.hinges[0]].translation.vector;
        }
        let fixed = robot.fixed.iter().filter(|f| f.parent == Some(last));
        let far = fixed.map(|f| (self.places[last] * f.origin).translation.vector);
        let here = self.places[last].translation.vector;
        let far = far.max_by(|a, b| (a - here).norm().total_cmp(&(b - here).norm()));
        far.filter(|f| (f - here).norm() > 0.01).unwrap_or_else(|| here + (here - self.begin(upper, here)))
    }

    /// The start of the upper bone: its last hinge, or its first if the last is at the elbow (the yaw of some upper arms).
    fn begin(&self, upper: &Assigned, elbow: Vector3<f64>) -> Vector3<f64> {
        let at = |h: usize| self.places[h].translation.vector;
        let (first, last) = (at(upper.hinges[0]), at(upper.hinges[upper.hinges.len() - 1]));
        if (elbow - last).norm() > 0.3 * (elbow - first).norm() { last } else { first }
    }

    /// Frames of upper and lower bone.
    fn limb(
        &mut self,
        robot: &Robot,
        upper: &Assigned,
        lower: &Assigned,
        tip: Vector3<f64>,
        arm: bool,
        axes: UnitQuaternion<f64>,
    ) {
        let (u, l) = (upper.hinges[upper.hinges.len() - 1], lower.hinges[lower.hinges.len() - 1]);
        let elbow = self.places[lower.hinges[0]].translation.vector;
        let upper_bone = elbow - self.begin(upper, elbow);
        let lower_bone = tip - elbow;
        // Direction of bending: with its hinges in the middle of their ranges.
        let mut bent = vec![0.0; robot.hinges.len()];
        for &h in &lower.hinges {
            let (low, high) = robot.hinges[h].range;
            bent[h] = 0.5 * (low + high);
        }
        let places = robot.places(&bent);
        let tip_in_link = self.places[l].inverse_transform_point(&tip.into());
        let bent_bone = places[l].transform_point(&tip_in_link).coords - elbow;
        let bend = upper_bone.cross(&bent_bone);
        let across = if bend.norm() > 0.15 * upper_bone.norm() * bent_bone.norm() {
            bend
        } else {
            // A knee bends about the left axis; an elbow about the right one, carried up with the arm.
            let (down, side) = (axes * -Vector3::y(), axes * Vector3::x());
            if arm {
                UnitQuaternion::rotation_between(&down, &upper_bone).map_or(-side, |r| r * -side)
            } else {
                side
            }
        };
        for (h, bone) in [(u, upper_bone), (l, lower_bone)] {
            let frame = frame(bone, across);
            self.frames[h] = Some(self.places[h].rotation.inverse() * frame);
        }
    }
}

/// Axes with Y along the bone and X across.
fn frame(bone: Vector3<f64>, across: Vector3<f64>) -> UnitQuaternion<f64> {
    let y = bone.try_normalize(1e-9).unwrap_or_else(Vector3::y);
    let other = if y.x.abs() < 0.7 { Vector3::x() } else { Vector3::z() };
    let x = (across - y * y.dot(&across)).try_normalize(1e-9).unwrap_or_else(|| y.cross(&other).normalize());
    let matrix = Matrix3::from_columns(&[x, y, x.cross(&y)]);
    UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix))
}

/// Whether a limb is a leg, and its parts from the body on: each leg before its side's arm.
fn chains() -> impl Iterator<Item = (bool, [Part; 3])> {
    Side::BOTH.into_iter().flat_map(|side| {
        [
            (true, [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side)]),
            (false, [Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)]),
        ]
    })
}

/// The limbs that both have, each a single chain of hinges.
pub(super) fn limbs(body: &Body, robot: &Robot, assignment: &Assignment, links: &Links) -> Vec<Limb> {
    let group = |part: Part| assignment.groups.iter().find(|g| g.part == part);
    let mut limbs = Vec::new();
    for (leg, chain) in chains() {
        let (Some(upper), Some(lower)) = (group(chain[0]), group(chain[1])) else { continue };
        let (Some(from), Some(to)) = (body.parts.get(chain[0]), body.parts.get(chain[2])) else {
            continue;
        };
        let (first, last) = (upper.hinges[0], lower.hinges[lower.hinges.len() - 1]);
        let chained = (first + 1..=last).all(|h| robot.hinges[h].parent == Some(h - 1));
        if !chained || last - first >= MAX_LIMB_HINGES {
            continue;
        }
        let tip = links.tips[&chain[2]];
        let elbow = links.places[lower.hinges[0]].translation.vector;
        let length = (elbow - links.places[first].translation.vector).norm() + (tip - elbow).norm();
        let whole = if leg { body.anatomy.leg_m } else { body.anatomy.arm_m };
        let tip = links.places[last].inverse_transform_point(&tip.into()).coords;
        limbs.push(Limb {
            joints: (from, to),
            hinges: (first, last),
            scale: length / whole.max(1e-6),
            tip,
            leg,
        });
    }
    limbs
}
