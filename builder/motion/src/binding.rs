//! Animation to clip: the unit, the hips, and the skeleton below them.
//!
//! A [`Binding`] is made once per file:
//!
//! * Joint 0 of the skeleton is the hips. Joints above them that do not move, or whose name says that they only carry the
//!   body (`joint_Root`, `Reference`, ...), are folded into the hips: `hips = L_1 ... L_n hips_local` in each frame. What
//!   else hangs on such a joint, as weapons and controls of inverse kinematics do, stays as it is in the file. Writing
//!   puts them back as they are in the file's first frame.
//! * Every other joint's offset is its position at rest, or its mean position over the clip if the animation translates
//!   it. [`Binding::notes`] names joints that move by more than a centimetre.

use std::sync::Arc;

use nalgebra::{Isometry3, Vector3};
use thiserror::Error;

use crate::{
    animation::{Joint, Recording, children},
    clip::{Clip, Frame, Skeleton},
    height, names,
    unit::Unit,
};

/// How to read a document.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Options {
    /// The file's unit of length. If not given, that of the format, or guessed from the body's height.
    pub unit: Option<Unit>,
    /// Name of the joint to take as the hips; found if not given.
    pub root: Option<String>,
}

/// A document that can't be read as a clip, or a clip that can't be written like a document. The caller adds the file's
/// name to the message.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum ConvertError {
    #[error("no joint is called `{name}`; the joints are {joints}")]
    NoSuchRoot { name: String, joints: String },
    #[error(
        "frame {frame} is {metres:.1e} m from the origin, expected at most 1e7; check the values and the unit"
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

/// Greatest distance of a body from the origin, metres; in millimetres it can still be written and read.
const FAR_M: f64 = 1e7;
/// Longest bone, metres: the limit of databases and retargeting maps.
const MAX_BONE_M: f64 = 100.0;
/// Movement of an inner joint's translation that is worth a note, metres.
const STRETCH_M: f64 = 0.01;

/// How a document's joints and channels make a clip.
#[derive(Debug, Clone)]
pub struct Binding {
    pub(crate) skeleton: Arc<Skeleton>,
    pub(crate) unit: Unit,
    doubt: Option<String>,
    notes: Vec<String>,
    /// Joints of the file above the hips, from the top.
    pub(crate) above: Vec<usize>,
    /// The file's joint for each joint of the skeleton.
    pub(crate) joints: Vec<usize>,
    pub(crate) file: String,
    /// The rig, to recognise the file.
    pub(crate) rig: Vec<Joint>,
}

impl Binding {
    /// Lays out the skeleton of an animation.
    pub fn new(recording: &impl Recording, options: &Options) -> Result<Binding, ConvertError> {
        let file = recording.name().to_owned();
        let all = &*recording.joints();
        let hips = match &options.root {
            None => find_hips(all),
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
        let means: Vec<Vector3<f64>> = joints.iter().map(|&j| mean_translation(recording, all, j)).collect();

        let mut notes = recording.notes().to_vec();
        let guess = || Unit::guess(height::estimate(all, &joints, &place, &means));
        let (unit, guessed, doubt) = match (options.unit, recording.unit()) {
            (Some(unit), _) => (unit, None, None),
            (None, Some(unit)) => match guess().instead(unit) {
                Some((other, said)) => (other, None, Some(said)),
                None => (unit, None, guess().doubt(unit)),
            },
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
            if metres.is_nan() || metres > MAX_BONE_M {
                return Err(ConvertError::TooLong { joint: all[j].name.clone(), metres });
            }
            offsets.push(offset);
            let moves = if s == 0 { 0.0 } else { translation_range(recording, all, j) * scale };
            if moves > STRETCH_M {
                let cm = moves * 100.0;
                notes.push(format!(
                    "joint {} is moved by up to {cm:.1} cm in its parent; its mean place is used",
                    all[j].name
                ));
            }
        }
        if all[hips].moves != [true; 3] {
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
        Ok(Binding { skeleton, unit, doubt, notes, above, joints, file, rig: all.to_vec() })
    }

    /// The joints of the clips that this makes, hips first.
    pub fn skeleton(&self) -> &Arc<Skeleton> {
        &self.skeleton
    }

    /// The file's unit of length.
    pub fn unit(&self) -> Unit {
        self.unit
    }

    /// A warning if the body has an unlikely size in the format's unit.
    pub fn doubt(&self) -> Option<&str> {
        self.doubt.as_deref()
    }

    /// Notes for the user about the reading: the guessed unit, translations that were averaged.
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// Ends of a joint's bones that carry no joint, in its frame, metres.
    pub fn tips(&self, joint: usize) -> Vec<Vector3<f64>> {
        self.rig[self.joints[joint]].tips.iter().map(|tip| tip * self.unit.metres()).collect()
    }

    /// The animation's motion, at its own rate. The clip is named by the stem of the file's name.
    pub fn to_clip(&self, recording: &impl Recording) -> Result<Clip, ConvertError> {
        self.check_rig(&recording.joints())?;
        let scale = self.unit.metres();
        let mut frames = Vec::with_capacity(recording.frames());
        for f in 0..recording.frames() {
            let poses = &*recording.frame(f);
            let hips = self.carrier(poses) * poses[self.joints[0]];
            let root = hips.translation.vector * scale;
            let metres = root.norm();
            if metres.is_nan() || metres > FAR_M {
                return Err(ConvertError::TooFar { frame: f + 1, metres });
            }
            let mut rotations = Vec::with_capacity(self.joints.len());
            rotations.push(hips.rotation);
            rotations.extend(self.joints[1..].iter().map(|&j| poses[j].rotation));
            frames.push(Frame { root, rotations });
        }
        let name = std::path::Path::new(recording.name()).file_stem().unwrap_or_default();
        Ok(Clip {
            name: name.to_string_lossy().into_owned(),
            skeleton: self.skeleton.clone(),
            rate_hz: recording.rate_hz(),
            frames,
        })
    }

    /// Product of the joints above the hips, file units.
    pub(crate) fn carrier(&self, poses: &[Isometry3<f64>]) -> Isometry3<f64> {
        self.above.iter().fold(Isometry3::identity(), |sum, &j| sum * poses[j])
    }

    /// Checks that a clip can be written like a document of that rig and name.
    pub(crate) fn check(&self, rig: &[Joint], file: &str, clip: &Clip) -> Result<(), ConvertError> {
        self.check_rig(rig)?;
        if let Some(difference) = clip.skeleton.difference(&self.skeleton) {
            let (clip, file) = (clip.name.clone(), file.to_owned());
            return Err(ConvertError::OtherSkeleton { clip, file, difference });
        }
        check_clip(clip)
    }

    fn check_rig(&self, theirs: &[Joint]) -> Result<(), ConvertError> {
        let ours = &self.rig;
        let same = |a: &Joint, b: &Joint| {
            a.name == b.name && a.parent == b.parent && a.moves == b.moves && a.degrees == b.degrees
        };
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

/// A recording's clip and the binding that made it.
pub fn to_clip(recording: &impl Recording, options: &Options) -> Result<(Clip, Binding), ConvertError> {
    let binding = Binding::new(recording, options)?;
    Ok((binding.to_clip(recording)?, binding))
}

pub(crate) fn check_clip(clip: &Clip) -> Result<(), ConvertError> {
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

/// The first joint from the top that does more than carry the body.
fn find_hips(all: &[Joint]) -> usize {
    let mut joint = 0;
    loop {
        let Some(child) = carried(all, joint) else { return joint };
        let name = all[joint].name.to_ascii_lowercase();
        let is_hips = ["hips", "pelvis"].iter().any(|n| name.contains(n));
        let is_carrier =
            ["root", "reference", "armature", "world", "origin"].iter().any(|n| name.contains(n));
        // The hips can carry what is above them only with all six channels of their own.
        let can_carry = all[joint].degrees == 0 || until_moved(all, child).any(|j| all[j].degrees == 6);
        let idle = is_carrier || all[joint].still;
        if is_hips || !can_carry || !idle || children(all, child).next().is_none() {
            return joint;
        }
        joint = child;
    }
}

/// The child that is all of the body that hangs on a joint, if one is.
fn carried(all: &[Joint], joint: usize) -> Option<usize> {
    let below: Vec<usize> = children(all, joint).collect();
    match below[..] {
        [] => None,
        [only] => Some(only),
        // Beside the body there may be weapons, or the controls of inverse kinematics that Unreal and Blender export. A
        // pelvis beside the arms is not the whole body.
        [..] => match below.iter().find(|&&child| has_both_legs(all, child)) {
            Some(&body) if below.iter().any(|&child| child != body && has_both_arms(all, child)) => None,
            Some(&body) => Some(body),
            None => moved_body(all, joint, &below),
        },
    }
}

/// The joints from this one on, as far as each carries the whole body, to the first that is not still.
fn until_moved(all: &[Joint], from: usize) -> impl Iterator<Item = usize> + '_ {
    std::iter::successors(Some(from), |&joint| carried(all, joint).filter(|_| all[joint].still))
}

/// The child that moves and carries almost all joints below one that is still, as an armature carries body and camera.
fn moved_body(all: &[Joint], joint: usize, below: &[usize]) -> Option<usize> {
    /// Least share of the joints below.
    const ALMOST_ALL: f64 = 0.8;
    let is_below =
        |j: usize, top: usize| std::iter::successors(Some(j), |&j| all[j].parent).any(|j| j == top);
    let joints = |top: usize| (top..all.len()).filter(|&j| is_below(j, top)).count() as f64;
    let is_body = |&&child: &&usize| {
        all[child].degrees == 6 && !all[child].still && joints(child) > ALMOST_ALL * (joints(joint) - 1.0)
    };
    if all[joint].still { below.iter().find(is_body).copied() } else { None }
}

/// Whether thigh, shin and foot of either side hang on a joint, as the names say.
fn has_both_legs(all: &[Joint], joint: usize) -> bool {
    has_both(all, joint, |name| names::names().is_leg(name))
}

/// Whether upper arm, lower arm and hand of either side do, which are no controls of inverse kinematics.
fn has_both_arms(all: &[Joint], joint: usize) -> bool {
    has_both(all, joint, |name| names::names().is_arm(name) && !names::words(name).iter().any(|w| w == "ik"))
}

/// Whether three joints of such a name hang one on the other below a joint, on either side.
fn has_both(all: &[Joint], joint: usize, is: impl Fn(&str) -> bool) -> bool {
    /// Joints of a limb, one on the other.
    const LIMB: usize = 3;
    let mut depth = vec![None; all.len()];
    depth[joint] = Some(0);
    let mut found = [false; 2];
    for j in joint + 1..all.len() {
        let Some(above) = all[j].parent.and_then(|p| depth[p]) else { continue };
        let here = above + usize::from(is(&all[j].name));
        depth[j] = Some(here);
        if let Some(side) = names::side(&all[j].name).filter(|_| here >= LIMB) {
            found[side.index()] = true;
        }
    }
    found == [true; 2]
}

fn mean_translation(recording: &impl Recording, joints: &[Joint], joint: usize) -> Vector3<f64> {
    if !joints[joint].moves.contains(&true) {
        return joints[joint].offset;
    }
    let frames = recording.frames();
    let place = |f: usize| recording.place(f, joint);
    // From the first frame on, so that the mean of a constant is that constant.
    let first = place(0);
    let sum: Vector3<f64> = (0..frames).map(|f| place(f) - first).sum();
    first + sum / frames as f64
}

fn translation_range(recording: &impl Recording, joints: &[Joint], joint: usize) -> f64 {
    if !joints[joint].moves.contains(&true) {
        return 0.0;
    }
    let place = |f: usize| recording.place(f, joint);
    let first = place(0);
    (1..recording.frames()).map(|f| (place(f) - first).norm()).fold(0.0, f64::max)
}
