//! The skeleton: joints, hips line and toes.

use crate::{
    blob::{
        Database,
        crc::crc32c,
        layout::{ROOT_DOFS, joint},
        read::{Record, floats},
    },
    math::quaternion::{Quaternion, Vector},
};

/// A joint of the database's skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Joint {
    /// Index of the parent, smaller than the joint's own; `None` for the root.
    pub parent: Option<usize>,
    /// Joint group.
    pub group: usize,
    /// Position in the parent's frame, metres.
    pub offset: Vector,
    /// Mean local rotation; the joint's dofs are relative to it.
    pub mean: Quaternion,
}

impl<'db> Database<'db> {
    /// Joint `index`.
    #[inline(never)]
    pub fn joint(&self, index: usize) -> Joint {
        let record = Record::of(self.required.skeleton, index, joint::LENGTH);
        let parent = record.u8(joint::PARENT);
        Joint {
            parent: (parent != joint::ROOT).then_some(usize::from(parent)),
            group: usize::from(record.u8(joint::GROUP)),
            offset: record.floats(joint::OFFSET),
            mean: record.floats(joint::MEAN),
        }
    }

    /// Identifies the skeleton: CRC-32C of the joints' parents and offsets. A map and a robot store that of their database.
    pub fn skeleton_fingerprint(&self) -> u32 {
        // One checksum a joint, folded: no buffer of the skeleton's length.
        (0..self.counts.joints).fold(0u32, |sum, j| {
            let joint = self.joint(j);
            let [x, y, z] = joint.offset.map(f32::to_le_bytes);
            let parent = [joint.parent.and_then(|p| u8::try_from(p).ok()).unwrap_or(u8::MAX)];
            crc32c(&[&sum.to_le_bytes(), &parent, &x, &y, &z])
        })
    }

    /// Mean local rotations of the joints, in order.
    #[inline]
    pub fn means(&self) -> impl Iterator<Item = Quaternion> + use<'db> {
        self.joints().iter().map(|record| Record(record).floats(joint::MEAN))
    }

    /// Joint groups of the joints, in order.
    #[inline]
    pub fn groups(&self) -> impl Iterator<Item = usize> + use<'db> {
        self.joints().iter().map(|record| usize::from(Record(record).u8(joint::GROUP)))
    }

    #[inline]
    fn joints(&self) -> &'db [[u8; joint::LENGTH]] {
        self.required.skeleton.as_chunks().0.get(..self.counts.joints).unwrap_or(&[])
    }

    /// Joint group of joint `index`.
    #[inline]
    pub fn joint_group(&self, index: usize) -> usize {
        usize::from(Record::of(self.required.skeleton, index, joint::LENGTH).u8(joint::GROUP))
    }

    /// The hips line in the root's own frame, from right to left: what the heading is measured with.
    #[inline]
    pub fn hips_line(&self) -> Vector {
        floats(self.trailer(), joint::HIPS_LINE.start)
    }

    /// Joints of the left and right toes, where the skeleton has them.
    pub fn toes(&self) -> [Option<usize>; 2] {
        let record = Record(self.trailer());
        [0, 1].map(|side| {
            let joint = record.u8(joint::TOES.start + side);
            (joint != joint::ROOT).then_some(usize::from(joint))
        })
    }

    fn trailer(&self) -> &'db [u8] {
        self.required.skeleton.get(self.counts.joints * joint::LENGTH..).unwrap_or(&[])
    }

    /// Joint group of a dof.
    pub fn group_of_dof(&self, dof: usize) -> usize {
        let joint = (dof.saturating_sub(ROOT_DOFS)) / 3;
        self.joint_group(joint)
    }
}
