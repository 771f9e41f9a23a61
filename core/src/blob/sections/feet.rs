//! The legs: joints from hip to toe, and how high they stand.

use crate::blob::{Database, layout::foot, read::Record};

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
    /// How far ankle and toes are over the point that the standing foot rolls about, metres: a foot that turns by an angle
    /// moves the joint by that times the angle. 0 where the joint itself stands still.
    pub rolls: [f32; 2],
}

impl Leg {
    fn read(record: Record<'_>) -> Self {
        let joint = |at: usize| usize::from(record.u8(at));
        Self {
            hip: joint(foot::HIP),
            knee: joint(foot::KNEE),
            ankle: joint(foot::ANKLE),
            toe: (record.u8(foot::TOE) != foot::NO_TOE).then(|| joint(foot::TOE)),
            heights: [record.f32(foot::ANKLE_HEIGHT), record.f32(foot::TOE_HEIGHT)],
            rolls: [foot::ANKLE_ROLL, foot::TOE_ROLL].map(|at| foot::ROLL_STEP_M * f32::from(record.u16(at))),
        }
    }
}

impl Database<'_> {
    /// The legs, left and right, where the blob describes them.
    #[inline(never)]
    pub fn legs(&self) -> Option<[Leg; 2]> {
        let section = self.optional.feet?;
        Some([0, 1].map(|side| Leg::read(Record::of(section, side, foot::LENGTH))))
    }
}
