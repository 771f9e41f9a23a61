//! Forward kinematics over the database's skeleton.

use crate::{
    blob::Database,
    body::pose::Pose,
    math::quaternion::{self, IDENTITY, Quaternion, Vector},
};

/// A point, in integer units of length.
pub type Point = [i32; 3];

/// World positions of the joints, shape `[joints]` (the first of `positions`; the rest is left alone), in parts of which
/// `parts` make a metre. Heights that do not fit 32 bits are held at their end; places on the ground, of which only
/// differences matter, wrap around. Cost: one quaternion product and one rotated
/// vector a joint.
pub fn positions<const J: usize>(
    database: &Database<'_>,
    pose: &Pose<J>,
    parts: f32,
    positions: &mut [Point; J],
) {
    place(database, pose.position, &pose.rotations, parts, &mut [IDENTITY; J], positions);
}

/// The same, whatever the capacity; `world` is room for the joints' orientations.
#[inline(never)]
fn place(
    database: &Database<'_>,
    root: Vector,
    rotations: &[Quaternion],
    parts: f32,
    world: &mut [Quaternion],
    positions: &mut [Point],
) {
    let whole = |v: Vector| v.map(|v| (v * parts) as i32);
    for (j, &own) in rotations.iter().enumerate().take(database.counts().joints) {
        let joint = database.joint(j);
        let (rotation, position) = match joint.parent {
            None => {
                let [x, z] = [root[0], root[2]].map(|v| (v * parts) as i64 as i32);
                (own, [x, (root[1] * parts) as i32, z])
            }
            // Parents come before their children: `open` has checked it.
            Some(parent) => {
                let (Some(&turn), Some(&from)) = (world.get(parent), positions.get(parent)) else { continue };
                let [x, y, z] = whole(quaternion::rotate(turn, joint.offset));
                let place = [from[0].wrapping_add(x), from[1].saturating_add(y), from[2].wrapping_add(z)];
                (quaternion::multiply(turn, own), place)
            }
        };
        if let (Some(turn), Some(place)) = (world.get_mut(j), positions.get_mut(j)) {
            (*turn, *place) = (rotation, position);
        }
    }
}
