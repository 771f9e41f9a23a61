//! Which clips constants are chosen on, and which clips published figures are measured on.
//!
//! A file with two lists of patterns of file names, as in [`super::config`]; no clip may be in both:
//!
//! ```
//! use gestus_database::data_folder::split::{Set, Split};
//! let text = r#"
//!     development = ["{action}_{style}_1"]
//!     test = ["{action}_{style}_2"]
//! "#;
//! let split = Split::parse(text, "split.toml")?;
//! assert_eq!(split.set_of("walk_proud_2.bvh")?, Some(Set::Test));
//! assert_eq!(split.set_of("walk_proud_3.bvh")?, None);
//! # Ok::<(), gestus_database::data_folder::config::AnnotateError>(())
//! ```

use std::path::Path;

use gestus_motion::files::{self, MAX_SETTINGS_BYTES};
use serde::Deserialize;

use super::{config::AnnotateError, pattern::Pattern};

/// A set of clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "command-line", derive(clap::ValueEnum))]
pub enum Set {
    /// Clips on which constants are chosen.
    Development,
    /// Clips of which figures are published.
    Test,
}

/// Both sets.
#[derive(Debug, Clone)]
pub struct Split {
    file: String,
    development: Vec<Pattern>,
    test: Vec<Pattern>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Lists {
    development: Vec<String>,
    test: Vec<String>,
}

impl Split {
    /// Reads a file.
    ///
    /// # Errors
    /// [`AnnotateError`], with the file's name.
    pub fn read(path: &Path) -> Result<Self, AnnotateError> {
        let file = path.display().to_string();
        let text = files::read_text(path, MAX_SETTINGS_BYTES)
            .map_err(|e| AnnotateError::Io { file: file.clone(), error: e.to_string() })?;
        Self::parse(&text, &file)
    }

    /// Reads a text; `file` is its name, for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, file: &str) -> Result<Self, AnnotateError> {
        let Lists { development, test } = toml::from_str(text).map_err(|e| AnnotateError::Toml {
            file: file.to_owned(),
            error: e.to_string().trim_end().to_owned(),
        })?;
        let patterns = |list: Vec<String>| {
            let pattern = |pattern: String| {
                Pattern::new(&pattern).map_err(|problem| AnnotateError::Pattern {
                    file: file.to_owned(),
                    pattern,
                    problem,
                })
            };
            list.into_iter().map(pattern).collect::<Result<Vec<_>, _>>()
        };
        Ok(Self { file: file.to_owned(), development: patterns(development)?, test: patterns(test)? })
    }

    /// The set of a clip, by its name; `None` of one in neither list.
    ///
    /// # Errors
    /// [`AnnotateError::Both`].
    pub fn set_of(&self, name: &str) -> Result<Option<Set>, AnnotateError> {
        let among = |patterns: &[Pattern]| patterns.iter().any(|p| p.find(name).is_some());
        match (among(&self.development), among(&self.test)) {
            (true, true) => Err(AnnotateError::Both { file: self.file.clone(), clip: name.to_owned() }),
            (true, false) => Ok(Some(Set::Development)),
            (false, true) => Ok(Some(Set::Test)),
            (false, false) => Ok(None),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odd_files_are_refused() {
        let parse = |text: &str| Split::parse(text, "s.toml");
        let missing = parse("test = []").unwrap_err();
        assert!(matches!(missing, AnnotateError::Toml { .. }), "{missing}");
        let odd = parse("development = [\"walk\"]\ntest = []").unwrap_err();
        assert!(matches!(odd, AnnotateError::Pattern { ref pattern, .. } if pattern == "walk"), "{odd}");
        let both =
            parse("development = [\"{action}_{style}_{*}\"]\ntest = [\"{action}_{style}_2\"]").unwrap();
        let error = both.set_of("walk_proud_2").unwrap_err();
        assert!(matches!(error, AnnotateError::Both { ref clip, .. } if clip == "walk_proud_2"), "{error}");
        assert_eq!(both.set_of("walk_proud_1"), Ok(Some(Set::Development)));
    }

    #[test]
    fn the_shipped_split_names_every_take_once() {
        let split =
            Split::parse(include_str!("../../../../docs/splits/bandai-namco-2.toml"), "shipped").unwrap();
        for (take, set) in
            [("001", Set::Development), ("003", Set::Development), ("004", Set::Test), ("007", Set::Test)]
        {
            let name = format!("dataset-2_walk-turn-left_normal_{take}");
            assert_eq!(split.set_of(&name), Ok(Some(set)), "{name}");
        }
    }
}
