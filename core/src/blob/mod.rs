//! The blob: one flat image that the builder writes and the stylizer reads in place.
//!
//! [`Database::open`] checks everything once; after that every read is in range, and none can fail. The bytes
//! stay where they are (flash, a memory map, a `Vec`); a `Database` is a handful of slices and counts, `Copy`.
//! `docs/FORMAT.md` is the format for people, [`layout`] is the format for programs.

pub(crate) mod check;
pub mod crc;
mod dial;
pub mod layout;
mod manifest;
mod models;
mod pairs;
pub mod read;
pub(crate) mod rows;
mod validate;

pub use manifest::{Manifest, Names};
pub use models::{LinearModel, Numbers, Table, Unit};
pub use pairs::{Counterpart, Moment};

use crate::{
    BlobError,
    math::quaternion::{Quaternion, Vector},
};
use layout::{DEGREE, ENTRIES, section};
use read::{Record, f32_at, floats, u16_at};

/// The counts of a database. Every one fits the width that it is stored in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Counts {
    /// Joints, 2 to [`layout::MAX_JOINTS`].
    pub joints: usize,
    /// Degrees of freedom: 3 joints + 4.
    pub dofs: usize,
    /// Principal components of a feature.
    pub features: usize,
    /// Frames of the query window.
    pub window: usize,
    /// Styles.
    pub styles: usize,
    /// Actions.
    pub actions: usize,
    /// Classes: combinations of action and style that hold frames.
    pub classes: usize,
    /// Joint groups.
    pub groups: usize,
    /// Captured frames, the rows that a search returns; 0 in a blob that was cut to its models, which then holds
    /// nothing that is about frames.
    pub frames: usize,
    /// Captured frames and the prototypes' frames behind them.
    pub rows: usize,
    /// Rows of a block.
    pub block_rows: usize,
    /// Dofs of the timing metric.
    pub timing: usize,
    /// Cycles.
    pub cycles: usize,
    /// Clips.
    pub clips: usize,
}

/// A joint of the database's skeleton.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Joint {
    /// Index of the parent, smaller than the joint's own; `None` for the root.
    pub parent: Option<usize>,
    /// Joint group.
    pub group: usize,
    /// Position in the parent's frame, metres.
    pub offset: Vector,
    /// Mean local rotation; the joint's dofs are relative to it.
    pub mean: Quaternion,
}

/// A class: the frames of one action in one style.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Class {
    /// First row.
    pub first_row: usize,
    /// Number of rows, at most 65,535.
    pub rows: usize,
    /// First cycle.
    pub first_cycle: usize,
    /// Number of cycles.
    pub cycles: usize,
    /// Action.
    pub action: u16,
    /// Style.
    pub style: u16,
    /// Most neighbors that a search returns: small classes are no neighborhood for a large K.
    pub k_cap: usize,
    /// Rows that the search may return.
    pub searchable: usize,
}

/// A dof that the timing prediction compares.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TimingDof {
    /// The dof.
    pub dof: usize,
    /// Weight of squared differences of the dof.
    pub pose: f32,
    /// Weight of squared differences of its change from frame to frame.
    pub change: f32,
}

/// A leg: its joints from hip to toe, each the parent of the next, and how high they stand.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Leg {
    /// The joint that turns the thigh.
    pub hip: usize,
    /// The knee.
    pub knee: usize,
    /// The ankle.
    pub ankle: usize,
    /// The toes, where the skeleton has them.
    pub toe: Option<usize>,
    /// Heights of ankle and toes over the floor that they stand on, metres.
    pub heights: [f32; 2],
}

impl Leg {
    fn read(record: Record<'_>) -> Self {
        use layout::foot;
        let joint = |at: usize| usize::from(record.u8(at));
        Self {
            hip: joint(foot::HIP),
            knee: joint(foot::KNEE),
            ankle: joint(foot::ANKLE),
            toe: (record.u8(foot::TOE) != foot::NO_TOE).then(|| joint(foot::TOE)),
            heights: [record.f32(foot::ANKLE_HEIGHT), record.f32(foot::TOE_HEIGHT)],
        }
    }
}

/// A checked blob. Cheap to copy; several stylizers may share one.
#[derive(Debug, Clone, Copy)]
pub struct Database<'db> {
    counts: Counts,
    identity: u32,
    rate_hz: f32,
    block_shift: u32,
    manifest: &'db [u8],
    skeleton: &'db [u8],
    dofs: &'db [u8],
    query: &'db [u8],
    classes: &'db [u8],
    clips: &'db [u8],
    cycles: &'db [u8],
    knots: &'db [u8],
    pairs: &'db [u8],
    blocks: &'db [u8],
    rows: &'db [u8],
    features: &'db [u8],
    graph: &'db [u8],
    flags: &'db [u8],
    timing: &'db [u8],
    optional: [Option<&'db [u8]>; section::OPTIONAL.len()],
}

/// What it holds, and not its megabytes.
#[cfg(feature = "defmt")]
impl defmt::Format for Database<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Database {} at {} Hz", self.counts, self.rate_hz);
    }
}

impl<'db> Database<'db> {
    /// Checks a blob: magic, version, lengths, checksums, every index, every scale. Takes time in proportion to
    /// its size, and no memory.
    ///
    /// # Errors
    /// [`BlobError`] says which section and record is wrong.
    #[inline]
    pub fn open(bytes: &'db [u8]) -> Result<Self, BlobError> {
        let database = validate::sections(bytes)?;
        validate::contents(&database)?;
        Ok(database)
    }

    /// The counts.
    #[inline]
    pub fn counts(&self) -> &Counts {
        &self.counts
    }

    /// CRC-32C of header and section table. The table holds the sections' own checksums, so that two databases with
    /// the same identity are the same bytes, short of a collision: how a board and its host know each other's.
    #[inline]
    pub fn identity(&self) -> u32 {
        self.identity
    }

    /// Frames a second of the motion, and of the stream that a stylizer expects.
    #[inline]
    pub fn rate_hz(&self) -> f32 {
        self.rate_hz
    }

    /// Names, licences and build parameters.
    ///
    /// # Errors
    /// [`BlobError::Manifest`]; not after `open`, which has decoded it once.
    pub fn manifest(&self) -> Result<Manifest<'db>, BlobError> {
        Manifest::read(self.manifest).ok_or(BlobError::Manifest)
    }

    /// Joint `index`.
    #[inline(never)]
    pub fn joint(&self, index: usize) -> Joint {
        let record = Record::of(self.skeleton, index, layout::joint::LENGTH);
        let parent = record.u8(layout::joint::PARENT);
        Joint {
            parent: (parent != layout::joint::ROOT).then_some(usize::from(parent)),
            group: usize::from(record.u8(layout::joint::GROUP)),
            offset: record.floats(layout::joint::OFFSET),
            mean: record.floats(layout::joint::MEAN),
        }
    }

    /// Mean local rotations of the joints, in order.
    #[inline]
    pub fn means(&self) -> impl Iterator<Item = Quaternion> + use<'db> {
        self.joints().iter().map(|record| Record(record).floats(layout::joint::MEAN))
    }

    /// Joint groups of the joints, in order.
    #[inline]
    pub fn groups(&self) -> impl Iterator<Item = usize> + use<'db> {
        self.joints().iter().map(|record| usize::from(Record(record).u8(layout::joint::GROUP)))
    }

    #[inline]
    fn joints(&self) -> &'db [[u8; layout::joint::LENGTH]] {
        self.skeleton.as_chunks().0.get(..self.counts.joints).unwrap_or(&[])
    }

    /// Joint group of joint `index`.
    #[inline]
    pub fn joint_group(&self, index: usize) -> usize {
        usize::from(Record::of(self.skeleton, index, layout::joint::LENGTH).u8(layout::joint::GROUP))
    }

    /// The hips line in the root's own frame, from right to left: what the heading is measured with.
    #[inline]
    pub fn hips_line(&self) -> Vector {
        floats(self.trailer(), layout::joint::HIPS_LINE.start)
    }

    /// Joints of the left and right toes, where the skeleton has them.
    pub fn toes(&self) -> [Option<usize>; 2] {
        let record = Record(self.trailer());
        [0, 1].map(|side| {
            let joint = record.u8(layout::joint::TOES.start + side);
            (joint != layout::joint::ROOT).then_some(usize::from(joint))
        })
    }

    /// The legs, left and right, where the blob describes them.
    #[inline(never)]
    pub fn legs(&self) -> Option<[Leg; 2]> {
        let section = self.optional(section::FEET)?;
        Some([0, 1].map(|side| Leg::read(Record::of(section, side, layout::foot::LENGTH))))
    }

    fn trailer(&self) -> &'db [u8] {
        self.skeleton.get(self.counts.joints * layout::joint::LENGTH..).unwrap_or(&[])
    }

    /// Joint group of a dof.
    pub fn group_of_dof(&self, dof: usize) -> usize {
        let joint = (dof.saturating_sub(layout::ROOT_DOFS)) / 3;
        self.joint_group(joint)
    }

    /// Quantisation step of a dof, in its unit.
    #[inline(never)]
    pub fn step(&self, dof: usize) -> f32 {
        Record::of(self.dofs, dof, layout::dof_record::LENGTH).f32(layout::dof_record::STEP)
    }

    /// Standard deviation of a dof over the database, in its unit.
    #[inline(never)]
    pub fn scale(&self, dof: usize) -> f32 {
        Record::of(self.dofs, dof, layout::dof_record::LENGTH).f32(layout::dof_record::SCALE)
    }

    /// Class `index`.
    #[inline(never)]
    pub fn class(&self, index: usize) -> Class {
        let record = Record::of(self.classes, index, layout::class::LENGTH);
        Class {
            first_row: record.u32(layout::class::FIRST_ROW) as usize,
            rows: record.u32(layout::class::ROWS) as usize,
            first_cycle: record.u32(layout::class::FIRST_CYCLE) as usize,
            cycles: record.u32(layout::class::CYCLES) as usize,
            action: record.u16(layout::class::ACTION),
            style: record.u16(layout::class::STYLE),
            k_cap: usize::from(record.u16(layout::class::K_CAP)),
            searchable: usize::from(record.u16(layout::class::SEARCHABLE)),
        }
    }

    /// The classes, by number.
    pub fn classes(&self) -> impl Iterator<Item = Class> + '_ {
        (0..self.counts.classes).map(|c| self.class(c))
    }

    /// Entry points of a class's graph: rows of the class.
    #[inline]
    pub fn entries(&self, class: usize) -> impl Iterator<Item = u16> + 'db {
        let record = Record::of(self.classes, class, layout::class::LENGTH).0;
        let entries = record.get(layout::class::ENTRY_POINTS).unwrap_or(&[]);
        (0..ENTRIES).map(move |i| u16_at(entries, 2 * i)).filter(|&row| row != layout::NONE)
    }

    /// First row and number of rows of a clip.
    #[inline(never)]
    pub fn clip(&self, index: usize) -> (usize, usize) {
        let record = Record::of(self.clips, index, layout::clip::LENGTH);
        (record.u32(layout::clip::FIRST_ROW) as usize, record.u32(layout::clip::ROWS) as usize)
    }

    /// The stored feature of a captured frame: i8, one a byte.
    #[inline]
    pub fn feature(&self, row: usize) -> &'db [u8] {
        let length = self.counts.features;
        self.features.get(row.wrapping_mul(length)..).and_then(|rest| rest.get(..length)).unwrap_or(&[])
    }

    /// Metres for one step of a stored feature.
    #[inline(never)]
    pub fn feature_scale(&self, feature: usize) -> f32 {
        f32_at(self.query, layout::query::scales(self.counts.window, self.counts.joints) + 4 * feature)
    }

    /// Joint group that a feature looks at.
    #[inline(never)]
    pub fn feature_group(&self, feature: usize) -> usize {
        let at =
            layout::query::groups(self.counts.window, self.counts.joints, self.counts.features) + feature;
        self.query.get(at).copied().map_or(0, usize::from)
    }

    /// The query section, as [`layout::query`] divides it.
    #[inline]
    pub fn query_section(&self) -> &'db [u8] {
        self.query
    }

    /// Graph edges of a captured frame: rows of its class, [`layout::NONE`] where there is none.
    #[inline]
    pub fn edges(&self, row: usize) -> [u16; DEGREE] {
        let record = Record::of(self.graph, row, 2 * DEGREE);
        core::array::from_fn(|i| record.u16(2 * i..2 * i + 2))
    }

    /// Flags of a captured frame ([`layout::flag`]); 0 for any other row.
    #[inline]
    pub fn flags(&self, row: usize) -> u8 {
        self.flags.get(row).copied().unwrap_or(0)
    }

    /// Entry `index` of the timing metric.
    #[inline(never)]
    pub fn timing(&self, index: usize) -> TimingDof {
        let record = Record::of(self.timing, index, layout::timing::LENGTH);
        TimingDof {
            dof: usize::from(record.u16(layout::timing::DOF)),
            pose: record.f32(layout::timing::POSE),
            change: record.f32(layout::timing::CHANGE),
        }
    }

    /// The bytes of one of [`section::OPTIONAL`]; `None` where the blob has no such section.
    #[inline(never)]
    pub fn optional(&self, id: u16) -> Option<&'db [u8]> {
        let index = section::OPTIONAL.iter().position(|&o| o == id)?;
        self.optional.get(index).copied().flatten()
    }

    /// The optional sections that the blob has: number and bytes, in the order of [`section::OPTIONAL`].
    pub fn optional_sections(&self) -> impl Iterator<Item = (u16, &'db [u8])> + '_ {
        section::OPTIONAL.iter().zip(self.optional).filter_map(|(&id, bytes)| bytes.map(|b| (id, b)))
    }

    /// The sections that every blob has: number and bytes, in the order of [`section::REQUIRED`].
    pub fn sections(&self) -> [(u16, &'db [u8]); section::REQUIRED.len()] {
        [
            (section::MANIFEST, self.manifest),
            (section::SKELETON, self.skeleton),
            (section::DOFS, self.dofs),
            (section::QUERY, self.query),
            (section::CLASSES, self.classes),
            (section::CLIPS, self.clips),
            (section::CYCLES, self.cycles),
            (section::KNOTS, self.knots),
            (section::PAIRS, self.pairs),
            (section::BLOCKS, self.blocks),
            (section::ROWS, self.rows),
            (section::FEATURES, self.features),
            (section::GRAPH, self.graph),
            (section::FLAGS, self.flags),
            (section::TIMING, self.timing),
        ]
    }
}
