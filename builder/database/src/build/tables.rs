//! Tables by phase, which are made of everything before: cycles, their outputs, and features.

use rayon::prelude::*;

use super::{clips::Clips, frames::Frames, index::Index, pairs::Paired};
use crate::{
    models::phase::{self, Source, Tables},
    search::features::clouds,
};

/// The section of the tables, where models are built.
pub(super) fn encode(
    clips: &Clips<'_>,
    frames: &Frames<'_>,
    paired: &Paired,
    index: &Index,
) -> Option<Vec<u8>> {
    let Clips { options, examples, corpus, .. } = clips;
    if !options.models {
        return None;
    }
    let features: Vec<Vec<Vec<f64>>> = examples
        .par_iter()
        .map(|e| clouds(&e.clip, options.window).iter().map(|cloud| index.space.feature(cloud)).collect())
        .collect();
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
