//! Tables by phase, which are made of everything before: cycles, their outputs, and features.

use super::{clips::Clips, frames::Frames, index::Index, pairs::Paired};
use crate::models::phase::{self, Source, Tables};

/// The section of the tables, where models are built.
pub(super) fn encode(
    clips: &Clips<'_>,
    frames: &Frames<'_>,
    paired: &Paired,
    index: &Index,
) -> Option<Vec<u8>> {
    let Clips { options, examples, corpus, dofs, .. } = clips;
    if !options.models {
        return None;
    }
    let clip = |(&first, dofs): (&usize, &Vec<_>)| &index.features[first..first + dofs.len()];
    let features: Vec<&[Vec<f64>]> = frames.first_rows.iter().zip(dofs).map(clip).collect();
    let contacts: Vec<&[[bool; 2]]> = examples.iter().map(|e| e.contacts.as_slice()).collect();
    let source = Source {
        cycles: &frames.cycles,
        classes: &frames.names(),
        features: &features,
        feature_groups: &index.space.groups,
        contacts: &contacts,
        pairing: &paired.pairing,
        rate_hz: corpus.rate_hz,
    };
    Some(phase::section(&Tables::of(&source)))
}
