//! A BVH document.

/// One column of the motion table: a joint's translation or rotation along one axis.
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

    /// Its word in a file.
    pub fn word(self) -> &'static str {
        match self {
            Channel::Position(axis) => ["Xposition", "Yposition", "Zposition"][axis],
            Channel::Rotation(axis) => ["Xrotation", "Yrotation", "Zrotation"][axis],
        }
    }

    /// The channel of a word; case is ignored.
    pub fn from_word(word: &str) -> Option<Channel> {
        Channel::ALL.into_iter().find(|c| c.word().eq_ignore_ascii_case(word))
    }
}

/// A joint as the file declares it.
#[derive(Debug, Clone, PartialEq)]
pub struct Joint {
    /// Its name, unique in the document; it may hold spaces.
    pub name: String,
    /// Index of its parent; `None` for the first joint only.
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
/// Joints are in the order of the file, which is depth first. Values are the motion table, row after row. Documents are
/// equal that would be written alike.
#[derive(Debug, Clone)]
pub struct Bvh {
    pub(super) name: String,
    /// What the reader let pass, for the user.
    pub(super) notes: Vec<String>,
    pub(super) joints: Vec<Joint>,
    pub(super) channels: usize,
    pub(super) frame_time_s: f64,
    pub(super) values: Vec<f64>,
}

impl PartialEq for Bvh {
    fn eq(&self, other: &Self) -> bool {
        let Self { name, notes: _, joints, channels, frame_time_s, values } = self;
        *name == other.name
            && *joints == other.joints
            && *channels == other.channels
            && *frame_time_s == other.frame_time_s
            && *values == other.values
    }
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

    /// Number of frames; at least one.
    pub fn frames(&self) -> usize {
        self.values.len() / self.channels
    }

    /// Seconds from a frame to the next, as written in the file.
    pub fn frame_time_s(&self) -> f64 {
        self.frame_time_s
    }

    /// Frames a second. A frame time rounded by its writer (0.0333333) gives the intended round rate (30).
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
}
