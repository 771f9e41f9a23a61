//! Document to clip, and a clip back onto the document's channels.
//!
//! A [`Binding`] is made once per document. It fixes the unit, finds the hips and lays out the skeleton:
//!
//! * Joint 0 of the skeleton is the hips. Joints above them that hold a single child and stand still, or are mere
//!   carriers by name (`joint_Root`, `Reference`, ...), are folded into the hips: `hips = L_1 ... L_n hips_local`
//!   in each frame. [`Binding::write`] puts them back as they are in the document's first frame.
//! * Every other joint's offset is its `OFFSET`, each component with a position channel replaced by that channel's
//!   mean over the clip. Where such a channel really moves, [`Binding::notes`] says so.
//!
//! Reading costs a quaternion product a rotation channel; writing three `atan2` a joint.

use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use thiserror::Error;

use crate::formats::bvh::{Bvh, Channel, Joint, Unit, parse::MOST_LENGTH};
use crate::{
    clip::{Clip, Frame, Skeleton},
    euler,
};

/// How to read a document.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// The file's unit of length. If not given, that of the format, or guessed from the body's height.
    pub unit: Option<Unit>,
    /// Name of the joint to take as the hips; found if not given.
    pub root: Option<String>,
}

/// A document and a clip that don't go together. Whoever reads the file names it before the message.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ConvertError {
    #[error("no joint is called `{name}`; the joints are {joints}")]
    NoSuchRoot { name: String, joints: String },
    #[error(
        "frame {frame} is {metres:.1e} m from the origin, expected at most 1e6; check the values and the unit"
    )]
    TooFar { frame: usize, metres: f64 },
    #[error(
        "the bone from the parent to joint `{joint}` is {metres:.1e} m long, expected at most 100; check OFFSET and unit"
    )]
    TooLong { joint: String, metres: f64 },
    #[error("the document has other joints than {file}, which this binding was made for: {difference}")]
    OtherDocument { file: String, difference: String },
    #[error("clip {clip} is on another skeleton than {file}: {difference}; retarget it first")]
    OtherSkeleton { clip: String, file: String, difference: String },
    #[error("clip {clip} has no frames; a BVH file needs at least one")]
    NoFrames { clip: String },
    #[error("clip {clip} has a rate of {rate_hz} frames a second; expected 1 to 1000000")]
    Rate { clip: String, rate_hz: f64 },
    #[error("clip {clip} has a number that is not finite or too large in frame {frame}, joint `{joint}`")]
    NotFinite { clip: String, frame: usize, joint: String },
    #[error("joint `{name}` cannot be written: names are not empty, unique, and hold no brace or line end")]
    BadName { name: String },
}

/// Farthest that a body may be from the origin, metres: in millimetres it can still be written and read.
const FAR_M: f64 = 1e6;
/// Longest bone, metres: what a database and the map of a skeleton have room for.
const LONG_M: f64 = 100.0;
/// Movement of an inner joint's translation that is worth a note, metres.
const STRETCH_M: f64 = 0.01;

/// How a document's joints and channels make a clip.
#[derive(Debug, Clone)]
pub struct Binding {
    skeleton: Arc<Skeleton>,
    unit: Unit,
    doubt: Option<String>,
    notes: Vec<String>,
    /// Document joints above the hips, from the top.
    above: Vec<usize>,
    /// Document joint of each joint of the skeleton.
    joints: Vec<usize>,
    file: String,
    /// Of the document: name, parent and channels of each joint, by which it is known again.
    layout: Vec<Joint>,
}

impl Binding {
    /// Lays out the skeleton of a document.
    pub fn new(document: &Bvh, options: &Options) -> Result<Binding, ConvertError> {
        let file = document.name().to_string();
        let all = document.joints();
        let hips = match &options.root {
            None => find_hips(document),
            Some(name) => {
                all.iter().position(|j| &j.name == name).ok_or_else(|| ConvertError::NoSuchRoot {
                    name: name.clone(),
                    joints: all.iter().map(|j| j.name.as_str()).collect::<Vec<_>>().join(", "),
                })?
            }
        };
        let mut above: Vec<usize> = std::iter::successors(all[hips].parent, |&j| all[j].parent).collect();
        above.reverse();

        let mut place = vec![None; all.len()];
        let mut joints = Vec::new();
        for j in hips..all.len() {
            if j == hips || all[j].parent.is_some_and(|p| place[p].is_some()) {
                place[j] = Some(joints.len());
                joints.push(j);
            }
        }
        let means: Vec<Vector3<f64>> = joints.iter().map(|&j| mean_translation(document, j)).collect();

        let mut notes = document.notes.clone();
        let guess = || Unit::guess(longest_chain(document, &joints, &place, &means));
        let (unit, guessed, doubt) = match (options.unit, document.unit) {
            (Some(unit), _) => (unit, None, None),
            (None, Some(unit)) => (unit, None, guess().doubt(unit)),
            (None, None) => {
                let guess = guess();
                (guess.unit, Some(guess.to_string()), None)
            }
        };
        notes.extend(guessed.or_else(|| doubt.clone()));
        let scale = unit.metres();
        let mut offsets = Vec::with_capacity(joints.len());
        for (s, &j) in joints.iter().enumerate() {
            let offset = if s == 0 { Vector3::zeros() } else { means[s] * scale };
            let metres = offset.norm();
            if metres.is_nan() || metres > LONG_M {
                return Err(ConvertError::TooLong { joint: all[j].name.clone(), metres });
            }
            offsets.push(offset);
            let moves = if s == 0 { 0.0 } else { translation_range(document, j) * scale };
            if moves > STRETCH_M {
                let cm = moves * 100.0;
                notes.push(format!(
                    "joint {} is moved by up to {cm:.1} cm in its parent; its mean place is used",
                    all[j].name
                ));
            }
        }
        if !(0..3).all(|axis| all[hips].channels.contains(&Channel::Position(axis))) {
            notes.push(format!(
                "{} has no three position channels, so what is written stays in place there",
                all[hips].name
            ));
        }
        let skeleton = Skeleton {
            names: joints.iter().map(|&j| all[j].name.clone()).collect(),
            parents: joints.iter().map(|&j| all[j].parent.and_then(|p| place[p])).collect(),
            offsets,
        };
        let skeleton = Arc::new(skeleton);
        Ok(Binding { skeleton, unit, doubt, notes, above, joints, file, layout: all.to_vec() })
    }

    /// The joints of the clips that this makes, hips first.
    pub fn skeleton(&self) -> &Arc<Skeleton> {
        &self.skeleton
    }

    /// The file's unit of length.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// What there is to say of a format's unit in which the body has an odd size.
    pub fn doubt(&self) -> Option<&str> {
        self.doubt.as_deref()
    }

    /// What a user should know of the reading: the guessed unit, translations that were averaged.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// The document's motion, at its own rate. The clip is named by the stem of the file's name.
    pub fn to_clip(&self, document: &Bvh) -> Result<Clip, ConvertError> {
        self.check_document(document)?;
        let scale = self.unit.metres();
        let all = document.joints();
        let mut frames = Vec::with_capacity(document.frames());
        for f in 0..document.frames() {
            let row = document.row(f);
            let hips = self.carrier(row) * local(&all[self.joints[0]], row);
            let root = hips.translation.vector * scale;
            let metres = root.norm();
            if metres.is_nan() || metres > FAR_M {
                return Err(ConvertError::TooFar { frame: f + 1, metres });
            }
            let mut rotations = Vec::with_capacity(self.joints.len());
            rotations.push(hips.rotation);
            rotations.extend(self.joints[1..].iter().map(|&j| rotation(&all[j], row)));
            frames.push(Frame { root, rotations });
        }
        let name = std::path::Path::new(document.name()).file_stem().unwrap_or_default();
        Ok(Clip {
            name: name.to_string_lossy().into_owned(),
            skeleton: self.skeleton.clone(),
            rate_hz: document.rate_hz(),
            frames,
        })
    }

    /// A clip as a document like the given one: its units, channels, joint order, and joints that carry nothing.
    ///
    /// Joints that the clip doesn't move are as in the document's first frame. Angles are rounded to 1e-6 degrees,
    /// positions to a micrometre or finer.
    pub fn write(&self, document: &Bvh, clip: &Clip) -> Result<Bvh, ConvertError> {
        self.check_document(document)?;
        if let Some(difference) = difference(&clip.skeleton, &self.skeleton) {
            let (clip, file) = (clip.name.clone(), document.name().to_string());
            return Err(ConvertError::OtherSkeleton { clip, file, difference });
        }
        check_clip(clip)?;
        let all = document.joints();
        let scale = self.unit.metres();
        let carrier = self.carrier(document.row(0)).inverse();
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
            joints: document.joints.clone(),
            channels: document.channels,
            frame_time_s: if same_rate { document.frame_time_s } else { 1.0 / clip.rate_hz },
            values,
            unit: document.unit,
            notes: Vec::new(),
        })
    }

    /// Product of the joints above the hips, file units.
    fn carrier(&self, row: &[f64]) -> Isometry3<f64> {
        self.above.iter().fold(Isometry3::identity(), |sum, &j| sum * local(&self.layout[j], row))
    }

    fn check_document(&self, document: &Bvh) -> Result<(), ConvertError> {
        let (ours, theirs) = (&self.layout, document.joints());
        let same =
            |a: &Joint, b: &Joint| a.name == b.name && a.parent == b.parent && a.channels == b.channels;
        if ours.len() == theirs.len() && ours.iter().zip(theirs).all(|(a, b)| same(a, b)) {
            return Ok(());
        }
        let first = ours.iter().zip(theirs).find(|(a, b)| !same(a, b));
        let difference = match first {
            Some((a, b)) => format!("`{}` there, `{}` here", a.name, b.name),
            None => format!("{} joints there, {} here", ours.len(), theirs.len()),
        };
        Err(ConvertError::OtherDocument { file: self.file.clone(), difference })
    }
}

/// A document's clip and the binding that made it.
pub fn to_clip(document: &Bvh, options: &Options) -> Result<(Clip, Binding), ConvertError> {
    let binding = Binding::new(document, options)?;
    Ok((binding.to_clip(document)?, binding))
}

/// Whether joints are the same by name and parent; their offsets may differ.
pub fn same_skeleton(a: &Skeleton, b: &Skeleton) -> bool {
    difference(a, b).is_none()
}

fn difference(a: &Skeleton, b: &Skeleton) -> Option<String> {
    if a.joints() != b.joints() {
        return Some(format!("{} joints against {}", a.joints(), b.joints()));
    }
    let j = (0..a.joints()).find(|&j| a.names[j] != b.names[j] || a.parents[j] != b.parents[j])?;
    Some(match a.names[j] == b.names[j] {
        true => format!("`{}` hangs on another joint", a.names[j]),
        false => format!("joint {j} is `{}` against `{}`", a.names[j], b.names[j]),
    })
}

impl Bvh {
    /// A document for a clip that came from none: position and Z-X-Y rotation channels on the root, rotations on
    /// the other joints, an End Site on every leaf. Joints are reordered depth first, as the format wants.
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
    /// counts where the joint moves.
    ///
    /// # Errors
    /// [`ConvertError`] where it could not be written and read again.
    pub(crate) fn from_poses(
        name: &str,
        rate_hz: f64,
        unit: Unit,
        rigged: Vec<Rigged>,
        poses: impl Iterator<Item = Vec<Isometry3<f64>>>,
    ) -> Result<Bvh, ConvertError> {
        let scale = unit.metres();
        let parents: Vec<Option<usize>> = rigged.iter().map(|j| j.parent).collect();
        let mut joints: Vec<Joint> = Vec::with_capacity(rigged.len());
        let mut channels = 0;
        for (j, Rigged { name, parent, offset, moves }) in rigged.into_iter().enumerate() {
            let taken = joints.iter().any(|j| j.name == name);
            if taken || name.is_empty() || name.contains(NOT_IN_NAMES) {
                return Err(ConvertError::BadName { name });
            }
            let mut own = if moves { Channel::ALL[..3].to_vec() } else { Vec::new() };
            own.extend([2, 0, 1].map(Channel::Rotation));
            let first_channel = channels;
            channels += own.len();
            let leaf = !parents.contains(&Some(j));
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
                if !own.iter().chain(&joint.offset).all(|x| x.abs() <= MOST_LENGTH) {
                    let (clip, joint) = (name.to_string(), joint.name.clone());
                    return Err(ConvertError::NotFinite { clip, frame: f + 1, joint });
                }
            }
            values.extend_from_slice(&row);
        }
        let frame_time_s = 1.0 / rate_hz;
        Ok(Bvh {
            name: name.to_string(),
            joints,
            channels,
            frame_time_s,
            values,
            unit: None,
            notes: Vec::new(),
        })
    }
}

/// A joint that gets its channels by [`Bvh::from_poses`].
pub(crate) struct Rigged {
    pub(crate) name: String,
    pub(crate) parent: Option<usize>,
    /// Metres, in the parent's frame.
    pub(crate) offset: Vector3<f64>,
    /// Whether it has position channels.
    pub(crate) moves: bool,
}

/// What ends or splits a name in a file.
pub(crate) const NOT_IN_NAMES: [char; 6] = ['{', '}', '\n', '\r', '\0', '\u{feff}'];

fn check_clip(clip: &Clip) -> Result<(), ConvertError> {
    let name = || clip.name.clone();
    if clip.frames.is_empty() {
        return Err(ConvertError::NoFrames { clip: name() });
    }
    if !(clip.rate_hz.is_finite() && clip.rate_hz >= 1.0 && clip.rate_hz <= 1e6) {
        return Err(ConvertError::Rate { clip: name(), rate_hz: clip.rate_hz });
    }
    for (f, frame) in clip.frames.iter().enumerate() {
        let fine = |s: usize| {
            let rotation = frame.rotations.get(s).is_some_and(|q| q.coords.iter().all(|x| x.is_finite()));
            rotation && (s > 0 || frame.root.norm() <= FAR_M)
        };
        if let Some(s) = (0..clip.skeleton.joints()).find(|&s| !fine(s)) {
            let joint = clip.skeleton.names[s].clone();
            return Err(ConvertError::NotFinite { clip: name(), frame: f + 1, joint });
        }
    }
    Ok(())
}

/// The first joint from the top that is no mere carrier.
fn find_hips(document: &Bvh) -> usize {
    let all = document.joints();
    let mut joint = 0;
    loop {
        let mut children = document.children(joint);
        let (Some(child), None) = (children.next(), children.next()) else { return joint };
        let name = all[joint].name.to_ascii_lowercase();
        let is_hips = ["hips", "pelvis"].iter().any(|n| name.contains(n));
        let is_carrier =
            ["root", "reference", "armature", "world", "origin"].iter().any(|n| name.contains(n));
        // The hips can carry what is above them only with all six channels of their own.
        let can_carry = all[joint].channels.is_empty() || all[child].channels.len() == 6;
        let idle = is_carrier || stands_still(document, joint);
        if is_hips || !can_carry || !idle || document.children(child).next().is_none() {
            return joint;
        }
        joint = child;
    }
}

/// Whether a joint's channels don't change, to 1e-3 degrees and file units.
fn stands_still(document: &Bvh, joint: usize) -> bool {
    let joint = &document.joints()[joint];
    let columns = joint.first_channel..joint.first_channel + joint.channels.len();
    let first = &document.row(0)[columns.clone()];
    (1..document.frames())
        .all(|f| document.row(f)[columns.clone()].iter().zip(first).all(|(a, b)| (a - b).abs() <= 1e-3))
}

/// Where a joint is in its parent, file units: its position channels, and `OFFSET` where it has none.
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
            // Whole turns off first: sines of large angles lose digits.
            q *= euler::about(axis, (row[joint.first_channel + i] % 720.0).to_radians());
        }
    }
    q
}

fn local(joint: &Joint, row: &[f64]) -> Isometry3<f64> {
    Isometry3::from_parts(Translation3::from(translation(joint, row)), rotation(joint, row))
}

fn mean_translation(document: &Bvh, joint: usize) -> Vector3<f64> {
    let frames = document.frames();
    let joint = &document.joints()[joint];
    if !joint.channels.iter().any(|c| matches!(c, Channel::Position(_))) {
        return Vector3::from(joint.offset);
    }
    // From the first frame on, so that the mean of a constant is that constant.
    let first = translation(joint, document.row(0));
    let sum: Vector3<f64> = (0..frames).map(|f| translation(joint, document.row(f)) - first).sum();
    first + sum / frames as f64
}

fn translation_range(document: &Bvh, joint: usize) -> f64 {
    let joint = &document.joints()[joint];
    if !joint.channels.iter().any(|c| matches!(c, Channel::Position(_))) {
        return 0.0;
    }
    let first = translation(joint, document.row(0));
    (1..document.frames()).map(|f| (translation(joint, document.row(f)) - first).norm()).fold(0.0, f64::max)
}

/// Longest way from the hips to a tip along the bones, End Sites counted, file units.
fn longest_chain(document: &Bvh, joints: &[usize], place: &[Option<usize>], means: &[Vector3<f64>]) -> f64 {
    let mut reach = vec![0.0; joints.len()];
    let mut longest: f64 = 0.0;
    for (s, &j) in joints.iter().enumerate() {
        let joint = &document.joints()[j];
        if s > 0 {
            reach[s] = means[s].norm() + joint.parent.and_then(|p| place[p]).map_or(0.0, |p| reach[p]);
        }
        let tip = joint.end_sites.iter().map(|&e| Vector3::from(e).norm()).fold(0.0, f64::max);
        longest = longest.max(reach[s] + tip);
    }
    longest
}

/// Writes a local pose, file units, into a joint's columns. Angles near those that are there already.
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
    // Axes without a channel come last and at zero: a rotation that needs none of them loses nothing.
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

/// Rounded to 1e-6 of a degree or metre, or finer where the file's unit is larger than a metre.
fn rounded(value: f64, scale: f64) -> f64 {
    let digits = 6.0 + scale.log10().max(0.0).ceil();
    let power = 10f64.powf(digits);
    let rounded = (value * power).round() / power;
    if rounded.is_finite() { rounded + 0.0 } else { value }
}
