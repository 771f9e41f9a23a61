//! From a [`Corpus`] to a blob, in stages: clips, frames, pairs, index, sections. Each is a type that later stages take.
//! Where only some cycles are kept, the clips are cut to them after the pairs, and models, feature space and scales are
//! those of all.

mod clips;
mod condense;
mod estimated;
mod fit;
mod frames;
mod held_out;
mod index;
mod medoids;
mod options;
mod pairs;
mod sections;
mod source;
mod tables;

pub use fit::Choice;
pub use options::{BuildError, BuildOptions};
pub use pairs::stretches;

use gestus_core::Database;
use gestus_motion::corpus::Corpus;

use self::{clips::Clips, estimated::Estimated, frames::Frames, pairs::Paired, source::Source};

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
    let source = Source::new(&clips, &frames, &paired);
    let choice = (options.bytes > 0).then(|| fit::choose(&source)).transpose()?;
    let options = choice.as_ref().map_or_else(|| options.clone(), |choice| choice.options(options));
    let bytes = Estimated::new(&source, options.features).blob(&options, &source.shared(options.error_cm))?;
    Database::open(&bytes)?;
    let notes = clips.notes.iter().chain(&paired.notes).cloned().collect();
    Ok(Built { bytes, notes, choice })
}
