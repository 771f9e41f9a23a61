//! The joints of a large skeleton that a map needs: those of body parts, and what carries them.
//!
//! A map takes as many joints as a board can hold. Characters have more, of faces, hair and clothes, which move as they do.

use std::collections::BTreeSet;

use gestus_motion::{clip::Frame, joints};

use crate::retarget::body::Body;

/// Joints of a skeleton: all, or those that are needed, parents before children.
#[derive(Debug, Clone)]
pub struct Kept(Option<Vec<usize>>);

impl Kept {
    /// All joints of a body that has at most that many, or else those that are needed.
    pub fn of(body: &Body, most: usize) -> Self {
        let skeleton = &body.skeleton;
        if skeleton.joints() <= most { Self(None) } else { Self::needed(body, &[]) }
    }

    /// The joints of body parts and those that are named, and what carries them.
    pub fn needed(body: &Body, named: &[usize]) -> Self {
        let parts = body.parts.joints.values().chain(&body.parts.spine).chain(&body.parts.neck);
        let needed = parts.chain(named);
        let carried: BTreeSet<usize> = needed.flat_map(|&joint| body.skeleton.path(joint)).collect();
        Self(Some(carried.into_iter().collect()))
    }

    /// Whether joints are left out.
    pub fn is_part(&self) -> bool {
        self.0.is_some()
    }

    /// The body of these joints.
    pub fn body(&self, body: &Body) -> Body {
        let Some(kept) = &self.0 else { return body.clone() };
        let place = |joint: usize| kept.iter().position(|&k| k == joint);
        let places = |joints: &[usize]| joints.iter().filter_map(|&j| place(j)).collect::<Vec<_>>();
        let mut part = body.clone();
        part.skeleton = joints::skeleton_of(&body.skeleton, kept);
        part.parts.joints.values_mut().for_each(|joint| *joint = place(*joint).unwrap_or(0));
        part.parts.spine = places(&body.parts.spine);
        part.parts.neck = places(&body.parts.neck);
        let frames = body.anatomy.frames.iter();
        part.anatomy.frames = frames.filter_map(|(&j, frame)| Some((place(j)?, *frame))).collect();
        let seen = body.anatomy.seen.iter();
        part.anatomy.seen =
            seen.filter_map(|(&(a, b), turn)| Some(((place(a)?, place(b)?), *turn))).collect();
        part.rest = kept.iter().map(|&j| body.rest[j]).collect();
        part
    }

    /// Those of a pose.
    pub fn pick(&self, frame: &Frame) -> Frame {
        self.0.as_ref().map_or_else(|| frame.clone(), |kept| frame.on_joints(kept))
    }

    /// A pose of them, with the other joints as in `whole`.
    pub fn put(&self, part: Frame, whole: &Frame) -> Frame {
        let Some(kept) = &self.0 else { return part };
        let mut frame = Frame { root: part.root, rotations: whole.rotations.clone() };
        kept.iter().zip(part.rotations).for_each(|(&j, rotation)| frame.rotations[j] = rotation);
        frame
    }
}
