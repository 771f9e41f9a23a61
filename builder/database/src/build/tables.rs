//! Phase tables, which are made of everything before: cycles, their outputs, and features.

use super::{clips::Clips, frames::Frames, index::Features, pairs::Paired};
use crate::models::phase::{self, Source, Tables};

/// The section of the tables, where models are built.
pub(super) fn encode(
    clips: &Clips<'_>,
    frames: &Frames<'_>,
    paired: &Paired,
    features: &Features,
) -> Option<Vec<u8>> {
    let Clips { options, examples, corpus, dofs, .. } = clips;
    if !options.models {
        return None;
    }
    let clip = |(&first, dofs): (&usize, &Vec<_>)| &features.values[first..first + dofs.len()];
    let of_clips: Vec<&[Vec<f64>]> = frames.first_rows.iter().zip(dofs).map(clip).collect();
    let contacts: Vec<&[[bool; 2]]> = examples.iter().map(|e| e.contacts.as_slice()).collect();
    let source = Source {
        cycles: &frames.cycles,
        classes: &frames.names(),
        features: &of_clips,
        feature_groups: &features.space.groups,
        contacts: &contacts,
        pairing: &paired.pairing,
        rate_hz: corpus.rate_hz,
    };
    Some(phase::section(&Tables::of(&source)))
}
