//! The map file, in TOML: corrections to the identification by names and shape.
//!
//! ```toml
//! floor = -0.72                  # height of the floor in the clip, metres; found from the motion if left out
//! up = "z"                       # the incoming world's up: x, y, z, -x, -y, -z; found from the motion if left out
//! rest = "zero"                  # "zero": with all rotations zero the body stands upright; "motion": it does not
//! [joints]
//! left-upper-arm = "Arm01"       # part = joint; an empty name says that there is none
//! right-toes = ""
//! ```

use std::{collections::BTreeMap, ops::RangeInclusive, path::Path};

use serde::{Deserialize, Deserializer, de::Error as _};
use thiserror::Error;

use crate::retarget::{axis, parts::Part};
use gestus_motion::{
    capture::Document,
    files::{self, FileError, MAX_SETTINGS_BYTES},
};

/// Heights of a floor that can be given, metres: as far as a clip can be from its origin.
pub const FLOORS_M: RangeInclusive<f64> = -1e7..=1e7;

/// Refuses a floor that is too far away.
///
/// # Errors
/// [`FloorError`].
pub fn check_floor(metres: f64) -> Result<f64, FloorError> {
    if FLOORS_M.contains(&metres) { Ok(metres) } else { Err(FloorError { metres }) }
}

/// A floor that is too far away.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("floor {metres}: {}", expected_floor())]
pub struct FloorError {
    /// Its height, metres.
    pub metres: f64,
}

/// [`FLOORS_M`] in words, for messages.
pub fn expected_floor() -> String {
    format!("metres from {} to {}", FLOORS_M.start(), FLOORS_M.end())
}

/// The file's content, checked for its words.
#[derive(Debug, Clone, Default)]
pub struct MapFile {
    /// Joint of each part that the file names; `None`: the body has none.
    pub joints: BTreeMap<Part, Option<String>>,
    /// Height of the floor along the clip's up, metres.
    pub floor_m: Option<f64>,
    /// Up in the incoming world: axis 0 to 2 and sign.
    pub up: Option<(usize, f64)>,
    /// Whether the clip's format has Y up.
    pub has_y_up: bool,
    /// Whether zero rotations are an upright body.
    pub upright: Option<bool>,
}

/// A file that can't be used.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MapFileError {
    #[error("{file} can't be read: {error}")]
    Read { file: String, error: FileError },
    #[error("{file}: {error}")]
    Toml { file: String, error: Box<toml::de::Error> },
    #[error("{file}: `{word}` is not a body part; the parts are {parts}")]
    Part { file: String, word: String, parts: String },
    #[error("{file}: {word} = \"\": every body has this part: name its joint, or leave the line out")]
    Needed { file: String, word: String },
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Raw {
    #[serde(default, deserialize_with = "floor")]
    floor: Option<f64>,
    #[serde(default, deserialize_with = "axis::deserialize")]
    up: Option<(usize, f64)>,
    rest: Option<Rest>,
    #[serde(default)]
    joints: BTreeMap<String, String>,
}

/// What zero rotations are.
#[derive(Deserialize)]
#[serde(rename_all = "lowercase")]
enum Rest {
    /// An upright body.
    Zero,
    /// Any pose: the motion shows the axes.
    Motion,
}

/// Reads the height of a floor; the reader names the line.
fn floor<'d, D: Deserializer<'d>>(from: D) -> Result<Option<f64>, D::Error> {
    check_floor(f64::deserialize(from)?).map(Some).map_err(D::Error::custom)
}

impl MapFile {
    /// Reads a file.
    ///
    /// # Errors
    /// [`MapFileError`] names the file and what is wrong in it.
    pub fn read(path: &Path) -> Result<Self, MapFileError> {
        let file = path.display().to_string();
        let text = files::read_text(path, MAX_SETTINGS_BYTES)
            .map_err(|error| MapFileError::Read { file: file.clone(), error })?;
        Self::parse(&text, &file)
    }

    /// The same with what the document's format says: glTF has Y up, a BVH file leaves it to its body.
    pub fn of_document(&self, document: &Document) -> Self {
        Self { has_y_up: document.has_y_up(), ..self.clone() }
    }

    /// The joint that is stated to be the hips.
    pub fn hips(&self) -> Option<&String> {
        self.joints.get(&Part::Hips).and_then(Option::as_ref)
    }

    /// Reads a text; `file` is for messages.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn parse(text: &str, file: &str) -> Result<Self, MapFileError> {
        let file = file.to_owned();
        let raw: Raw = toml::from_str(text)
            .map_err(|error| MapFileError::Toml { file: file.clone(), error: Box::new(error) })?;
        let mut joints = BTreeMap::new();
        for (word, joint) in raw.joints {
            let Some(part) = Part::named(&word) else {
                let parts = Part::all().iter().map(ToString::to_string).collect::<Vec<_>>().join(", ");
                return Err(MapFileError::Part { file, word, parts });
            };
            if joint.is_empty() && !part.optional() {
                return Err(MapFileError::Needed { file, word });
            }
            joints.insert(part, Some(joint).filter(|j| !j.is_empty()));
        }
        let upright = raw.rest.map(|rest| matches!(rest, Rest::Zero));
        Ok(Self { joints, floor_m: raw.floor, up: raw.up, upright, has_y_up: false })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::parts::Side;

    #[test]
    fn parts_axes_and_rest_are_read() {
        let file = MapFile::parse(
            "floor = -0.72\nup = \"-z\"\nrest = \"motion\"\n[joints]\nleft-upper-arm = \"Arm01\"\nright_toes = \"\"\n",
            "m.toml",
        )
        .unwrap();
        assert_eq!(file.joints[&Part::UpperArm(Side::Left)].as_deref(), Some("Arm01"));
        assert_eq!(file.joints[&Part::Toes(Side::Right)], None);
        assert_eq!((file.up, file.upright, file.floor_m), (Some((2, -1.0)), Some(false), Some(-0.72)));
    }

    #[test]
    fn what_is_wrong_is_named_with_its_file() {
        for (text, words) in [
            ("[joints]\ntail = \"x\"", vec!["m.toml", "tail", "left-foot"]),
            ("\nup = \"north\"", vec!["m.toml", "line 2", "north", "-z"]),
            ("rest = \"bed\"", vec!["m.toml", "line 1", "bed", "motion"]),
            ("[joints]\nhips = \"\"", vec!["m.toml", "hips", "every body"]),
            ("turn = 3", vec!["m.toml", "turn"]),
            ("\n\nfloor = nan", vec!["m.toml", "line 3", "NaN", "10000000"]),
            ("[joints\n", vec!["m.toml"]),
        ] {
            let message = MapFile::parse(text, "m.toml").unwrap_err().to_string();
            for word in words {
                assert!(message.contains(word), "{message}");
            }
        }
    }
}
