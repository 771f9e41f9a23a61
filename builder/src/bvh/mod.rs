//! BVH files, in and out.
//!
//! A [`Bvh`] keeps everything that a file says (joints, offsets, channels in their order, end sites, the numbers),
//! so that it can be written back as it was. [`Binding`] ties it to a [`Clip`](crate::motion::Clip): which of its
//! joints are the body's, and in which unit lengths are.
//!
//! Read: any root name; any channels on any joint, in any order; end sites; CRLF, BOM, tabs, blank lines; keywords
//! in any case. A translation channel *replaces* its joint's offset. Degrees. Errors say file, line, column, what
//! was expected, and what to do.

mod convert;
mod folder;
mod lexer;
mod parse;
mod write;

pub use convert::{BindError, Binding, Unit};
pub use folder::{Folder, read_folder};

use std::path::{Path, PathBuf};

use nalgebra::Vector3;
use thiserror::Error;

/// A channel of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channel {
    /// Translation along an axis (0 x, 1 y, 2 z).
    Position(usize),
    /// Rotation about an axis, degrees.
    Rotation(usize),
}

impl Channel {
    const NAMES: [(&'static str, Channel); 6] = [
        ("Xposition", Channel::Position(0)),
        ("Yposition", Channel::Position(1)),
        ("Zposition", Channel::Position(2)),
        ("Xrotation", Channel::Rotation(0)),
        ("Yrotation", Channel::Rotation(1)),
        ("Zrotation", Channel::Rotation(2)),
    ];

    fn named(name: &str) -> Option<Self> {
        Self::NAMES.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, c)| *c)
    }

    fn name(self) -> &'static str {
        Self::NAMES.iter().find(|(_, c)| *c == self).map_or("Xrotation", |(n, _)| n)
    }
}

/// A joint of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// Index of its parent; `None` for the root.
    pub parent: Option<usize>,
    /// Offset from its parent, file units.
    pub offset: Vector3<f64>,
    /// Its channels, in the file's order.
    pub channels: Vec<Channel>,
    /// Offset of its end site, where it has one.
    pub end_site: Option<Vector3<f64>>,
}

/// A BVH file.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    /// Joints in the file's order; parents come before their children.
    pub joints: Vec<Joint>,
    /// Seconds a frame.
    pub frame_time: f64,
    /// Numbers of all frames, one after another; [`channels`](Self::channels) a frame.
    pub values: Vec<f64>,
}

impl Bvh {
    /// Reads a file.
    ///
    /// # Errors
    /// [`BvhError`] for files that can't be read or are no BVH.
    pub fn read(path: &Path) -> Result<Self, BvhError> {
        let bytes = std::fs::read(path).map_err(|source| BvhError {
            file: path.to_owned(),
            place: None,
            problem: Problem::Io(source.to_string()),
        })?;
        Self::parse(&bytes, path)
    }

    /// Parses a file's bytes; `path` is only for the messages.
    ///
    /// # Errors
    /// [`BvhError`] says where, what was expected, and what to do.
    pub fn parse(bytes: &[u8], path: &Path) -> Result<Self, BvhError> {
        parse::parse(bytes).map_err(|(place, problem)| BvhError { file: path.to_owned(), place, problem })
    }

    /// Channels of all joints: numbers a frame.
    pub fn channels(&self) -> usize {
        self.joints.iter().map(|j| j.channels.len()).sum()
    }

    /// Number of frames.
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels().max(1)
    }

    /// The numbers of a frame.
    pub fn frame(&self, index: usize) -> &[f64] {
        let channels = self.channels();
        &self.values[index * channels..(index + 1) * channels]
    }
}

/// Line and column, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
}

/// A file that is no BVH, or not one that can be used.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}{}: {problem}", file.display(), place.map_or(String::new(), |p| format!(":{}:{}", p.line, p.column)))]
pub struct BvhError {
    /// The file.
    pub file: PathBuf,
    /// Where in the file.
    pub place: Option<Place>,
    /// What is wrong and what to do.
    pub problem: Problem,
}

/// What can be wrong with a file.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Problem {
    /// It can't be read.
    #[error("the file can't be read: {0}")]
    Io(String),
    /// It is not text.
    #[error("the file is not text (UTF-8): is it really a BVH?")]
    NotText,
    /// A word other than the expected one.
    #[error("expected {expected}, found {found}")]
    Expected {
        /// What should be there.
        expected: String,
        /// What is there.
        found: String,
    },
    /// Something that is no number.
    #[error("expected a number, found `{found}`{hint}")]
    Number {
        /// What is there.
        found: String,
        /// What to do, where that is known.
        hint: &'static str,
    },
    /// A channel that does not exist.
    #[error("`{0}` is no channel: use Xposition, Yposition, Zposition, Xrotation, Yrotation or Zrotation")]
    Channel(String),
    /// A channel named twice.
    #[error("joint `{joint}` has the channel {channel} twice: remove one")]
    ChannelTwice {
        /// The joint.
        joint: String,
        /// The channel.
        channel: &'static str,
    },
    /// A number of channels that no joint has.
    #[error("a joint has 0 to 6 channels, not {0}")]
    ChannelCount(String),
    /// Two joints of one name.
    #[error("the joint name `{0}` is used twice: rename one of the joints")]
    JointTwice(String),
    /// Joints within joints without end.
    #[error("joints are nested more than {0} deep: is a closing brace missing?")]
    Depth(usize),
    /// More joints than anyone has.
    #[error("more than {0} joints")]
    Joints(usize),
    /// A hierarchy in which nothing moves.
    #[error("no joint has a channel: nothing can move")]
    NoChannels,
    /// No frames.
    #[error("the file has no frames: export it again with its motion")]
    NoFrames,
    /// No time between frames.
    #[error(
        "the frame time is {0}: it has to be seconds a frame, above zero (0.0333333 for 30 frames a second)"
    )]
    FrameTime(String),
    /// A frame that is too short or too long.
    #[error(
        "frame {frame} has {found} values, the hierarchy has {channels} channels: the line is cut, or joints are missing above"
    )]
    Values {
        /// The frame, from 1.
        frame: usize,
        /// Values found.
        found: usize,
        /// Values needed.
        channels: usize,
    },
    /// The number of frames in the header is not what follows.
    #[error(
        "the file says {stated} frames and holds {found}: correct the line `Frames:`, or export it again"
    )]
    FrameCount {
        /// Frames stated.
        stated: u64,
        /// Frames found.
        found: usize,
    },
    /// A second hierarchy.
    #[error("a second ROOT: only one skeleton a file can be read; split the file")]
    SecondRoot,
}
