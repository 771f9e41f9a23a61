//! The errors of the core: `Copy`, and without strings of their own.

use core::fmt;

use serde::{Deserialize, Serialize};

/// Why a blob was refused by [`Database::open`](crate::Database::open).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum BlobError {
    /// Fewer bytes than a header has, or fewer or more than the header says.
    Truncated {
        /// Bytes needed.
        need: u32,
        /// Bytes there.
        have: u32,
    },
    /// The first bytes are not a Gestus blob's.
    Magic,
    /// Written in another version of the format.
    Version {
        /// The version that this core reads.
        need: u16,
        /// The version found.
        have: u16,
    },
    /// A checksum does not agree: the bytes were changed after writing. Section 0 is the header.
    Checksum {
        /// Section whose bytes disagree.
        section: u16,
    },
    /// A section is missing, doubled, misplaced or not aligned.
    Section {
        /// The section.
        section: u16,
    },
    /// A section's length does not follow from the header's counts.
    Length {
        /// The section.
        section: u16,
        /// Bytes needed.
        need: u32,
        /// Bytes there.
        have: u32,
    },
    /// A number in the section is out of its range, not finite, or refers to something that is not there.
    Value {
        /// The section.
        section: u16,
        /// Index of the record in the section.
        record: u32,
    },
    /// A reserved byte is not zero.
    Reserved {
        /// The section; 0 is the header.
        section: u16,
    },
    /// The manifest can't be decoded.
    Manifest,
}

impl fmt::Display for BlobError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Truncated { need, have } => {
                let advice = match have > need {
                    true => "leave out the bytes after its end",
                    false => "copy it again, whole",
                };
                write!(f, "the blob has {have} bytes and needs {need}: {advice}")
            }
            Self::Magic => f.write_str(
                "this is not a Gestus blob, or not the place where one begins: build one with `gestus build`",
            ),
            Self::Version { need, have } => {
                write!(
                    f,
                    "the blob is of format version {have}, this core reads {need}: build it again with the builder of this version"
                )
            }
            Self::Checksum { section } => {
                write!(
                    f,
                    "the checksum of {} does not agree: the blob was damaged, copy it again",
                    Name(section)
                )
            }
            Self::Section { section } => {
                write!(f, "{} is missing, doubled or misplaced: build the blob again", Name(section))
            }
            Self::Length { section, need, have } => {
                write!(f, "{} has {have} bytes and needs {need}: build the blob again", Name(section))
            }
            Self::Value { section, record } => {
                write!(f, "record {record} of {} is out of range: build the blob again", Name(section))
            }
            Self::Reserved { section } => {
                write!(
                    f,
                    "a reserved byte of {} is not zero: the blob is newer than this core or damaged, build it again with the builder of this version",
                    Name(section)
                )
            }
            Self::Manifest => f.write_str("the manifest can't be decoded: build the blob again"),
        }
    }
}

impl core::error::Error for BlobError {}

struct Name(u16);

impl fmt::Display for Name {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            0 => f.write_str("the header"),
            id => match crate::blob::layout::section::name(id) {
                Some(name) => write!(f, "section `{name}`"),
                None => write!(f, "section {id}"),
            },
        }
    }
}

/// A count as errors and messages have it: the greatest number where it is greater.
pub(crate) fn saturating_u16(count: usize) -> u16 {
    u16::try_from(count).unwrap_or(u16::MAX)
}

/// The same for lengths and counts that are held as 32 bits.
pub(crate) fn saturating_u32(count: usize) -> u32 {
    u32::try_from(count).unwrap_or(u32::MAX)
}

/// Why a stylizer refused a database or a setting. The setting before stays in force.
///
/// It travels over the [`link`](crate::link): new variants go to the end.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum ConfigError {
    /// The database has more joints than the stylizer's `J`.
    Joints {
        /// Joints in the database.
        need: u16,
        /// The stylizer's capacity.
        have: u16,
    },
    /// The database has more classes than the stylizer's `C`.
    Classes {
        /// Classes in the database.
        need: u16,
        /// The stylizer's capacity.
        have: u16,
    },
    /// `k` is zero or larger than the stylizer's `K`.
    Neighbors {
        /// Neighbors asked for.
        need: u16,
        /// The stylizer's capacity.
        have: u16,
    },
    /// There is no style, action, joint group or parameter of that number.
    Unknown {
        /// The number asked for.
        id: u16,
        /// How many there are.
        have: u16,
    },
    /// The bounds of a retimer need more poses than its `N`.
    Poses {
        /// Poses that the bounds need.
        need: u16,
        /// The retimer's capacity.
        have: u16,
    },
    /// No class has the labelled action in the labelled style.
    NoClass,
    /// A weight is negative or not finite, or all are zero; or a joint group is given more than three styles.
    Weights,
    /// An argument is out of its range or not finite, or a mask leaves nothing to search.
    OutOfRange,
    /// The database has no effort dial.
    NoDial,
    /// The robot has more hinges than the drive's `H`.
    Hinges {
        /// Hinges of the robot.
        need: u16,
        /// The drive's capacity.
        have: u16,
    },
    /// The database lacks the data of the method (frames, linear models, statistics or phase tables), or the core was
    /// built without the method: see [`Method::is_built`](crate::Method::is_built).
    Method,
    /// A joint group can't have a style of its own with linear models, which have one state and one time step for the
    /// whole body.
    WholeBody,
    /// A robot or a map was made for another database.
    OtherDatabase,
    /// A parameter is out of its range or not finite.
    Parameter {
        /// Its number in [`parameters::TABLE`](crate::config::parameters::TABLE).
        number: u16,
    },
}

impl core::error::Error for ConfigError {}

#[cfg(test)]
mod tests {
    use super::*;

    /// A slice of all the flash behind a blob's address was called cut, and to be copied again.
    #[test]
    fn a_blob_that_is_too_long_is_not_called_cut() {
        let advice = |need, have| {
            BlobError::Truncated { need, have }.to_string().rsplit_once(':').map(|s| s.1.to_owned())
        };
        assert_eq!(advice(64, 10), advice(64, 63));
        assert_ne!(advice(64, 10), advice(64, 65));
    }
}
