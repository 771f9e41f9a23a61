//! From a folder of BVH files to a [`Corpus`].

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use nalgebra::Vector3;
use rayon::prelude::*;
use thiserror::Error;

use crate::{
    annotate::{AnnotateError, Annotation, Config, FILE_NAME},
    bvh::{Binding, Bvh, BvhError, Options, read_folder},
    corpus::Corpus,
    joints::JointsError,
    landmarks::LandmarkError,
    motion::{Clip, Skeleton},
    register::{Performance, register},
};

/// What was read, and what was not.
#[derive(Debug)]
pub struct Loaded {
    /// The clips.
    pub corpus: Corpus,
    /// One line for each file or clip left out, and for what was guessed.
    pub notes: Vec<String>,
    /// How many files could not be used.
    pub skipped: usize,
}

/// A folder that can't be used.
#[derive(Debug, Error)]
pub enum LoadError {
    /// A file.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// `gestus.toml`, or a file that it does not know, under `strict`.
    #[error(transparent)]
    Annotate(#[from] AnnotateError),
    /// The skeleton.
    #[error("{0}: {1}")]
    Landmark(String, LandmarkError),
    /// Joints to keep that can't be kept.
    #[error("{0}: {1}")]
    Joints(String, JointsError),
    /// A file that was left out, under `strict`.
    #[error("{0} (--strict: nothing is left out)")]
    Strict(String),
    /// No clips.
    #[error("{folder}: no clip can be used{detail}")]
    Empty {
        /// The folder.
        folder: String,
        /// What was asked for and is not there.
        detail: String,
    },
}

/// Reads the clips that a configuration asks for, and gives them contacts and a canonical timeline.
///
/// # Errors
/// [`LoadError`] where nothing can be used, or under `strict` anything can't.
pub fn load(config: &Config) -> Result<Loaded, LoadError> {
    let folder = config.data.clone().unwrap_or_else(|| PathBuf::from("."));
    let place = folder.display().to_string();
    let files = read_folder(&folder, config.strict)?;
    let mut left_out: Vec<String> = files.skipped.iter().map(ToString::to_string).collect();
    let bound: Vec<Result<Option<Bound>, String>> =
        files.documents.par_iter().map(|(path, document)| bind(config, &folder, path, document)).collect();
    let mut performances: Vec<Performance> = Vec::new();
    let mut units: Vec<String> = Vec::new();
    for clip in bound {
        let clip = match clip {
            Ok(Some(clip)) => clip,
            Ok(None) => continue,
            Err(note) => {
                left_out.push(note);
                continue;
            }
        };
        if let Some(first) = performances.first()
            && let Some(difference) = difference(&first.clip.skeleton, &clip.clip.skeleton)
        {
            let other = &first.clip.name;
            left_out.push(format!("{}: its skeleton differs from that of {other}: {difference}", clip.name));
            continue;
        }
        let Annotation { action, style, take, kind } = clip.annotation;
        let same = |p: &&Performance| p.action == action && p.style == style;
        if config.limit > 0 && performances.iter().filter(same).count() >= config.limit {
            continue;
        }
        if !units.contains(&clip.unit) {
            units.push(clip.unit);
        }
        let (clip, licence) = (clip.clip.resampled(config.rate_hz), config.licence.clone());
        performances.push(Performance { clip, kind, action, style, take, licence });
    }
    if config.strict
        && let Some(note) = left_out.first()
    {
        return Err(LoadError::Strict(note.clone()));
    }
    if performances.is_empty() {
        return Err(LoadError::Empty { folder: place, detail: wanted(config, &left_out) });
    }
    unify(&mut performances);
    let (mut corpus, warnings) = register(performances).map_err(|e| LoadError::Landmark(place.clone(), e))?;
    left_out.extend(warnings);
    if corpus.examples.is_empty() {
        return Err(LoadError::Empty { folder: place, detail: wanted(config, &left_out) });
    }
    corpus.order(&config.actions, &config.styles);
    if !config.joints.is_empty() {
        corpus = corpus.on_joints(&config.joints).map_err(|e| LoadError::Joints(place.clone(), e))?;
    }
    let mut notes = vec![files.summary()];
    if config.unit.is_none() {
        let units = units.join(" and ");
        notes.push(format!(
            "lengths are taken as {units}, by the body's size (`unit` in {FILE_NAME} says otherwise)"
        ));
    }
    notes.extend(left_out.iter().map(|n| format!("left out: {n}")));
    Ok(Loaded { corpus, notes, skipped: left_out.len() })
}

/// A file as a clip, and what it is.
struct Bound {
    name: String,
    annotation: Annotation,
    unit: String,
    clip: Clip,
}

/// Takes a file to a clip; `None` where it is not asked for.
fn bind(config: &Config, folder: &Path, path: &Path, document: &Bvh) -> Result<Option<Bound>, String> {
    let name = path.display().to_string();
    let below = path.strip_prefix(folder).unwrap_or(path);
    let annotation = config.annotate(below).map_err(|e| e.to_string())?;
    if !config.wants(&annotation) {
        return Ok(None);
    }
    let options = Options { unit: config.unit(), ..Options::default() };
    let binding = Binding::new(document, &options).map_err(|e| format!("{name}: {e}"))?;
    let mut clip = binding.to_clip(document).map_err(|e| format!("{name}: {e}"))?;
    clip.name = path.file_stem().map_or_else(|| name.clone(), |s| s.to_string_lossy().into_owned());
    Ok(Some(Bound { name, annotation, unit: binding.unit().name(), clip }))
}

/// What was asked for, for the message that it is not there.
fn wanted(config: &Config, left_out: &[String]) -> String {
    let mut detail = String::new();
    for (what, names) in [("actions", &config.actions), ("styles", &config.styles)] {
        if !names.is_empty() {
            detail += &format!(", {what} {}", names.join(","));
        }
    }
    match left_out.first() {
        Some(first) => format!("{detail}; the first of {} left out: {first}", left_out.len()),
        None => format!("{detail}; are there .bvh files in it, named like `walk_proud_01.bvh`?"),
    }
}

/// What keeps two skeletons from being one.
fn difference(a: &Skeleton, b: &Skeleton) -> Option<String> {
    if a.joints() != b.joints() {
        return Some(format!("{} joints against {}", b.joints(), a.joints()));
    }
    (0..a.joints())
        .find(|&j| a.names[j] != b.names[j] || a.parents[j] != b.parents[j])
        .map(|j| format!("joint {j} is `{}` against `{}`", b.names[j], a.names[j]))
}

/// Gives all clips one skeleton: the mean of their offsets.
fn unify(performances: &mut [Performance]) {
    let Some(first) = performances.first() else { return };
    let mut skeleton = (*first.clip.skeleton).clone();
    let count = performances.len() as f64;
    for (j, offset) in skeleton.offsets.iter_mut().enumerate() {
        *offset = performances.iter().map(|p| p.clip.skeleton.offsets[j]).sum::<Vector3<f64>>() / count;
    }
    let skeleton = Arc::new(skeleton);
    for performance in performances {
        let clip = &mut performance.clip;
        *clip = Clip { skeleton: skeleton.clone(), ..clip.clone() };
    }
}
