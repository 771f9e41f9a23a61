//! Where the core departs from Xia 2015 for speed, beside what the paper says, in `f64` and without regard to speed: the
//! comparison of point clouds (eq. 1), neighbors of their own for timing (section 5.1) and for contacts (section 6).
//!
//! | `part` | `option` | neighbors are |
//! |---|---|---|
//! | `search` | `core` | those of the core's search |
//! | | `mean-cloud`, `tapered` | exact, clouds aligned to a mean cloud; weights that taper off |
//! | | `pairwise`, `pairwise-tapered` | exact, each pair aligned as in eq. 1; weights that taper off |
//! | `timing` | `core` | those of the pose, weighed by the core's metric |
//! | | `own`, `own-all-dofs` | the timing's own, by the core's metric and by all dofs |
//! | `contacts` | `core` | those of the pose, each foot by its own leg |
//! | | `own` | the contacts' own, by the clouds of the legs |

mod contacts;
mod names;
mod search;
mod timing;

use anyhow::Result;
use gestus_core::{Config, Database};
use gestus_database::stream::Request;
use gestus_motion::body::Body;

use crate::{
    baselines::outputs::{Outputs, Record, examples},
    evaluation::Evaluation,
    experiment::{Experiment, HeldOut},
    fold::{Fold, class_of, each},
    measures::{OnClips, Uses},
    report::table,
};

/// Options of `gestus evaluate literal`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let (body, folds) = experiment.folds()?;
        let rows = each("literal", experiment, &folds, &experiment.build, |held, database| {
            let mut rows = labelled(experiment, &body, held, database);
            // Contacts do not depend on the output style: one row a test clip.
            if folds.iter().find(|f| f.test == held.test) == Some(&held) {
                rows.extend(contacts::rows(experiment, &body, database, held.test));
            }
            rows
        })?;
        Ok(Evaluation {
            what: "literal",
            about: "What the core does otherwise than Xia 2015, beside what the paper says, with the paper's constants (K 40, or the class's cap) \
                    and action and style labelled. `search`: neighbors by point clouds (eq. 1), and the local autoregressive \
                    model and interpolation over them. `timing` and `contacts`: neighbors of their own."
                .into(),
            keys: vec!["part", "method", "option"],
            rows: rows.into_iter().flatten().collect(),
            figures: Vec::new(),
        })
    }
}

/// Search and timing of a fold, action and style labelled.
fn labelled(experiment: &Experiment, body: &Body, held: HeldOut, database: &Database<'_>) -> Vec<table::Row> {
    let fold = Fold::of(experiment, body, held);
    let example = &fold.corpus.examples[fold.test];
    let Some(class) = class_of(database, example.action, example.style) else { return Vec::new() };
    let request = Request {
        config: Config::paper(),
        action: Some(example.action as u16),
        input_style: Some(example.style as u16),
        ..Request::style(fold.style as u16)
    };
    let Ok((record, streamed)) = Record::of_stream(database, &example.clip, &request) else {
        return Vec::new();
    };
    let examples = examples(database, class, fold.style, Outputs::Mean);
    let mut rows = search::rows(&fold, database, class, &examples, &record);
    rows.extend(timing::rows(&fold, database, class, &examples, (&record, &streamed)));
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_literal_search_finds_what_the_core_does_and_its_model_errs_as_much() {
        let walks = Experiment::generated(&["walk"], &["neutral", "proud"], 3, 5.0);
        let rows = Args.evaluate(&walks).unwrap().rows;
        let of = |part: &str, method: &str, option: &str, key: &str| {
            let mut found =
                rows.iter().filter(|r| r["part"] == part && r["method"] == method && r["option"] == option);
            let row = found.next().unwrap_or_else(|| panic!("{part} {method} {option}"));
            row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row:?}"))
        };
        // The core's neighbors are those of the exact search but for packing, and its model is this one.
        assert!(of("search", "local-ar", "mean-cloud", "shared") > 0.8);
        for option in ["mean-cloud", "tapered", "pairwise", "pairwise-tapered"] {
            for method in ["local-ar", "knn"] {
                let ratio = of("search", method, option, "joint_error_cm")
                    / of("search", method, "core", "joint_error_cm");
                assert!((0.7..1.4).contains(&ratio), "{method} {option} {ratio}");
            }
        }
        for option in ["core", "own", "own-all-dofs"] {
            assert!(of("timing", "local-ar", option, "step_error_ms") < 8.0, "{option}");
        }
        for option in ["core", "own"] {
            assert!(of("contacts", "unsmoothed", option, "contact_f1") > 0.9, "{option}");
        }
    }
}
