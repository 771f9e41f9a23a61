//! What is estimated from all cycles, and the blob of all or some of them.

use super::{
    condense::{self, Cut},
    frames::Frames,
    index::{Features, Index, Shared, Stored},
    options::{BuildError, BuildOptions},
    sections::{self, Estimates},
    source::Source,
    tables,
};

/// What is estimated from all clips, for a number of features.
pub(super) struct Estimated<'a> {
    source: &'a Source<'a>,
    pub features: Features,
    phase: Option<Vec<u8>>,
}

impl<'a> Estimated<'a> {
    /// Estimates with at most so many features.
    pub fn new(source: &'a Source<'a>, features: usize) -> Self {
        let Source { clips, frames, paired, .. } = source;
        let features = Features::new(clips, features);
        let phase = tables::encode(clips, frames, paired, &features);
        Self { source, features, phase }
    }

    /// The blob of the cycles that the options keep; without a graph for a draft, which is as large.
    pub fn blob(
        &self,
        options: &BuildOptions,
        shared: &Shared,
        is_draft: bool,
    ) -> Result<Vec<u8>, BuildError> {
        let Source { clips, frames, paired, .. } = self.source;
        let all = Stored { clips, frames, pairing: &paired.pairing, first_frames: &frames.first_rows };
        if options.cycles == 0 || options.cycles >= self.source.choices().most() {
            return self.encode(&all, options, shared, is_draft);
        }
        let kept = self.source.choices().keep(options.cycles);
        let cut = Cut::new(clips, frames, &kept);
        let pairing = condense::pairing(clips, frames, &kept);
        let clips = cut.clips(clips);
        let frames = Frames::new(&clips)?;
        let first_frames = &cut.first_frames;
        self.encode(
            &Stored { clips: &clips, frames: &frames, pairing: &pairing, first_frames },
            options,
            shared,
            is_draft,
        )
    }

    fn encode(
        &self,
        stored: &Stored<'_>,
        options: &BuildOptions,
        shared: &Shared,
        is_draft: bool,
    ) -> Result<Vec<u8>, BuildError> {
        let index = Index::new(stored, &self.features, shared, is_draft)?;
        let estimates = Estimates {
            clips: self.source.clips,
            models: &self.source.paired.models,
            features: &self.features,
            shared,
            phase: self.phase.as_deref(),
        };
        Ok(sections::encode(stored, index, &estimates, options))
    }
}
