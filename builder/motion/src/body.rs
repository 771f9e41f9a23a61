//! A skeleton with its mean pose, and the conversion from clips to dofs in `f64`.
//!
//! The same conversion as `gestus_core::body::pose` does in `f32` on the board; a test compares the two.

use std::sync::Arc;

use gestus_core::{Database, blob::layout::dof};
use nalgebra::{Matrix4, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};

use crate::{
    clip::{Clip, Frame, Skeleton, rotation},
    corpus::Corpus,
    landmarks::{LandmarkError, Landmarks, rest_positions},
};

/// A skeleton, its mean pose and its landmarks.
#[derive(Debug, Clone)]
pub struct Body {
    /// The skeleton.
    pub skeleton: Arc<Skeleton>,
    /// Feet, hips and joint groups.
    pub landmarks: Landmarks,
    /// Mean local rotation of each joint; the root's without its heading. Shape `[joints]`.
    pub means: Vec<UnitQuaternion<f64>>,
    /// Direction from the right to the left hip joint in the root's frame, unit length.
    pub hips_line: Vector3<f64>,
}

/// The rotation about Y by that angle.
pub fn about_y(angle: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::y_axis(), angle)
}

impl Body {
    /// The body of a corpus: means over all its frames.
    ///
    /// # Errors
    /// [`LandmarkError`] where hips or legs can't be found in the skeleton.
    pub fn of(corpus: &Corpus) -> Result<Self, LandmarkError> {
        let skeleton = corpus.skeleton.clone();
        let landmarks = Landmarks::find(&skeleton)?;
        let hips_line = hips_line(corpus, &landmarks);
        let joints = skeleton.joints();
        let mut body =
            Self { skeleton, landmarks, means: vec![UnitQuaternion::identity(); joints], hips_line };
        let local = |frame: &Frame, j: usize| match j {
            0 => about_y(-body.heading(frame)) * frame.rotations[0],
            _ => frame.rotations[j],
        };
        let frames = || corpus.examples.iter().flat_map(|e| &e.clip.frames);
        let mean = |j: usize| mean_rotation(frames().map(|frame| local(frame, j)));
        body.means = (0..joints).map(|j| shorter(&mean(j))).collect();
        Ok(body)
    }

    /// Degrees of freedom: 3 joints + 4.
    pub fn dofs(&self) -> usize {
        gestus_core::blob::layout::dofs(self.skeleton.joints())
    }

    /// Heading of a frame, radians: that of the hips line on the ground, 0 along +Z, growing towards +X.
    pub fn heading(&self, frame: &Frame) -> f64 {
        let line = frame.rotations[0] * self.hips_line;
        (-line.z).atan2(line.x)
    }

    /// Positions of the joints relative to the ground below the root and to the heading, metres.
    pub fn local_positions(&self, frame: &Frame) -> Vec<Vector3<f64>> {
        let turn = about_y(-self.heading(frame));
        let ground = Vector3::new(frame.root.x, 0.0, frame.root.z);
        frame.positions(&self.skeleton).into_iter().map(|p| turn * (p - ground)).collect()
    }

    /// Dofs of every frame of a clip, shape `[frames][D]`. The velocities of the first frame are those of the second.
    pub fn clip_dofs(&self, clip: &Clip) -> Vec<Vec<f64>> {
        let headings: Vec<f64> = clip.frames.iter().map(|f| self.heading(f)).collect();
        (0..clip.frames.len())
            .map(|i| {
                let now = i.max(1).min(clip.frames.len() - 1);
                let before = now.saturating_sub(1);
                let moved = clip.frames[now].root - clip.frames[before].root;
                let velocity = about_y(-headings[before]) * moved * clip.rate_hz;
                let turned = wrap(headings[now] - headings[before]) * clip.rate_hz;
                let frame = &clip.frames[i];
                let tilt = self.relative(0, about_y(-headings[i]) * frame.rotations[0]);
                let mut dofs = vec![frame.root.y, tilt.x, tilt.y, tilt.z, velocity.z, velocity.x, turned];
                for j in 1..self.skeleton.joints() {
                    dofs.extend(self.relative(j, frame.rotations[j]).iter());
                }
                dofs
            })
            .collect()
    }

    fn relative(&self, joint: usize, rotation: UnitQuaternion<f64>) -> Vector3<f64> {
        log(&(self.means[joint].inverse() * rotation))
    }

    /// The pose of a row of dofs at a position on the ground and a heading.
    pub fn pose(&self, dofs: &[f64], ground: [f64; 2], heading: f64) -> Frame {
        let map =
            |at: usize| UnitQuaternion::from_scaled_axis(Vector3::new(dofs[at], dofs[at + 1], dofs[at + 2]));
        let root = about_y(heading) * self.means[0] * map(first_dof(0));
        let others = (1..self.skeleton.joints()).map(|j| self.means[j] * map(first_dof(j)));
        Frame {
            root: Vector3::new(ground[0], dofs[dof::HEIGHT], ground[1]),
            rotations: std::iter::once(root).chain(others).collect(),
        }
    }

    /// Names of the dofs, in order.
    pub fn dof_names(&self) -> Vec<String> {
        dof_names(self.skeleton.names.iter().map(String::as_str))
    }

    /// The same body with a database's means: its dofs are the database's.
    pub fn with_means_of(&self, database: &Database<'_>) -> Self {
        let mean = |j: usize| rotation(database.joint(j).mean);
        Self { means: (0..database.counts().joints).map(mean).collect(), ..self.clone() }
    }
}

/// The skeleton of a database.
pub fn database_skeleton(database: &Database<'_>) -> Skeleton {
    let joints: Vec<_> = (0..database.counts().joints).map(|j| database.joint(j)).collect();
    Skeleton {
        names: database.manifest().map(|m| m.joints.iter().map(String::from).collect()).unwrap_or_default(),
        parents: joints.iter().map(|j| j.parent).collect(),
        offsets: joints.iter().map(|j| j.offset.map(f64::from).into()).collect(),
    }
}

/// The first of the three dofs of a joint's rotation.
pub const fn first_dof(joint: usize) -> usize {
    if joint == 0 { dof::TILT } else { dof::JOINTS + 3 * (joint - 1) }
}

/// Names of the dofs of a skeleton with those joints, in order.
pub fn dof_names<'a>(joints: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut names: Vec<String> =
        ["hips.height", "hips.tilt.x", "hips.tilt.y", "hips.tilt.z", "root.forward", "root.left", "root.yaw"]
            .map(String::from)
            .to_vec();
    names.extend(joints.skip(1).flat_map(|joint| ["x", "y", "z"].map(|axis| format!("{joint}.{axis}"))));
    names
}

/// The row of dofs at a fractional position, clamped to the first and last row.
pub fn row_at(rows: &[Vec<f64>], position: f64) -> Vec<f64> {
    let position = position.clamp(0.0, (rows.len() - 1) as f64);
    let i = (position as usize).min(rows.len() - 1);
    let next = (i + 1).min(rows.len() - 1);
    let t = position - i as f64;
    rows[i].iter().zip(&rows[next]).map(|(a, b)| a + t * (b - a)).collect()
}

/// Rotation vector of the shorter of the two rotations, radians.
pub fn log(q: &UnitQuaternion<f64>) -> Vector3<f64> {
    shorter(q).scaled_axis()
}

/// The quaternion of the same rotation whose real part is not negative.
fn shorter(q: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    if q.w < 0.0 { UnitQuaternion::new_unchecked(-q.into_inner()) } else { *q }
}

/// An angle wrapped to -π..π.
pub fn wrap(angle: f64) -> f64 {
    use std::f64::consts::PI;
    (angle + PI).rem_euclid(2.0 * PI) - PI
}

/// The line from the right to the left hip joint, as the root sees them in the mean of some poses; unit length. `None` where
/// they are in one place.
pub fn mean_hips_line<'f>(
    skeleton: &Skeleton,
    [left, right]: [usize; 2],
    frames: impl Iterator<Item = &'f Frame>,
) -> Option<Vector3<f64>> {
    let line = |frame: &Frame| {
        let p = frame.positions(skeleton);
        frame.rotations[0].inverse() * (p[left] - p[right])
    };
    frames.map(line).sum::<Vector3<f64>>().try_normalize(1e-9)
}

/// The hips line: from the right to the left hip joint, as the root sees them. Bones between the root and the hip joints count
/// as stiff, with zero rotations unless those are turned otherwise throughout.
fn hips_line(corpus: &Corpus, landmarks: &Landmarks) -> Vector3<f64> {
    /// Angle between the line of zero rotations and the mean one from which the mean is taken, radians.
    const TURNED: f64 = 0.35;
    let skeleton = &corpus.skeleton;
    let [left, right] = landmarks.hip_joints;
    let positions = rest_positions(skeleton);
    let zero = (positions[left] - positions[right]).try_normalize(1e-9);
    if [left, right].iter().all(|&hip| skeleton.parents[hip] == Some(0)) {
        return zero.unwrap_or_else(Vector3::x);
    }
    let frames = corpus.examples.iter().flat_map(|e| &e.clip.frames);
    match (zero, mean_hips_line(skeleton, [left, right], frames)) {
        (Some(zero), Some(mean)) if zero.angle(&mean) > TURNED => mean,
        (zero, mean) => zero.or(mean).unwrap_or_else(Vector3::x),
    }
}

/// The rotation nearest to all: first eigenvector of the sum of `q qᵀ` (Markley et al. 2007), whatever the
/// signs of the quaternions; its own sign is arbitrary. Identity if there are none.
pub fn mean_rotation(rotations: impl Iterator<Item = UnitQuaternion<f64>>) -> UnitQuaternion<f64> {
    let moment = rotations.fold(Matrix4::zeros(), |sum, q| sum + q.coords * q.coords.transpose());
    if moment.trace() < 1e-12 {
        return UnitQuaternion::identity();
    }
    let eigen = SymmetricEigen::new(moment);
    let largest = eigen.eigenvalues.imax();
    UnitQuaternion::new_normalize(Quaternion::from(eigen.eigenvectors.column(largest).into_owned()))
}
