//! A body measured on its rest pose alone, as a character without an animation is.
//!
//! Its joints' axes may lie in any way at rest. So the pose is measured on a copy of the skeleton whose axes are the
//! world's: its zero rotations are that pose, which is upright in a T-pose or an A-pose. Frames of the copy are then turned
//! into the joints' own axes.

use std::sync::Arc;

use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::UnitQuaternion;

use crate::retarget::{
    anatomy::{Anatomy, Standing},
    body::{Body, MapError, floor_of},
    file::MapFile,
    identify::Parts,
    up::{self, lifted},
};

impl Body {
    /// A body measured on a clip of one pose, and the rotation of its world to Y up. `None` if it does not stand upright in
    /// it with straight limbs, so that nothing tells how they bend.
    ///
    /// # Errors
    /// [`MapError`] if it can't be identified.
    pub fn at_rest(clip: &Clip, file: &MapFile) -> Result<Option<(Self, UnitQuaternion<f64>)>, MapError> {
        let [pose] = &clip.frames[..] else { return Ok(None) };
        let world = up::upright(clip, file);
        let pose = lifted(pose, &world);
        let (skeleton, turns) = in_axes_of_the_world(&clip.skeleton, &pose);
        let still = Frame { root: pose.root, rotations: vec![UnitQuaternion::identity(); turns.len()] };
        let mut parts =
            Parts::find(&skeleton, std::slice::from_ref(&still), file).map_err(MapError::Source)?;
        parts.doubts.extend(up::doubt(clip, file));
        let sample = std::slice::from_ref(&still);
        let mut anatomy = Anatomy::of(&skeleton, &parts, sample, None, Standing::BothFeet);
        if !anatomy.upright {
            return Ok(None);
        }
        // All of them say that limbs hardly bend.
        anatomy.doubts.clear();
        let copy = Clip { skeleton: Arc::new(skeleton), frames: vec![still], ..clip.clone() };
        let floor = floor_of(&copy, &UnitQuaternion::identity(), &parts, anatomy.leg_m, file)?;
        anatomy.stand_on(floor.height_m);
        for (&joint, frame) in &mut anatomy.frames {
            *frame = turns[joint].inverse() * *frame;
        }
        for (&(joint, other), seen) in &mut anatomy.seen {
            *seen = turns[joint].inverse() * *seen * turns[other];
        }
        anatomy.hips = turns[0].inverse() * anatomy.hips;
        let skeleton = clip.skeleton.clone();
        let body = Self { skeleton, parts, anatomy, floor, rest: pose.rotations }.checked("character")?;
        Ok(Some((body, world)))
    }
}

/// The skeleton with every joint's axes as the world's in that pose, and the orientations of the joints in it.
fn in_axes_of_the_world(skeleton: &Skeleton, pose: &Frame) -> (Skeleton, Vec<UnitQuaternion<f64>>) {
    let (_, turns) = pose.world(skeleton);
    let bones = skeleton.offsets.iter().zip(&skeleton.parents);
    let offsets = bones.map(|(offset, parent)| parent.map_or(*offset, |p| turns[p] * offset)).collect();
    (Skeleton { offsets, ..skeleton.clone() }, turns)
}
