//! From a folder of BVH files to a [`Corpus`].

use std::{path::Path, sync::Arc};

use nalgebra::Vector3;
use rayon::prelude::*;
use thiserror::Error;

use crate::{
    annotate::{AnnotateError, Annotations},
    bvh::{Binding, BvhError, Unit, read_folder},
    corpus::Corpus,
    landmarks::LandmarkError,
    motion::{Clip, Skeleton},
    register::{Performance, register},
};

/// Which clips of a folder, and at what rate.
#[derive(Debug, Clone, Default)]
pub struct Selection {
    /// Actions wanted; all where empty.
    pub actions: Vec<String>,
    /// Styles wanted, the first ones first in the database; all where empty.
    pub styles: Vec<String>,
    /// Frames a second; the first clip's where absent.
    pub rate_hz: Option<f64>,
    /// Most clips of an action in a style.
    pub limit: Option<usize>,
    /// Bad files are errors.
    pub strict: bool,
}

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
    /// `gestus.toml`.
    #[error(transparent)]
    Annotate(#[from] AnnotateError),
    /// The skeleton.
    #[error("{0}: {1}")]
    Landmark(String, LandmarkError),
    /// Files that were left out, under `--strict`.
    #[error("{0} (--strict: nothing is left out)")]
    Strict(String),
    /// No clips.
    #[error(
        "{folder}: no clip can be used{detail}; files are named like `walk_proud_01.bvh`, \
         or described by patterns or a table in gestus.toml"
    )]
    Empty {
        /// The folder.
        folder: String,
        /// What was asked for and is not there.
        detail: String,
    },
}

/// Reads the clips of a folder, and gives them contacts and a canonical timeline.
///
/// # Errors
/// [`LoadError`] where nothing can be used, or under `strict` anything can't.
pub fn load(folder: &Path, selection: &Selection) -> Result<Loaded, LoadError> {
    let annotations = Annotations::of_folder(folder)?;
    let wanted = |list: &[String], name: &str| list.is_empty() || list.iter().any(|w| w == name);
    let files = read_folder(folder, |path| {
        annotations
            .of_file(path)
            .is_none_or(|a| wanted(&selection.actions, &a.action) && wanted(&selection.styles, &a.style))
    })?;
    let mut notes: Vec<String> = files.errors.iter().map(|e| format!("left out: {e}")).collect();
    let unit = annotations.unit.as_deref().and_then(Unit::named);
    let mut performances: Vec<Performance> = Vec::new();
    let bound: Vec<_> = files
        .files
        .par_iter()
        .map(|(path, bvh)| {
            let name = path.display().to_string();
            let Some(annotation) = annotations.of_file(path) else {
                return Err(format!(
                    "left out: {name}: neither its name nor {} says action and style",
                    crate::annotate::FILE
                ));
            };
            let binding = Binding::new(bvh, unit).map_err(|e| format!("left out: {name}: {e}"))?;
            let stem = path.file_stem().map_or(String::new(), |s| s.to_string_lossy().into_owned());
            Ok((name, annotation, binding.unit, binding.clip(bvh, &stem)))
        })
        .collect();
    let mut rate_hz = selection.rate_hz;
    let mut units: Vec<&str> = Vec::new();
    for clip in bound {
        let (name, annotation, unit, clip) = match clip {
            Ok(clip) => clip,
            Err(note) => {
                notes.push(note);
                continue;
            }
        };
        if let Some(first) = performances.first()
            && let Some(difference) = difference(&first.clip.skeleton, &clip.skeleton)
        {
            notes.push(format!(
                "left out: {name}: its skeleton differs from {}'s: {difference}",
                first.clip.name
            ));
            continue;
        }
        let same = |p: &&Performance| p.action == annotation.action && p.style == annotation.style;
        if selection.limit.is_some_and(|limit| performances.iter().filter(same).count() >= limit) {
            continue;
        }
        if !units.contains(&unit.name) {
            units.push(unit.name);
        }
        let rate = *rate_hz.get_or_insert((clip.rate_hz * 100.0).round() / 100.0);
        performances.push(Performance {
            clip: clip.resampled(rate),
            kind: annotations.kind(&annotation.action),
            action: annotation.action,
            style: annotation.style,
            licence: annotations.licence.clone(),
        });
    }
    if annotations.unit.is_none() && !units.is_empty() {
        notes.push(format!(
            "lengths are taken as {} (guessed from the body's size; set `unit` in {} otherwise)",
            units.join(" and "),
            crate::annotate::FILE
        ));
    }
    let skipped = notes.iter().filter(|n| n.starts_with("left out")).count();
    if selection.strict
        && let Some(note) = notes.iter().find(|n| n.starts_with("left out"))
    {
        return Err(LoadError::Strict(note.trim_start_matches("left out: ").to_owned()));
    }
    if performances.is_empty() {
        let mut detail = String::new();
        if !selection.actions.is_empty() || !selection.styles.is_empty() {
            detail = format!(
                " for actions [{}], styles [{}]",
                selection.actions.join(", "),
                selection.styles.join(", ")
            );
        }
        if let Some(note) = notes.first() {
            detail += &format!(" ({note})");
        }
        return Err(LoadError::Empty { folder: folder.display().to_string(), detail });
    }
    unify(&mut performances);
    let place = folder.display().to_string();
    let (mut corpus, warnings) = register(performances).map_err(|e| LoadError::Landmark(place, e))?;
    corpus.order(&selection.actions, &selection.styles);
    notes.extend(warnings);
    Ok(Loaded { corpus, notes, skipped })
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
