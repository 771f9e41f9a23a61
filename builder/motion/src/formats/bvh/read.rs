//! Channels to local poses: one quaternion product per rotation channel.

use std::borrow::Cow;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};

use crate::{
    animation::{Joint as RigJoint, Recording},
    euler,
    formats::bvh::document::{Bvh, Channel, Joint},
    unit::Unit,
};

impl Recording for Bvh {
    fn name(&self) -> &str {
        &self.name
    }

    fn unit(&self) -> Option<Unit> {
        None
    }

    fn rate_hz(&self) -> f64 {
        self.rate_hz()
    }

    fn notes(&self) -> &[String] {
        &self.notes
    }

    fn joints(&self) -> Cow<'_, [RigJoint]> {
        Cow::Owned(rig(self))
    }

    fn frames(&self) -> usize {
        self.frames()
    }

    fn frame(&self, frame: usize) -> Cow<'_, [Isometry3<f64>]> {
        Cow::Owned(poses(self, frame))
    }

    fn place(&self, frame: usize, joint: usize) -> Vector3<f64> {
        translation(&self.joints[joint], self.row(frame))
    }
}

/// The document's joints.
pub(super) fn rig(document: &Bvh) -> Vec<RigJoint> {
    let joint = |joint: &Joint| RigJoint {
        name: joint.name.clone(),
        parent: joint.parent,
        offset: joint.offset.into(),
        tips: joint.end_sites.iter().map(|&tip| tip.into()).collect(),
        moves: [0, 1, 2].map(|axis| joint.channels.contains(&Channel::Position(axis))),
        degrees: joint.channels.len(),
        still: stands_still(document, joint),
    };
    document.joints().iter().map(joint).collect()
}

/// The local poses of a frame, file units. Shape `[joints]`.
pub(super) fn poses(document: &Bvh, frame: usize) -> Vec<Isometry3<f64>> {
    document.joints().iter().map(|joint| local(joint, document.row(frame))).collect()
}

/// True for a joint whose channels are constant, to 1e-3 degrees and file units.
fn stands_still(document: &Bvh, joint: &Joint) -> bool {
    let columns = joint.first_channel..joint.first_channel + joint.channels.len();
    let first = &document.row(0)[columns.clone()];
    (1..document.frames())
        .all(|f| document.row(f)[columns.clone()].iter().zip(first).all(|(a, b)| (a - b).abs() <= 1e-3))
}

/// A joint's translation in its parent, file units: its position channels, and `OFFSET` for axes without one.
fn translation(joint: &Joint, row: &[f64]) -> Vector3<f64> {
    let mut at = Vector3::from(joint.offset);
    for (i, channel) in joint.channels.iter().enumerate() {
        if let Channel::Position(axis) = *channel {
            at[axis] = row[joint.first_channel + i];
        }
    }
    at
}

/// Product of a joint's rotation channels, in their order.
fn rotation(joint: &Joint, row: &[f64]) -> UnitQuaternion<f64> {
    let mut q = UnitQuaternion::identity();
    for (i, channel) in joint.channels.iter().enumerate() {
        if let Channel::Rotation(axis) = *channel {
            // Whole turns are removed first, since sines of large angles lose digits.
            q *= euler::about(axis, (row[joint.first_channel + i] % 720.0).to_radians());
        }
    }
    q
}

fn local(joint: &Joint, row: &[f64]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(translation(joint, row)), rotation(joint, row))
}
