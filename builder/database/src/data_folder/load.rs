//! From a folder of clips to a [`Corpus`].

use std::{
    collections::{BTreeSet, HashMap},
    path::{Path, PathBuf},
};

use thiserror::Error;

mod bind;
mod cut;
mod kinds;

use bind::{Bound, below, bind_all, disambiguate_names};

use crate::{
    data_folder::{
        balance::balanced,
        config::{AnnotateError, Annotation, Config, FILE_NAME},
        floors,
        left_out::{Group, LeftOut, Reason, Refused},
        licence::licence_beside,
        rig::{Rig, RigError},
        size,
        skeletons::{difference, kinds, most_common, unify},
        spelling, worlds,
    },
    registration::{Performance, has_cycles, no_cycle, register, timeline::Kind},
};
use gestus_motion::{
    capture::{CaptureError, Format, read_folder},
    clip::{Clip, Skeleton},
    corpus::Corpus,
    joints::JointsError,
    landmarks::LandmarkError,
};

/// The result of reading a folder.
#[derive(Debug)]
pub struct Loaded {
    /// The clips.
    pub corpus: Corpus,
    /// One line for each file or clip left out, and for each guess.
    pub notes: Vec<String>,
    /// Clips that were on a floor of their own, and its height, metres. They were moved onto a floor at zero.
    pub floors: Vec<(String, f64)>,
    /// Clips that could not be used.
    pub left_out: Vec<LeftOut>,
    /// The character whose skeleton they are on.
    pub rig: Option<Rig>,
}

/// A folder that can't be used.
#[derive(Debug, Error)]
pub enum LoadError {
    /// A file.
    #[error(transparent)]
    Capture(#[from] CaptureError),
    /// `gestus.toml`.
    #[error(transparent)]
    Annotate(#[from] AnnotateError),
    /// The character.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// A file in place of a folder.
    #[error("{0}: this is a file: give the folder that it is in, whose clips make a database together")]
    File(String),
    /// Settings for unknown actions, styles or files.
    #[error("{0}: {1}")]
    Names(String, AnnotateError),
    /// The skeleton.
    #[error("{0}: {1}")]
    Landmark(String, LandmarkError),
    /// A selection of joints that can't be kept.
    #[error("{0}: {1}")]
    Joints(String, JointsError),
    /// Clips that can't be used, under `strict`.
    #[error("{0}: {1}")]
    Strict(String, Refused),
    /// No clips.
    #[error("{folder}: no clip can be used{detail}")]
    Empty {
        /// The folder.
        folder: String,
        /// The selection, if any.
        detail: String,
    },
}

/// Reads the clips that a configuration selects, and registers them.
///
/// # Errors
/// [`LoadError`] if no clip can be used, or with `strict` if any can't.
pub fn load(config: &Config) -> Result<Loaded, LoadError> {
    let folder = config.data.clone().unwrap_or_else(|| PathBuf::from("."));
    let place = folder.display().to_string();
    if folder.is_file() {
        return Err(LoadError::File(place));
    }
    let rig = Rig::of_config(config)?;
    let mut files = read_folder(&folder)?;
    // A character in the folder need not be a clip.
    let is_rig = |path: &Path| rig.as_ref().is_some_and(|rig| rig.holds(path));
    files.skipped.retain(|error| !is_rig(Path::new(error.file())));
    files.documents.retain(|(path, _)| !is_rig(path) || config.annotate(below(&folder, path)).is_ok());
    let mut left_out: Vec<LeftOut> = Vec::new();
    let mut clips =
        bind_all(config, &folder, &files, &mut left_out).map_err(|e| LoadError::Names(place.clone(), e))?;
    disambiguate_names(&mut clips);
    let mut notes = vec![files.summary()];
    let mut clips = match &rig {
        Some(rig) => {
            notes.extend(rig.notes.iter().map(|note| format!("{}: {note}", rig.file)));
            clips
        }
        None => on_common_skeleton(clips, &mut left_out),
    };
    notes.extend(turn_upright(&mut clips));
    let clips = of_human_size(clips, &mut left_out);
    let (mut clips, leaps) = cut::at_leaps(clips, &mut left_out);
    notes.extend(leaps);
    notes.extend(cut::over_the_ground(&mut clips));
    notes.extend(kinds::of_motion(config, &mut clips));
    let clips = registrable(clips, &mut left_out);
    notes.extend(cut::without_motion(&clips));
    let (clips, floors) = match &rig {
        Some(rig) => {
            let (clips, mut floors) = onto_rig(clips, rig, &mut left_out, &mut notes);
            let clips = limit_clips(clips, config.limit);
            floors.retain(|(name, _)| clips.iter().any(|clip| clip.clip.name == *name));
            (clips, floors)
        }
        None => {
            let mut clips = limit_clips(clips, config.limit);
            let floors = move_to_zero_floor(&mut clips);
            unify(&mut clips.iter_mut().map(|clip| &mut clip.clip).collect::<Vec<_>>());
            (clips, floors)
        }
    };
    let (doubt, units) = (clips.iter().find_map(|clip| clip.doubt.clone()), guessed_units(&clips));
    let performance = |Bound { annotation: Annotation { action, style, take, kind }, clip, .. }| {
        Performance { clip, kind, action, style, take, licence: config.licence.clone() }
    };
    let performances: Vec<Performance> = clips.into_iter().map(performance).collect();
    if performances.is_empty() {
        refuse_if_strict(config, &place, &left_out, None)?;
        return Err(LoadError::Empty { folder: place, detail: selection(config, &left_out) });
    }
    let (mut corpus, without) = register(performances).map_err(|e| LoadError::Landmark(place.clone(), e))?;
    let have = |p: &Performance| corpus.actions.contains(&p.action);
    left_out.extend(without.iter().map(|p| without_cycle(&p.clip, &p.action, p.kind, have(p))));
    refuse_if_strict(config, &place, &left_out, Some(&corpus))?;
    if corpus.examples.is_empty() {
        return Err(LoadError::Empty { folder: place, detail: selection(config, &left_out) });
    }
    notes.extend(spelling::doubts(&corpus));
    corpus.order(&config.actions, &config.styles);
    if !config.joints.is_empty() {
        corpus = corpus.on_joints(&config.joints).map_err(|e| LoadError::Joints(place.clone(), e))?;
    }
    notes.extend(doubt);
    notes.extend(floors::note(&floors));
    notes.extend(units);
    notes.extend(left_out.iter().map(ToString::to_string));
    notes.extend(licence_beside(&folder, config));
    Ok(Loaded { corpus, notes, floors, left_out, rig })
}

/// What to tell about units that were guessed.
fn guessed_units(clips: &[Bound]) -> Option<String> {
    let mut units: Vec<&str> = Vec::new();
    for unit in clips.iter().filter_map(|clip| clip.guessed.as_deref()) {
        if !units.contains(&unit) {
            units.push(unit);
        }
    }
    let list = units.join(" and ");
    (!units.is_empty()).then(|| {
        format!("lengths are taken as {list}, by the body's size (`unit` in {FILE_NAME} says otherwise)")
    })
}

/// Under `strict`, refuses a folder of which something was left out, or whose `corpus` has incomplete actions or styles.
fn refuse_if_strict(
    config: &Config,
    place: &str,
    left_out: &[LeftOut],
    corpus: Option<&Corpus>,
) -> Result<(), LoadError> {
    if !config.strict {
        return Ok(());
    }
    let messages = left_out.iter().map(|one| one.said.clone()).collect();
    let incomplete = corpus.map(|corpus| balanced(corpus, !config.styles.is_empty()).1);
    let groups = Group::all(left_out).into_iter().chain(incomplete.into_iter().flatten()).collect();
    let refused = Refused::unless_empty(messages, groups);
    refused.map_err(|e| LoadError::Strict(place.to_owned(), e))
}

/// The clips on the most common skeleton, of equally common ones the first.
fn on_common_skeleton(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> Vec<Bound> {
    let skeletons: Vec<&Skeleton> = clips.iter().map(|clip| &*clip.clip.skeleton).collect();
    let Some((first, count)) = most_common(&skeletons) else { return clips };
    let (skeleton, name) = (clips[first].clip.skeleton.clone(), clips[first].clip.name.clone());
    let fits = |clip: &Bound| match difference(&skeleton, &clip.clip.skeleton) {
        None => true,
        Some(difference) => {
            let most = if count == 1 { String::new() } else { format!(" and {} more", count - 1) };
            let said = format!("{}: its skeleton differs from that of {name}{most}: {difference}", clip.name);
            left_out.push(LeftOut::new(Reason::Skeleton, &clip.below, said));
            false
        }
    };
    clips.into_iter().filter(fits).collect()
}

/// Puts clips of any skeletons on that of a character, each kind on a floor at zero and with one map. Returns those that
/// could be, in their order, and the floors that clips were on.
fn onto_rig(
    clips: Vec<Bound>,
    rig: &Rig,
    left_out: &mut Vec<LeftOut>,
    notes: &mut Vec<String>,
) -> (Vec<Bound>, Vec<(String, f64)>) {
    let kinds = kinds(&clips.iter().map(|clip| &*clip.clip.skeleton).collect::<Vec<_>>());
    let mut clips: Vec<Option<Bound>> = clips.into_iter().map(Some).collect();
    let mut floors = Vec::new();
    for places in kinds {
        let mut kind: Vec<Bound> = places.iter().filter_map(|&place| clips[place].take()).collect();
        floors.extend(move_to_zero_floor(&mut kind));
        let mut motions: Vec<&mut Clip> = kind.iter_mut().map(|clip| &mut clip.clip).collect();
        unify(&mut motions);
        match rig.take(&mut motions) {
            Ok(doubts) => {
                let name = &kind[0].name;
                notes.extend(doubts.iter().map(|doubt| format!("{name}: retargeted; doubt: {doubt}")));
                places.iter().zip(kind).for_each(|(&place, clip)| clips[place] = Some(clip));
            }
            Err(error) => left_out.extend(kind.iter().map(|clip| {
                let said = format!("{}: it can't be retargeted to {}: {error}", clip.name, rig.file);
                LeftOut::new(Reason::Skeleton, &clip.below, said)
            })),
        }
    }
    (clips.into_iter().flatten().collect(), floors)
}

/// The clips that registration can use. Others do not count for limits and mean bone lengths.
fn registrable(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> Vec<Bound> {
    let (used, others): (Vec<Bound>, Vec<Bound>) = clips.into_iter().partition(|clip| clip.has_cycles);
    let have: BTreeSet<&str> = used.iter().map(|clip| clip.annotation.action.as_str()).collect();
    left_out.extend(others.iter().map(|c| {
        let Annotation { action, kind, .. } = &c.annotation;
        without_cycle(&c.clip, action, *kind, have.contains(action.as_str()))
    }));
    used
}

/// Leaves out bodies whose size shows a wrong unit, and those far from the floor that is stated for them.
fn of_human_size(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> Vec<Bound> {
    let fits = |clip: &Bound| match size::problem(&clip.clip, clip.floor_m) {
        None => true,
        Some(problem) => {
            let said = format!("{}: {problem}", clip.name);
            left_out.push(LeftOut::new(Reason::Size, &clip.below, said));
            false
        }
    };
    clips.into_iter().filter(fits).collect()
}

/// A clip that registration can't use; `others` says whether it can use others of the action.
fn without_cycle(clip: &Clip, action: &str, kind: Kind, others: bool) -> LeftOut {
    let (reason, action) = match kind {
        Kind::Gait if others => (Reason::Brief, None),
        Kind::Gait => (Reason::NoCycle, Some(action.to_owned())),
        Kind::Whole => (Reason::Short, None),
    };
    LeftOut { action, ..LeftOut::new(reason, &clip.name, no_cycle(clip, kind)) }
}

/// Keeps the first `most` clips of each action and style; all for 0.
fn limit_clips(mut clips: Vec<Bound>, most: usize) -> Vec<Bound> {
    let mut count = HashMap::<[String; 2], usize>::new();
    clips.retain(|clip| {
        let Annotation { action, style, .. } = &clip.annotation;
        let seen = count.entry([action.clone(), style.clone()]).or_default();
        *seen += 1;
        most == 0 || *seen <= most
    });
    clips
}

/// Moves clips to a floor at zero. Returns the names of those that were on another, and its height, metres.
fn move_to_zero_floor(clips: &mut [Bound]) -> Vec<(String, f64)> {
    let names: Vec<String> = clips.iter().map(|clip| clip.clip.name.clone()).collect();
    let mut moved: Vec<_> = clips.iter_mut().map(|clip| (&mut clip.clip, clip.floor_m)).collect();
    names.into_iter().zip(floors::lower(&mut moved)).filter(|(_, height)| *height != 0.0).collect()
}

/// Turns clips to Y up; returns what to tell.
fn turn_upright(clips: &mut [Bound]) -> Option<String> {
    let mut worlds: Vec<_> = clips.iter_mut().map(|clip| (&mut clip.clip, clip.up)).collect();
    let (turned, note) = worlds::turn(&mut worlds);
    for (clip, _) in clips.iter_mut().zip(turned).filter(|(_, turned)| *turned) {
        clip.has_cycles = has_cycles(&clip.clip, clip.annotation.kind);
    }
    note
}

/// The selection, for the message that no clip matches it.
fn selection(config: &Config, left_out: &[LeftOut]) -> String {
    let mut detail = String::new();
    for (what, names) in [("actions", &config.actions), ("styles", &config.styles)] {
        if !names.is_empty() {
            detail += &format!(", {what} {}", names.join(","));
        }
    }
    match left_out.first() {
        Some(first) => {
            let groups: Vec<String> = Group::all(left_out).iter().flat_map(Group::lines).collect();
            let (count, said) = (left_out.len(), &first.said);
            format!("{detail}; the first of {count} left out: {said}\n  {}", groups.join("\n  "))
        }
        None => {
            let endings = Format::endings_that_are_read();
            format!("{detail}; are there files in it ({endings}) that are named like `walk_proud_01.bvh`?")
        }
    }
}

#[cfg(test)]
mod tests;
