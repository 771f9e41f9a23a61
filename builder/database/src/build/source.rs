//! The stages before anything is stored: clips, frames and pairs.

use std::sync::OnceLock;

use super::{clips::Clips, condense::Choices, frames::Frames, index::Shared, pairs::Paired};

/// The first stages, which do not depend on how much is stored.
pub(super) struct Source<'a> {
    pub clips: &'a Clips<'a>,
    pub frames: &'a Frames<'a>,
    pub paired: &'a Paired,
    /// Made when it is first used: a database of all cycles needs no distances between them.
    choices: OnceLock<Choices>,
}

impl<'a> Source<'a> {
    pub fn new(clips: &'a Clips<'a>, frames: &'a Frames<'a>, paired: &'a Paired) -> Self {
        Self { clips, frames, paired, choices: OnceLock::new() }
    }

    /// What does not depend on which cycles are kept, for rows of a mean joint error in centimetres.
    pub fn shared(&self, error_cm: f64) -> Shared {
        Shared::new(self.clips, &self.paired.pairing, error_cm)
    }

    /// The choices among all cycles.
    pub fn choices(&self) -> &Choices {
        let all = || vec![true; self.frames.cycles.len()];
        self.choices.get_or_init(|| Choices::new(self.clips, self.frames, &all()))
    }
}
