//! From a [`Corpus`] to a blob, in stages: clips, frames, pairs, index, sections. Each is a type that later stages take.
//! Where only some cycles are kept, the clips are cut to them after the pairs, and models, feature space and scales are
//! those of all.

mod clips;
mod condense;
mod fit;
mod frames;
mod held_out;
mod index;
mod medoids;
mod options;
mod pairs;
mod sections;
mod tables;

pub use fit::Choice;
pub use options::{BuildError, BuildOptions};

use gestus_core::Database;
use gestus_motion::corpus::Corpus;

use self::{
    clips::Clips,
    condense::{Choices, Cut},
    frames::Frames,
    index::{Features, Index, Shared, Stored},
    pairs::Paired,
    sections::Estimates,
};

/// A database with notes about its building.
#[derive(Debug)]
pub struct Built {
    /// The blob.
    pub bytes: Vec<u8>,
    /// One line for each class left out.
    pub notes: Vec<String>,
    /// What was chosen for [`BuildOptions::bytes`].
    pub choice: Option<Choice>,
}

/// Builds a database, and checks that the core opens it.
///
/// # Errors
/// [`BuildError`] if the corpus is incomplete or too large, or the database would be larger than wanted.
pub fn build(corpus: &Corpus, options: &BuildOptions) -> Result<Built, BuildError> {
    let clips = Clips::new(corpus, options)?;
    let frames = Frames::new(&clips)?;
    let paired = Paired::new(&clips, &frames)?;
    let source = Source { clips: &clips, frames: &frames, paired: &paired };
    let choice = (options.bytes > 0).then(|| fit::choose(&source)).transpose()?;
    let options = choice.as_ref().map_or_else(|| options.clone(), |choice| choice.options(options));
    let bytes =
        Estimated::new(&source, options.features).blob(&options, &source.shared(options.error_cm), false)?;
    Database::open(&bytes)?;
    let notes = clips.notes.iter().chain(&paired.notes).cloned().collect();
    Ok(Built { bytes, notes, choice })
}

/// The first stages, which do not depend on how much is stored.
struct Source<'a> {
    clips: &'a Clips<'a>,
    frames: &'a Frames<'a>,
    paired: &'a Paired,
}

impl Source<'_> {
    fn shared(&self, error_cm: f64) -> Shared {
        Shared::new(self.clips, &self.paired.pairing, error_cm)
    }
}

/// What is estimated from all clips, for a number of features.
struct Estimated<'a> {
    source: &'a Source<'a>,
    choices: Choices,
    features: Features,
    phase: Option<Vec<u8>>,
}

impl<'a> Estimated<'a> {
    fn new(source: &'a Source<'a>, features: usize) -> Self {
        let Source { clips, frames, paired } = source;
        let features = Features::new(clips, features);
        let phase = tables::encode(clips, frames, paired, &features);
        let choices = Choices::new(clips, frames, &vec![true; frames.cycles.len()]);
        Self { source, choices, features, phase }
    }

    /// The blob of the cycles that the options keep; without a graph for a draft, which is as large.
    fn blob(&self, options: &BuildOptions, shared: &Shared, is_draft: bool) -> Result<Vec<u8>, BuildError> {
        let Source { clips, frames, paired } = self.source;
        let all = Stored { clips, frames, pairing: &paired.pairing, first_frames: &frames.first_rows };
        if options.cycles == 0 || options.cycles >= self.choices.most() {
            return self.encode(&all, options, shared, is_draft);
        }
        let kept = self.choices.keep(options.cycles);
        let cut = Cut::new(clips, frames, &kept);
        let pairing = condense::pairing(clips, frames, &kept);
        let clips = clips.of(&cut);
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
