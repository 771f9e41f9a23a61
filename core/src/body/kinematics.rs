//! Forward kinematics over the database's skeleton.

use crate::{
    blob::Database,
    body::pose::Pose,
    math::{
        quaternion::{self, IDENTITY, Quaternion, Vector},
        vector::add,
    },
};

/// World positions of the joints, metres, shape `[joints]` (the first of `positions`; the rest is left alone).
/// Cost: one quaternion product and one rotated vector a joint.
pub fn positions<const J: usize>(database: &Database<'_>, pose: &Pose<J>, positions: &mut [Vector; J]) {
    place(database, pose.position, &pose.rotations, &mut [IDENTITY; J], positions);
}

/// The same, whatever the capacity; `world` is room for the joints' orientations.
#[inline(never)]
fn place(
    database: &Database<'_>,
    root: Vector,
    rotations: &[Quaternion],
    world: &mut [Quaternion],
    positions: &mut [Vector],
) {
    for (j, &own) in rotations.iter().enumerate().take(database.counts().joints) {
        let joint = database.joint(j);
        let (rotation, position) = match joint.parent {
            None => (own, root),
            // Parents come before their children: `open` has checked it.
            Some(parent) => {
                let (Some(&turn), Some(&from)) = (world.get(parent), positions.get(parent)) else { continue };
                (quaternion::multiply(turn, own), add(from, quaternion::rotate(turn, joint.offset)))
            }
        };
        if let (Some(turn), Some(place)) = (world.get_mut(j), positions.get_mut(j)) {
            (*turn, *place) = (rotation, position);
        }
    }
}
