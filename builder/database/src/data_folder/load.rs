//! From a folder of clips to a [`Corpus`].

use std::{
    collections::{BTreeMap, HashMap},
    fmt::Display,
    path::{Path, PathBuf},
};

use rayon::prelude::*;
use thiserror::Error;

use crate::{
    data_folder::{
        config::{AnnotateError, Annotation, Config, FILE_NAME},
        floors,
        left_out::{Group, LeftOut, Reason, Refused},
        skeletons::{difference, most_common, unify},
    },
    registration::{Performance, has_cycles, no_cycle, register, timeline::Kind},
};
use gestus_motion::{
    animation::Recording,
    binding::{Options, to_clip},
    capture::{CaptureError, Document, read_folder},
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
    let files = read_folder(&folder)?;
    let below = |path: &Path| path.strip_prefix(&folder).unwrap_or(path).to_path_buf();
    let skipped = files.skipped.iter().map(|error| {
        LeftOut::new(Reason::Unreadable, below(Path::new(error.file())).to_string_lossy(), error)
    });
    let mut left_out: Vec<LeftOut> = skipped.collect();
    // Files that can't be read have names too.
    let named: Vec<PathBuf> = (files.documents.iter().map(|(path, _)| below(path)))
        .chain(files.skipped.iter().map(|e| below(Path::new(e.file()))))
        .collect();
    let paths: Vec<&Path> = named.iter().map(PathBuf::as_path).collect();
    config.check_names(&paths).map_err(|e| LoadError::Names(place.clone(), e))?;
    let bound: Vec<Result<Option<Bound>, LeftOut>> = files
        .documents
        .par_iter()
        .map(|(path, document)| bind(config, &below(path), path, document))
        .collect();
    let mut clips: Vec<Bound> = Vec::new();
    for clip in bound {
        match clip {
            Ok(clip) => clips.extend(clip),
            Err(why) => left_out.push(why),
        }
    }
    tell_apart(&mut clips);
    let mut notes = vec![files.summary()];
    let mut clips = of_one_body(clips, &mut left_out);
    notes.extend(whole_where_nothing_walks(config, &mut clips));
    let mut clips = limited(with_cycles(clips, &mut left_out), config.limit);
    let floors = on_zero(&mut clips);
    let mut units: Vec<String> = Vec::new();
    let mut doubt = None;
    let mut performances: Vec<Performance> = Vec::new();
    for clip in clips {
        let Annotation { action, style, take, kind } = clip.annotation;
        if let Some(unit) = clip.guessed.filter(|unit| !units.contains(unit)) {
            units.push(unit);
        }
        doubt = doubt.or(clip.doubt);
        let (clip, licence) = (clip.clip, config.licence.clone());
        performances.push(Performance { clip, kind, action, style, take, licence });
    }
    let refuse = |left_out: &[LeftOut]| {
        let left_out = if config.strict { left_out } else { &[] };
        let said = left_out.iter().map(|one| one.said.clone()).collect();
        let refused = Refused::unless_empty(said, Group::all(left_out));
        refused.map_err(|e| LoadError::Strict(place.clone(), e))
    };
    refuse(&left_out)?;
    if performances.is_empty() {
        return Err(LoadError::Empty { folder: place, detail: wanted(config, &left_out) });
    }
    unify(&mut performances);
    let (mut corpus, without) = register(performances).map_err(|e| LoadError::Landmark(place.clone(), e))?;
    left_out.extend(without.iter().map(|p| uncut(&p.clip, &p.action, p.kind)));
    refuse(&left_out)?;
    if corpus.examples.is_empty() {
        return Err(LoadError::Empty { folder: place, detail: wanted(config, &left_out) });
    }
    corpus.order(&config.actions, &config.styles);
    if !config.joints.is_empty() {
        corpus = corpus.on_joints(&config.joints).map_err(|e| LoadError::Joints(place.clone(), e))?;
    }
    notes.extend(doubt);
    notes.extend(floors::told(&floors));
    if !units.is_empty() {
        let units = units.join(" and ");
        notes.push(format!(
            "lengths are taken as {units}, by the body's size (`unit` in {FILE_NAME} says otherwise)"
        ));
    }
    notes.extend(left_out.iter().map(ToString::to_string));
    notes.extend(licence_beside(&folder, config));
    Ok(Loaded { corpus, notes, floors, left_out })
}

/// A clip with its file's labels.
struct Bound {
    name: String,
    /// The file below the folder, without its ending.
    below: String,
    annotation: Annotation,
    /// The unit, if guessed.
    guessed: Option<String>,
    /// A warning about the body's size, if the unit was not guessed.
    doubt: Option<String>,
    /// The height of its floor, metres, if told.
    floor_m: Option<f64>,
    /// Whether registration has a timeline for it.
    has_cycles: bool,
    clip: Clip,
}

/// Names clips by their files; clips of the same name in several folders get the folder's name too.
fn tell_apart(clips: &mut [Bound]) {
    let mut count = HashMap::<String, usize>::new();
    for clip in clips.iter() {
        *count.entry(clip.clip.name.clone()).or_default() += 1;
    }
    for clip in clips.iter_mut().filter(|c| count[&c.clip.name] > 1) {
        clip.clip.name.clone_from(&clip.below);
    }
}

/// The clips on the most common skeleton, of equally common ones the first.
fn of_one_body(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> Vec<Bound> {
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

/// Takes actions that are gaits by their names alone as whole clips, if no clip of them has a gait cycle. One line for each.
fn whole_where_nothing_walks(config: &Config, clips: &mut [Bound]) -> Vec<String> {
    let mut walks: BTreeMap<String, bool> = BTreeMap::new();
    for clip in clips.iter().filter(|c| c.annotation.kind == Kind::Gait) {
        if !config.kind.contains_key(&clip.annotation.action) {
            *walks.entry(clip.annotation.action.clone()).or_default() |= clip.has_cycles;
        }
    }
    walks.retain(|_, walks| !*walks);
    for clip in clips.iter_mut().filter(|c| walks.contains_key(&c.annotation.action)) {
        clip.annotation.kind = Kind::Whole;
        clip.has_cycles = has_cycles(&clip.clip, Kind::Whole);
    }
    let said = |action: &String| {
        format!(
            "action {action}: no clip has a gait cycle, so each is taken as a whole, from its start to its end (`[kind]` \
             with `{action} = \"whole\"` in {FILE_NAME} says so, `\"gait\"` leaves them out)"
        )
    };
    walks.keys().map(said).collect()
}

/// A file of terms that lies in the folder, if the manifest will have none.
fn licence_beside(folder: &Path, config: &Config) -> Option<String> {
    if !config.licence.is_empty() {
        return None;
    }
    let is_licence = |name: &str| {
        let name = name.to_ascii_lowercase();
        ["license", "licence", "copying", "eula", "terms"].iter().any(|word| name.starts_with(word))
    };
    let files =
        std::fs::read_dir(folder).ok()?.filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let file = files.filter(|name| is_licence(name)).min()?;
    Some(format!(
        "{}: the database's manifest does not have these terms: say them by `licence = \"...\"` in {FILE_NAME}",
        folder.join(file).display()
    ))
}

/// The clips that registration can use. Others do not count for limits and mean bone lengths.
fn with_cycles(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> Vec<Bound> {
    let (used, others): (Vec<Bound>, Vec<Bound>) = clips.into_iter().partition(|clip| clip.has_cycles);
    left_out.extend(others.iter().map(|c| uncut(&c.clip, &c.annotation.action, c.annotation.kind)));
    used
}

/// A clip that registration can't use.
fn uncut(clip: &Clip, action: &str, kind: Kind) -> LeftOut {
    let (reason, action) = match kind {
        Kind::Gait => (Reason::NoCycle, Some(action.to_owned())),
        Kind::Whole => (Reason::Short, None),
    };
    LeftOut { action, ..LeftOut::new(reason, &clip.name, no_cycle(clip, kind)) }
}

/// At most so many clips of each action and style, the first; all for 0.
fn limited(mut clips: Vec<Bound>, most: usize) -> Vec<Bound> {
    let mut count = HashMap::<[String; 2], usize>::new();
    clips.retain(|clip| {
        let Annotation { action, style, .. } = &clip.annotation;
        let seen = count.entry([action.clone(), style.clone()]).or_default();
        *seen += 1;
        most == 0 || *seen <= most
    });
    clips
}

/// Moves clips onto a floor at zero; returns the names of those that were on another, and its height, metres.
fn on_zero(clips: &mut [Bound]) -> Vec<(String, f64)> {
    let names: Vec<String> = clips.iter().map(|clip| clip.clip.name.clone()).collect();
    let mut moved: Vec<_> = clips.iter_mut().map(|clip| (&mut clip.clip, clip.floor_m)).collect();
    names.into_iter().zip(floors::lower(&mut moved)).filter(|(_, height)| *height != 0.0).collect()
}

/// Converts a file to a clip at the database's rate; `None` if it is not selected.
fn bind(config: &Config, below: &Path, path: &Path, document: &Document) -> Result<Option<Bound>, LeftOut> {
    let name = document.name().to_owned();
    let file = below.to_string_lossy();
    let annotation = config.annotate(below).map_err(|e| LeftOut::new(Reason::Unlabelled, file.clone(), e))?;
    if !config.wants(&annotation) {
        return Ok(None);
    }
    let options = Options { unit: config.unit(), ..Options::default() };
    let unread =
        |e: &dyn Display| LeftOut::new(Reason::Unreadable, file.clone(), format_args!("{name}: {e}"));
    let (clip, binding) = to_clip(document, &options).map_err(|e| unread(&e))?;
    let mut clip = clip.fitted(config.rate_hz).map_err(|e| unread(&e))?;
    clip.name = path.file_stem().map_or_else(|| name.clone(), |s| s.to_string_lossy().into_owned());
    let steps: Vec<_> = below.with_extension("").iter().map(|s| s.to_string_lossy().into_owned()).collect();
    let guessed = (config.unit.is_none() && document.unit().is_none()).then(|| binding.unit().name());
    let doubt = binding.doubt().map(|doubt| format!("{name}: {doubt}"));
    let has_cycles = has_cycles(&clip, annotation.kind);
    let floor_m = config.floor(below);
    let below = steps.join("/");
    Ok(Some(Bound { name, below, annotation, guessed, doubt, floor_m, has_cycles, clip }))
}

/// The selection, for the message that no clip matches it.
fn wanted(config: &Config, left_out: &[LeftOut]) -> String {
    let mut detail = String::new();
    for (what, names) in [("actions", &config.actions), ("styles", &config.styles)] {
        if !names.is_empty() {
            detail += &format!(", {what} {}", names.join(","));
        }
    }
    match left_out.first() {
        Some(first) => format!("{detail}; the first of {} left out: {}", left_out.len(), first.said),
        None => format!("{detail}; are there .bvh or .glb files in it, named like `walk_proud_01.bvh`?"),
    }
}

#[cfg(test)]
mod tests {
    use std::{fs, sync::Arc};

    use super::*;
    use crate::{
        build::{BuildOptions, build},
        data_folder::skeletons::size,
        synth::performance,
    };
    use gestus_motion::{formats::bvh::Bvh, unit::Unit};

    fn generated() -> Clip {
        performance(1, "walk", "neutral", 30.0, 4.0).unwrap().clip
    }

    /// The first joint of a long bone.
    fn long_bone() -> usize {
        let skeleton = generated().skeleton;
        (1..skeleton.joints())
            .find(|&j| skeleton.offsets[j].norm() > 0.2 && skeleton.parents[j] != Some(0))
            .unwrap()
    }

    /// The same motion by a body of another size.
    fn scale(clip: &mut Clip, times: f64) {
        Arc::make_mut(&mut clip.skeleton).offsets.iter_mut().for_each(|offset| *offset *= times);
        clip.frames.iter_mut().for_each(|frame| frame.root *= times);
    }

    /// A folder of generated clips, which goes when it is dropped.
    struct Folder(PathBuf);

    impl Folder {
        fn new(name: &str) -> Self {
            let folder = std::env::temp_dir().join(format!("gestus-load-{name}-{}", std::process::id()));
            fs::create_dir_all(&folder).unwrap();
            Self(folder)
        }

        /// Writes a clip of so many frames of a walk.
        fn walk(&self, file: &str, frames: usize, change: impl FnOnce(&mut Clip)) {
            self.write("walk", file, frames, change);
        }

        /// Writes a clip of so many frames of an action.
        fn write(&self, action: &str, file: &str, frames: usize, change: impl FnOnce(&mut Clip)) {
            let mut clip = performance(1, action, "neutral", 30.0, 4.0).unwrap().clip;
            clip.frames.truncate(frames);
            change(&mut clip);
            fs::write(self.0.join(file), Bvh::from_clip(&clip, Unit::Centimetres).unwrap().to_text())
                .unwrap();
        }

        fn load(&self, more: &str) -> Result<Loaded, LoadError> {
            let mut config = Config::parse(more, "gestus.toml").unwrap();
            config.data = Some(self.0.clone());
            load(&config)
        }
    }

    impl Drop for Folder {
        fn drop(&mut self) {
            let _ = fs::remove_dir_all(&self.0);
        }
    }

    #[test]
    fn a_clip_of_one_frame_at_another_rate_decides_nothing() {
        let folder = Folder::new("rate");
        folder.walk("walk_a_1.bvh", 1, |clip| clip.rate_hz = 120.0);
        folder.walk("walk_b_1.bvh", 120, |_| ());
        let loaded = folder.load("").unwrap();
        assert_eq!((loaded.corpus.rate_hz, loaded.left_out.len()), (30.0, 1), "{:?}", loaded.notes);
        let slower = folder.load("rate_hz = 20").unwrap();
        assert_eq!((slower.corpus.rate_hz, slower.corpus.examples[0].clip.rate_hz), (20.0, 20.0));
    }

    #[test]
    fn clips_of_one_name_are_told_apart_by_their_folders() {
        let folder = Folder::new("names");
        for style in ["a", "b"] {
            fs::create_dir_all(folder.0.join(style)).unwrap();
            folder.walk(&format!("{style}/walk-1.bvh"), 120, |_| ());
        }
        folder.walk("a/walk-2.bvh", 120, |_| ());
        let loaded = folder.load("patterns = [\"{style}/{action}-{take}.bvh\"]").unwrap();
        let mut names: Vec<&str> = loaded.corpus.examples.iter().map(|e| e.clip.name.as_str()).collect();
        names.sort_unstable();
        assert_eq!(names, ["a/walk-1", "b/walk-1", "walk-2"]);
    }

    #[test]
    fn the_skeleton_is_the_one_that_most_files_have() {
        let folder = Folder::new("skeleton");
        folder.walk("walk_a_1.bvh", 120, |clip| Arc::make_mut(&mut clip.skeleton).names[3] = "Other".into());
        folder.walk("walk_b_1.bvh", 120, |_| ());
        folder.walk("walk_c_1.bvh", 120, |_| ());
        let loaded = folder.load("").unwrap();
        assert_eq!(loaded.corpus.styles, ["b", "c"]);
        let said = loaded.notes.join("\n");
        assert!(
            said.contains("walk_a_1.bvh: its skeleton differs from that of walk_b_1 and 1 more"),
            "{said}"
        );
    }

    /// Of a skeleton of the same joints rotations may mean something else, or lengths.
    #[test]
    fn a_body_in_another_rest_pose_or_unit_is_left_out_and_named() {
        let folder = Folder::new("rest");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        folder.walk("walk_b_1.bvh", 120, |_| ());
        let arm = long_bone();
        folder.walk("walk_c_1.bvh", 120, |clip| {
            let offset = &mut Arc::make_mut(&mut clip.skeleton).offsets[arm];
            *offset = nalgebra::Rotation3::from_euler_angles(0.0, 0.0, 1.0) * *offset;
        });
        folder.walk("walk_d_1.bvh", 120, |clip| scale(clip, 0.01));
        let loaded = folder.load("unit = 'cm'").unwrap();
        assert_eq!(loaded.corpus.styles, ["a", "b"]);
        let said = loaded.notes.join("\n");
        for wanted in ["lies 57 degrees off at rest", "its bones are 0.01 times as long"] {
            assert!(said.contains(wanted), "{said}");
        }
    }

    /// A folder in which some clips had their floor at the hips taught feet at two heights.
    #[test]
    fn clips_on_floors_of_their_own_are_moved_onto_one_at_zero() {
        let actions = ["walk", "run", "jump"];
        let write = |name: &str, floors: [f64; 3]| {
            let folder = Folder::new(name);
            for (action, floor) in actions.iter().zip(floors) {
                for style in ["a", "b"] {
                    folder.write(action, &format!("{action}_{style}_1.bvh"), 120, |clip| {
                        clip.frames.iter_mut().for_each(|frame| frame.root.y += floor);
                    });
                }
            }
            folder
        };
        // How far the hips of the first clip of each action are above those of another folder's, metres.
        let above = |one: &Loaded, other: &Loaded| {
            let first = |loaded: &Loaded, action: usize| {
                let of = loaded.corpus.examples.iter().find(|e| e.action == action).unwrap();
                of.clip.frames[7].root.y
            };
            [0, 1, 2].map(|action| first(one, action) - first(other, action))
        };
        let plain = write("plain-floor", [0.0; 3]).load("").unwrap();
        assert_eq!(plain.floors, []);
        for floors in [[0.0, -0.72, 1.3], [0.0, 0.4, 0.41]] {
            let folder = write("own-floors", floors);
            let moved = folder.load("").unwrap();
            let apart = above(&moved, &plain);
            assert!(apart.iter().all(|apart| apart.abs() < 0.02), "{floors:?}: {apart:?}");
            assert_eq!(moved.floors.len(), 4, "{:?}", moved.floors);
            let said = moved.notes.join("\n");
            assert!(said.contains("_a_1 is on a floor at ") && said.contains("`[floors]`"), "{said}");
            // What is told is not looked for.
            let told = folder.load("floor = 0.0\n[floors]\n\"walk_a_1.bvh\" = 0.5").unwrap();
            let [jump, run, walk] = above(&told, &plain);
            let off = [walk + 0.5, run - floors[1], jump - floors[2]];
            assert!(off.iter().all(|off| off.abs() < 1e-5), "{off:?}");
        }
        // All on one floor: as tall as before, up to the height of a sole.
        let sunk = write("sunk", [-0.72; 3]).load("").unwrap();
        let [a, b, c] = above(&sunk, &plain);
        assert!(sunk.floors.len() == 6 && (a - b).abs() < 1e-5 && (a - c).abs() < 1e-5, "{:?}", sunk.floors);
        assert!(a.abs() < 0.04, "{a}");
        let message = Config::parse("[floors]\nx = 3000", "c").unwrap_err().to_string();
        assert!(message.contains("`floor` is 3000; expected metres"), "{message}");
        let absent = write("sunk", [0.0; 3]).load("[floors]\nx = 3").unwrap_err().to_string();
        assert!(absent.contains("`floors`: no file is called `x`"), "{absent}");
    }

    /// A tall actor's steps are a tall body's, and his feet are where its feet are.
    #[test]
    fn a_larger_body_takes_the_steps_of_the_common_one() {
        let folder = Folder::new("tall");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        folder.walk("walk_b_1.bvh", 120, |clip| scale(clip, 1.2));
        let corpus = folder.load("").unwrap().corpus;
        let [one, other] = &corpus.examples[..] else { panic!("both are used") };
        assert_eq!(one.clip.skeleton, other.clip.skeleton);
        let apart = one.clip.frames.iter().zip(&other.clip.frames).map(|(a, b)| (a.root - b.root).norm());
        let most = apart.fold(0.0, f64::max);
        // Both are the same performance; files hold some digits.
        assert!(most < 1e-4, "{most}");
        let middle = (size(&one.clip.skeleton) / size(&generated().skeleton) - 1.1).abs();
        assert!(middle < 1e-4, "{middle}");
    }

    #[test]
    fn a_limit_counts_what_is_used() {
        let folder = Folder::new("limit");
        folder.walk("walk_a_1.bvh", 5, |_| ());
        folder.walk("walk_a_2.bvh", 120, |_| ());
        folder.walk("walk_a_3.bvh", 120, |_| ());
        let loaded = folder.load("limit = 1").unwrap();
        assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (1, 1), "{:?}", loaded.notes);
        assert_eq!(loaded.corpus.examples[0].clip.name, "walk_a_2");
    }

    /// What registration leaves out had its say in the length of everybody's bones, but for a limit.
    #[test]
    fn a_clip_that_is_left_out_has_no_say_in_the_bones() {
        let folder = Folder::new("bones");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        folder.walk("walk_b_1.bvh", 120, |_| ());
        let alone = folder.load("").unwrap().corpus.skeleton;
        let tall = |clip: &mut Clip| {
            Arc::make_mut(&mut clip.skeleton).offsets.iter_mut().for_each(|offset| *offset *= 1.3);
        };
        folder.walk("walk_a_2.bvh", 5, tall);
        let loaded = folder.load("").unwrap();
        assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (2, 1), "{:?}", loaded.notes);
        assert_eq!(loaded.corpus.skeleton.offsets, alone.offsets);
        // Nothing is left out, of whatever reason, and all of it is told.
        fs::write(folder.0.join("walk_b_2.bvh"), "HIERARCHY").unwrap();
        let said = folder.load("strict = true").unwrap_err().to_string();
        for wanted in
            ["2 files or clips can't be used (--strict", "walk_a_2: no gait cycle found", "walk_b_2.bvh:1:"]
        {
            assert!(said.contains(wanted), "{wanted}: {said}");
        }
        assert!(
            said.contains("1 without a gait cycle (walk_a_2)") && said.contains("walk = \"whole\""),
            "{said}"
        );
    }

    /// A pose to calibrate by, beside good clips: `build` called its knots a fault of the builder.
    #[test]
    fn a_pose_among_the_clips_of_an_action_is_left_out_and_named() {
        let folder = Folder::new("pose");
        for style in ["a", "b"] {
            folder.write("punch", &format!("punch_{style}_2.bvh"), 60, |_| ());
        }
        for frames in [1, 2] {
            folder.write("punch", "punch_a_1.bvh", frames, |_| ());
            for limit in ["", "limit = 1"] {
                let loaded = folder.load(limit).unwrap();
                let said = loaded.notes.join("\n");
                assert!(
                    said.contains(&format!("left out: punch_a_1: too short: {frames} of the 3 frames")),
                    "{said}"
                );
                assert_eq!((loaded.corpus.examples.len(), loaded.left_out.len()), (2, 1), "{said}");
                build(&loaded.corpus, &BuildOptions::default()).unwrap();
            }
        }
        // As its style's only clip it leaves the style out, and with it what nothing else can be paired with.
        folder.write("punch", "punch_c_1.bvh", 1, |_| ());
        assert_eq!(folder.load("").unwrap().corpus.styles, ["a", "b"]);
    }

    /// A dance that is called a walk: it was left out in every style.
    #[test]
    fn an_action_without_cycles_is_taken_as_a_whole() {
        let folder = Folder::new("whole");
        for style in ["a", "b"] {
            folder.walk(&format!("walk_{style}_1.bvh"), 120, |_| ());
            folder.walk(&format!("run_{style}_1.bvh"), 12, |_| ());
        }
        let loaded = folder.load("").unwrap();
        assert_eq!((loaded.corpus.actions.len(), loaded.left_out.len()), (2, 0), "{:?}", loaded.notes);
        assert!(loaded.notes.iter().any(|n| n.contains("action run: no clip has a gait cycle")));
        // Where the folder says what it is, it is that.
        let loaded = folder.load("kind = { run = 'gait' }").unwrap();
        assert_eq!((loaded.corpus.actions.len(), loaded.left_out.len()), (1, 2), "{:?}", loaded.notes);
    }

    #[test]
    fn terms_in_the_folder_are_named() {
        let folder = Folder::new("terms");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        fs::write(folder.0.join("LICENSE.txt"), "mine").unwrap();
        let has = |more: &str| folder.load(more).unwrap().notes.iter().any(|n| n.contains("LICENSE.txt"));
        assert!(has("") && !has("licence = 'CC-BY'"));
    }

    #[test]
    fn what_is_not_there_is_named() {
        let folder = Folder::new("not-there");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        let message = |more: &str| folder.load(more).unwrap_err().to_string();
        assert!(message("styles = ['proud']").contains("no style is called `proud`: there are a"));
        assert!(
            message("actions = ['walk', 'pnuch']").contains("no action is called `pnuch`: there are walk")
        );
        let config = Config { data: Some(folder.0.join("walk_a_1.bvh")), ..Config::default() };
        let message = load(&config).unwrap_err().to_string();
        assert!(message.contains("walk_a_1.bvh: this is a file: give the folder"), "{message}");
    }

    #[test]
    fn a_clip_that_would_fill_the_memory_is_left_out() {
        let folder = Folder::new("memory");
        folder.walk("walk_a_1.bvh", 120, |_| ());
        folder.walk("walk_b_1.bvh", 120, |clip| {
            clip.rate_hz = 1.0;
            clip.frames = clip.frames.iter().cycle().take(400).cloned().collect();
        });
        let loaded = folder.load("rate_hz = 1000").unwrap();
        let said = loaded.notes.join("\n");
        assert!(said.contains("walk_b_1.bvh: 399.0 s are 399001 frames at 1000 a second"), "{said}");
        assert_eq!(loaded.corpus.styles, ["a"]);
    }
}
