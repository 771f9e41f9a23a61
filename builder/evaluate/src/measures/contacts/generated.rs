//! Contacts of generated motion against the generator's: it plants feet by plan, so that its truth is no detector's.
//!
//! A foot is in contact from the first touch of its heel to the last of its toes ([`synth::touches`]).

use anyhow::Result;
use gestus_core::Database;
use gestus_database::{
    build::{BuildOptions, build},
    registration::contact::{apply_majority, contacts},
    stream::{Request, stream},
    synth::{self, Options},
};
use gestus_motion::{
    corpus::{Corpus, Example},
    landmarks::Landmarks,
};
use rayon::prelude::*;
use serde_json::json;

use super::{
    score::{changes, flickers, over, score},
    smoothing::smoothings,
};
use crate::{evaluation::row, report::table};

/// Seed of the motion. The detector's thresholds were chosen on seed 1.
const SEED: u64 = 20;
/// Clips of each action and style for the detector.
const CLIPS: usize = 3;
/// Length of gaits, seconds.
const SECONDS: f64 = 10.0;
/// What is streamed: clip 0 of each class is held out of a database of the others.
const STREAMED: ([&str; 4], [&str; 3]) = (["walk", "run", "jump", "kick"], ["neutral", "old", "childlike"]);

/// Rows of the detector over all actions and styles, and of streams over some.
pub(super) fn rows() -> Result<Vec<table::Row>> {
    let mut rows = detector(&Options { seed: SEED, clips: CLIPS, seconds: SECONDS, ..Options::default() })?;
    let (actions, styles) = STREAMED;
    rows.extend(streams(&Options { seed: SEED, ..Options::of(&actions, &styles, 4, SECONDS) })?);
    Ok(rows)
}

/// The generator's own contacts of every clip.
fn truths(options: &Options, corpus: &Corpus) -> Result<Vec<Vec<[bool; 2]>>> {
    let of = |e: &Example| {
        let clip = e.take.parse()?;
        Ok(synth::touches(options, &corpus.actions[e.action], &corpus.styles[e.style], clip)?)
    };
    corpus.examples.iter().map(of).collect()
}

/// The builder's detector: in each clip alone, and carried over the canonical timelines.
fn detector(options: &Options) -> Result<Vec<table::Row>> {
    let corpus = synth::corpus(options)?;
    let truths = truths(options, &corpus)?;
    let landmarks = Landmarks::find(&corpus.skeleton)?;
    let mut found = corpus.examples.clone();
    found.par_iter_mut().for_each(|e| e.contacts = contacts(&e.clip, &landmarks));
    let mut carried = found.clone();
    apply_majority(&mut carried);
    let mut rows = Vec::new();
    for (method, found) in [("detector", found), ("detector-carried", carried)] {
        for ((example, truth), planned) in found.iter().zip(&truths).zip(&corpus.examples) {
            rows.push(of_clip(&corpus, method, example, truth, &planned.contacts));
        }
    }
    Ok(rows)
}

/// Held-out clips to their own styles; the neighbors vote with the generator's contacts.
fn streams(options: &Options) -> Result<Vec<table::Row>> {
    let mut corpus = synth::corpus(options)?;
    let truths = truths(options, &corpus)?;
    let planned: Vec<Vec<[bool; 2]>> = corpus.examples.iter().map(|e| e.contacts.clone()).collect();
    for (example, truth) in corpus.examples.iter_mut().zip(&truths) {
        example.contacts.clone_from(truth);
    }
    let tests: Vec<usize> =
        (0..corpus.examples.len()).filter(|&i| corpus.examples[i].take == "000").collect();
    let bytes =
        build(&corpus.without(&tests), &BuildOptions { models: false, ..BuildOptions::default() })?.bytes;
    let database = Database::open(&bytes)?;
    let of = |&test: &usize| -> Result<Vec<table::Row>> {
        let example = &corpus.examples[test];
        let request = Request::style(example.style as u16);
        let streamed = stream(&database, &example.clip, &request, &mut ()).map_err(anyhow::Error::msg)?;
        let rows = smoothings(&streamed, corpus.rate_hz).map(|(method, found)| {
            let example = Example { contacts: found, ..example.clone() };
            of_clip(&corpus, method, &example, &truths[test], &planned[test])
        });
        Ok(rows.to_vec())
    };
    let rows: Vec<Vec<table::Row>> = tests.par_iter().map(of).collect::<Result<_>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// A row: the contacts of an example against the truth, and against what the generator calls planted.
fn of_clip(
    corpus: &Corpus,
    method: &str,
    found: &Example,
    truth: &[[bool; 2]],
    planted: &[[bool; 2]],
) -> table::Row {
    let agreed = score(&found.contacts, truth);
    row(json!({
        "part": "generated",
        "method": method,
        "action": corpus.actions[found.action],
        "style": corpus.styles[found.style],
        "clip": found.clip.name,
        "frames": truth.len(),
        "contact_f1": agreed.f1(),
        "accuracy": agreed.accuracy(),
        "planted_f1": score(&found.contacts, planted).f1(),
        "flickers": flickers(&found.contacts, corpus.rate_hz),
        "changes_over_truth": over(changes(&found.contacts), changes(truth)),
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_detector_finds_the_generators_contacts() {
        let options = Options { seed: SEED, ..Options::of(&["walk", "run"], &["neutral", "old"], 2, 6.0) };
        let rows = detector(&options).unwrap();
        let of = |method: &str, key: &str| {
            let rows: Vec<&table::Row> = rows.iter().filter(|r| r["method"] == method).collect();
            assert_eq!(rows.len(), 8);
            rows.iter().map(|r| r[key].as_f64().unwrap()).sum::<f64>() / 8.0
        };
        // A heel that touches stands, before the ball is down.
        assert!(of("detector", "contact_f1") > of("detector", "planted_f1"));
        assert!(of("detector", "contact_f1") > 0.95, "{}", of("detector", "contact_f1"));
        assert!(of("detector-carried", "contact_f1") > of("detector", "contact_f1") - 0.01);
    }

    #[test]
    fn a_foot_touches_the_floor_from_heel_to_toe() {
        let options = Options::of(&["walk", "jump"], &["neutral"], 1, 6.0);
        let corpus = synth::corpus(&options).unwrap();
        for (example, touches) in corpus.examples.iter().zip(truths(&options, &corpus).unwrap()) {
            for (t, frame) in example.clip.frames.iter().enumerate() {
                for side in [0, 1] {
                    let lowest = synth::sole(frame, &corpus.skeleton, side).map(|p| p.y);
                    let lowest = lowest.into_iter().fold(f64::INFINITY, f64::min);
                    // A planted foot touches; what touches is on the floor, whatever the hips cost the leg.
                    assert!(touches[t][side] || !example.contacts[t][side]);
                    assert!(!touches[t][side] || lowest.abs() < 0.005, "{} {t} {lowest}", example.clip.name);
                }
            }
        }
    }
}
