//! BVH, the text format of motion capture: read it, turn it into a [`Clip`](crate::clip::Clip), write it back.
//!
//! A BVH file has two parts. `HIERARCHY` is a tree of joints, each with an `OFFSET` from its parent and an ordered
//! list of `CHANNELS`; leaves may end in an `End Site`, a length without a rotation. `MOTION` is a table: one line
//! a frame, one number a channel, in the order in which the channels were declared. A joint's local rotation is
//! the product of its rotation channels *in their order*,
//!
//! ```text
//! CHANNELS 3 Zrotation Xrotation Yrotation   =>   R = Rz(a) Rx(b) Ry(c),  degrees
//! ```
//!
//! and a position channel *replaces* that component of the joint's `OFFSET`; it is not added to it. The order
//! differs from file to file, and may differ from joint to joint.
//!
//! A clip goes through the modules in this order:
//!
//! 1. [`Bvh::parse`] (`lexer`, `parse`): bytes to a document that keeps all that is needed to write the file again.
//!    It is iterative, never trusts a count in the file, and says line and column of what is wrong.
//! 2. [`Unit`] (`unit`): metres a file unit, given or guessed from the body's height.
//! 3. [`Binding`] (`convert`): document to skeleton and clip, and a clip back onto the document's channels. Static
//!    joints above the hips (`joint_Root` of Bandai-Namco) are applied and dropped; they come back on writing.
//! 4. [`Bvh::to_text`] (`write`): the document as text. Numbers are printed shortest-exact, so that reading what
//!    was written gives the same `f64`s.
//!
//! [`capture`](crate::capture) does the first step for files, and for folders of them.
//!
//! ```
//! use gestus_motion::formats::bvh::{Binding, Bvh, Options};
//! let text = "HIERARCHY ROOT Hips { OFFSET 0 90 0 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation
//!   Yrotation JOINT Foot { OFFSET 0 -85 0 CHANNELS 3 Zrotation Xrotation Yrotation End Site { OFFSET 0 -5 20 } } }
//!   MOTION
//!   Frames: 1
//!   Frame Time: 0.0333333
//!   0 91 0 0 0 0 10 0 0";
//! let document = Bvh::parse(text.as_bytes(), "step.bvh")?;
//! let binding = Binding::new(&document, &Options::default())?;
//! let clip = binding.to_clip(&document)?;
//! assert!((clip.frames[0].root.y - 0.91).abs() < 1e-12);
//! let written = binding.write(&document, &clip)?;
//! assert_eq!(written.values(), document.values());
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod convert;
mod error;
mod lexer;
mod parse;
mod unit;
mod write;

pub use convert::{Binding, ConvertError, Options, same_skeleton, to_clip};
pub(crate) use convert::{NOT_IN_NAMES, Rigged};
pub use error::{BvhError, BvhErrorKind};
pub use parse::MAX_DEPTH;
pub use unit::{ParseUnitError, Unit, UnitGuess};

/// One column of the motion table: where a joint is in its parent's frame, or a turn about one of its axes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Translation along an axis (0 X, 1 Y, 2 Z), in file units; replaces that component of the `OFFSET`.
    Position(usize),
    /// Rotation about an axis (0 X, 1 Y, 2 Z), degrees.
    Rotation(usize),
}

impl Channel {
    /// All six, in the order X, Y, Z, positions first.
    pub const ALL: [Channel; 6] = [
        Channel::Position(0),
        Channel::Position(1),
        Channel::Position(2),
        Channel::Rotation(0),
        Channel::Rotation(1),
        Channel::Rotation(2),
    ];

    /// The word that stands for it in a file.
    pub fn word(self) -> &'static str {
        match self {
            Channel::Position(axis) => ["Xposition", "Yposition", "Zposition"][axis],
            Channel::Rotation(axis) => ["Xrotation", "Yrotation", "Zrotation"][axis],
        }
    }

    /// The channel of that word, in any case.
    pub fn from_word(word: &str) -> Option<Channel> {
        Channel::ALL.into_iter().find(|c| c.word().eq_ignore_ascii_case(word))
    }
}

/// A joint as the file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name, unique in the document; it may hold spaces.
    pub name: String,
    /// Index of the joint that it hangs on; `None` for the first alone.
    pub parent: Option<usize>,
    /// `OFFSET`, in the parent's frame, file units.
    pub offset: [f64; 3],
    /// Its channels, in their order.
    pub channels: Vec<Channel>,
    /// Column of its first channel in the motion table.
    pub first_channel: usize,
    /// `OFFSET`s of its `End Site`s, in its own frame, file units.
    pub end_sites: Vec<[f64; 3]>,
}

/// A BVH document: everything needed to write the file again.
///
/// Joints are in the order of the file, which is depth first. Values are the motion table, row after row.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    name: String,
    joints: Vec<Joint>,
    channels: usize,
    frame_time_s: f64,
    values: Vec<f64>,
    /// The unit of length, where it came from a format that has one.
    unit: Option<Unit>,
    /// What a user should know of where it came from.
    notes: Vec<String>,
}

impl Bvh {
    /// The file's name, as given to [`parse`](Self::parse): for messages and for naming clips.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// The joints, parents before children, depth first.
    pub fn joints(&self) -> &[Joint] {
        &self.joints
    }

    /// The unit of length, where it came from a format that has one: glTF has metres, BVH none.
    pub fn unit(&self) -> Option<Unit> {
        self.unit
    }

    /// The document with lengths of a known unit, and notes for its [`Binding`].
    pub(crate) fn of_format(self, unit: Unit, notes: Vec<String>) -> Self {
        Self { unit: Some(unit), notes, ..self }
    }

    /// Columns of the motion table.
    pub fn channels(&self) -> usize {
        self.channels
    }

    /// Number of frames; at least one.
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// Seconds from a frame to the next, as written in the file.
    pub fn frame_time_s(&self) -> f64 {
        self.frame_time_s
    }

    /// Frames a second. A frame time rounded by its writer (0.0333333) gives the round rate that was meant (30).
    pub fn rate_hz(&self) -> f64 {
        let rate = 1.0 / self.frame_time_s;
        if (rate - rate.round()).abs() <= 1e-4 * rate { rate.round() } else { rate }
    }

    /// The motion table, degrees and file units. Shape `[frames x channels]`.
    pub fn values(&self) -> &[f64] {
        &self.values
    }

    /// One row of the motion table. Shape `[channels]`.
    pub fn row(&self, frame: usize) -> &[f64] {
        &self.values[frame * self.channels..(frame + 1) * self.channels]
    }

    /// Indices of a joint's children, in order.
    pub fn children(&self, joint: usize) -> impl Iterator<Item = usize> + '_ {
        (joint + 1..self.joints.len()).filter(move |&j| self.joints[j].parent == Some(joint))
    }
}
