//! The stages before anything is stored: clips, frames and pairs.

use super::{clips::Clips, frames::Frames, index::Shared, pairs::Paired};

/// The first stages, which do not depend on how much is stored.
pub(super) struct Source<'a> {
    pub clips: &'a Clips<'a>,
    pub frames: &'a Frames<'a>,
    pub paired: &'a Paired,
}

impl Source<'_> {
    /// What does not depend on which cycles are kept, for rows of a mean joint error in centimetres.
    pub fn shared(&self, error_cm: f64) -> Shared {
        Shared::new(self.clips, &self.paired.pairing, error_cm)
    }
}
