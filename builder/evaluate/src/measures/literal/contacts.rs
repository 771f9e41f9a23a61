//! Contacts by neighbors of their own: over all classes, those whose legs are nearest by eq. 1 (Xia 2015, section 6).

use gestus_core::{Config, Database, methods::mixture::contact_votes::captured_contacts as label};
use gestus_database::{
    registration::contact::{GAUSSIAN_S, contacts, smoothed},
    stream::{Request, stream},
};
use gestus_motion::body::Body;
use serde_json::json;

use crate::{
    baselines::clouds::{CloudSearch, Comparison},
    evaluation::row,
    experiment::Experiment,
    measures::contacts::score::{flickers, score},
    report::table,
};

/// The clouds of the legs, each pair aligned.
const LEGS: Comparison = Comparison { pairwise: true, tapered: false, legs: true };

/// A clip to its own style, unlabelled, against where its feet are: by the core's votes and by the paper's, each without
/// smoothing and with the paper's.
pub(super) fn rows(
    experiment: &Experiment,
    body: &Body,
    database: &Database<'_>,
    test: usize,
) -> Vec<table::Row> {
    let corpus = &experiment.corpus;
    let example = &corpus.examples[test];
    let truth = contacts(&example.clip, &body.landmarks);
    let request = Request { config: Config::paper(), ..Request::style(example.style as u16) };
    let Ok(streamed) = stream(database, &example.clip, &request, &mut ()) else { return Vec::new() };
    let core = streamed.steps.iter().map(|s| s.report.contact_likelihood.map(f64::from)).collect();
    let mut rows = Vec::new();
    for (option, likelihoods) in [("core", core), ("own", own(database, body, &example.clip))] {
        let bare = likelihoods.iter().map(|l: &[f64; 2]| l.map(|l| l > 0.5)).collect();
        let gaussian = smoothed(&likelihoods, GAUSSIAN_S * corpus.rate_hz);
        for (method, found) in [("unsmoothed", bare), ("gaussian", gaussian)] {
            let score = score(&found, &truth);
            rows.push(row(json!({
                "part": "contacts",
                "method": method,
                "option": option,
                "action": corpus.actions[example.action],
                "style": corpus.styles[example.style],
                "clip": example.clip.name,
                "contact_f1": score.f1(),
                "accuracy": score.accuracy(),
                "flickers": flickers(&found, corpus.rate_hz),
            })));
        }
    }
    rows
}

/// How likely each foot stands: the neighbors' labels, weighted by the inverse of their distances.
fn own(database: &Database<'_>, body: &Body, clip: &gestus_motion::clip::Clip) -> Vec<[f64; 2]> {
    let classes: Vec<usize> = (0..database.counts().classes).collect();
    let search = CloudSearch::of(database, &body.with_means_of(database), &classes, LEGS);
    let vote = |near: Vec<(usize, f64)>| {
        let (mut stands, mut total) = ([0.0; 2], 0.0);
        for (found, distance2) in near {
            let weight = 1.0 / (distance2.sqrt() + 1e-6);
            total += weight;
            for (sum, stands) in stands.iter_mut().zip(label(database, found)) {
                *sum += weight * f64::from(stands);
            }
        }
        stands.map(|s| s / total)
    };
    search.nearest(clip, usize::from(Config::paper().k)).into_iter().map(vote).collect()
}
