//! Joints that turn or slide and are held, as if they were fixed.

use nalgebra::{UnitQuaternion, Vector3};
use urdf_rs::JointType::{Continuous, Fixed, Prismatic, Revolute};

/// A joint that turns or slides and is held.
#[derive(Debug, Clone, PartialEq)]
pub struct Held {
    /// The joint's name.
    pub name: String,
    /// Hinges before it, depth first.
    pub before: usize,
    /// True if its state is one number: it slides, or turns without a range.
    pub single: bool,
    /// Where it is held, radians: at zero, or at the end of its limits that is nearest to it.
    pub angle: f64,
}

impl Held {
    /// Its turn, from the frame before it to the one behind it.
    pub(super) fn turn(&self, joint: &urdf_rs::Joint) -> UnitQuaternion<f64> {
        let axis = Vector3::from(joint.axis.xyz.0).try_normalize(1e-6).unwrap_or_default();
        UnitQuaternion::from_scaled_axis(axis * self.angle)
    }
}

/// A joint that is no hinge of the robot, unless it is fixed in the file too.
pub(super) fn held(joint: &urdf_rs::Joint, before: usize) -> Option<Held> {
    let single = matches!(joint.joint_type, Continuous | Prismatic | Revolute);
    (joint.joint_type != Fixed).then(|| Held { name: joint.name.clone(), before, single, angle: rest(joint) })
}

/// The angle at which a joint without a range is held: the one within its limits that is nearest to zero.
pub(super) fn rest(joint: &urdf_rs::Joint) -> f64 {
    let (low, high) = (joint.limit.lower, joint.limit.upper);
    if joint.joint_type == Revolute && low <= high { 0f64.clamp(low, high) } else { 0.0 }
}
