//! The content of a motion file, whatever its format: a rig of joints, and the local pose of each joint in each frame.
//!
//! Every format is a [`Recording`]; a [`Binding`](crate::binding::Binding) turns that into a clip.

use std::borrow::Cow;

use nalgebra::{Isometry3, Vector3};

use crate::unit::Unit;

/// A joint of a rig.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name, unique in the rig.
    pub name: String,
    /// Its parent; `None` for the first joint only.
    pub parent: Option<usize>,
    /// Position in the parent's frame at rest, file units.
    pub offset: Vector3<f64>,
    /// Ends of bones that carry no joint (BVH's End Sites), in the joint's own frame, file units.
    pub tips: Vec<Vector3<f64>>,
    /// Axes along which the animation translates it.
    pub moves: [bool; 3],
    /// Number of animated degrees of freedom, 0 to 6.
    pub degrees: usize,
    /// True for a joint that does not move, to 1e-3 degrees and file units.
    pub still: bool,
}

/// A rig and its motion. Joints are in depth-first order.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// The file's name, for messages and for naming clips.
    pub name: String,
    /// The unit of length, where the format has one.
    pub unit: Option<Unit>,
    /// Frames a second.
    pub rate_hz: f64,
    /// Notes for the user about the reading of the file.
    pub notes: Vec<String>,
    /// The rig.
    pub joints: Vec<Joint>,
    /// Local poses, file units. Shape `[frames x joints]`.
    pub poses: Vec<Isometry3<f64>>,
}

/// A source of a rig and its motion. Poses are made when they are asked for: those of a whole file would take several
/// times its size.
pub trait Recording {
    /// The file's name, for messages and for naming clips.
    fn name(&self) -> &str;
    /// The unit of length, where the format has one.
    fn unit(&self) -> Option<Unit>;
    /// Frames a second.
    fn rate_hz(&self) -> f64;
    /// Notes for the user about the reading of the file.
    fn notes(&self) -> &[String];
    /// The rig, joints in depth-first order. Computed by some formats: ask once.
    fn joints(&self) -> Cow<'_, [Joint]>;
    /// Number of frames.
    fn frames(&self) -> usize;
    /// The local poses of a frame, file units. Shape `[joints]`.
    fn frame(&self, frame: usize) -> Cow<'_, [Isometry3<f64>]>;
    /// The translation of one joint in its parent, file units.
    fn place(&self, frame: usize, joint: usize) -> Vector3<f64>;
}

impl Recording for Animation {
    fn name(&self) -> &str {
        &self.name
    }

    fn unit(&self) -> Option<Unit> {
        self.unit
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn joints(&self) -> Cow<'_, [Joint]> {
        Cow::Borrowed(&self.joints)
    }

    fn frames(&self) -> usize {
        self.poses.len() / self.joints.len().max(1)
    }

    fn frame(&self, frame: usize) -> Cow<'_, [Isometry3<f64>]> {
        Cow::Borrowed(&self.poses[frame * self.joints.len()..(frame + 1) * self.joints.len()])
    }

    fn place(&self, frame: usize, joint: usize) -> Vector3<f64> {
        self.poses[frame * self.joints.len() + joint].translation.vector
    }
}

/// Indices of a joint's children, in order.
pub fn children(joints: &[Joint], joint: usize) -> impl Iterator<Item = usize> + '_ {
    (joint + 1..joints.len()).filter(move |&j| joints[j].parent == Some(joint))
}
