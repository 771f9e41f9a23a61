//! The content of a motion file, whatever its format: a rig of joints, and the local pose of each joint in each frame.
//!
//! Every format is read into an [`Animation`]; a [`Binding`](crate::binding::Binding) turns that into a clip.

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

impl Animation {
    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.poses.len() / self.joints.len().max(1)
    }

    /// The local poses of a frame, file units. Shape `[joints]`.
    pub fn frame(&self, frame: usize) -> &[Isometry3<f64>] {
        &self.poses[frame * self.joints.len()..(frame + 1) * self.joints.len()]
    }

    /// Indices of a joint's children, in order.
    pub fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        (joint + 1..self.joints.len()).filter(move |&j| self.joints[j].parent == Some(joint))
    }
}

/// A source of an animation.
pub trait Recording {
    /// The animation; converted if the format stores it in another form. Convert once and keep it.
    fn animation(&self) -> Cow<'_, Animation>;
}

impl Recording for Animation {
    fn animation(&self) -> Cow<'_, Animation> {
        Cow::Borrowed(self)
    }
}
