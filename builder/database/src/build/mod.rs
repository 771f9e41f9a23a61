//! From a [`Corpus`] to a blob, in stages: clips, frames, pairs, index, sections. Each is a type that later stages take.

mod clips;
mod frames;
mod index;
mod options;
mod pairs;
mod sections;
mod tables;

pub use options::{BuildError, BuildOptions};

use gestus_core::Database;
use gestus_motion::corpus::Corpus;

use self::{clips::Clips, frames::Frames, index::Index, pairs::Paired};

/// A database with notes about its building.
#[derive(Debug)]
pub struct Built {
    /// The blob.
    pub bytes: Vec<u8>,
    /// One line for each class left out.
    pub notes: Vec<String>,
}

/// Builds a database, and checks that the core opens it.
///
/// # Errors
/// [`BuildError`] if the corpus is incomplete or too large.
pub fn build(corpus: &Corpus, options: &BuildOptions) -> Result<Built, BuildError> {
    let clips = Clips::new(corpus, options)?;
    let frames = Frames::new(&clips)?;
    let paired = Paired::new(&clips, &frames)?;
    let index = Index::new(&clips, &frames, &paired)?;
    let tables = tables::encode(&clips, &frames, &paired, &index);
    let notes = clips.notes.iter().chain(&paired.notes).cloned().collect();
    let bytes = sections::encode(&clips, &frames, paired, index, tables);
    Database::open(&bytes)?;
    Ok(Built { bytes, notes })
}
