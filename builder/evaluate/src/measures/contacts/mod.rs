//! Contacts on clips that the database has never seen, against where their feet really are and how fast they move.
//!
//! A held-out clip is streamed to its own style, nothing labelled: the output is the input, so that its feet have a
//! truth. The labels that vote come from other clips. `generated` has the same on generated motion, whose truth is the
//! generator's and not ours, and holds the builder's own detector against it.

use gestus_core::Database;
use serde_json::json;

mod generated;
pub(in crate::measures) mod score;
mod smoothing;

use crate::{
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut},
    fold::each,
    measures::{OnClips, Uses},
    metrics::matched,
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    registration::contact::contacts,
    stream::{Request, Streamed, stream},
};
use gestus_motion::{body::Body, corpus::Corpus, statistics::mean_or_zero};

pub use score::Score;
use score::{changes, flickers, over, score};
use smoothing::smoothings;

/// Options of `gestus evaluate contacts`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let corpus = &experiment.corpus;
        let (body, folds) = experiment.folds()?;
        let rows = each("contacts", experiment, &folds, &experiment.build, |fold, database| {
            let mut rows = Vec::new();
            // One row a clip: the same one is in several folds, and would count as often.
            for clip in [fold.test, fold.truth] {
                let mut earlier = folds.iter().take_while(|f| **f != fold);
                if earlier.all(|f| f.test != clip && f.truth != clip) {
                    own_style(corpus, &body, database, clip, &mut rows);
                }
            }
            rows.extend(other_style(corpus, &body, database, &fold));
            rows
        })?;
        let mut rows: Vec<table::Row> = rows.into_iter().flatten().collect();
        let figures = vec![by_action(corpus, &rows)];
        rows.extend(generated::rows()?);
        Ok(Evaluation {
            what: "contacts",
            about: "Which foot stands, on held-out clips, against where their feet are and how fast they move. Each clip \
                    is streamed to its own style, unlabelled. `stream` is what the core reports, `gaussian` what a file can \
                    have (Xia 2015, section 6), `unsmoothed` the bare vote; `transfer` compares the output in another \
                    style with the truth clip at equal canonical time. Rows of `generated` are against the generator's \
                    own contacts: `detector` is what labels the builder's clips, the others are streams."
                .into(),
            keys: vec!["part", "method", "action"],
            rows,
            figures,
        })
    }
}

fn run(database: &Database<'_>, corpus: &Corpus, clip: usize, style: usize) -> Option<Streamed> {
    stream(database, &corpus.examples[clip].clip, &Request::style(style as u16), &mut ()).ok()
}

fn own_style(corpus: &Corpus, body: &Body, database: &Database<'_>, clip: usize, rows: &mut Vec<table::Row>) {
    let example = &corpus.examples[clip];
    let truth = contacts(&example.clip, &body.landmarks);
    let Some(streamed) = run(database, corpus, clip, example.style) else { return };
    for (method, found) in smoothings(&streamed, corpus.rate_hz) {
        let score = score(&found, &truth);
        rows.push(row(json!({
            "part": "data",
            "method": method,
            "action": corpus.actions[example.action],
            "style": corpus.styles[example.style],
            "clip": example.clip.name,
            "frames": truth.len(),
            "contact_f1": score.f1(),
            "accuracy": score.accuracy(),
            "flickers": flickers(&found, corpus.rate_hz),
            "changes_over_truth": over(changes(&found), changes(&truth)),
        })));
    }
}

/// The output in the fold's style against the truth clip at equal canonical time.
fn other_style(corpus: &Corpus, body: &Body, database: &Database<'_>, fold: &HeldOut) -> Option<table::Row> {
    let (example, other) = (&corpus.examples[fold.test], &corpus.examples[fold.truth]);
    let truth = contacts(&other.clip, &body.landmarks);
    let streamed = run(database, corpus, fold.test, fold.style)?;
    let mut score = Score::default();
    for (t, step) in streamed.steps.iter().enumerate() {
        // Contacts of two performances are compared at equal phase, in any cycle.
        let Some(at) = matched(&example.cycles, t, &other.cycles, 0) else { continue };
        let label = truth[(at.round().max(0.0) as usize).min(truth.len() - 1)];
        for side in [0, 1] {
            score.add(step.report.contacts[side], label[side]);
        }
    }
    // Two performances differ: these keys are not comparable with the classifier's own error.
    Some(row(json!({
        "part": "data",
        "method": "transfer",
        "action": corpus.actions[example.action],
        "style": corpus.styles[fold.style],
        "clip": example.clip.name,
        "truth": other.clip.name,
        "matched_f1": score.f1(),
        "matched_accuracy": score.accuracy(),
    })))
}

fn by_action(corpus: &Corpus, rows: &[table::Row]) -> Figure {
    let series: Vec<(String, Vec<f64>)> = ["stream", "unsmoothed", "gaussian"]
        .iter()
        .map(|method| {
            let of = |action: &String| {
                let rows = rows.iter().filter(|r| r["method"] == *method && r["action"] == **action);
                mean_or_zero(rows.filter_map(|r| r["contact_f1"].as_f64()))
            };
            ((*method).to_owned(), corpus.actions.iter().map(of).collect())
        })
        .collect();
    let labels = Labels { title: "F1 of contacts on held-out clips", x: "action", y: "F1" };
    Figure {
        name: "f1".into(),
        caption: "F1 of \"the foot stands\" against kinematic truth, by action and smoothing.".into(),
        svg: plots::bars(labels, &corpus.actions, &series),
    }
}
