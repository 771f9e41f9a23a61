//! Clips: a skeleton and one pose for every frame, in `f64`.
//!
//! Right-handed, Y up, metres, radians, seconds. Quaternions are nalgebra's; as numbers their
//! order is `[x, y, z, w]`. Joint 0 is the root of the animated body (the hips); its rotation and
//! position are in the world, every other rotation is local to its parent.

use std::{ops::RangeInclusive, sync::Arc};

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::statistics::mean_or_zero;

/// Frames a second that clips and databases can have.
pub const RATES_HZ: RangeInclusive<f64> = 1.0..=1000.0;

/// What a rate has to be, in words.
pub fn expected_rate() -> String {
    format!("frames a second from {} to {}", RATES_HZ.start(), RATES_HZ.end())
}

/// A tree of joints. Parents come before their children.
#[derive(Debug, Clone, PartialEq)]
pub struct Skeleton {
    /// Name of each joint, unique.
    pub names: Vec<String>,
    /// Index of each joint's parent; `None` for joint 0 alone.
    pub parents: Vec<Option<usize>>,
    /// Position of each joint in its parent's frame, metres. Joint 0: zero.
    pub offsets: Vec<Vector3<f64>>,
}

impl Skeleton {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.names.len()
    }

    /// Joints from the root to this one.
    pub fn path(&self, joint: usize) -> Vec<usize> {
        let mut path: Vec<usize> = std::iter::successors(Some(joint), |&at| self.parents[at]).collect();
        path.reverse();
        path
    }

    /// Index of the joint of that name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.names.iter().position(|n| n == name)
    }

    /// How the joints of this skeleton differ from another's in number, name or parent, if they do. Their offsets may
    /// differ.
    pub fn difference(&self, other: &Skeleton) -> Option<String> {
        if self.joints() != other.joints() {
            return Some(format!("{} joints against {}", self.joints(), other.joints()));
        }
        let differs = |&j: &usize| self.names[j] != other.names[j] || self.parents[j] != other.parents[j];
        let j = (0..self.joints()).find(differs)?;
        Some(match self.names[j] == other.names[j] {
            true => format!("`{}` has another parent", self.names[j]),
            false => format!("joint {j} is `{}` against `{}`", self.names[j], other.names[j]),
        })
    }
}

/// Memory of a frame beside its rotations, bytes: the root, the list, and what the allocator adds.
pub const FRAME_BYTES: usize = size_of::<Frame>() + 16;
/// Memory of a joint's rotation in a frame, bytes.
pub const ROTATION_BYTES: usize = size_of::<UnitQuaternion<f64>>();

/// One pose: where the root is, and each joint's rotation.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Root position in the world, metres.
    pub root: Vector3<f64>,
    /// Joint rotations, `[joints]`; entry 0 is the root's orientation in the world.
    pub rotations: Vec<UnitQuaternion<f64>>,
}

impl Frame {
    /// The pose of some joints of the skeleton, in this order; the first is the root.
    pub fn on_joints(&self, joints: &[usize]) -> Frame {
        Frame { root: self.root, rotations: joints.iter().map(|&j| self.rotations[j]).collect() }
    }

    /// Greatest angle between the rotations of a joint in this pose and in another, radians.
    pub fn angle_to(&self, other: &Frame) -> f64 {
        self.rotations.iter().zip(&other.rotations).map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max)
    }

    /// World positions of all joints, metres, by forward kinematics. Shape `[joints]`.
    pub fn positions(&self, skeleton: &Skeleton) -> Vec<Vector3<f64>> {
        self.world(skeleton).0
    }

    /// World positions of all joints, metres, and their orientations, by forward kinematics. Shapes `[joints]`.
    pub fn world(&self, skeleton: &Skeleton) -> (Vec<Vector3<f64>>, Vec<UnitQuaternion<f64>>) {
        let mut orientations = Vec::with_capacity(skeleton.joints());
        let mut positions = Vec::with_capacity(skeleton.joints());
        for j in 0..skeleton.joints() {
            match skeleton.parents[j] {
                None => {
                    orientations.push(self.rotations[j]);
                    positions.push(self.root);
                }
                Some(p) => {
                    let position: Vector3<f64> = positions[p] + orientations[p] * skeleton.offsets[j];
                    let orientation: UnitQuaternion<f64> = orientations[p] * self.rotations[j];
                    orientations.push(orientation);
                    positions.push(position);
                }
            }
        }
        (positions, orientations)
    }
}

/// Most frames of a resampled clip that had fewer: over two hours at 30 Hz. A file's frame rate can't be trusted.
pub const MAX_FRAMES: usize = 1 << 18;

/// A clip that would be too long at a rate.
#[derive(Debug, Clone, PartialEq, Error)]
#[error(
    "{seconds:.1} s are {frames} frames at {rate_hz} a second, more than {MAX_FRAMES}: cut the clip, take a lower rate, \
     or correct its frame time"
)]
pub struct TooManyFrames {
    /// Length of the clip.
    pub seconds: f64,
    /// Frames that it would take.
    pub frames: usize,
    /// At that rate.
    pub rate_hz: f64,
}

/// A clip of motion at a fixed rate.
#[derive(Debug, Clone)]
pub struct Clip {
    /// Name: the stem of the file's name, or the generator's.
    pub name: String,
    /// The joints that the frames move.
    pub skeleton: Arc<Skeleton>,
    /// Frames a second.
    pub rate_hz: f64,
    /// The poses, in order of time.
    pub frames: Vec<Frame>,
}

impl Clip {
    /// Duration in seconds, from the first frame to the last.
    pub fn duration_s(&self) -> f64 {
        self.frames.len().saturating_sub(1) as f64 / self.rate_hz
    }

    /// Mean speed of the root over the ground, m/s, Y up: of its way in half a second, or in the whole of a shorter clip.
    pub fn ground_speed_m_s(&self) -> f64 {
        let ground = |frame: &Frame| Vector3::new(frame.root.x, 0.0, frame.root.z);
        let stride = ((0.5 * self.rate_hz).ceil() as usize).min(self.frames.len().saturating_sub(1)).max(1);
        let pairs = self.frames.iter().zip(self.frames.iter().skip(stride));
        mean_or_zero(pairs.map(|(a, b)| (ground(b) - ground(a)).norm() * self.rate_hz / stride as f64))
    }

    /// The same motion at another rate, for clips that come from a file: refuses too many frames.
    ///
    /// # Errors
    /// [`TooManyFrames`] if there would be more than [`MAX_FRAMES`], and more than now.
    pub fn fitted(&self, rate_hz: f64) -> Result<Clip, TooManyFrames> {
        let frames = self.frames_at(rate_hz);
        if frames > MAX_FRAMES.max(self.frames.len()) {
            return Err(TooManyFrames { seconds: self.duration_s(), frames, rate_hz });
        }
        Ok(self.resampled(rate_hz))
    }

    fn frames_at(&self, rate_hz: f64) -> usize {
        (self.duration_s() * rate_hz + 1e-6).floor() as usize + 1
    }

    /// The same motion at another rate: positions linearly, rotations spherically interpolated.
    pub fn resampled(&self, rate_hz: f64) -> Clip {
        if (rate_hz - self.rate_hz).abs() < 1e-3 * rate_hz || self.frames.len() < 2 {
            return Clip { rate_hz, ..self.clone() };
        }
        let count = self.frames_at(rate_hz);
        let frames = (0..count).map(|i| self.at(i as f64 / rate_hz * self.rate_hz)).collect();
        Clip { name: self.name.clone(), skeleton: self.skeleton.clone(), rate_hz, frames }
    }

    /// The pose at a fractional frame index, clamped to the first and last frame.
    pub fn at(&self, index: f64) -> Frame {
        let last = self.frames.len() - 1;
        let index = index.clamp(0.0, last as f64);
        let i = (index.floor() as usize).min(last);
        let t = index - i as f64;
        if t <= 0.0 || i == last {
            return self.frames[i].clone();
        }
        interpolate(&self.frames[i], &self.frames[i + 1], t)
    }
}

/// A rotation of the core, `[x, y, z, w]`.
pub fn rotation(of_core: [f32; 4]) -> UnitQuaternion<f64> {
    let [x, y, z, w] = of_core.map(f64::from);
    UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z))
}

/// Mean distance of corresponding joints, metres.
pub fn joint_distance(a: &[Vector3<f64>], b: &[Vector3<f64>]) -> f64 {
    mean_or_zero(a.iter().zip(b).map(|(p, q)| (p - q).norm()))
}

/// A pose between two: positions linearly, rotations by [`slerp`]. `t` from 0 to 1.
pub fn interpolate(a: &Frame, b: &Frame, t: f64) -> Frame {
    Frame {
        root: a.root.lerp(&b.root, t),
        rotations: a.rotations.iter().zip(&b.rotations).map(|(p, q)| slerp(p, q, t)).collect(),
    }
}

/// Poses, each at its time, resampled to a rate from the first one on. Times are seconds from the first, and do not fall.
pub fn at_times(poses: &[&Frame], times: &[f64], rate_hz: f64) -> Vec<Frame> {
    let end = times.last().copied().unwrap_or(0.0);
    let count = if poses.is_empty() { 0 } else { (end * rate_hz + 1e-6).floor() as usize + 1 };
    let mut at = 0;
    (0..count)
        .map(|i| {
            let time = i as f64 / rate_hz;
            while at + 2 < times.len() && times[at + 1] <= time {
                at += 1;
            }
            let Some(next) = poses.get(at + 1) else { return poses[at].clone() };
            let span = times[at + 1] - times[at];
            let t = if span > 0.0 { ((time - times[at]) / span).clamp(0.0, 1.0) } else { 0.0 };
            interpolate(poses[at], next, t)
        })
        .collect()
}

/// Spherical interpolation along the shorter arc. Rotations half a turn apart are blended linearly, since their arc is
/// undefined.
pub fn slerp(a: &UnitQuaternion<f64>, b: &UnitQuaternion<f64>, t: f64) -> UnitQuaternion<f64> {
    let b = if a.coords.dot(&b.coords) < 0.0 { UnitQuaternion::new_unchecked(-b.into_inner()) } else { *b };
    a.try_slerp(&b, t, 1e-9).unwrap_or_else(|| a.nlerp(&b, t))
}
