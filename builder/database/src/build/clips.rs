//! First stage: the clips of a database, and their dofs.

use gestus_motion::{
    body::Body,
    corpus::{Corpus, Example},
};

use super::options::{BuildError, BuildOptions};
use crate::search::groups::Groups;

/// The clips of the actions that exist in every style.
pub(super) struct Clips<'c> {
    pub corpus: &'c Corpus,
    pub options: &'c BuildOptions,
    pub body: Body,
    pub groups: Groups,
    /// Sorted by class and name.
    pub examples: Vec<&'c Example>,
    /// Dofs of every clip, shape `[clips][frames][D]`.
    pub dofs: Vec<Vec<Vec<f64>>>,
    /// One line for each action left out.
    pub notes: Vec<String>,
}

impl<'c> Clips<'c> {
    pub fn new(corpus: &'c Corpus, options: &'c BuildOptions) -> Result<Self, BuildError> {
        let body = Body::of(corpus)?;
        let groups = Groups::of(&body.skeleton, &body.landmarks, &options.groups)?;
        let mut notes = Vec::new();
        let examples = complete(corpus, &mut notes)?;
        let dofs = examples.iter().map(|e| body.clip_dofs(&e.clip)).collect();
        Ok(Self { corpus, options, body, groups, examples, dofs, notes })
    }
}

/// The examples of actions that have every style, sorted by class and name.
fn complete<'a>(corpus: &'a Corpus, notes: &mut Vec<String>) -> Result<Vec<&'a Example>, BuildError> {
    let there = |action: usize, style: usize| {
        corpus.examples.iter().any(|e| (e.action, e.style) == (action, style) && !e.cycles.is_empty())
    };
    let mut kept = Vec::new();
    let mut missing = Vec::new();
    for (a, action) in corpus.actions.iter().enumerate() {
        let without: Vec<&str> =
            (0..corpus.styles.len()).filter(|&s| !there(a, s)).map(|s| corpus.styles[s].as_str()).collect();
        if without.is_empty() {
            kept.push(a);
        } else {
            missing.push(format!("{action} lacks {}", without.join(", ")));
        }
    }
    if kept.is_empty() {
        return Err(BuildError::Unpaired(missing.join("; ")));
    }
    notes.extend(
        missing.into_iter().map(|m| format!("left out: action {m}: a frame needs an output in every style")),
    );
    let mut examples: Vec<&Example> = corpus.examples.iter().filter(|e| kept.contains(&e.action)).collect();
    examples.sort_by(|a, b| (a.action, a.style, &a.clip.name).cmp(&(b.action, b.style, &b.clip.name)));
    Ok(examples)
}
