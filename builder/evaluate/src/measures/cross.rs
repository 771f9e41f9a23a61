//! `gestus evaluate cross`: motion of actions that the database lacks (Xia 2015, section 7.3). A translation of it should
//! be no further from the style than the input is; where it can't be made, the input should pass, and the report say so.
//!
//! | `database` | holds | `part` of its rows |
//! |---|---|---|
//! | an action | that action alone | `known`: its held-out clips; `other`: test clips of the other actions |
//! | `all` | all actions | `known`; `unseen`: clips of `--unseen` whose action is none of them |

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use gestus_core::Database;
use gestus_database::{
    build::build,
    command_line::progress,
    data_folder::{config, load::load},
    stream::is_same_body,
};
use gestus_motion::{body::Body, statistics::mean};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut, only},
    fold::{Fold, far, own_dofs},
    measures::{METHODS, OnClips, Uses, streamed},
    plots::{self, Labels},
    report::{html::Figure, table},
};

/// Options of `gestus evaluate cross`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// Folder with clips of more actions, on the same skeleton. Its clips in the style --from, of actions that --data lacks,
    /// are also translated
    #[arg(long)]
    unseen: Option<PathBuf>,
}

/// A test clip, and its counterpart in an output style if there is one.
struct Test {
    clip: usize,
    truth: Option<usize>,
    /// The output style, as the database numbers it.
    style: usize,
}

/// Test clips that go through one database, of which they are one part.
struct Part<'a> {
    name: &'static str,
    experiment: &'a Experiment,
    body: &'a Body,
    tests: Vec<Test>,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let corpus = &experiment.corpus;
        let (body, folds) = experiment.folds()?;
        let unseen = self.unseen.as_deref().map(|folder| load_unseen(folder, experiment)).transpose()?;
        let unseen_body = unseen.as_ref().map(|u| Body::of(&u.corpus)).transpose()?;
        let every: Vec<usize> = (0..corpus.actions.len()).collect();
        let mut sets: Vec<(String, Vec<usize>)> =
            every.iter().map(|&a| (corpus.actions[a].clone(), vec![a])).collect();
        if every.len() > 1 {
            sets.push(("all".into(), every));
        }
        let options = experiment.build_with_models();
        let bar = progress::bar(sets.len(), "across actions");
        let mut rows = Vec::new();
        for (i, (name, actions)) in sets.iter().enumerate() {
            let is_known = |f: &&HeldOut| actions.contains(&corpus.examples[f.test].action);
            let (known, other): (Vec<HeldOut>, Vec<HeldOut>) = folds.iter().partition(is_known);
            let test = |f: &HeldOut| Test { clip: f.test, truth: Some(f.truth), style: f.style };
            for (number, group) in experiment.grouped(&known).iter().enumerate() {
                let left_out: Vec<usize> = group.iter().flat_map(|f| [f.test, f.truth]).collect();
                let bytes = build(&only(corpus, actions, &left_out), &options)?.bytes;
                let database = Database::open(&bytes)?;
                let part = |name, folds: &[HeldOut]| {
                    let tests = folds.iter().map(test).collect();
                    Part { name, experiment, body: &body, tests }
                };
                let mut parts = vec![part("known", group)];
                // What the database lacks goes through the first alone: the others are of the same clips but one a class.
                if number == 0 {
                    parts.push(part("other", &other));
                    if let (Some(unseen), Some(body), true) = (&unseen, &unseen_body, i + 1 == sets.len()) {
                        let tests = tests_of(unseen, body, experiment);
                        parts.push(Part { name: "unseen", experiment: unseen, body, tests });
                    }
                }
                for part in parts {
                    part.rows(name, &database, &corpus.styles, &mut rows);
                }
            }
            bar.inc(1);
        }
        bar.finish_and_clear();
        Ok(Evaluation {
            what: "cross",
            about: "Motion of actions that the database lacks, unlabelled. `delivered_error_cm` is the distance of the pose \
                    that leaves from a real clip of the action in the output style, `unchanged_error_cm` that of the input, \
                    `over_unchanged` their ratio: above 1 the translation does harm. `far` is the share of frames in which \
                    the report says that the input is unlike the data."
                .into(),
            keys: vec!["method", "part", "database", "action"],
            figures: vec![harm(&rows)],
            rows,
        })
    }
}

/// The clips of a folder whose action the experiment lacks.
fn load_unseen(folder: &Path, experiment: &Experiment) -> Result<Experiment> {
    let known = &experiment.corpus;
    let mut config = config::Config::of_folder(folder)?;
    config.rate_hz = known.rate_hz;
    let loaded = load(&config)?.corpus;
    if !is_same_body(&loaded.skeleton, &known.skeleton) {
        bail!(
            "{}: its skeleton is not that of --data: bring its clips there with `gestus retarget`",
            folder.display()
        );
    }
    let actions: Vec<usize> =
        (0..loaded.actions.len()).filter(|&a| !known.actions.contains(&loaded.actions[a])).collect();
    let corpus = only(&loaded, &actions, &[]);
    let from = corpus.style(&known.styles[experiment.from]);
    let Ok(from) = from else {
        bail!("{}: no clip is in the style {} (--from)", folder.display(), known.styles[experiment.from]);
    };
    if corpus.examples.is_empty() {
        bail!("{}: all of its actions are in --data too", folder.display());
    }
    Ok(Experiment { corpus, from, folds: usize::MAX, among: None, ..experiment.clone() })
}

/// Every unseen clip in every output style, with a counterpart where the folder has one.
fn tests_of(unseen: &Experiment, body: &Body, experiment: &Experiment) -> Vec<Test> {
    let tests = unseen.test_clips();
    let of = |&clip: &usize| {
        experiment.to.iter().map(move |&style| {
            let own = unseen.corpus.style(&experiment.corpus.styles[style]).ok();
            let truth = own.and_then(|s| unseen.counterparts(body, clip, s).first().copied());
            Test { clip, truth, style }
        })
    };
    tests.iter().flat_map(of).collect()
}

impl Part<'_> {
    /// Adds a row for each test clip and method.
    fn rows(&self, name: &str, database: &Database<'_>, styles: &[String], rows: &mut Vec<table::Row>) {
        let corpus = &self.experiment.corpus;
        for test in &self.tests {
            let example = &corpus.examples[test.clip];
            let fold = test.truth.map(|truth| {
                let style = corpus.examples[truth].style;
                Fold::of(self.experiment, self.body, HeldOut { test: test.clip, truth, other: None, style })
            });
            for (method, _, record, streamed) in streamed(database, &example.clip, test.style) {
                let measured = fold.as_ref().map(|fold| {
                    let predicted = own_dofs(fold, database, &record.predicted);
                    let unchanged = fold.row("unchanged", &fold.x, None).delivered.error_cm;
                    (fold.row(method, &predicted, Some(&streamed)), unchanged)
                });
                let delivered = measured.as_ref().map(|m| m.0.delivered.error_cm);
                let unchanged = measured.as_ref().map(|m| m.1);
                rows.push(row(json!({
                    "method": method,
                    "part": self.name,
                    "database": name,
                    "action": corpus.actions[example.action],
                    "style": styles[test.style],
                    "clip": example.clip.name,
                    "truth": measured.as_ref().map(|m| &m.0.truth),
                    "delivered_error_cm": delivered,
                    "joint_error_cm": measured.as_ref().map(|m| m.0.predicted.error_cm),
                    "unchanged_error_cm": unchanged,
                    "over_unchanged": delivered.zip(unchanged).map(|(d, u)| d / u),
                    "far": far(&streamed),
                    "passed": mean(streamed.steps.iter().map(|s| f64::from(s.report.passed))),
                })));
            }
        }
    }
}

/// Error delivered over that of the input, for each method by database and action.
fn harm(rows: &[table::Row]) -> Figure {
    let means = table::means(rows, &["method", "database", "action"]);
    let name =
        |r: &table::Row| format!("{} < {}", table::text(r.get("database")), table::text(r.get("action")));
    let pairs = table::distinct(means.iter().filter(|r| r.contains_key("over_unchanged")).map(name));
    let of = |method: &str, pair: &String| {
        let row = means.iter().find(|r| r["method"] == method && name(r) == *pair);
        row.and_then(|r| r.get("over_unchanged")?.as_f64()).unwrap_or(0.0)
    };
    let series: Vec<(String, Vec<f64>)> = METHODS
        .iter()
        .map(|(method, _)| ((*method).to_owned(), pairs.iter().map(|p| of(method, p)).collect()))
        .collect();
    let labels =
        Labels { title: "Delivered error over the input's", x: "database < action of the input", y: "ratio" };
    Figure {
        name: "harm".into(),
        caption: "Above 1, the translation is further from the style than the input.".into(),
        svg: plots::bars(labels, &pairs, &series),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_action_goes_through_a_database_of_the_other() {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "proud"], 2, 4.0);
        let rows = Args { unseen: None }.evaluate(&experiment).unwrap().rows;
        let of = |database: &str, part: &str| {
            let is =
                |r: &&table::Row| r["method"] == "mixture" && r["database"] == database && r["part"] == part;
            let found: Vec<&table::Row> = rows.iter().filter(is).collect();
            assert_eq!(found.len(), if database == "all" { 2 } else { 1 }, "{database} {part}");
            found[0].clone()
        };
        let (known, other) = (of("walk", "known"), of("walk", "other"));
        assert_eq!((known["action"].as_str(), other["action"].as_str()), (Some("walk"), Some("run")));
        let number = |row: &table::Row, key: &str| row[key].as_f64().unwrap();
        assert!(number(&known, "over_unchanged") < 1.0, "{known:?}");
        // A run among walks is what `far` is for.
        assert!(number(&other, "far") > 0.5 && number(&known, "far") < 0.1, "{other:?} {known:?}");
        assert!(rows.iter().all(|r| r["part"] != "unseen"));
        of("all", "known");
        of("run", "other");
    }
}
