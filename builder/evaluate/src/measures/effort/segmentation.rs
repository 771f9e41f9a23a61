//! How well inputs are segmented: streams made of fragments, cut into the fragments that they are made of.

use gestus_database::effort::{fragment::Library, sheet::selected, stage::segment};
use gestus_motion::{
    body::row_at,
    corpus::Corpus,
    statistics::{mean, mean_or_zero},
};
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde_json::json;

use super::regression::SEED;
use crate::{evaluation, report::table};

/// Streams of each kind.
pub(super) const STREAMS: usize = 12;
/// Fragments in each stream.
const SENTENCE: usize = 8;
/// Fragments that streams are cut into, at most.
const VOCABULARY: usize = 240;

/// Agreement with the fragments that one stream is made of.
struct Found {
    frames: usize,
    /// Frames whose fragment shows the right action.
    action: usize,
    /// Frames whose fragment is the right one.
    exact: usize,
    /// Mean distance of a fragment's start to the nearest cut, frames.
    boundary: f64,
}

/// Rows of three kinds of streams: of known fragments, of the same at another pace and with noise, and of fragments of
/// clips that the vocabulary lacks.
pub(super) fn segmentation(
    corpus: &Corpus,
    library: &Library,
    tests: &[usize],
    tick: &(dyn Fn() + Sync),
) -> Vec<table::Row> {
    let is_held = |clip: &str| tests.iter().any(|&t| corpus.examples[t].clip.name == clip);
    let own = |unseen: bool| {
        let fragments =
            library.fragments.iter().filter(|f| is_held(&f.span.clip) == unseen).cloned().collect();
        selected(&Library { fragments, ..library.clone() }, VOCABULARY)
    };
    let (known, unseen) = (own(false), own(true));
    let known = if known.fragments.is_empty() { selected(library, VOCABULARY) } else { known };
    let mut rows = Vec::new();
    for kind in ["known", "known-warped", "unseen"] {
        let source = if kind == "unseen" { &unseen } else { &known };
        if source.fragments.is_empty() {
            continue;
        }
        let results: Vec<Found> = (0..STREAMS)
            .into_par_iter()
            .map(|n| {
                let found = one(&known, source, kind == "known-warped", n as u64);
                tick();
                found
            })
            .collect();
        let frames: usize = results.iter().map(|r| r.frames).sum();
        let share =
            |pick: fn(&Found) -> usize| results.iter().map(pick).sum::<usize>() as f64 / frames as f64;
        rows.push(evaluation::row(json!({
            "part": "segmentation", "method": "one-stage", "action": null, "style": null, "streams": kind, "corpus": "data",
            "frames": frames, "fragments": known.fragments.len(),
            "right": share(|r| r.action),
            "right_fragment": (kind != "unseen").then(|| share(|r| r.exact)),
            "boundary_frames": mean(results.iter().map(|r| r.boundary)),
        })));
    }
    rows
}

/// A random stream of fragments of `source`, cut into fragments of `known`.
fn one(known: &Library, source: &Library, warped: bool, number: u64) -> Found {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    rng.set_stream(number);
    let (mut input, mut truth, mut starts) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..SENTENCE {
        let Some(fragment) = source.fragments.choose(&mut rng) else { continue };
        let pace = if warped { rng.random_range(0.8..1.25) } else { 1.0 };
        let count = ((fragment.content.len() as f64 / pace).round() as usize).max(2);
        let last = (fragment.content.len() - 1) as f64;
        starts.push(input.len());
        for i in 0..count {
            let mut pose = row_at(&fragment.content, last * i as f64 / (count - 1) as f64);
            if warped {
                pose.iter_mut().for_each(|v| *v += rng.random_range(-0.03..0.03));
            }
            input.push(pose);
            truth.push((fragment.action, &fragment.span));
        }
    }
    let vocabulary: Vec<&[Vec<f64>]> = known.fragments.iter().map(|f| f.content.as_slice()).collect();
    let snippets = segment(&input, &vocabulary);
    let (mut action, mut exact) = (0, 0);
    for s in &snippets {
        let found = &known.fragments[s.fragment];
        for &(a, span) in &truth[s.from..s.to] {
            action += usize::from(a == found.action);
            exact += usize::from(span == &found.span);
        }
    }
    let nearest =
        |start: &usize| snippets.iter().map(|s| s.from.abs_diff(*start)).min().unwrap_or(input.len()) as f64;
    let boundary = mean_or_zero(starts.iter().map(nearest));
    Found { frames: input.len(), action, exact, boundary }
}
