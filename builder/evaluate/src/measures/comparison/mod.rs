//! `gestus evaluate methods`: every method on the same clips, as in Xia 2015, Table 3 and Figures 3, 4 and 6.
//!
//! | set | database and test clips |
//! |---|---|
//! | `homogeneous` | one action: the walk, or the first there is |
//! | `heterogeneous` | all actions at once |
//! | `stream` | all actions, and the test clips of all of them as one stream, one action after the other; labelled methods are told each change of action |
//! | `homogeneous-exact`, `heterogeneous-exact`, `stream-exact` | outputs made by rule, whose true answer is known ([`gestus_database::synth::affine`]) |
//! | `homogeneous-generated`, `heterogeneous-generated`, `stream-generated` | [`gestus_database::synth`]'s walk, and four of its actions, neutral to old: inputs too are generated, and the truth is the same content in the style |
//!
//! Rows are those of [`super::loo`], labelled and unlabelled, with their set. Gaussian processes are always among the
//! methods, as in the paper. The report states the result in words.

mod streams;
mod verdict;

use serde_json::json;

use crate::{
    evaluation::{self, Evaluation},
    experiment::{Experiment, only},
    measures::{
        OnClips, Uses,
        loo::{self, Methods, exact_pairs},
    },
    report::table,
};
use gestus_database::{build::BuildError, command_line::progress, synth};

/// Generated clips of an action in a style.
const GENERATED: usize = 8;

/// Options of `gestus evaluate methods`.
#[derive(clap::Args, Debug, Default)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let methods = Methods { gaussian_process: true, ..Methods::default() };
        let sets = sets(experiment)?;
        let bar = progress::bar(sets.iter().map(|(_, e)| e.max_folds()).sum(), "methods");
        let mut rows: Vec<table::Row> = Vec::new();
        for (set, experiment) in &sets {
            let corpus = &experiment.corpus;
            let (body, folds) = experiment.folds()?;
            let results = loo::run_folds(experiment, &body, &folds, &methods, &|| bar.inc(1))?;
            rows.extend(results.iter().map(|r| labelled(set, r.to_json(corpus))));
            if let Some(kind) = set.strip_prefix("heterogeneous") {
                let set = format!("stream{kind}");
                let results = streams::rows(experiment, &body, &folds)?;
                rows.extend(results.iter().map(|r| labelled(&set, r.to_json(corpus))));
            }
        }
        bar.finish_and_clear();
        let mut figures = vec![
            verdict::bars(&rows, "joint_error_cm", "Predicted error", "cm"),
            verdict::bars(&rows, "step_error_ms", "Timing error", "ms"),
        ];
        figures.extend(loo::figures::curves(experiment)?);
        let about = verdict::verdict(&rows);
        Ok(Evaluation { what: "methods", about, keys: vec!["set", "method"], rows, figures })
    }
}

/// The sets of clips that methods are compared on, by name.
fn sets(experiment: &Experiment) -> Result<Vec<(&'static str, Experiment)>, BuildError> {
    let generated = |actions: &[&str]| {
        let options = synth::Options::of(actions, &["neutral", "old"], GENERATED, 6.0);
        // The generator knows all of these names.
        let corpus = synth::corpus(&options).map_err(|e| BuildError::Unpaired(e.to_string()))?;
        Ok::<_, BuildError>(Experiment { among: None, ..experiment.on_pairs(corpus) })
    };
    let corpus = &experiment.corpus;
    let walk = corpus.action("walk").unwrap_or(0);
    let one = Experiment { corpus: only(corpus, &[walk], &[]), ..experiment.clone() };
    let several = (corpus.actions.len() > 1).then_some(experiment);
    let mut sets = vec![("homogeneous", one.clone())];
    sets.extend(several.map(|e| ("heterogeneous", e.clone())));
    sets.push(("homogeneous-exact", exact_pairs(&one)?));
    if let Some(several) = several {
        sets.push(("heterogeneous-exact", exact_pairs(several)?));
    }
    sets.push(("homogeneous-generated", generated(&["walk"])?));
    sets.push(("heterogeneous-generated", generated(&["walk", "run", "punch", "kick"])?));
    Ok(sets)
}

fn labelled(set: &str, row: table::Row) -> table::Row {
    let mut with = evaluation::row(json!({ "set": set }));
    with.extend(row);
    with
}
