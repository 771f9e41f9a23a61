//! From a file to a clip on the body's joints, and back.
//!
//! Files often begin with joints that carry the body about without being part of it (Bandai's `joint_Root`), all
//! in one chain. The body begins at the last joint of that chain: where the skeleton branches. What lies above is
//! applied to it, and written back as it was.

use std::sync::Arc;

use nalgebra::{Rotation3, UnitQuaternion, Vector3};
use thiserror::Error;

use super::{Bvh, Channel, Joint};
use crate::motion::{Clip, Frame, Skeleton};

/// Unit of lengths in a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Name, for people.
    pub name: &'static str,
    /// Metres.
    pub metres: f64,
}

impl Unit {
    /// Units by name.
    pub const ALL: [Unit; 6] = [
        Unit { name: "m", metres: 1.0 },
        Unit { name: "dm", metres: 0.1 },
        Unit { name: "cm", metres: 0.01 },
        Unit { name: "mm", metres: 0.001 },
        Unit { name: "in", metres: 0.0254 },
        // The CMU database's files: inches, scaled by 0.45.
        Unit { name: "cmu", metres: 0.0254 / 0.45 },
    ];

    /// The unit of that name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|u| u.name == name)
    }

    /// The unit in which the skeleton is nearest to a grown person: lengths of the longest chains, up and down
    /// from the hips, make about 1.7 m.
    pub fn guess(bvh: &Bvh) -> Self {
        let height = extent(bvh).max(1e-12);
        let misfit = |u: &Unit| (height * u.metres / 1.7).ln().abs();
        Self::ALL.into_iter().min_by(|a, b| misfit(a).total_cmp(&misfit(b))).unwrap_or(Self::ALL[2])
    }
}

/// Length of the longest chain of bones below the hips, twice: legs and what stands on them, about a height.
fn extent(bvh: &Bvh) -> f64 {
    let hips = hips_of(bvh);
    let offsets = offsets(bvh);
    let mut length = vec![0.0; bvh.joints.len()];
    let mut longest: f64 = 0.0;
    for (j, joint) in bvh.joints.iter().enumerate() {
        if j <= hips {
            continue;
        }
        length[j] = joint.parent.map_or(0.0, |p| length[p]) + offsets[j].norm();
        longest = longest.max(length[j] + joint.end_site.map_or(0.0, |e| e.norm()));
    }
    // Outstretched, hips to fingertips or toes is a bit more than half of a body.
    longest * 1.85
}

/// A clip that can't be bound.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum BindError {
    /// Rotation channels that leave an axis out.
    #[error("joint `{joint}` has {found} rotation channels: a body joint needs all three")]
    Rotations {
        /// The joint.
        joint: String,
        /// Channels found.
        found: usize,
    },
    /// The hips do not move.
    #[error(
        "joint `{0}`, where the body begins, has no position channels: the body's place is not in the file"
    )]
    Rooted(String),
    /// A clip of another skeleton.
    #[error("the motion has {found} joints, the file's body has {need}")]
    Joints {
        /// Joints of the file.
        need: usize,
        /// Joints of the clip.
        found: usize,
    },
}

/// Ties a file's joints to a clip's.
#[derive(Debug, Clone)]
pub struct Binding {
    /// Unit of the file.
    pub unit: Unit,
    /// The body's skeleton, metres.
    pub skeleton: Arc<Skeleton>,
    /// The file's joint that is the body's root.
    hips: usize,
}

impl Binding {
    /// Finds the body in a file.
    ///
    /// # Errors
    /// [`BindError`] where the body's joints lack channels.
    pub fn new(bvh: &Bvh, unit: Option<Unit>) -> Result<Self, BindError> {
        let unit = unit.unwrap_or_else(|| Unit::guess(bvh));
        let hips = hips_of(bvh);
        let placed =
            bvh.joints[..=hips].iter().any(|j| j.channels.iter().any(|c| matches!(c, Channel::Position(_))));
        if !placed {
            return Err(BindError::Rooted(bvh.joints[hips].name.clone()));
        }
        let offsets = offsets(bvh);
        let mut skeleton = Skeleton { names: Vec::new(), parents: Vec::new(), offsets: Vec::new() };
        for (j, joint) in bvh.joints.iter().enumerate().skip(hips) {
            let rotations = joint.channels.iter().filter(|c| matches!(c, Channel::Rotation(_))).count();
            if rotations != 3 && rotations != 0 {
                return Err(BindError::Rotations { joint: joint.name.clone(), found: rotations });
            }
            skeleton.names.push(joint.name.clone());
            skeleton.parents.push(if j == hips { None } else { joint.parent.map(|p| p - hips) });
            skeleton.offsets.push(if j == hips { Vector3::zeros() } else { offsets[j] * unit.metres });
        }
        Ok(Self { unit, skeleton: Arc::new(skeleton), hips })
    }

    /// The file's motion as a clip, metres.
    pub fn clip(&self, bvh: &Bvh, name: &str) -> Clip {
        let frames = (0..bvh.frames())
            .map(|f| {
                let locals = locals(bvh, bvh.frame(f));
                let (root, rotation) = above(&locals, self.hips);
                let root_position = root + rotation * locals[self.hips].0;
                let mut rotations = vec![rotation * locals[self.hips].1];
                rotations.extend(locals[self.hips + 1..].iter().map(|l| l.1));
                Frame { root: root_position * self.unit.metres, rotations }
            })
            .collect();
        Clip { name: name.to_owned(), skeleton: self.skeleton.clone(), rate_hz: 1.0 / bvh.frame_time, frames }
    }

    /// A clip in the form of a file: its joints, channels, offsets and unit. What lies above the hips, and
    /// translations below them, stay as in the file's frame of the same number (its last one beyond).
    ///
    /// # Errors
    /// [`BindError::Joints`] where the clip is of another skeleton.
    pub fn unbind(&self, bvh: &Bvh, clip: &Clip) -> Result<Bvh, BindError> {
        let need = self.skeleton.joints();
        if clip.skeleton.joints() != need {
            return Err(BindError::Joints { need, found: clip.skeleton.joints() });
        }
        let mut values = Vec::with_capacity(bvh.channels() * clip.frames.len());
        for (f, frame) in clip.frames.iter().enumerate() {
            let template = bvh.frame(f.min(bvh.frames() - 1));
            let (origin, turn) = above(&locals(bvh, template), self.hips);
            let mut at = 0;
            for (j, joint) in bvh.joints.iter().enumerate() {
                let numbers = &template[at..at + joint.channels.len()];
                at += joint.channels.len();
                if j < self.hips {
                    values.extend(numbers);
                    continue;
                }
                let rotation = if j == self.hips {
                    turn.inverse() * frame.rotations[0]
                } else {
                    frame.rotations[j - self.hips]
                };
                let angles = euler(&rotation, &joint.channels);
                let position = turn.inverse() * (frame.root / self.unit.metres - origin);
                let mut next_angle = angles.into_iter();
                for (channel, &number) in joint.channels.iter().zip(numbers) {
                    values.push(match channel {
                        Channel::Position(axis) if j == self.hips => position[*axis],
                        Channel::Position(_) => number,
                        Channel::Rotation(_) => next_angle.next().unwrap_or(0.0),
                    });
                }
            }
        }
        Ok(Bvh { joints: bvh.joints.clone(), frame_time: 1.0 / clip.rate_hz, values })
    }
}

impl Bvh {
    /// A file for a clip that never was one: six channels on the root, three on the others, centimetres.
    pub fn of_clip(clip: &Clip) -> Self {
        let skeleton = &clip.skeleton;
        let rotation = [Channel::Rotation(2), Channel::Rotation(0), Channel::Rotation(1)];
        let position = [Channel::Position(0), Channel::Position(1), Channel::Position(2)];
        let joints: Vec<Joint> = (0..skeleton.joints())
            .map(|j| {
                let leaf = !skeleton.parents.contains(&Some(j));
                Joint {
                    name: skeleton.names[j].clone(),
                    parent: skeleton.parents[j],
                    offset: skeleton.offsets[j] * 100.0,
                    channels: if j == 0 { [position, rotation].concat() } else { rotation.to_vec() },
                    end_site: leaf.then(|| skeleton.offsets[j] * 50.0),
                }
            })
            .collect();
        let mut values = Vec::new();
        for frame in &clip.frames {
            values.extend((frame.root * 100.0).iter());
            for (q, joint) in frame.rotations.iter().zip(&joints) {
                values.extend(euler(q, &joint.channels));
            }
        }
        Bvh { joints, frame_time: 1.0 / clip.rate_hz, values }
    }
}

/// The joint at which the body begins: the first with more than one child.
fn hips_of(bvh: &Bvh) -> usize {
    let children = |j: usize| bvh.joints.iter().filter(|k| k.parent == Some(j)).count();
    (0..bvh.joints.len()).find(|&j| children(j) != 1).unwrap_or(0)
}

/// Mean position of each joint in its parent's frame: translation channels replace offsets.
fn offsets(bvh: &Bvh) -> Vec<Vector3<f64>> {
    let frames = bvh.frames();
    let mut at = 0;
    bvh.joints
        .iter()
        .map(|joint| {
            let mut offset = joint.offset;
            for (c, channel) in joint.channels.iter().enumerate() {
                if let Channel::Position(axis) = channel {
                    offset[*axis] = (0..frames).map(|f| bvh.frame(f)[at + c]).sum::<f64>() / frames as f64;
                }
            }
            at += joint.channels.len();
            offset
        })
        .collect()
}

/// Position and rotation of each joint in its parent's frame, file units.
fn locals(bvh: &Bvh, numbers: &[f64]) -> Vec<(Vector3<f64>, UnitQuaternion<f64>)> {
    let mut at = 0;
    bvh.joints
        .iter()
        .map(|joint| {
            let mut position = joint.offset;
            let mut rotation = UnitQuaternion::identity();
            for channel in &joint.channels {
                match *channel {
                    Channel::Position(axis) => position[axis] = numbers[at],
                    Channel::Rotation(axis) => {
                        let mut vector = Vector3::zeros();
                        vector[axis] = numbers[at].to_radians();
                        rotation *= UnitQuaternion::from_scaled_axis(vector);
                    }
                }
                at += 1;
            }
            (position, rotation)
        })
        .collect()
}

/// Position and rotation of the frame that the hips are given in.
fn above(locals: &[(Vector3<f64>, UnitQuaternion<f64>)], hips: usize) -> (Vector3<f64>, UnitQuaternion<f64>) {
    locals[..hips]
        .iter()
        .fold((Vector3::zeros(), UnitQuaternion::identity()), |(origin, turn), (position, rotation)| {
            (origin + turn * position, turn * rotation)
        })
}

/// Angles in degrees, in the order of a joint's rotation channels.
fn euler(rotation: &UnitQuaternion<f64>, channels: &[Channel]) -> Vec<f64> {
    let axes: Vec<usize> = channels
        .iter()
        .filter_map(|c| if let Channel::Rotation(axis) = c { Some(*axis) } else { None })
        .collect();
    let [i, j, k] = axes[..] else { return vec![0.0; axes.len()] };
    // R = R_i(a) R_j(b) R_k(c) with three different axes; even orders (xyz, yzx, zxy) and odd ones differ by a sign.
    let m: Rotation3<f64> = rotation.to_rotation_matrix();
    let sign = if (j + 3 - i) % 3 == 1 { 1.0 } else { -1.0 };
    let sine = (sign * m[(i, k)]).clamp(-1.0, 1.0);
    let (a, b, c) = if sine.abs() < 1.0 - 1e-12 {
        let a = (-sign * m[(j, k)]).atan2(m[(k, k)]);
        let c = (-sign * m[(i, j)]).atan2(m[(i, i)]);
        (a, sine.asin(), c)
    } else {
        // Gimbal lock: only one of the outer angles counts.
        ((sign * m[(k, j)]).atan2(m[(j, j)]), sine.asin(), 0.0)
    };
    vec![a.to_degrees(), b.to_degrees(), c.to_degrees()]
}
