//! How well Effort is learned: mean squared errors of each method over random splits (Torresani 2006, Table 1).

use gestus_database::{
    build::BuildError,
    effort::{
        Factors, NAMES, Source,
        fragment::Library,
        learn::{Method, compare, errors, means},
        model::{BLENDS, MIN_BLENDS, Model, draw},
        sheet::{SEEDS, selected},
    },
    synth,
};
use serde_json::{Value, json};

use crate::{
    evaluation,
    metrics::annotator::{Annotator, Eye},
    plots::{self, Labels, Series},
    report::{html::Figure, table},
};

/// Examples to learn from in each random split (Torresani 2006, section 8).
pub(super) const TRAIN: usize = 85;
/// Corpora of generated motion that the annotator labels. Each has this share of the splits.
pub(super) const ANNOTATORS: usize = 10;
/// Corpora of the regression: the data's, and generated motion with the labels of each annotator.
pub(super) const CORPORA: [&str; 3] = ["data", "generated-first", "generated"];
/// Seed of everything random in the measure.
pub(super) const SEED: u64 = 2006;

/// Mean squared errors on the simulated annotator's labels, of each method ([`Method::ALL`]) and factor: over random
/// splits of one corpus of generated motion, or of each of several, that of the seed and of those after it. Shape
/// `[annotators][methods]`.
///
/// # Errors
/// [`BuildError`] where the generator makes nothing to learn from.
pub fn annotated(
    annotators: usize,
    splits: usize,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Vec<Factors>>, BuildError> {
    (0..annotators as u64)
        .map(|n| {
            let model = generated(Eye::Force, SEED + n)?;
            Ok(means(&errors(&model.known, &model.examples, TRAIN, splits, SEED, progress)))
        })
        .collect()
}

/// Generated motion in eight styles with a simulated annotator's labels.
pub(super) fn generated(eye: Eye, seed: u64) -> Result<Model, BuildError> {
    let options = synth::Options {
        seed,
        actions: ["walk", "run", "punch", "kick", "jump"].map(String::from).to_vec(),
        clips: 2,
        seconds: 6.0,
        ..synth::Options::default()
    };
    // The names above are the generator's own.
    let corpus = synth::corpus(&options).map_err(|e| BuildError::Unpaired(e.to_string()))?;
    let library = selected(&Library::found(&corpus)?, SEEDS);
    let annotator = Annotator::of(&library, eye, seed);
    let draws = draw(&library, BLENDS, seed);
    Ok(Model::observed(library, Source::Generated, &draws, &move |rows, action| annotator.note(rows, action)))
}

/// Table 1 of Torresani 2006 of a model; nothing of one that has too few labelled blends to learn from and to test.
pub(super) fn regression(
    corpus: &str,
    model: &Model,
    splits: usize,
    tick: &(dyn Fn() + Sync),
) -> Vec<table::Row> {
    if model.examples.len() < MIN_BLENDS {
        return Vec::new();
    }
    // 85 of 105, and as large a share of fewer.
    let train = TRAIN.min(model.examples.len() * TRAIN / BLENDS);
    let errors = errors(&model.known, &model.examples, train, splits, SEED, tick);
    let of = json!({ "part": "regression", "action": null, "style": null, "corpus": corpus, "labels": model.source.name() });
    let sizes = json!({
        "splits": splits, "train": train, "test": model.examples.len() - train,
        "fragments": model.library.fragments.len(),
    });
    compared(&errors, &of, &sizes)
}

/// Compares every method with interpolation, factor by factor, over the same splits or annotators.
fn compared(errors: &[Vec<Factors>], of: &Value, sizes: &Value) -> Vec<table::Row> {
    let mut rows = Vec::new();
    for (m, method) in Method::ALL.iter().enumerate() {
        for (k, factor) in NAMES.iter().enumerate() {
            let of_method = |m: usize| errors.iter().map(|e| e[m][k]).collect::<Vec<f64>>();
            let compared = compare(&of_method(m), &of_method(0));
            let mut row = evaluation::row(of.clone());
            row.extend(evaluation::row(json!({
                "method": method.name(), "factor": factor, "mse": compared.mean,
                "standard_error": compared.standard_error,
                "gain": compared.gain, "gain_error": compared.gain_error, "better": compared.better,
            })));
            row.extend(evaluation::row(sizes.clone()));
            rows.push(row);
        }
    }
    rows
}

/// The same annotator with new motion and noise each time. Splits of one corpus share their examples, corpora share
/// nothing: a paired test over corpora says whether a method is better for annotators like this one.
pub(super) fn annotators(splits: usize, tick: &(dyn Fn() + Sync)) -> Result<Vec<table::Row>, BuildError> {
    let errors = annotated(ANNOTATORS, splits, tick)?;
    let of = json!({ "part": "annotators", "action": null, "style": null, "corpus": "generated", "labels": Source::Generated.name() });
    Ok(compared(&errors, &of, &json!({ "annotators": ANNOTATORS, "splits": splits })))
}

/// Errors by factor and method.
pub(super) fn mse_figure(rows: &[table::Row]) -> Figure {
    let value = |corpus: &str, method: &str, factor: &str| {
        rows.iter()
            .find(|r| {
                r["part"] == "regression"
                    && r["corpus"] == corpus
                    && r["method"] == method
                    && r["factor"] == factor
            })
            .and_then(|r| r["mse"].as_f64())
            .unwrap_or(f64::NAN)
    };
    let groups: Vec<String> =
        CORPORA.iter().flat_map(|c| NAMES.iter().map(move |n| format!("{n}, {c}"))).collect();
    let series: Vec<(String, Vec<f64>)> = Method::ALL
        .iter()
        .map(|m| {
            let of = |c: &'static str| NAMES.iter().map(move |n| value(c, m.name(), n));
            (m.name().to_owned(), CORPORA.into_iter().flat_map(of).collect())
        })
        .collect();
    Figure {
        name: "mse".into(),
        caption: "Mean squared error of predicted Efforts (Torresani 2006, Table 1).".into(),
        svg: plots::bars(
            Labels { title: "Predicting the Effort of a blend", x: "factor", y: "mean squared error" },
            &groups,
            &series,
        ),
    }
}

/// Predicted factors over α for three pairs.
pub(super) fn curve_figure(model: &Model) -> Figure {
    let mut series: Vec<Series> = Vec::new();
    for (n, e) in model.examples.iter().take(3).enumerate() {
        for (k, name) in NAMES.iter().enumerate() {
            let points = (0..=30).map(|i| -0.25 + 1.5 * f64::from(i) / 30.0);
            let curve = points.map(|a| (a, model.predict(e.first, e.second, a)[k])).collect();
            series.push((format!("{name}, pair {}", n + 1), curve));
        }
    }
    Figure {
        name: "alpha".into(),
        caption: "Effort predicted by kernel ridge regression over the weight of a blend, generated annotator (Torresani 2006, Figure 1).".into(),
        svg: plots::lines(Labels { title: "Effort over the weight of a blend", x: "weight of the second fragment", y: "factor" }, &series),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nothing was tested, and an error of 0 was reported; of one blend there was nothing to learn from, and a panic.
    #[test]
    fn too_few_blends_have_no_error() {
        let library = Library::found(
            &synth::corpus(&synth::Options::of(&["walk"], &["neutral", "angry"], 2, 4.0)).unwrap(),
        )
        .unwrap();
        let draws = draw(&library, BLENDS, SEED);
        for count in [0, 1, MIN_BLENDS - 1] {
            let model = Model::estimated(library.clone(), &draws[..count]);
            assert_eq!(model.examples.len(), count);
            assert!(regression("data", &model, 1, &|| ()).is_empty(), "{count}");
        }
        let model = Model::estimated(library, &draws[..MIN_BLENDS]);
        let rows = regression("data", &model, 1, &|| ());
        assert_eq!(rows.len(), 3 * Method::ALL.len());
        assert!(rows.iter().all(|r| r["test"].as_u64() > Some(0)));
    }
}
