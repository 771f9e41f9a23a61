//! Contacts on clips that the database has never seen, against where their feet really are and how fast they move.
//!
//! A held-out clip is streamed to its own style, nothing labelled: the output is the input, so that its feet have a
//! truth. The labels that vote come from other clips.

use gestus_core::{Database, methods::mixture::contact_votes::DELAY_FRAMES};
use serde_json::json;

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
    build::BuildError,
    command_line::progress,
    registration::contact::{GAUSSIAN_S, contacts, smoothed},
    stream::{Request, Streamed, stream},
};
use gestus_motion::{body::Body, corpus::Corpus, statistics::mean_or_zero};

/// Counts of agreement over both feet.
#[derive(Debug, Clone, Copy, Default)]
pub struct Score {
    both: f64,
    found: f64,
    true_: f64,
    agreed: f64,
    all: f64,
}

impl Score {
    /// Counts one foot in one frame.
    pub fn add(&mut self, found: bool, truth: bool) {
        let one = |b: bool| f64::from(u8::from(b));
        self.both += one(found && truth);
        self.found += one(found);
        self.true_ += one(truth);
        self.agreed += one(found == truth);
        self.all += 1.0;
    }

    /// Harmonic mean of precision and recall of "stands".
    pub fn f1(&self) -> f64 {
        2.0 * self.both / (self.found + self.true_).max(1.0)
    }

    /// Share of feet and frames that agree.
    pub fn accuracy(&self) -> f64 {
        self.agreed / self.all.max(1.0)
    }
}

fn score(found: &[[bool; 2]], truth: &[[bool; 2]]) -> Score {
    let mut score = Score::default();
    for (f, t) in found.iter().zip(truth) {
        score.add(f[0], t[0]);
        score.add(f[1], t[1]);
    }
    score
}

/// Options of `gestus evaluate contacts`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let corpus = &experiment.corpus;
        let (body, folds) = experiment.folds()?;
        let bar = progress::bar(folds.len(), "contacts");
        let rows = each(experiment, &folds, &experiment.build, |fold, database| {
            let mut rows = Vec::new();
            // One row a clip: the same one is in several folds, and would count as often.
            for clip in [fold.test, fold.truth] {
                let mut earlier = folds.iter().take_while(|f| **f != fold);
                if earlier.all(|f| f.test != clip && f.truth != clip) {
                    own_style(corpus, &body, database, clip, &mut rows);
                }
            }
            rows.extend(other_style(corpus, &body, database, &fold));
            bar.inc(1);
            Ok::<_, BuildError>(rows)
        })?;
        bar.finish_and_clear();
        let rows: Vec<table::Row> = rows.into_iter().flatten().collect();
        let figures = vec![by_action(corpus, &rows)];
        Ok(Evaluation {
            what: "contacts",
            about: "Which foot stands, on held-out clips, against where their feet are and how fast they move. Each clip \
                    is streamed to its own style, unlabelled. `causal` is what a stream gets, `gaussian` what a file can \
                    have (Xia 2015, section 6), `unsmoothed` the bare vote; `transfer` compares the output in another \
                    style with the truth clip at equal canonical time."
                .into(),
            keys: vec!["method", "action", "style"],
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
    let likelihoods: Vec<[f64; 2]> =
        streamed.steps.iter().map(|s| s.report.contact_likelihood.map(f64::from)).collect();
    let causal: Vec<[bool; 2]> = streamed.steps.iter().map(|s| s.report.contacts).collect();
    let bare: Vec<[bool; 2]> = likelihoods.iter().map(|l| l.map(|l| l > 0.5)).collect();
    let gaussian = smoothed(&likelihoods, GAUSSIAN_S * corpus.rate_hz);
    for (method, found, delay) in
        [("causal", causal, f64::from(DELAY_FRAMES)), ("unsmoothed", bare, 0.0), ("gaussian", gaussian, 0.0)]
    {
        let score = score(&found, &truth);
        rows.push(row(json!({
            "method": method,
            "action": corpus.actions[example.action],
            "style": corpus.styles[example.style],
            "clip": example.clip.name,
            "frames": truth.len(),
            "contact_f1": score.f1(),
            "accuracy": score.accuracy(),
            "delay_frames": delay,
            "flickers": flickers(&found, corpus.rate_hz),
        })));
    }
}

/// Contacts and gaps of less than 50 ms, a second.
fn flickers(contacts: &[[bool; 2]], rate_hz: f64) -> f64 {
    let shortest = (0.05 * rate_hz).ceil() as usize;
    let mut count = 0;
    for side in [0, 1] {
        let mut start = 0;
        for t in 1..contacts.len() {
            if contacts[t][side] != contacts[t - 1][side] {
                count += usize::from(start > 0 && t - start < shortest);
                start = t;
            }
        }
    }
    count as f64 / (contacts.len() as f64 / rate_hz)
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
    let series: Vec<(String, Vec<f64>)> = ["causal", "unsmoothed", "gaussian"]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_count_what_they_say() {
        // Left: two right of three; right: one missed.
        let found = [[true, false], [true, false], [false, false]];
        let truth = [[true, false], [false, true], [false, false]];
        let score = score(&found, &truth);
        assert!((score.f1() - 0.5).abs() < 1e-12);
        assert!((score.accuracy() - 4.0 / 6.0).abs() < 1e-12);
    }

    #[test]
    fn one_frame_in_the_air_is_a_flicker_and_a_step_is_none() {
        let mut contacts = vec![[true, true]; 30];
        contacts[10][0] = false;
        contacts[20..25].iter_mut().for_each(|c| c[1] = false);
        assert!((flickers(&contacts, 30.0) - 1.0).abs() < 1e-12);
    }
}
