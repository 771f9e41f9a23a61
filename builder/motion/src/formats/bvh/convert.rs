//! A clip as BVH channels: three `atan2` per joint and frame.

use std::{borrow::Cow, collections::HashSet};

use nalgebra::{Isometry3, Translation3, Vector3};

use crate::{
    animation::{Animation, Recording},
    binding::{Binding, ConvertError, check_clip},
    clip::Clip,
    euler,
    formats::bvh::{
        document::{Bvh, Channel, Joint},
        numbers::MAX_LENGTH,
        read::{poses, rig},
    },
    unit::Unit,
};

/// A document that a clip can be written like, as BVH.
pub trait AsBvh {
    /// The document whose joints and channels are written.
    ///
    /// # Errors
    /// [`ConvertError`] if BVH can't represent it.
    fn as_bvh(&self) -> Result<Cow<'_, Bvh>, ConvertError>;
}

impl AsBvh for Bvh {
    fn as_bvh(&self) -> Result<Cow<'_, Bvh>, ConvertError> {
        Ok(Cow::Borrowed(self))
    }
}

impl AsBvh for Animation {
    fn as_bvh(&self) -> Result<Cow<'_, Bvh>, ConvertError> {
        let unit = self.unit.unwrap_or(Unit::Metres);
        let rigged = self.joints.iter().map(|joint| Rigged {
            name: joint.name.clone(),
            parent: joint.parent,
            offset: joint.offset * unit.metres(),
            moves: joint.moves.contains(&true),
        });
        let metres = |pose: &Isometry3<f64>| {
            Isometry3::from_parts((pose.translation.vector * unit.metres()).into(), pose.rotation)
        };
        let poses = (0..self.frames()).map(|f| self.frame(f).iter().map(metres).collect());
        Bvh::from_poses(&self.name, self.rate_hz, unit, rigged.collect(), poses).map(Cow::Owned)
    }
}

impl Binding {
    /// A clip as a document like the given one: with its units, channels, joint order, and joints that carry nothing.
    ///
    /// Joints that the clip doesn't move are as in the document's first frame. Angles are rounded to 1e-6 degrees,
    /// positions to a micrometre or finer.
    pub fn write(&self, document: &impl AsBvh, clip: &Clip) -> Result<Bvh, ConvertError> {
        let document = &*document.as_bvh()?;
        self.check(&rig(document), document.name(), clip)?;
        let all = document.joints();
        let scale = self.unit.metres();
        let carrier = self.carrier(&poses(document, 0)).inverse();
        let mut row = document.row(0).to_vec();
        let mut values = Vec::with_capacity(clip.frames.len() * row.len());
        for frame in &clip.frames {
            for (s, &j) in self.joints.iter().enumerate() {
                let pose = Isometry3::from_parts(
                    Translation3::from(if s == 0 { frame.root } else { self.skeleton.offsets[s] } / scale),
                    frame.rotations[s],
                );
                let pose = if s == 0 { carrier * pose } else { pose };
                put(&all[j], &pose, scale, &mut row);
            }
            values.extend_from_slice(&row);
        }
        let same_rate = (clip.rate_hz - document.rate_hz()).abs() <= 1e-6 * clip.rate_hz;
        Ok(Bvh {
            name: document.name.clone(),
            notes: Vec::new(),
            joints: document.joints.clone(),
            channels: document.channels,
            frame_time_s: if same_rate { document.frame_time_s } else { 1.0 / clip.rate_hz },
            values,
        })
    }
}

impl Bvh {
    /// A new document for a clip: position and Z-X-Y rotation channels on the root, rotations on
    /// the other joints, an End Site on every leaf. Joints are reordered depth first, as the format requires.
    pub fn from_clip(clip: &Clip, unit: Unit) -> Result<Bvh, ConvertError> {
        check_clip(clip)?;
        let skeleton = &clip.skeleton;
        let mut order = Vec::with_capacity(skeleton.joints());
        let mut open = vec![0];
        while let Some(s) = open.pop() {
            order.push(s);
            open.extend((0..skeleton.joints()).rev().filter(|&c| skeleton.parents[c] == Some(s)));
        }
        let rigged = order.iter().map(|&s| Rigged {
            name: skeleton.names[s].trim().to_string(),
            parent: skeleton.parents[s].and_then(|p| order.iter().position(|&o| o == p)),
            offset: skeleton.offsets[s],
            moves: s == 0,
        });
        let poses = clip.frames.iter().map(|frame| {
            let pose = |&s: &usize| Isometry3::from_parts(Translation3::from(frame.root), frame.rotations[s]);
            order.iter().map(pose).collect()
        });
        Bvh::from_poses(&clip.name, clip.rate_hz, unit, rigged.collect(), poses)
    }

    /// A document of joints in depth-first order, and their local poses frame by frame, metres. A pose's translation
    /// is used only for joints that move.
    ///
    /// # Errors
    /// [`ConvertError`] if it could not be read again after writing.
    fn from_poses(
        name: &str,
        rate_hz: f64,
        unit: Unit,
        rigged: Vec<Rigged>,
        poses: impl Iterator<Item = Vec<Isometry3<f64>>>,
    ) -> Result<Bvh, ConvertError> {
        let scale = unit.metres();
        let parts: HashSet<Option<usize>> = rigged.iter().map(|j| j.parent).collect();
        let mut names = HashSet::new();
        let mut joints: Vec<Joint> = Vec::with_capacity(rigged.len());
        let mut channels = 0;
        for (j, Rigged { name, parent, offset, moves }) in rigged.into_iter().enumerate() {
            let taken = !names.insert(name.clone());
            if taken || name.is_empty() || name.contains(NOT_IN_NAMES) {
                return Err(ConvertError::BadName { name });
            }
            let mut own = if moves { Channel::ALL[..3].to_vec() } else { Vec::new() };
            own.extend([2, 0, 1].map(Channel::Rotation));
            let first_channel = channels;
            channels += own.len();
            let leaf = !parts.contains(&Some(j));
            joints.push(Joint {
                name,
                parent,
                offset: (offset / scale).map(|x| rounded(x, scale)).into(),
                channels: own,
                first_channel,
                end_sites: if leaf { vec![[0.0; 3]] } else { Vec::new() },
            });
        }
        let mut row = vec![0.0; channels];
        let mut values = Vec::new();
        for (f, frame) in poses.enumerate() {
            for (joint, mut pose) in joints.iter().zip(frame) {
                pose.translation.vector /= scale;
                put(joint, &pose, scale, &mut row);
                let own = &row[joint.first_channel..joint.first_channel + joint.channels.len()];
                if !own.iter().chain(&joint.offset).all(|x| x.abs() <= MAX_LENGTH) {
                    let (clip, joint) = (name.to_string(), joint.name.clone());
                    return Err(ConvertError::NotFinite { clip, frame: f + 1, joint });
                }
            }
            values.extend_from_slice(&row);
        }
        let frame_time_s = 1.0 / rate_hz;
        Ok(Bvh { name: name.to_string(), notes: Vec::new(), joints, channels, frame_time_s, values })
    }
}

/// A joint for [`Bvh::from_poses`].
struct Rigged {
    name: String,
    parent: Option<usize>,
    /// Metres, in the parent's frame.
    offset: Vector3<f64>,
    /// Whether it has position channels.
    moves: bool,
}

/// Characters that end or split a name in a file.
pub(crate) const NOT_IN_NAMES: [char; 6] = ['{', '}', '\n', '\r', '\0', '\u{feff}'];

/// Writes a local pose, file units, into a joint's columns. Of equivalent angles, the nearest to those in the row are
/// chosen.
fn put(joint: &Joint, pose: &Isometry3<f64>, scale: f64, row: &mut [f64]) {
    let mut axes = [0; 3];
    let mut near = [0.0; 3];
    let mut count = 0;
    for (i, channel) in joint.channels.iter().enumerate() {
        let value = &mut row[joint.first_channel + i];
        match *channel {
            Channel::Position(axis) => *value = rounded(pose.translation.vector[axis], scale),
            Channel::Rotation(axis) => {
                axes[count] = axis;
                near[count] = value.to_radians();
                count += 1;
            }
        }
    }
    // Axes without a channel come last, with angle zero.
    let missing = (0..3).filter(|axis| !axes[..count].contains(axis)).collect::<Vec<_>>();
    axes[count..].copy_from_slice(&missing);
    let angles = euler::angles(&pose.rotation, axes, near);
    let mut turn = 0;
    for (i, channel) in joint.channels.iter().enumerate() {
        if let Channel::Rotation(_) = channel {
            row[joint.first_channel + i] = rounded(angles[turn].to_degrees(), 1.0);
            turn += 1;
        }
    }
}

/// Rounded to 1e-6 of a degree or metre, or finer if the file's unit is larger than a metre.
fn rounded(value: f64, scale: f64) -> f64 {
    let digits = 6.0 + scale.log10().max(0.0).ceil();
    let power = 10f64.powf(digits);
    let rounded = (value * power).round() / power;
    if rounded.is_finite() { rounded + 0.0 } else { value }
}
