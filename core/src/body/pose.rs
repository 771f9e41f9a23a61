//! Poses and degrees of freedom.
//!
//! A pose says where every joint points; the regressions want numbers that are small, smooth and free of where
//! in the room the body is. These are, in order (D = 3 joints + 4):
//!
//! | dofs | unit | what |
//! |---|---|---|
//! | 0 | m | height of the root |
//! | 1-3 | rad | root orientation without its heading, exponential map relative to its mean |
//! | 4, 5 | m/s | ground velocity of the root, forward and left of the heading of the frame before |
//! | 6 | rad/s | rate of the heading |
//! | 7- | rad | local rotation of joint 1, 2, ...: exponential map relative to the joint's mean |
//!
//! The heading is that of the hips line projected on the ground: 0 along +Z, growing towards +X. Maps are taken
//! relative to the means because raw ones reach half a turn (upper legs) and break there. Source: Xia 2015,
//! section 4; maps relative to the means, heading and velocities are ours.

use crate::{
    blob::{Database, layout::dof},
    math::{
        atan2,
        quaternion::{self, IDENTITY, Quaternion, Vector},
        sin_cos, wrap_angle,
    },
};

/// A pose: metres and unit quaternions `[x, y, z, w]`, right-handed, Y up.
///
/// `J` is a capacity: a database with fewer joints uses the first of them.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Pose<const J: usize> {
    /// Root position in the world, metres.
    pub position: Vector,
    /// Joint rotations; entry 0 is the root's orientation in the world, the others are local to their parents.
    pub rotations: [Quaternion; J],
}

impl<const J: usize> Pose<J> {
    /// The root at the origin and no rotation anywhere.
    pub const IDENTITY: Self = Self { position: [0.0; 3], rotations: [IDENTITY; J] };

    /// No pose: its position is not a number.
    pub const INVALID: Self = Self { position: [f32::NAN; 3], rotations: [IDENTITY; J] };

    /// True where the first `joints` rotations are unit quaternions and each coordinate of the position is within 100 km
    /// of the origin.
    pub fn is_valid(&self, joints: usize) -> bool {
        self.position.iter().all(|v| (-1e5..=1e5).contains(v))
            && quaternion::are_units(self.rotations.get(..joints).unwrap_or(&self.rotations))
    }
}

impl<const J: usize> Default for Pose<J> {
    fn default() -> Self {
        Self::IDENTITY
    }
}

/// The dofs of one frame; the first D of its 4 J numbers are in use. Room for D = 3 J + 4 from J = 4 on.
pub type Dofs<const J: usize> = [[f32; 4]; J];

/// Where a body stands and which way it faces: what turns velocities into places.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Anchor {
    /// Ground position of the root, x and z, metres.
    pub ground: [f32; 2],
    /// Heading, radians.
    pub heading: f32,
}

impl Anchor {
    /// The origin, facing +Z.
    pub const ORIGIN: Self = Self { ground: [0.0; 2], heading: 0.0 };

    /// The anchor of a root; where its hips line stands upright the heading of `before` stays.
    pub fn of(database: &Database<'_>, position: Vector, root: Quaternion, before: Self) -> Self {
        let line = quaternion::rotate(root, database.hips_line());
        let flat = line[0] * line[0] + line[2] * line[2];
        let heading = if flat > 1e-4 { atan2(-line[2], line[0]) } else { before.heading };
        Self { ground: [position[0], position[2]], heading }
    }

    /// The ground position reached from here by moving for `seconds` with a velocity, forward and left, m/s.
    pub fn moved(&self, forward: f32, left: f32, seconds: f32) -> [f32; 2] {
        let (s, c) = sin_cos(self.heading);
        [
            self.ground[0] + (s * forward + c * left) * seconds,
            self.ground[1] + (c * forward - s * left) * seconds,
        ]
    }
}

/// Takes a pose to its dofs; `before` is the anchor of the frame before. Returns the pose's own anchor.
/// `dofs` holds at least D numbers; the rest is left alone.
pub fn to_dofs<const J: usize>(
    database: &Database<'_>,
    pose: &Pose<J>,
    before: Anchor,
    dofs: &mut [f32],
) -> Anchor {
    take_apart(database, pose.position, &pose.rotations, before, dofs)
}

// Not generic over capacities, so that it is compiled with the core, optimised for speed.
#[inline(never)]
fn take_apart(
    database: &Database<'_>,
    position: Vector,
    rotations: &[Quaternion],
    before: Anchor,
    dofs: &mut [f32],
) -> Anchor {
    let root = rotations.first().copied().unwrap_or(IDENTITY);
    let anchor = Anchor::of(database, position, root, before);
    let rate = database.rate_hz();
    let (dx, dz) = (anchor.ground[0] - before.ground[0], anchor.ground[1] - before.ground[1]);
    let (s, c) = sin_cos(before.heading);
    let upright = quaternion::multiply(quaternion::about_y(-anchor.heading), root);
    let mut means = database.means();
    let tilt = quaternion::between(means.next().unwrap_or(IDENTITY), upright);
    let head = [
        position[1],
        tilt[0],
        tilt[1],
        tilt[2],
        (s * dx + c * dz) * rate,
        (c * dx - s * dz) * rate,
        wrap_angle(anchor.heading - before.heading) * rate,
    ];
    let (root_dofs, joint_dofs) = dofs.split_at_mut(dof::JOINTS.min(dofs.len()));
    for (slot, value) in root_dofs.iter_mut().zip(head) {
        *slot = value;
    }
    let maps = joint_dofs.as_chunks_mut::<3>().0;
    for ((map, mean), &rotation) in maps.iter_mut().zip(means).zip(rotations.iter().skip(1)) {
        *map = quaternion::between(mean, rotation);
    }
    anchor
}

/// Turns dofs into a pose that stands on `anchor`. Rotations beyond the database's joints are the identity.
pub fn to_pose<const J: usize>(database: &Database<'_>, dofs: &[f32], anchor: Anchor, pose: &mut Pose<J>) {
    let height = dofs.get(dof::HEIGHT).copied().unwrap_or(0.0);
    pose.position = [anchor.ground[0], height, anchor.ground[1]];
    put_together(database, dofs, anchor.heading, &mut pose.rotations);
}

#[inline(never)]
fn put_together(database: &Database<'_>, dofs: &[f32], heading: f32, rotations: &mut [Quaternion]) {
    let Some((root, others)) = rotations.split_first_mut() else { return };
    let mut means = database.means();
    // The tilt stands in the place of joint 0's map, behind the height; the other maps begin at dof 7.
    let maps = |from: usize| dofs.get(from..).unwrap_or(&[]).as_chunks::<3>().0;
    let tilt = maps(dof::TILT).first().copied().unwrap_or([0.0; 3]);
    let upright = quaternion::turned(means.next().unwrap_or(IDENTITY), tilt);
    let faced = quaternion::multiply(quaternion::about_y(heading), upright);
    *root = quaternion::normalize(faced).unwrap_or(IDENTITY);
    for ((rotation, mean), map) in others.iter_mut().zip(means).zip(maps(dof::JOINTS)) {
        *rotation = quaternion::turned(mean, *map);
    }
    others.iter_mut().skip(database.counts().joints.saturating_sub(1)).for_each(|r| *r = IDENTITY);
}
