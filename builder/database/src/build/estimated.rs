//! What is estimated from all cycles, and the blob of all or some of them.

use super::{
    condense::{self, Cut},
    frames::Frames,
    index::{Extent, Features, Index, Shared, Stored},
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
    /// Estimates with at most that many features.
    pub fn new(source: &'a Source<'a>, features: usize) -> Self {
        let Source { clips, frames, paired, .. } = source;
        let features = Features::new(clips, features);
        let phase = tables::encode(clips, frames, paired, &features);
        Self { source, features, phase }
    }

    /// The blob of the cycles that the options keep.
    pub fn blob(&self, options: &BuildOptions, shared: &Shared) -> Result<Vec<u8>, BuildError> {
        let extent = if options.graph { Extent::Whole } else { Extent::WithoutGraph };
        self.encode(options, shared, extent)
    }

    /// Bytes of that blob without a graph, from a draft that is made faster.
    pub fn draft_bytes(&self, options: &BuildOptions, shared: &Shared) -> Result<usize, BuildError> {
        Ok(self.encode(options, shared, Extent::Draft)?.len())
    }

    fn encode(&self, options: &BuildOptions, shared: &Shared, extent: Extent) -> Result<Vec<u8>, BuildError> {
        let Source { clips, frames, paired, .. } = self.source;
        let source = (*clips, *frames);
        let all =
            Stored { source, clips, frames, pairing: &paired.pairing, first_frames: &frames.first_rows };
        if options.cycles == 0 || options.cycles >= self.source.choices().most() {
            return self.encode_stored(&all, options, shared, extent);
        }
        let kept = self.source.choices().keep(options.cycles);
        let cut = Cut::new(clips, frames, &kept);
        let pairing = condense::pairing(clips, frames, &kept);
        let clips = cut.clips(clips);
        let frames = Frames::new(&clips)?;
        let first_frames = &cut.first_frames;
        let stored = Stored { source, clips: &clips, frames: &frames, pairing: &pairing, first_frames };
        self.encode_stored(&stored, options, shared, extent)
    }

    fn encode_stored(
        &self,
        stored: &Stored<'_>,
        options: &BuildOptions,
        shared: &Shared,
        extent: Extent,
    ) -> Result<Vec<u8>, BuildError> {
        let index = Index::new(stored, &self.features, shared, extent)?;
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
