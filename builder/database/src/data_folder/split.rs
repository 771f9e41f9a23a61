//! Which clips constants are chosen on, and which clips published figures are measured on.
//!
//! A file with two lists of file names, or patterns of them as in [`super::config`]; no clip may be in both:
//!
//! ```
//! use gestus_database::data_folder::split::{Set, Split};
//! let text = r#"
//!     development = ["{action}_{style}_1"]
//!     test = ["{action}_{style}_2", "run_proud_7"]
//! "#;
//! let split = Split::parse(text, "split.toml")?;
//! assert_eq!(split.set_of("walk_proud_2.bvh")?, Some(Set::Test));
//! assert_eq!(split.set_of("run_proud_7.bvh")?, Some(Set::Test));
//! assert_eq!(split.set_of("walk_proud_3.bvh")?, None);
//! # Ok::<(), gestus_database::data_folder::config::AnnotateError>(())
//! ```

use std::path::Path;

use gestus_motion::files::{self, MAX_SETTINGS_BYTES};
use serde::Deserialize;

use super::{
    config::AnnotateError,
    pattern::{Pattern, PatternError, stem},
};

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
    development: Vec<Clips>,
    test: Vec<Clips>,
}

/// Clips of a set.
#[derive(Debug, Clone)]
enum Clips {
    /// One, by its name.
    Named(String),
    /// Those whose names are like it.
    Like(Pattern),
}

impl Clips {
    fn new(text: String) -> Result<Self, (String, PatternError)> {
        if text.contains(['{', '}']) {
            return Pattern::new(&text).map(Self::Like).map_err(|problem| (text, problem));
        }
        Ok(Self::Named(stem(&text).to_owned()))
    }

    fn have(&self, name: &str) -> bool {
        match self {
            Self::Named(own) => own == stem(name),
            Self::Like(pattern) => pattern.find(name).is_some(),
        }
    }
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
        let clips = |list: Vec<String>| {
            let odd = |(pattern, problem)| AnnotateError::Pattern { file: file.to_owned(), pattern, problem };
            list.into_iter().map(|text| Clips::new(text).map_err(odd)).collect::<Result<Vec<_>, _>>()
        };
        Ok(Self { file: file.to_owned(), development: clips(development)?, test: clips(test)? })
    }

    /// The set of a clip, by its name; `None` of one in neither list.
    ///
    /// # Errors
    /// [`AnnotateError::Both`].
    pub fn set_of(&self, name: &str) -> Result<Option<Set>, AnnotateError> {
        let among = |set: &[Clips]| set.iter().any(|clips| clips.have(name));
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
        let odd = parse("development = [\"{action}\"]\ntest = []").unwrap_err();
        assert!(matches!(odd, AnnotateError::Pattern { ref pattern, .. } if pattern == "{action}"), "{odd}");
        let both =
            parse("development = [\"{action}_{style}_{*}\"]\ntest = [\"{action}_{style}_2\"]").unwrap();
        let error = both.set_of("walk_proud_2").unwrap_err();
        assert!(matches!(error, AnnotateError::Both { ref clip, .. } if clip == "walk_proud_2"), "{error}");
        assert_eq!(both.set_of("walk_proud_1"), Ok(Some(Set::Development)));
        let named = parse("development = [\"walk one.bvh\"]\ntest = [\"b/run\"]").unwrap();
        assert_eq!(named.set_of("walk one"), Ok(Some(Set::Development)));
        assert_eq!(named.set_of("b/run.glb"), Ok(Some(Set::Test)));
        assert_eq!(named.set_of("run"), Ok(None));
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
