//! Labels of the files in a data folder (action, style and take), and options of the build.
//!
//! Most collections have labels in their file names. Otherwise a `gestus.toml` in the folder gives them, by patterns or
//! file by file. The same struct is what `gestus build --config FILE` reads. A file is looked up in the table
//! `files` first, then tried against `patterns` in order, then against the built-in ones:
//!
//! ```text
//! dataset-1_bow_proud_001.bvh     dataset-{*}_{action}_{style}_{take}    Bandai-Namco 1 and 2
//! angry_13_000.bvh                {style}_{action}_{take}                Xia et al. 2015; 01 is walk, 13 run
//! walk_proud_2.bvh                {action}_{style}_{take}                anything else
//! ```
//!
//! In a pattern `{style}` and `{take}` hold no underscore, `{action}` and `{*}` may; none is empty or holds a `/`.
//! A pattern with a `/` is matched with the path below the folder, others with the file's name.
//!
//! ```
//! use gestus_database::{data_folder::config::Config, registration::timeline::Kind};
//! let config = Config::parse(r#"patterns = ["{style}/{action}-{take}.bvh"]"#, "gestus.toml")?;
//! let walk = config.annotate("proud/walk-7.bvh".as_ref())?;
//! assert_eq!((walk.action.as_str(), walk.style.as_str(), walk.kind), ("walk", "proud", Kind::Gait));
//! # Ok::<(), gestus_database::data_folder::config::AnnotateError>(())
//! ```

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::pattern::{Pattern, PatternError, built_in, example};
use crate::{
    build::BuildOptions,
    registration::timeline::Kind,
    retarget::{
        axis,
        file::{FLOORS_M, expected_floor},
    },
};
use gestus_motion::{
    clip::{RATES_HZ, expected_rate},
    files::{self, MAX_SETTINGS_BYTES},
    unit::Unit,
};

/// Name of the configuration file in a data folder.
pub const FILE_NAME: &str = "gestus.toml";

/// Characters that names of actions and styles can't have, since `--style a=1,b=2` and file names of `export` use them.
const NOT_IN_NAMES: [char; 3] = [',', '=', '/'];

/// Labels of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Annotation {
    /// Action: `walk`, `kick`.
    pub action: String,
    /// Style: `proud`.
    pub style: String,
    /// Take; empty if unknown.
    pub take: String,
    /// Kind of the action's timeline.
    pub kind: Kind,
}

/// A row of the table `files`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileEntry {
    /// Action.
    pub action: String,
    /// Style.
    pub style: String,
    /// Take.
    #[serde(default)]
    pub take: String,
}

/// A `gestus.toml`. Its defaults are those of [`Config::default`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// Folder of the clips, relative to the configuration file. A folder that the command line names goes before it.
    pub data: Option<PathBuf>,
    /// Patterns of file names, tried in order before the built-in ones.
    pub patterns: Vec<String>,
    /// Files by name or path below the folder.
    pub files: BTreeMap<String, FileEntry>,
    /// Other names for actions as the files have them: `"01" = "walk"`.
    pub names: BTreeMap<String, String>,
    /// Kinds of actions whose names mislead.
    pub kind: BTreeMap<String, Kind>,
    /// Licence or source of the clips, for the manifest.
    pub licence: String,
    /// Unit of length (m, cm, mm, inch, cmu, or metres a unit); guessed a file if absent.
    pub unit: Option<String>,
    /// Up in the clips' world: axis and sign; found a clip if absent.
    #[serde(with = "axis")]
    pub up: Option<(usize, f64)>,
    /// Height of the clips' floor, metres; found a clip if absent.
    pub floor: Option<f64>,
    /// Heights of the floors of single files, by name or path below the folder, metres.
    pub floors: BTreeMap<String, f64>,
    /// The character whose skeleton the database gets, relative to the configuration file.
    pub rig: Option<PathBuf>,
    /// The map of its skeleton, relative to the configuration file.
    pub rig_map: Option<PathBuf>,
    /// Its unit of length, as `unit` is of the clips.
    pub rig_unit: Option<String>,
    /// Actions to use; all if empty.
    pub actions: Vec<String>,
    /// Styles to use; all if empty.
    pub styles: Vec<String>,
    /// Joints to keep, with the parent of each among them; all if empty.
    pub joints: Vec<String>,
    /// Rate of the database, frames a second.
    pub rate_hz: f64,
    /// Most clips of each action and style; 0 is no limit.
    pub limit: usize,
    /// How the database is built.
    pub build: BuildOptions,
    /// Whether a file that cannot be read or annotated ends the build.
    pub strict: bool,
}

impl Default for Config {
    fn default() -> Self {
        Config {
            data: None,
            patterns: Vec::new(),
            files: BTreeMap::new(),
            names: BTreeMap::new(),
            kind: BTreeMap::new(),
            licence: String::new(),
            unit: None,
            up: None,
            floor: None,
            floors: BTreeMap::new(),
            rig: None,
            rig_map: None,
            rig_unit: None,
            actions: Vec::new(),
            styles: Vec::new(),
            joints: Vec::new(),
            rate_hz: 30.0,
            limit: 0,
            build: BuildOptions::default(),
            strict: false,
        }
    }
}

/// An invalid configuration, or a file without labels.
#[derive(Debug, Clone, PartialEq, Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum AnnotateError {
    #[error("{file}: cannot be read: {error}")]
    Io { file: String, error: String },
    #[error("{file}: {error}")]
    Toml { file: String, error: String },
    #[error("{file}: pattern `{pattern}`: {problem}")]
    Pattern { file: String, pattern: String, problem: PatternError },
    #[error("{file}: `{key}` is {found}; expected {expected}")]
    Value { file: String, key: String, found: String, expected: String },
    #[error(
        "{file}: its name doesn't say action and style; add a pattern like \"{}\" to `patterns` in {FILE_NAME}, or the file \
         to the table `files`",
        example(.file)
    )]
    Unknown { file: String },
    #[error(
        "{file}: its {what} is called `{name}`, and `{found}` splits lists of names and paths: give it another name, by \
         `patterns`, `files` or `names` in {FILE_NAME}"
    )]
    Name { file: String, what: &'static str, name: String, found: char },
    #[error("{file}: {clip} is in `development` and in `test`: leave it in one of them")]
    Both { file: String, clip: String },
    #[error("`{key}`: no {what} is called `{name}`: there are {have}")]
    Absent { key: &'static str, what: &'static str, name: String, have: String },
}

impl Config {
    /// Reads a configuration; `file` is its name, for messages.
    pub fn parse(text: &str, file: &str) -> Result<Config, AnnotateError> {
        let file = || file.to_string();
        let config: Config = toml::from_str(text)
            .map_err(|e| AnnotateError::Toml { file: file(), error: e.to_string().trim_end().to_string() })?;
        for pattern in &config.patterns {
            Pattern::new(pattern).map_err(|problem| AnnotateError::Pattern {
                file: file(),
                pattern: pattern.clone(),
                problem,
            })?;
        }
        let value = |key: &str, found: String, expected: String| {
            Err(AnnotateError::Value { file: file(), key: key.to_owned(), found, expected })
        };
        if !RATES_HZ.contains(&config.rate_hz) {
            return value("rate_hz", config.rate_hz.to_string(), expected_rate());
        }
        if !(1..=8).contains(&config.build.window) {
            return value("build.window", config.build.window.to_string(), "1 to 8 frames".into());
        }
        if !BuildOptions::ERRORS_CM.contains(&config.build.error_cm) {
            let (least, most) = (BuildOptions::ERRORS_CM.start(), BuildOptions::ERRORS_CM.end());
            let expected = format!("centimetres from {least} to {most}");
            return value("build.error_cm", config.build.error_cm.to_string(), expected);
        }
        if !BuildOptions::FEATURES.contains(&config.build.features) {
            let (least, most) = (BuildOptions::FEATURES.start(), BuildOptions::FEATURES.end());
            let expected = format!("{least} to {most} components");
            return value("build.features", config.build.features.to_string(), expected);
        }
        if !matches!(config.build.block_rows, 1 | 2 | 4 | 8 | 16 | 32 | 64) {
            return value(
                "build.block_rows",
                config.build.block_rows.to_string(),
                "a power of two up to 64".into(),
            );
        }
        for (key, unit) in [("unit", &config.unit), ("rig_unit", &config.rig_unit)] {
            if let Some(unit) = unit.as_ref().filter(|u| u.parse::<Unit>().is_err()) {
                let expected = "m, cm, mm, inch, cmu, or metres a unit as a number above zero";
                return value(key, unit.clone(), expected.into());
            }
        }
        let floor = config.floor.iter().map(|metres| ("floor".to_owned(), metres));
        let floors = config.floors.iter().map(|(clip, metres)| (format!("floors.\"{clip}\""), metres));
        if let Some((key, metres)) = floor.chain(floors).find(|(_, metres)| !FLOORS_M.contains(*metres)) {
            return value(&key, metres.to_string(), expected_floor());
        }
        if let Some((found, _)) = config.files.iter().find(|(_, e)| e.action.is_empty() || e.style.is_empty())
        {
            return value("files", format!("without action or style for {found}"), "both, not empty".into());
        }
        Ok(config)
    }

    /// Reads a configuration file. Relative paths are relative to the file's folder, which is also the
    /// default of `data`.
    pub fn read(path: &Path) -> Result<Config, AnnotateError> {
        let file = path.display().to_string();
        let text = files::read_text(path, MAX_SETTINGS_BYTES)
            .map_err(|e| AnnotateError::Io { file: file.clone(), error: e.to_string() })?;
        let mut config = Config::parse(&text, &file)?;
        let folder = path.parent().unwrap_or(Path::new(""));
        for other in [&mut config.rig, &mut config.rig_map].into_iter().flatten() {
            *other = folder.join(&other);
        }
        config.data = Some(match config.data.take() {
            Some(data) => folder.join(data),
            None if folder.as_os_str().is_empty() => PathBuf::from("."),
            None => folder.to_path_buf(),
        });
        Ok(config)
    }

    /// The configuration of a data folder: its `gestus.toml`, or the defaults if it has none. Its clips are in the folder,
    /// whatever the file has as `data`.
    pub fn of_folder(folder: &Path) -> Result<Config, AnnotateError> {
        let path = folder.join(FILE_NAME);
        let config = if path.is_file() { Config::read(&path)? } else { Config::default() };
        Ok(Config { data: Some(folder.to_path_buf()), ..config })
    }

    /// The unit of length, if given.
    pub fn unit(&self) -> Option<Unit> {
        self.unit.as_deref().and_then(|unit| unit.parse().ok())
    }

    /// The character's unit of length, if given.
    pub fn rig_unit(&self) -> Option<Unit> {
        self.rig_unit.as_deref().and_then(|unit| unit.parse().ok())
    }

    /// The height of a file's floor, metres, if given.
    pub fn floor(&self, path: &Path) -> Option<f64> {
        let [whole, name] = file_names(path);
        self.floors.get(&whole).or_else(|| self.floors.get(&name)).copied().or(self.floor)
    }

    /// True if a file's action and style are selected.
    pub fn wants(&self, annotation: &Annotation) -> bool {
        let among = |list: &[String], name: &String| list.is_empty() || list.contains(name);
        among(&self.actions, &annotation.action) && among(&self.styles, &annotation.style)
    }

    /// Labels of a file, by its path below the data folder.
    pub fn annotate(&self, path: &Path) -> Result<Annotation, AnnotateError> {
        let [action, style, take] = self.labels(path)?;
        let annotation = self.annotation(action, style, take);
        for (what, name) in [("action", &annotation.action), ("style", &annotation.style)] {
            if let Some(found) = name.chars().find(|c| NOT_IN_NAMES.contains(c)) {
                let [file, _] = file_names(path);
                return Err(AnnotateError::Name { file, what, name: name.clone(), found });
            }
        }
        Ok(annotation)
    }

    /// Action and style of a file, if known. `folder` is that of the clips, or the file itself.
    pub fn class(&self, folder: &Path, path: &Path) -> Option<(String, String)> {
        let below = path.strip_prefix(folder).ok().filter(|below| !below.as_os_str().is_empty());
        let annotation = self.annotate(below.or(path.file_name().map(Path::new))?).ok()?;
        Some((annotation.action, annotation.style))
    }

    /// Refuses settings for actions, styles and files that do not exist, since a misspelt name would have no effect. `paths`
    /// are all files, below the data folder.
    ///
    /// # Errors
    /// [`AnnotateError::Absent`], with the known names.
    pub fn check_names(&self, paths: &[&Path]) -> Result<(), AnnotateError> {
        let labels: Vec<[String; 3]> = paths.iter().filter_map(|p| self.labels(p).ok()).collect();
        // Without any labelled file, the files' own errors are more helpful.
        if labels.is_empty() {
            return Ok(());
        }
        let found: Vec<Annotation> =
            labels.iter().map(|[a, s, t]| self.annotation(a.clone(), s.clone(), t.clone())).collect();
        let raw: BTreeSet<&str> = labels.iter().map(|[action, ..]| action.as_str()).collect();
        let actions: BTreeSet<&str> = found.iter().map(|a| a.action.as_str()).collect();
        let styles: BTreeSet<&str> = found.iter().map(|a| a.style.as_str()).collect();
        let files: Vec<[String; 2]> = paths.iter().map(|p| file_names(p)).collect();
        let files: BTreeSet<&str> = files.iter().flatten().map(String::as_str).collect();
        absent("actions", "action", self.actions.iter(), &actions)?;
        absent("styles", "style", self.styles.iter(), &styles)?;
        absent("kind", "action", self.kind.keys(), &actions)?;
        absent("names", "action, as the files have it,", self.names.keys(), &raw)?;
        absent("floors", "file", self.floors.keys(), &files)?;
        absent("files", "file", self.files.keys(), &files)
    }

    /// Action, style and take as the file has them.
    fn labels(&self, path: &Path) -> Result<[String; 3], AnnotateError> {
        let [whole, name] = file_names(path);
        if let Some(entry) = self.files.get(&whole).or_else(|| self.files.get(&name)) {
            let FileEntry { action, style, take } = entry.clone();
            return Ok([action, style, take]);
        }
        for text in &self.patterns {
            let Ok(pattern) = Pattern::new(text) else { continue };
            if let Some(found) = pattern.find(if text.contains('/') { &whole } else { &name }) {
                return Ok(found);
            }
        }
        built_in(&name).ok_or(AnnotateError::Unknown { file: whole })
    }

    fn annotation(&self, action: String, style: String, take: String) -> Annotation {
        let action = self.names.get(&action).cloned().unwrap_or(action);
        let kind = self.kind.get(&action).copied().unwrap_or_else(|| Kind::of_action(&action));
        Annotation { action, style, take, kind }
    }
}

/// The path below the data folder and the file's name, in the form of tables and patterns.
fn file_names(path: &Path) -> [String; 2] {
    let whole = path.to_string_lossy().replace('\\', "/");
    let name = whole.rsplit('/').next().unwrap_or_default().to_owned();
    [whole, name]
}

fn absent<'a>(
    key: &'static str,
    what: &'static str,
    mut names: impl Iterator<Item = &'a String>,
    have: &BTreeSet<&str>,
) -> Result<(), AnnotateError> {
    /// Most names that a message lists.
    const LISTED: usize = 40;
    match names.find(|name| !have.contains(name.as_str())) {
        Some(name) => {
            let mut list: Vec<&str> = have.iter().take(LISTED).copied().collect();
            list.extend((have.len() > LISTED).then_some("..."));
            Err(AnnotateError::Absent { key, what, name: name.clone(), have: list.join(", ") })
        }
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests;
