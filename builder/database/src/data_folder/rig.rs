//! The character that a database is built for: every clip is retargeted to its skeleton before registration, so that a game
//! or a robot steps poses of its own joints.
//!
//! The database's joints are those that carry the body: of body parts, what lies between, and what the user names. The body
//! is measured on the rest pose, if that is upright with straight limbs, as T-poses and A-poses are; else on the file's own
//! motion, as an input clip is.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use gestus_core::blob::layout::MAX_JOINTS;
use gestus_motion::{
    binding::{ConvertError, Options, to_clip},
    capture::{self, CaptureError, Document},
    clip::{Clip, Skeleton},
    joints::{JointsError, clip_on},
    landmarks::{LandmarkError, Landmarks},
    unit::Unit,
};
use nalgebra::UnitQuaternion;
use rayon::prelude::*;
use serde_json::{Value, json};
use thiserror::Error;

use super::config::Config;
use crate::{
    registration::floor::Floor,
    retarget::{
        MapError, MapFile, MapFileError, Retarget,
        body::Body,
        kept::Kept,
        parts::{Part, Side},
        up::SAMPLE,
    },
    stream::{body_mapping::same_body, far::origin_of},
};

/// A character, ready to take clips.
#[derive(Debug)]
pub struct Rig {
    /// Name of its file, without the folder.
    pub file: String,
    path: PathBuf,
    /// The body of the joints that are kept, on a floor at zero.
    pub body: Body,
    /// What was found and is doubtful, for the user.
    pub notes: Vec<String>,
}

/// A file that is no character that clips can be retargeted to.
#[derive(Debug, Error)]
pub enum RigError {
    /// It can't be read.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// Its map file can't be read.
    #[error(transparent)]
    Map(#[from] MapFileError),
    /// It can't be turned into poses.
    #[error("{0}: {1}")]
    Convert(String, ConvertError),
    /// Its body can't be identified, or is no humanoid.
    #[error("{0}: {1}")]
    Body(String, Box<MapError>),
    /// A joint that is named and not there.
    #[error("{0}: {1}")]
    Joints(String, JointsError),
    /// Its legs can't be found in the database later.
    #[error("{0}: {1}")]
    Landmark(String, LandmarkError),
    /// Its legs would be found elsewhere in the database later.
    #[error(
        "{file}: {part} is `{joint}`, but by its name it would be taken for another joint in the database: name the joints \
         like `LeftUpLeg`, `UpperLeg_L` or `lfemur`, one joint each for thigh, shin and foot"
    )]
    Names {
        /// The file.
        file: String,
        /// The part.
        part: Part,
        /// Its joint.
        joint: String,
    },
}

impl Rig {
    /// The character that a configuration names, if it names one.
    ///
    /// # Errors
    /// [`RigError`] names the file and what to do.
    pub fn of_config(config: &Config) -> Result<Option<Self>, RigError> {
        let Some(path) = &config.rig else { return Ok(None) };
        let map = config.rig_map.as_deref().map(MapFile::read).transpose()?.unwrap_or_default();
        Self::read(path, &map, config.rig_unit(), &config.joints).map(Some)
    }

    /// Reads a character. Without a unit, it is found as a clip's is; `joints` are kept besides those that carry the body.
    ///
    /// # Errors
    /// [`RigError`] names the file and what to do.
    pub fn read(path: &Path, map: &MapFile, unit: Option<Unit>, joints: &[String]) -> Result<Self, RigError> {
        let name = || path.display().to_string();
        let (whole, world, mut notes) = measured(path, map, unit)?;
        let find = |joint: &String| {
            whole.skeleton.find(joint).ok_or_else(|| JointsError::Unknown {
                name: joint.clone(),
                list: whole.skeleton.names.join(", "),
            })
        };
        let named = joints.iter().map(find).collect::<Result<Vec<_>, _>>();
        let named = named.map_err(|e| RigError::Joints(name(), e))?;
        let mut body = Kept::needed(&whole, &named).body(&whole);
        let have = body.skeleton.joints();
        if have > MAX_JOINTS {
            let error = MapError::Joints { have, most: MAX_JOINTS };
            return Err(RigError::Body(name(), Box::new(error)));
        }
        check_landmarks(&body, &name())?;
        // A database stands on a floor at zero, and no toes are in it.
        body.anatomy.ankle_m -= body.floor.height_m;
        body.anatomy.ankle_m -=
            toes_over_ankles_m(&body).map_or(0.0, |m| (body.anatomy.ankle_m + m).min(0.0));
        body.floor = Floor::ZERO;
        notes.extend(body.doubts().map(|doubt| format!("doubt: {doubt}")));
        if world.angle() > 1e-6 {
            notes.push("its world is turned to Y up: the database's poses have Y up".to_owned());
        }
        let file = path.file_name().map_or_else(name, |file| file.to_string_lossy().into_owned());
        Ok(Self { file, path: path.to_owned(), body, notes })
    }

    /// Puts clips of one skeleton, with Y up and on a floor at zero, on the character's; returns doubts about the map.
    ///
    /// # Errors
    /// [`MapError`] if their body can't be identified.
    pub(super) fn take(&self, clips: &mut [&mut Clip]) -> Result<Vec<String>, MapError> {
        let Some(first) = clips.first() else { return Ok(Vec::new()) };
        let target = &self.body.skeleton;
        if let Some(joints) = same_body(&first.skeleton, target) {
            clips.par_iter_mut().for_each(|clip| **clip = clip_on(clip, &joints, target));
            return Ok(Vec::new());
        }
        let file = MapFile { floor_m: Some(0.0), ..MapFile::default() };
        let source = Body::of_upright(&pooled(clips), &file)?;
        let doubts = source.doubts().cloned().collect();
        clips.par_iter_mut().try_for_each(|clip| {
            let map = Retarget::of_bodies(source.clone(), self.body.clone(), origin_of(clip))?;
            **clip = map.to_target(clip);
            Ok::<(), MapError>(())
        })?;
        Ok(doubts)
    }

    /// Whether a clip's path ([`capture::Folder::documents`]) is that of the character's own file, or of an animation in it.
    pub(super) fn holds(&self, clip: &Path) -> bool {
        let real = |path: &Path| path.canonicalize().ok();
        let inside = |path: &Path| real(path.parent().filter(|folder| !folder.as_os_str().is_empty())?);
        let animation_of = |folder: &Path| {
            folder.file_name() == self.path.file_stem() && inside(folder) == inside(&self.path)
        };
        match real(clip) {
            Some(file) => real(&self.path) == Some(file),
            // Several animations of a file are clips in a folder of its name, which is not there.
            None => clip.parent().is_some_and(animation_of),
        }
    }

    /// For a program.
    pub fn json(&self) -> Value {
        let names = &self.body.skeleton.names;
        let parts =
            self.body.parts.joints.iter().map(|(part, &joint)| (part.to_string(), json!(names[joint])));
        let parts: serde_json::Map<_, _> = parts.collect();
        json!({ "file": self.file, "joints": names, "parts": parts, "notes": self.notes })
    }
}

/// The whole body of a character's file, the rotation of its world to Y up, and notes about the reading.
fn measured(
    path: &Path,
    map: &MapFile,
    unit: Option<Unit>,
) -> Result<(Body, UnitQuaternion<f64>, Vec<String>), RigError> {
    let name = || path.display().to_string();
    let fail = |error| RigError::Body(name(), Box::new(error));
    let read = |document: &Document| {
        let options = Options { unit, ..Options::default() };
        let (clip, binding) = to_clip(document, &options).map_err(|e| RigError::Convert(name(), e))?;
        Ok::<_, RigError>((clip, map.of_document(document), binding.notes().to_vec()))
    };
    let documents = capture::read_rest(path)?;
    let poses = documents.iter().map(read).collect::<Result<Vec<_>, _>>()?;
    for (clip, map, notes) in &poses {
        if let Some((body, world)) = Body::at_rest(clip, map).map_err(fail)? {
            return Ok((body, world, notes.clone()));
        }
    }
    // `read_rest` gives one at least.
    let (mut clip, map, mut notes) = poses.into_iter().next().ok_or_else(|| fail(MapError::Empty))?;
    if clip.frames.len() == 1 {
        let moving = moving(path, unit, &clip.skeleton);
        if moving.is_empty() {
            notes.push(
                "it does not stand upright with straight limbs at rest, so that the axes of knees and elbows are taken from \
                 one pose: export it in its T-pose or A-pose, or with an animation"
                    .to_owned(),
            );
        } else {
            clip.frames = moving;
        }
    }
    let (body, world) = Body::of_clip(&clip, &map).map_err(fail)?;
    Ok((body, world, notes))
}

/// The poses of all animations in a file that move that skeleton.
fn moving(path: &Path, unit: Option<Unit>, skeleton: &Arc<Skeleton>) -> Vec<gestus_motion::clip::Frame> {
    let documents = capture::clips(path).unwrap_or_default();
    let options = Options { unit, root: skeleton.names.first().cloned() };
    let clips = documents.iter().filter_map(|(_, document)| Some(to_clip(document, &options).ok()?.0));
    clips.filter(|clip| clip.skeleton.difference(skeleton).is_none()).flat_map(|clip| clip.frames).collect()
}

/// Poses of some clips, evenly spaced over all of them.
fn pooled(clips: &[&mut Clip]) -> Clip {
    let count: usize = clips.iter().map(|clip| clip.frames.len()).sum();
    let frames = clips.iter().flat_map(|clip| {
        let origin = origin_of(clip);
        clip.frames.iter().map(move |frame| crate::stream::far::moved_frame(frame, &-origin))
    });
    let frames = frames.step_by(count.div_ceil(SAMPLE).max(1)).collect();
    Clip { frames, ..Clip::clone(clips[0]) }
}

/// Height of the toes over the ankles of feet that stand, metres; the lower of the two.
fn toes_over_ankles_m(body: &Body) -> Option<f64> {
    let toes = Side::BOTH.into_iter().filter_map(|side| {
        let [foot, toes] = [Part::Foot(side), Part::Toes(side)].map(|part| body.parts.get(part));
        let (foot, toes) = (foot?, toes?);
        let offset = body.anatomy.frame(foot)?.inverse() * body.skeleton.offsets[toes];
        (body.skeleton.parents[toes] == Some(foot)).then_some(offset.y)
    });
    toes.reduce(f64::min)
}

/// Refuses a skeleton in which the database's legs would be found elsewhere than the body's: they are looked for by names
/// and with zero rotations.
fn check_landmarks(body: &Body, file: &str) -> Result<(), RigError> {
    let skeleton = &body.skeleton;
    let marks = Landmarks::find(skeleton).map_err(|e| RigError::Landmark(file.to_owned(), e))?;
    for side in Side::BOTH {
        let wanted = [Part::LowerLeg(side), Part::Foot(side)].into_iter().zip([marks.knees, marks.feet]);
        for (part, found) in wanted {
            if let Some(joint) = body.parts.get(part).filter(|joint| found[side.index()] != *joint) {
                let (file, joint) = (file.to_owned(), skeleton.names[joint].clone());
                return Err(RigError::Names { file, part, joint });
            }
        }
    }
    Ok(())
}
