//! The conversion of a clip to a database's body and floor, and back: joint by joint if the bodies are the same, else by a
//! retargeting map.

use std::sync::Arc;

use anyhow::Result;
use gestus_core::{Database, blob::layout::MAX_JOINTS};
use gestus_motion::{
    body::database_skeleton,
    clip::{Clip, Frame, Skeleton},
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    registration::floor::{self, Floor, Supports},
    retarget::{
        MapFile, Retarget,
        body::check_floor,
        kept::Kept,
        up::{self, lifted},
    },
    stream::{
        cleanup::{Limbs, above_floor},
        far::{moved, moved_frame, origin_of},
    },
};

/// The conversion between the clip's joints and the database's.
#[derive(Debug)]
pub enum BodyMapping {
    /// The same body. For each joint of the database: the clip's joint of the same name and position; and the place
    /// about which its poses are streamed ([`origin_of`]).
    Same(Vec<usize>, Vector3<f64>),
    /// Another body: a retargeting map, and the legs of the file's body, if found, to keep its feet above the floor,
    /// with the joints that carry them.
    Map(Box<Retarget>, Option<Box<(Limbs, Kept)>>),
}

impl BodyMapping {
    /// The middle of the hip joints as the clip's root sees it. The database's own root is there.
    pub fn hips(&self) -> Vector3<f64> {
        match self {
            Self::Same(..) => Vector3::zeros(),
            Self::Map(map, _) => map.source.anatomy.hips,
        }
    }

    /// Finds the conversion from a clip's body to the database's, and the clip's floor.
    pub fn find(database: &Database<'_>, clip: &Clip, map: &MapFile) -> Result<(Self, Floor)> {
        let target = Arc::new(database_skeleton(database));
        let same = same_body(&clip.skeleton, &target).filter(|_| map.joints.is_empty());
        // In another world it is another body.
        let same = same.filter(|_| up::upright(clip, map) == UnitQuaternion::identity());
        if let Some(joints) = same {
            let origin = origin_of(clip);
            // The floor's height is subtracted in any case.
            let mapping = Self::Same(joints, Vector3::new(origin.x, 0.0, origin.z));
            let floor = match (map.floor_m, database.legs()) {
                (Some(height_m), _) => {
                    check_floor(height_m, clip.frames.get(clip.frames.len() / 2).map_or(0.0, |f| f.root.y))?;
                    Floor::stated(height_m)
                }
                (None, Some(legs)) => {
                    let leg_m = legs.iter().map(|leg| length(&target, leg)).sum::<f64>() / 2.0;
                    floor::find(&mapping.onto(&target, clip, 0.0), &Supports::of_legs(&legs, leg_m))
                }
                (None, None) => Floor::ZERO,
            };
            return Ok((mapping, floor));
        }
        let retarget = Retarget::new(database, clip, map)?;
        let floor = retarget.source.floor;
        // In its own world with Y up, about the map's origin.
        let mut upright = moved(&clip.fitted(f64::from(database.rate_hz()))?, &-retarget.origin);
        let floor_m = floor.height_m - (retarget.world * retarget.origin).y;
        let kept = Kept::of(&retarget.source, MAX_JOINTS);
        upright.frames.iter_mut().for_each(|frame| *frame = lifted(&kept.pick(frame), &retarget.world));
        let source = kept.body(&retarget.source);
        upright.skeleton = source.skeleton.clone();
        let limbs = source
            .legs()
            .and_then(|legs| Limbs::of_landmarks(&legs, source.hips_line(&upright.frames), &upright))
            .map(|(limbs, _)| Box::new((limbs.standing_on(floor_m, source.anatomy.leg_m), kept)));
        Ok((Self::Map(Box::new(retarget), limbs), floor))
    }

    /// Converts a clip to the database's joints and a floor at zero, near the origin. The clip's floor is at `floor_m`,
    /// metres.
    pub fn onto(&self, target: &Arc<Skeleton>, clip: &Clip, floor_m: f64) -> Clip {
        match self {
            Self::Same(joints, origin) => {
                let lowered = |frame: &Frame| {
                    let mut frame = frame.on_joints(joints);
                    frame.root -= origin;
                    frame.root.y -= floor_m;
                    frame
                };
                let frames = clip.frames.iter().map(lowered).collect();
                Clip { skeleton: target.clone(), frames, ..clip.clone() }
            }
            Self::Map(retarget, _) => retarget.to_target(clip),
        }
    }

    /// Poses of the database's joints, on a floor at zero, on the clip's skeleton and floor; what the database lacks is
    /// taken from `inputs`.
    pub fn back(&self, frames: &[Frame], inputs: &[Frame], floor_m: f64) -> Vec<Frame> {
        let (joints, origin) = match self {
            Self::Same(joints, origin) => (joints, origin),
            Self::Map(map, limbs) => {
                let back = map.to_source(frames, inputs);
                let Some((limbs, kept)) = limbs.as_deref() else { return back };
                // A foot of another shape lands elsewhere: a longer one puts its toes into the floor.
                let upright: Vec<Frame> = back
                    .iter()
                    .map(|f| lifted(&moved_frame(&kept.pick(f), &-map.origin), &map.world))
                    .collect();
                let above = above_floor(limbs, &upright);
                let down = map.world.inverse();
                let put = |(frame, whole): (&Frame, &Frame)| {
                    kept.put(moved_frame(&lifted(frame, &down), &map.origin), whole)
                };
                return above.iter().zip(&back).map(put).collect();
            }
        };
        let carry = |(pose, input): (&Frame, &Frame)| {
            let mut frame = input.clone();
            frame.root = pose.root + origin;
            frame.root.y += floor_m;
            for (&joint, rotation) in joints.iter().zip(&pose.rotations) {
                frame.rotations[joint] = *rotation;
            }
            frame
        };
        frames.iter().zip(inputs).map(carry).collect()
    }

    /// Up in the clip's world.
    pub fn up(&self) -> Vector3<f64> {
        match self {
            Self::Same(..) => Vector3::y(),
            Self::Map(retarget, _) => retarget.world.inverse() * Vector3::y(),
        }
    }
}

/// Length of a leg of a skeleton, metres.
fn length(skeleton: &Skeleton, leg: &gestus_core::blob::Leg) -> f64 {
    skeleton.offsets[leg.knee].norm() + skeleton.offsets[leg.ankle].norm()
}

/// Whether rotations can be copied from one skeleton to the other, joint by joint: the same body, its joints in one order.
pub fn is_same_body(a: &Skeleton, b: &Skeleton) -> bool {
    a.names == b.names && same_body(a, b).is_some()
}

/// For each joint of the database the clip's, if both have the same body: the same names and parents, and about the same
/// bones. A copy of the skeleton of another size or with other axes is another body.
pub fn same_body(clip: &Skeleton, database: &Skeleton) -> Option<Vec<usize>> {
    let joints: Vec<usize> = database.names.iter().map(|n| clip.find(n)).collect::<Option<_>>()?;
    if joints.first() != Some(&0) {
        return None;
    }
    let length: f64 = database.offsets.iter().skip(1).map(nalgebra::Vector3::norm).sum();
    let mut apart = 0.0;
    for (j, &c) in joints.iter().enumerate().skip(1) {
        // Joints between them that the database lacks would rotate their children.
        if clip.parents[c] != database.parents[j].map(|p| joints[p]) {
            return None;
        }
        apart += (clip.offsets[c] - database.offsets[j]).norm();
    }
    // Calibrations of one performer differ by a few per cent.
    (apart < 0.1 * length).then_some(joints)
}
