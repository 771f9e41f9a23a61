//! The measures of the field, for every method: is the output recognised as its content and as its style, how far are its
//! features from those of real motion, how much do feet skate, how rough is it. `docs/METRICS.md` says which definition is
//! whose.

mod features;
mod motion;

use std::collections::{BTreeMap, BTreeSet};

use anyhow::Result;
use gestus_core::{Config, Database, Method};
use gestus_database::registration::contact::legs;
use gestus_motion::{body::Body, clip::Clip, corpus::Corpus};
use nalgebra::DVector;
use serde_json::json;

use crate::{
    baselines::outputs::{ClassNeighbors, Outputs, interpolated},
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut},
    fold::each,
    measures::{OnClips, Uses, streamed},
    metrics::performance::Performance,
    outside::{Output, OutsideArgs},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use features::{Classifier, frechet, windows};

/// Options of `gestus evaluate field`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    #[command(flatten)]
    outside: OutsideArgs,
}

/// A motion to be judged: the method's output for a fold, or a real clip.
struct Judged {
    method: String,
    fold: HeldOut,
    clip: Clip,
}

/// Classifiers of windows of real clips.
struct Judges {
    /// Of classes, action · styles + style.
    classes: Option<Classifier>,
    /// Of styles by the clips of all actions but one, less the mean of their action. By the action left out.
    across: Vec<Option<Classifier>>,
    /// Mean features of each action over real clips.
    means: Vec<DVector<f64>>,
    styles: usize,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let corpus = &experiment.corpus;
        let (body, folds) = experiment.folds()?;
        let others = self.outside.run(experiment)?;
        let options = experiment.build_with_models();
        let judged: Vec<Vec<Judged>> = each("field", experiment, &folds, &options, |fold, database| {
            outputs(corpus, &body, database, fold)
        })?;
        let mut judged: Vec<Judged> = judged.into_iter().flatten().collect();
        for (method, &fold) in others.iter().flat_map(|method| folds.iter().map(move |fold| (method, fold))) {
            let of = |output: &Output| Judged { method: method.name.clone(), fold, clip: output.resampled() };
            judged.extend(method.output(fold).map(of));
        }
        // No clip that is judged, and no truth, has taught the judges.
        let held: BTreeSet<usize> = folds.iter().flat_map(|f| [f.test, f.truth]).collect();
        let known: Vec<usize> = (0..corpus.examples.len()).filter(|i| !held.contains(i)).collect();
        let real: Vec<Vec<DVector<f64>>> =
            known.iter().map(|&i| windows(&body, &corpus.examples[i].clip)).collect();
        let judges = Judges::of(corpus, &known, &real);
        let seen: Vec<Vec<DVector<f64>>> = judged.iter().map(|j| windows(&body, &j.clip)).collect();
        let mut rows: Vec<table::Row> =
            judged.iter().zip(&seen).map(|(j, w)| judges.row(experiment, &body, j, w)).collect();
        rows.extend(distributions(experiment, &judged, &seen, (&known, &real)));
        Ok(Evaluation {
            what: "field",
            about: "Measures of other papers, unlabelled, of what is delivered. `content` and `style_right` are the shares of clips \
                    that a classifier of real motion takes for the input's action and for the output style; `style_across` \
                    by a classifier that has never seen the action; `fmd` the Fréchet distance of features to real clips \
                    of the style; `skating_ratio` the share of frames in which a low foot slides. `real` are held-out \
                    clips of the output style, the best that can be had; `unchanged` is the input."
                .into(),
            keys: vec!["method"],
            figures: vec![recognised(&rows)],
            rows,
        })
    }
}

/// The outputs of all methods for a fold, resampled to the database's rate at their own times.
fn outputs(corpus: &Corpus, body: &Body, database: &Database<'_>, fold: HeldOut) -> Vec<Judged> {
    let (test, truth) = (&corpus.examples[fold.test], &corpus.examples[fold.truth]);
    let judged = |method: &str, clip: Clip| Judged { method: method.to_owned(), fold, clip };
    let mut all = vec![judged("real", truth.clip.clone()), judged("unchanged", test.clip.clone())];
    for (name, method, record, streamed) in streamed(database, &test.clip, fold.style) {
        all.push(judged(name, streamed.clip(&test.clip, corpus.rate_hz)));
        if method == Method::Mar {
            let of = |near: &[ClassNeighbors]| {
                let near: Vec<&ClassNeighbors> = near.iter().collect();
                interpolated(database, &near, usize::from(Config::new().k), fold.style, Outputs::Mean)
            };
            let rows = record.each(of);
            let steps_s = vec![1.0 / corpus.rate_hz; rows.len()];
            let stands = vec![[false; 2]; rows.len()];
            let theirs = body.with_means_of(database);
            let frames = Performance::of_rows(&theirs, &rows, steps_s, stands).frames;
            all.push(judged("knn", Clip { frames, ..test.clip.clone() }));
        }
    }
    all
}

impl Judges {
    fn of(corpus: &Corpus, known: &[usize], real: &[Vec<DVector<f64>>]) -> Self {
        let styles = corpus.styles.len();
        let examples: Vec<(usize, usize, &DVector<f64>)> = known
            .iter()
            .zip(real)
            .flat_map(|(&i, windows)| {
                let e = &corpus.examples[i];
                windows.iter().map(move |w| (e.action, e.style, w))
            })
            .collect();
        let means: Vec<DVector<f64>> = (0..corpus.actions.len())
            .map(|action| {
                // Every style counts alike, so that the mean of an action is of no style.
                let of_style = |style: usize| {
                    let members = || examples.iter().filter(move |e| (e.0, e.1) == (action, style));
                    let count = members().count();
                    (count > 0).then(|| members().map(|e| e.2.clone()).sum::<DVector<f64>>() / count as f64)
                };
                let found: Vec<DVector<f64>> = (0..styles).filter_map(of_style).collect();
                let size = examples.first().map_or(0, |e| e.2.len());
                let zero = DVector::zeros(size);
                if found.is_empty() { zero } else { found.iter().sum::<DVector<f64>>() / found.len() as f64 }
            })
            .collect();
        let of_classes: Vec<(usize, &DVector<f64>)> =
            examples.iter().map(|&(a, s, w)| (a * styles + s, w)).collect();
        let less: Vec<(usize, usize, DVector<f64>)> =
            examples.iter().map(|&(a, s, w)| (a, s, w - &means[a])).collect();
        let across = (0..corpus.actions.len())
            .map(|action| {
                let others: Vec<(usize, &DVector<f64>)> =
                    less.iter().filter(|e| e.0 != action).map(|e| (e.1, &e.2)).collect();
                Classifier::of(&others)
            })
            .collect();
        Self { classes: Classifier::of(&of_classes), across, means, styles }
    }

    /// Action and style that a clip is taken for: the parts of its likeliest class.
    fn class(&self, windows: &[DVector<f64>]) -> Option<(usize, usize)> {
        let likely = self.classes.as_ref()?.clip(windows).into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?;
        Some((likely.0 / self.styles, likely.0 % self.styles))
    }

    /// The style by a classifier that has not seen the action.
    fn style_across(&self, action: usize, windows: &[DVector<f64>]) -> Option<usize> {
        let less: Vec<DVector<f64>> = windows.iter().map(|w| w - &self.means[action]).collect();
        let likely = self.across[action].as_ref()?.clip(&less);
        likely.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|l| l.0)
    }

    fn row(
        &self,
        experiment: &Experiment,
        body: &Body,
        judged: &Judged,
        windows: &[DVector<f64>],
    ) -> table::Row {
        let corpus = &experiment.corpus;
        let Judged { method, fold, clip } = judged;
        let (test, truth) = (&corpus.examples[fold.test], &corpus.examples[fold.truth]);
        let legs = legs(&[truth], &body.landmarks);
        let one = |found: usize, wanted: usize| u8::from(found == wanted);
        let class = self.class(windows);
        row(json!({
            "method": method,
            "action": corpus.actions[test.action],
            "style": corpus.styles[fold.style],
            "clip": test.clip.name,
            "truth": truth.clip.name,
            "content": class.map(|c| one(c.0, test.action)),
            "style_right": class.map(|c| one(c.1, fold.style)),
            "style_across": self.style_across(test.action, windows).map(|s| one(s, fold.style)),
            "fmd": null,
            "skating_ratio": motion::skating_ratio(&body.skeleton, &legs, clip),
            "jerk_m_s3": motion::jerk(clip),
            "jerk_ratio": motion::jerk(clip) / motion::jerk(&truth.clip),
        }))
    }
}

/// A row for each method and output style: the distance of all its windows from the real ones of the style, in the actions
/// that were tested.
fn distributions(
    experiment: &Experiment,
    judged: &[Judged],
    seen: &[Vec<DVector<f64>>],
    (known, real): (&[usize], &[Vec<DVector<f64>>]),
) -> Vec<table::Row> {
    let corpus = &experiment.corpus;
    let mut sets: BTreeMap<(usize, &str), Vec<DVector<f64>>> = BTreeMap::new();
    for (j, windows) in judged.iter().zip(seen) {
        sets.entry((j.fold.style, &j.method)).or_default().extend(windows.iter().cloned());
    }
    let tested: BTreeSet<usize> = judged.iter().map(|j| corpus.examples[j.fold.test].action).collect();
    sets.into_iter()
        .map(|((style, method), ours)| {
            let of_style = |i: usize| {
                let e = &corpus.examples[i];
                e.style == style && tested.contains(&e.action)
            };
            let real: Vec<DVector<f64>> = known
                .iter()
                .zip(real)
                .filter(|(i, _)| of_style(**i))
                .flat_map(|(_, windows)| windows.iter().cloned())
                .collect();
            row(json!({
                "method": method,
                "action": null,
                "style": corpus.styles[style],
                "windows": ours.len(),
                "fmd": frechet(&ours, &real),
            }))
        })
        .collect()
}

fn recognised(rows: &[table::Row]) -> Figure {
    let means = table::means(rows, &["method"]);
    let names: Vec<String> = means.iter().map(|r| table::text(r.get("method"))).collect();
    let of = |key: &str| {
        let values = means.iter().map(|r| r.get(key).and_then(serde_json::Value::as_f64).unwrap_or(0.0));
        (key.to_owned(), values.collect())
    };
    let series: Vec<(String, Vec<f64>)> = ["content", "style_right", "style_across"].map(of).to_vec();
    let labels =
        Labels { title: "Recognised by a classifier of real motion", x: "method", y: "share of clips" };
    Figure {
        name: "recognised".into(),
        caption: "Clips taken for the input's action and for the output style.".into(),
        svg: plots::bars(labels, &names, &series),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn real_clips_are_recognised_and_the_input_has_its_own_style() {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "proud", "old"], 4, 6.0);
        let rows = Args::default().evaluate(&experiment).unwrap().rows;
        let means = table::means(&rows, &["method"]);
        let of = |method: &str, key: &str| {
            let row = means.iter().find(|r| r["method"] == method).unwrap_or_else(|| panic!("{method}"));
            row.get(key).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{method} {key}"))
        };
        for method in ["real", "unchanged", "mixture", "phase", "lti", "statistic", "knn"] {
            for key in ["content", "style_right", "style_across", "skating_ratio"] {
                assert!((0.0..=1.0).contains(&of(method, key)), "{method} {key}");
            }
            assert!(of(method, "fmd") >= 0.0 && of(method, "jerk_ratio") > 0.0);
        }
        assert!(of("real", "content") > 0.99 && of("real", "style_right") > 0.99);
        assert!(of("unchanged", "content") > 0.99 && of("unchanged", "style_right") < 0.01);
        assert!(of("mixture", "style_right") > 0.7 && of("mixture", "fmd") < of("unchanged", "fmd"));
        assert!((of("real", "jerk_ratio") - 1.0).abs() < 1e-9);
    }
}
