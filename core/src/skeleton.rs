//! Forward kinematics over the database's skeleton.

use crate::{
    blob::Database,
    pose::Pose,
    quaternion::{self, IDENTITY, Vector},
};

/// World positions of the joints, metres, shape `[joints]` (the first of `positions`; the rest is left alone).
/// Cost: one quaternion product and one rotated vector a joint.
pub fn positions<const J: usize>(database: &Database<'_>, pose: &Pose<J>, positions: &mut [Vector; J]) {
    let mut world = [IDENTITY; J];
    for j in 0..database.counts().joints.min(J) {
        let joint = database.joint(j);
        let (rotation, position) = match joint.parent {
            None => (pose.rotations[j], pose.position),
            // Parents come before their children: `open` has checked it.
            Some(parent) => {
                let (Some(&turn), Some(&from)) = (world.get(parent), positions.get(parent)) else { continue };
                let arm = quaternion::rotate(turn, joint.offset);
                let position = [from[0] + arm[0], from[1] + arm[1], from[2] + arm[2]];
                (quaternion::multiply(turn, pose.rotations[j]), position)
            }
        };
        world[j] = rotation;
        positions[j] = position;
    }
}
