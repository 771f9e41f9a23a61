//! Laban effort, measured: how well it is learned, how well inputs are cut, and whether dial and whole clips go where they
//! are told to.
//!
//! Five parts, told apart by the column `part`: `regression` is Torresani 2006's Table 1, on the data's own labels or
//! estimates and on generated motion that a generated annotator has looked at; `annotators` the latter over ten corpora; `segmentation` streams made of fragments;
//! `dial` the core's dial on test clips; `clip` the whole-clip path on the same.

use gestus_core::{Config, Database, Effort, blob::layout::section};
use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::{
    evaluation::{self, Evaluation},
    fold::{LooOptions, test_clips},
    metrics::annotator::Annotator,
};
use crate::{
    plots::{self, Labels, Series},
    report::{html::Figure, table},
};
use gestus_database::{
    blob::assemble::with_section,
    build::{BuildError, build},
    command_line::progress,
    effort::{
        Factors, NAMES, Source,
        estimate::Estimator,
        fragment::Library,
        learn::{Method, errors, held_against, means, rank_correlation},
        model::{BLENDS, FEWEST, Model, draw},
        response,
        sheet::{SEEDS, caveat, selected},
        stage::segment,
        synthesize,
    },
    stream::{Request, Streamed, stream},
    synth,
};
use gestus_motion::{body::row_at, corpus::Corpus};

/// Random splits, and examples to learn from in each (Torresani 2006, section 8).
const SPLITS: usize = 500;
const TRAIN: usize = 85;
/// Corpora of generated motion that the annotator looks at, and splits of all of them together for one of the first.
const ANNOTATORS: usize = 10;
/// Everything random follows from it.
const SEED: u64 = 2006;
/// Streams of each kind, and fragments in each.
const STREAMS: usize = 12;
const SENTENCE: usize = 8;
/// Fragments that streams are cut into, at most.
const VOCABULARY: usize = 240;
/// Targets along each factor.
const TARGETS: usize = 9;

/// What an evaluation is told.
#[derive(Debug, Clone)]
pub struct EffortOptions<'a> {
    /// Test clips and how databases are built.
    pub loo: &'a LooOptions,
    /// A model of labels that people gave; estimates where there is none.
    pub given: Option<Model>,
    /// Random splits.
    pub splits: usize,
}

impl<'a> EffortOptions<'a> {
    /// As the paper has it, with estimates.
    pub fn new(loo: &'a LooOptions) -> Self {
        Self { loo, given: None, splits: SPLITS }
    }
}

/// Measures all of it.
///
/// # Errors
/// [`BuildError`] where the corpus makes no database.
pub fn evaluate(corpus: &Corpus, options: &EffortOptions<'_>) -> Result<Evaluation, BuildError> {
    let library = Library::found(corpus)?;
    let tests = test_clips(corpus, options.loo.from, options.loo.folds);
    let model = match &options.given {
        Some(model) => model.clone(),
        None if spare(corpus, &tests) => estimated(&Library::found(&corpus.without(&tests))?),
        None => estimated(&library),
    };
    let each = options.splits.div_ceil(ANNOTATORS);
    let steps = 2 * options.splits + ANNOTATORS * each + 3 * STREAMS + 6 * tests.len();
    let bar = progress::bar(steps, "effort");
    let tick = || bar.inc(1);
    let generated = generated(SEED)?;
    let mut rows = Vec::new();
    for (name, model) in [("data", &model), ("generated", &generated)] {
        rows.extend(regression(name, model, options.splits, &tick));
    }
    rows.extend(annotators(each, &tick)?);
    rows.extend(segmentation(corpus, &library, &tests, &tick)?);
    let (dialled, curves) = dialled(corpus, &model, options, &tests, &tick)?;
    rows.extend(dialled);
    rows.extend(clips(corpus, &model, &tests, &tick));
    bar.finish_and_clear();
    let figures = vec![mse_figure(&rows), curve_figure(&generated), dial_figure(&curves)];
    Ok(Evaluation {
        what: "effort",
        about: format!(
            "Laban effort after Torresani, Hackney and Bregler 2006. {}. Regression: mean squared errors of the Effort of \
             blends over {} random splits of {TRAIN} to learn from and the rest to test; `gain` is by how much that is \
             less than interpolation's, with the standard error of a paired test over splits. Annotators: the same over \
             {ANNOTATORS} corpora of generated motion, the errors over corpora. Segmentation: share of frames \
             whose fragment is the right one. Dial and clip: rank correlation of the target of one factor and the same \
             factor estimated on the output, within the reach of the styles.",
            caveat(model.source),
            options.splits
        ),
        keys: vec!["part", "corpus", "labels", "method", "factor", "streams"],
        rows,
        figures,
    })
}

/// A model of estimates, learned as from a filled-in sheet.
fn estimated(library: &Library) -> Model {
    let library = selected(library, 4 * SEEDS);
    let draws = draw(&library, BLENDS, SEED);
    Model::estimated(library, &draws)
}

/// Mean squared errors on what the generated annotator noted, of each method ([`Method::ALL`]) and factor: over random
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
            let model = generated(SEED + n)?;
            Ok(means(&errors(&model.known, &model.examples, TRAIN, splits, SEED, progress)))
        })
        .collect()
}

/// Generated motion in eight styles with a generated annotator's notes.
fn generated(seed: u64) -> Result<Model, BuildError> {
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
    let annotator = Annotator::of(&library, seed);
    let draws = draw(&library, BLENDS, seed);
    Ok(Model::observed(library, Source::Generated, &draws, &move |rows, action| annotator.note(rows, action)))
}

/// Paper 003's Table 1 of a model; nothing of one that has too few labelled blends to learn from and to test.
fn regression(corpus: &str, model: &Model, splits: usize, tick: &(dyn Fn() + Sync)) -> Vec<table::Row> {
    if model.examples.len() < FEWEST {
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

/// Every method held against interpolation, factor by factor, over the same splits or annotators.
fn compared(errors: &[Vec<Factors>], of: &Value, sizes: &Value) -> Vec<table::Row> {
    let mut rows = Vec::new();
    for (m, method) in Method::ALL.iter().enumerate() {
        for (k, factor) in NAMES.iter().enumerate() {
            let of_method = |m: usize| errors.iter().map(|e| e[m][k]).collect::<Vec<f64>>();
            let held = held_against(&of_method(m), &of_method(0));
            let mut row = evaluation::row(of.clone());
            row.extend(evaluation::row(json!({
                "method": method.name(), "factor": factor, "mse": held.mean,
                "standard_error": held.standard_error,
                "gain": held.gain, "gain_error": held.gain_error, "better": held.better,
            })));
            row.extend(evaluation::row(sizes.clone()));
            rows.push(row);
        }
    }
    rows
}

/// The same annotator with motion and noise drawn anew each time. Splits of one corpus share their examples; corpora
/// share nothing, so that over them a paired test says whether a method is better for annotators like this one.
fn annotators(splits: usize, tick: &(dyn Fn() + Sync)) -> Result<Vec<table::Row>, BuildError> {
    let errors = annotated(ANNOTATORS, splits, tick)?;
    let of = json!({ "part": "annotators", "action": null, "style": null, "corpus": "generated", "labels": Source::Generated.name() });
    Ok(compared(&errors, &of, &json!({ "annotators": ANNOTATORS, "splits": splits })))
}

/// Streams made of fragments: as they are, at another pace with noise, and of clips that the fragments are not from.
fn segmentation(
    corpus: &Corpus,
    library: &Library,
    tests: &[usize],
    tick: &(dyn Fn() + Sync),
) -> Result<Vec<table::Row>, BuildError> {
    let name = |i: &usize| corpus.examples[*i].clip.name.clone();
    let held: Vec<String> = tests.iter().map(name).collect();
    let is_held = |clip: &str| held.iter().any(|h| h == clip);
    let own = |unseen: bool| {
        let fragments =
            library.fragments.iter().filter(|f| is_held(&f.span.clip) == unseen).cloned().collect();
        selected(&Library { fragments, ..library.clone() }, VOCABULARY)
    };
    let (known, unseen) = (own(false), own(true));
    let known = if known.fragments.is_empty() { selected(library, VOCABULARY) } else { known };
    let words: Vec<&[Vec<f64>]> = known.fragments.iter().map(|f| f.content.as_slice()).collect();
    let mut rows = Vec::new();
    for kind in ["known", "known-warped", "unseen"] {
        let source = if kind == "unseen" { &unseen } else { &known };
        if source.fragments.is_empty() {
            continue;
        }
        let results: Vec<(usize, usize, usize, f64)> = (0..STREAMS)
            .into_par_iter()
            .map(|n| {
                let mut rng = ChaCha8Rng::seed_from_u64(SEED);
                rng.set_stream(n as u64);
                let mut input = Vec::new();
                let mut truth = Vec::new();
                let mut starts = Vec::new();
                for _ in 0..SENTENCE {
                    let Some(fragment) = source.fragments.choose(&mut rng) else { continue };
                    let pace = if kind == "known-warped" { rng.random_range(0.8..1.25) } else { 1.0 };
                    let count = ((fragment.content.len() as f64 / pace).round() as usize).max(2);
                    let last = (fragment.content.len() - 1) as f64;
                    starts.push(input.len());
                    for i in 0..count {
                        let mut pose = row_at(&fragment.content, last * i as f64 / (count - 1) as f64);
                        if kind == "known-warped" {
                            pose.iter_mut().for_each(|v| *v += rng.random_range(-0.03..0.03));
                        }
                        input.push(pose);
                        truth.push((fragment.action, &fragment.span));
                    }
                }
                let snippets = segment(&input, &words);
                let (mut action, mut exact) = (0, 0);
                for s in &snippets {
                    let found = &known.fragments[s.fragment];
                    for &(a, span) in &truth[s.from..s.to] {
                        action += usize::from(a == found.action);
                        exact += usize::from(span == &found.span);
                    }
                }
                let near = |start: &usize| {
                    snippets.iter().map(|s| s.from.abs_diff(*start)).min().unwrap_or(input.len()) as f64
                };
                let boundary = starts.iter().map(near).sum::<f64>() / starts.len().max(1) as f64;
                tick();
                (input.len(), action, exact, boundary)
            })
            .collect();
        let frames: usize = results.iter().map(|r| r.0).sum();
        let share = |pick: fn(&(usize, usize, usize, f64)) -> usize| {
            results.iter().map(pick).sum::<usize>() as f64 / frames as f64
        };
        rows.push(evaluation::row(json!({
            "part": "segmentation", "method": "one-stage", "action": null, "style": null, "streams": kind, "corpus": "data",
            "frames": frames, "fragments": words.len(),
            "right": share(|r| r.1),
            "right_fragment": (kind != "unseen").then(|| share(|r| r.2)),
            "boundary_frames": results.iter().map(|r| r.3).sum::<f64>() / STREAMS as f64,
        })));
    }
    Ok(rows)
}

/// Whether a class has other clips than the tests.
fn spare(corpus: &Corpus, tests: &[usize]) -> bool {
    tests.iter().all(|&t| {
        let e = &corpus.examples[t];
        (0..corpus.examples.len()).any(|i| {
            !tests.contains(&i)
                && (corpus.examples[i].action, corpus.examples[i].style) == (e.action, e.style)
        })
    })
}

/// Whether no fragment of a model is from a test clip.
fn unseen(corpus: &Corpus, model: &Model, tests: &[usize]) -> bool {
    let is_test = |clip: &str| tests.iter().any(|&t| corpus.examples[t].clip.name == clip);
    !model.library.fragments.iter().any(|f| is_test(&f.span.clip))
}

/// Targets of one factor that the dial reaches, the others at rest.
fn targets(dial: &gestus_core::stylizer::effort_dial::Dial<'_>, factor: usize) -> Vec<f64> {
    let (low, high) = dial.range()[factor];
    let rest = dial.rest().factors();
    let at = |value: f32| {
        let mut factors = rest;
        factors[factor] = value;
        Effort::new(factors)
    };
    let fine = (0..=100).map(|i| low + (high - low) * i as f32 / 100.0);
    let reached: Vec<f32> = fine.filter(|&v| !dial.weights(at(v)).1.clamped[factor]).collect();
    let (Some(&first), Some(&last)) = (reached.first(), reached.last()) else { return Vec::new() };
    (0..TARGETS).map(|i| f64::from(first + (last - first) * i as f32 / (TARGETS - 1) as f32)).collect()
}

type Curve = (usize, Vec<(f64, f64)>);

/// Every test clip of an action that the database holds, through the core with the dial at each of several targets of
/// each factor.
fn dialled(
    corpus: &Corpus,
    model: &Model,
    options: &EffortOptions<'_>,
    tests: &[usize],
    tick: &(dyn Fn() + Sync),
) -> Result<(Vec<table::Row>, Vec<Curve>), BuildError> {
    let spared = spare(corpus, tests);
    let held_out = spared && unseen(corpus, model, tests);
    let rest = corpus.without(tests);
    let seen = if spared { &rest } else { corpus };
    let built = build(seen, &options.loo.build)?;
    let solved = {
        let database = Database::open(&built.bytes)?;
        response::solve(&database, seen, model, options.loo.from)?
    };
    let solved = match solved {
        Ok(dial) => dial,
        Err(reason) => {
            eprintln!("no effort dial: {reason}");
            return Ok((Vec::new(), Vec::new()));
        }
    };
    let bytes = with_section(&built.bytes, section::EFFORT, &solved.section())?;
    let database = Database::open(&bytes)?;
    let Some(dial) = database.dial() else { return Ok((Vec::new(), Vec::new())) };
    let library = Library::of_database(&database)?;
    let estimator = Estimator::of(&library);
    let is_in = |t: &&usize| database.classes().any(|c| usize::from(c.action) == corpus.examples[**t].action);
    let tasks: Vec<(usize, usize)> =
        tests.iter().filter(is_in).flat_map(|&t| (0..3).map(move |k| (t, k))).collect();
    let results: Vec<Option<(table::Row, Curve)>> = tasks
        .par_iter()
        .map(|&(test, k)| {
            let example = &corpus.examples[test];
            let measure = |out: &Streamed| {
                let (body, rate_hz) = (&library.body, library.rate_hz);
                estimator.stream(body, &out.frames(), &out.times(), rate_hz, Some(example.action))
            };
            let mut curve = Vec::new();
            let mut held = Vec::new();
            for target in targets(&dial, k) {
                let mut factors = dial.rest().factors();
                factors[k] = target as f32;
                let (weights, _) = dial.weights(Effort::new(factors));
                let style: Vec<_> = (0..corpus.styles.len()).map(|s| (s as u16, weights[s])).collect();
                // As the regression has it, and with the feet held.
                let seen = |contacts: bool| {
                    let config = Config::new().contacts(contacts);
                    let request = Request { config, style: style.clone(), ..Request::style(0) };
                    Some(measure(&stream(&database, &example.clip, &request, &mut ()).ok()?)?[k])
                };
                curve.push((target, seen(false)?));
                held.push(seen(true)?);
            }
            tick();
            let (asked, got): (Vec<f64>, Vec<f64>) = curve.iter().copied().unzip();
            let row = evaluation::row(json!({
                "part": "dial", "method": "dial", "corpus": "data", "labels": solved.source.name(),
                "factor": NAMES[k], "action": corpus.actions[example.action], "style": null, "clip": example.clip.name,
                "rank_correlation": rank_correlation(&asked, &got),
                "rank_correlation_feet_held": rank_correlation(&asked, &held),
                "low": asked.first(), "high": asked.last(),
                "moved": got.last().zip(got.first()).map(|(a, b)| a - b),
                "held_out": held_out, "targets": asked, "estimates": got, "estimates_feet_held": held,
            }));
            Some((row, (k, curve)))
        })
        .collect();
    Ok(results.into_iter().flatten().unzip())
}

/// Every test clip by the whole-clip path at each of several targets of each factor.
fn clips(corpus: &Corpus, model: &Model, tests: &[usize], tick: &(dyn Fn() + Sync)) -> Vec<table::Row> {
    let library = &model.library;
    // A clip is not answered with itself where it can be helped.
    let held_out = unseen(corpus, model, tests);
    let estimator = Estimator::of(library);
    let (low, high) = (-1.0, 1.0);
    tests
        .iter()
        .flat_map(|&t| (0..3).map(move |k| (t, k)))
        .filter_map(|(test, k)| {
            let example = &corpus.examples[test];
            let mut asked = Vec::new();
            let (mut got, mut predicted) = (Vec::new(), Vec::new());
            for i in 0..5 {
                let target = low + (high - low) * f64::from(i) / 4.0;
                let mut wanted = [None; 3];
                wanted[k] = Some(target);
                let output = synthesize::translate(model, &example.clip, &wanted);
                let action = Some(example.action);
                got.push(estimator.estimate(&library.body, &output.rows, library.rate_hz, action)?[k]);
                let sum: f64 = output.choices.iter().map(|c| c.effort[k]).sum();
                predicted.push((sum / output.choices.len() as f64 - target).abs());
                asked.push(target);
            }
            tick();
            Some(evaluation::row(json!({
                "part": "clip", "method": "effort", "corpus": "data", "labels": model.source.name(),
                "factor": NAMES[k], "action": corpus.actions[example.action], "style": null, "clip": example.clip.name,
                "rank_correlation": rank_correlation(&asked, &got),
                "low": low, "high": high,
                "moved": got[got.len() - 1] - got[0],
                "predicted_off": predicted.iter().sum::<f64>() / predicted.len() as f64,
                "targets": asked, "estimates": got,
                "held_out": held_out,
            })))
        })
        .collect()
}

/// Errors by factor and method.
fn mse_figure(rows: &[table::Row]) -> Figure {
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
        ["data", "generated"].iter().flat_map(|c| NAMES.iter().map(move |n| format!("{n}, {c}"))).collect();
    let series: Vec<(String, Vec<f64>)> = Method::ALL
        .iter()
        .map(|m| {
            let of = |c: &'static str| NAMES.iter().map(move |n| value(c, m.name(), n));
            (m.name().to_owned(), of("data").chain(of("generated")).collect())
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
fn curve_figure(model: &Model) -> Figure {
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

/// Where the dial was set and what came out, mean over the clips.
fn dial_figure(curves: &[Curve]) -> Figure {
    let series: Vec<Series> = NAMES
        .iter()
        .enumerate()
        .map(|(k, name)| {
            let own: Vec<&Vec<(f64, f64)>> =
                curves.iter().filter(|c| c.0 == k && !c.1.is_empty()).map(|c| &c.1).collect();
            let count = own.iter().map(|c| c.len()).min().unwrap_or(0);
            let mean = |i: usize| own.iter().map(|c| c[i].1).sum::<f64>() / own.len() as f64;
            ((*name).to_owned(), (0..count).map(|i| (own[0][i].0, mean(i))).collect())
        })
        .collect();
    Figure {
        name: "dial".into(),
        caption: "The dial's target and the factor estimated on the core's output, mean over the test clips."
            .into(),
        svg: plots::lines(
            Labels { title: "The effort dial", x: "target", y: "estimated on the output" },
            &series,
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::loo::default_configs;
    use gestus_database::{
        build::BuildOptions,
        effort::{POLE, labels, sheet::sheet},
    };

    fn corpus(actions: &[&str]) -> Corpus {
        synth::corpus(&synth::Options {
            actions: actions.iter().map(|a| (*a).to_owned()).collect(),
            styles: ["neutral", "angry"].map(String::from).to_vec(),
            clips: 2,
            seconds: 4.0,
            ..synth::Options::default()
        })
        .unwrap()
    }

    /// Nothing was tested, and an error of 0 was reported; of one blend there was nothing to learn from, and a panic.
    #[test]
    fn too_few_blends_have_no_error() {
        let library = Library::found(&corpus(&["walk"])).unwrap();
        let draws = draw(&library, BLENDS, SEED);
        for count in [0, 1, FEWEST - 1] {
            let model = Model::estimated(library.clone(), &draws[..count]);
            assert_eq!(model.examples.len(), count);
            assert!(regression("data", &model, 1, &|| ()).is_empty(), "{count}");
        }
        let model = Model::estimated(library, &draws[..FEWEST]);
        let rows = regression("data", &model, 1, &|| ());
        assert_eq!(rows.len(), 3 * Method::ALL.len());
        assert!(rows.iter().all(|r| r["test"].as_u64() > Some(0)));
    }

    /// Labels of the very clips that are tested are not held out, and an action that lacks a style costs its own rows alone.
    #[test]
    fn a_dial_says_whether_its_tests_were_held_out() {
        let mut corpus = corpus(&["walk", "run"]);
        corpus.examples.retain(|e| (e.action, e.style) != (1, 1));
        let loo = LooOptions {
            from: 0,
            to: vec![1],
            folds: 1,
            build: BuildOptions { models: false, ..BuildOptions::default() },
            configs: default_configs(),
            mixtures_only: false,
            exact: false,
            gaussian_process: false,
        };
        let tests = test_clips(&corpus, 0, 1);
        assert!(tests.len() == 2 && spare(&corpus, &tests));
        let options = EffortOptions::new(&loo);
        let rows = |model: &Model| dialled(&corpus, model, &options, &tests, &|| ()).unwrap().0;
        let estimates = rows(&estimated(&Library::found(&corpus.without(&tests)).unwrap()));
        assert_eq!(estimates.len(), 3);
        assert!(estimates.iter().all(|r| r["action"] == "walk" && r["held_out"] == true), "{estimates:?}");
        let library = Library::found(&corpus).unwrap();
        let mut table = labels::parse(sheet(&library, 60, 1).csv.as_bytes(), "s.csv", 30.0).unwrap();
        for (i, row) in table.iter_mut().enumerate() {
            row.effort =
                Some([0.05 * i as f64 - 1.0, 1.0 - 0.05 * i as f64, 0.5].map(|v: f64| v.clamp(-POLE, POLE)));
        }
        let given = Model::given(&table, "s.csv", |s| Library::annotated(&corpus, s)).unwrap();
        let given = rows(&given);
        assert_eq!(given.len(), 3);
        assert!(given.iter().all(|r| r["labels"] == "given" && r["held_out"] == false), "{given:?}");
    }
}
