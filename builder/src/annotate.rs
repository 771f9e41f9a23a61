//! What each file is: its action, style and take, by its name or by a table; and what a folder says about itself.
//!
//! A folder may hold a `gestus.toml`:
//!
//! ```toml
//! licence = "CC BY-NC 4.0, Bandai Namco Research"
//! unit = "cm"                                     # m, dm, cm, mm, in, cmu; guessed where it is left out
//! patterns = ["dataset-2_{action}_{style}_{take}"]  # of file names without .bvh; {*} is anything
//! gaits = ["walk", "run"]                         # actions made of gait cycles; by their names where left out
//!
//! [[clips]]                                       # files whose names say nothing
//! file = "0007_take3.bvh"
//! action = "walk"
//! style = "old"
//! ```

use std::{collections::BTreeMap, path::Path};

use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Name of the file that describes a folder.
pub const FILE: &str = "gestus.toml";

/// Patterns that are tried where a folder names none.
const PATTERNS: [&str; 3] =
    ["dataset-{*}_{action}_{style}_{take}", "{action}_{style}_{take}", "{action}_{style}"];

/// Words in the names of actions that are made of gait cycles.
const GAIT_WORDS: [&str; 8] = ["walk", "run", "jog", "march", "turn", "sprint", "stroll", "gait"];

/// How an action is given a canonical timeline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Cut into gait cycles.
    Gait,
    /// Each clip is one performance, registered as a whole.
    Whole,
}

/// What a file is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Annotation {
    /// Its action.
    pub action: String,
    /// Its style.
    pub style: String,
}

/// What a folder says about itself: the file `gestus.toml`.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Annotations {
    /// Licence or source of the clips.
    pub licence: String,
    /// Unit of lengths.
    pub unit: Option<String>,
    /// Patterns of file names.
    pub patterns: Vec<String>,
    /// Actions made of gait cycles.
    pub gaits: Option<Vec<String>>,
    /// Files by name.
    pub clips: Vec<Entry>,
}

/// A file of the table.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// File name.
    pub file: String,
    /// Its action.
    pub action: String,
    /// Its style.
    pub style: String,
}

/// A description that can't be used.
#[derive(Debug, Error)]
pub enum AnnotateError {
    /// The file can't be read.
    #[error("{0}: {1}")]
    Io(String, std::io::Error),
    /// The file is no TOML, or has fields that don't exist.
    #[error("{0}: {1}")]
    Toml(String, toml::de::Error),
    /// A pattern without what it is for.
    #[error(
        "pattern `{0}` has to hold {{action}} and {{style}} once each, and separators between placeholders"
    )]
    Pattern(String),
    /// An unknown unit.
    #[error("unit `{0}` is not known: use m, dm, cm, mm, in or cmu")]
    Unit(String),
}

impl Annotations {
    /// Reads the description of a folder; the default where there is none.
    ///
    /// # Errors
    /// [`AnnotateError`] where it is there and wrong.
    pub fn of_folder(folder: &Path) -> Result<Self, AnnotateError> {
        let path = folder.join(FILE);
        if !path.exists() {
            return Ok(Self::default());
        }
        let name = path.display().to_string();
        let text = std::fs::read_to_string(&path).map_err(|e| AnnotateError::Io(name.clone(), e))?;
        let annotations: Self = toml::from_str(&text).map_err(|e| AnnotateError::Toml(name, e))?;
        annotations.check()?;
        Ok(annotations)
    }

    fn check(&self) -> Result<(), AnnotateError> {
        for pattern in &self.patterns {
            let pieces = pieces(pattern);
            let once = |name: &str| pieces.iter().filter(|p| **p == Piece::Field(name.into())).count() == 1;
            let apart = pieces.windows(2).all(|w| !w.iter().all(|p| matches!(p, Piece::Field(_))));
            if !once("action") || !once("style") || !apart {
                return Err(AnnotateError::Pattern(pattern.clone()));
            }
        }
        match &self.unit {
            Some(unit) if crate::bvh::Unit::named(unit).is_none() => Err(AnnotateError::Unit(unit.clone())),
            _ => Ok(()),
        }
    }

    /// What a file is; `None` where neither table nor patterns know.
    pub fn of_file(&self, path: &Path) -> Option<Annotation> {
        let name = path.file_name()?.to_str()?;
        if let Some(entry) = self.clips.iter().find(|e| e.file == name) {
            return Some(Annotation { action: entry.action.clone(), style: entry.style.clone() });
        }
        let stem = path.file_stem()?.to_str()?;
        let own = self.patterns.iter().map(String::as_str);
        let default = PATTERNS.iter().copied().filter(|_| self.patterns.is_empty());
        own.chain(default).find_map(|pattern| {
            let fields = matched(&pieces(pattern), stem)?;
            Some(Annotation { action: fields.get("action")?.clone(), style: fields.get("style")?.clone() })
        })
    }

    /// How an action gets its timeline.
    pub fn kind(&self, action: &str) -> Kind {
        let gait = match &self.gaits {
            Some(gaits) => gaits.iter().any(|g| g == action),
            None => kind_by_name(action) == Kind::Gait,
        };
        if gait { Kind::Gait } else { Kind::Whole }
    }
}

/// How an action gets its timeline, by its name alone.
pub fn kind_by_name(action: &str) -> Kind {
    if GAIT_WORDS.iter().any(|w| action.contains(w)) { Kind::Gait } else { Kind::Whole }
}

#[derive(Debug, PartialEq)]
enum Piece {
    Text(String),
    Field(String),
}

fn pieces(pattern: &str) -> Vec<Piece> {
    let mut pieces = Vec::new();
    let mut rest = pattern;
    while let Some((before, after)) = rest.split_once('{') {
        let Some((field, after)) = after.split_once('}') else { break };
        if !before.is_empty() {
            pieces.push(Piece::Text(before.into()));
        }
        pieces.push(Piece::Field(field.into()));
        rest = after;
    }
    if !rest.is_empty() {
        pieces.push(Piece::Text(rest.into()));
    }
    pieces
}

/// The fields of a name: each takes as little as it can, the last one the rest.
fn matched(pieces: &[Piece], name: &str) -> Option<BTreeMap<String, String>> {
    let mut fields = BTreeMap::new();
    let mut rest = name;
    for (i, piece) in pieces.iter().enumerate() {
        match piece {
            Piece::Text(text) => rest = rest.strip_prefix(text.as_str())?,
            Piece::Field(field) => {
                let end = match pieces.get(i + 1) {
                    Some(Piece::Text(next)) => rest.find(next.as_str())?,
                    _ => rest.len(),
                };
                if end == 0 {
                    return None;
                }
                fields.insert(field.clone(), rest[..end].to_owned());
                rest = &rest[end..];
            }
        }
    }
    rest.is_empty().then_some(fields)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(name: &str) -> Option<(String, String)> {
        Annotations::default().of_file(Path::new(name)).map(|a| (a.action, a.style))
    }

    #[test]
    fn names_say_action_and_style() {
        let expect = |a: &str, s: &str| Some((a.to_owned(), s.to_owned()));
        assert_eq!(of("x/dataset-2_walk-turn-left_active_001.bvh"), expect("walk-turn-left", "active"));
        assert_eq!(of("walk_proud_7.bvh"), expect("walk", "proud"));
        assert_eq!(of("kick_old.bvh"), expect("kick", "old"));
        assert_eq!(of("walk.bvh"), None);
    }

    #[test]
    fn a_table_goes_before_patterns_and_patterns_before_defaults() {
        let text = "patterns = [\"{style}-{action}-{*}\"]\n[[clips]]\nfile = \"a-b-c.bvh\"\naction = \"x\"\nstyle = \"y\"";
        let annotations: Annotations = toml::from_str(text).unwrap();
        annotations.check().unwrap();
        let of = |name| annotations.of_file(Path::new(name)).map(|a| (a.action, a.style));
        assert_eq!(of("a-b-c.bvh"), Some(("x".into(), "y".into())));
        assert_eq!(of("old-run-3.bvh"), Some(("run".into(), "old".into())));
        assert_eq!(of("walk_proud_7.bvh"), None);
    }

    #[test]
    fn mistakes_are_named() {
        let wrong = Annotations { patterns: vec!["{action}{style}".into()], ..Annotations::default() };
        assert!(wrong.check().unwrap_err().to_string().contains("{action}{style}"));
        assert!(
            toml::from_str::<Annotations>("license = \"x\"").unwrap_err().to_string().contains("licence")
        );
    }
}
