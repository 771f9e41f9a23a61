//! Leave one clip out: every method translates clips that the database has never seen.

use gestus_core::{Config, Database, blob::layout::dof};
use rayon::prelude::*;
use serde_json::json;

use super::{
    Evaluation,
    gaussian_process::{self, Editor, Pairs},
    methods::{ClassNeighbors, GlobalModel, Record, interpolated},
    metrics::{best_shift, centred, joint_distance, matched, third_difference, variability},
};
use crate::{
    body::{Body, row_at},
    build::{BuildError, BuildOptions, build},
    corpus::{Corpus, Cycle},
    pair::Scheme,
    report::{
        html::Figure,
        plot::{self, Labels},
        progress, table,
    },
    stream::{Request, Streamed, stream},
    synth::affine,
};

/// What is held out, and what is compared.
#[derive(Debug, Clone)]
pub struct LooOptions {
    /// Style of the test clips.
    pub from: usize,
    /// Output styles.
    pub to: Vec<usize>,
    /// Test clips an action.
    pub folds: usize,
    /// How databases are built.
    pub build: BuildOptions,
    /// Configurations of the mixture, by name.
    pub configs: Vec<(String, Config)>,
    /// Leave out the baselines.
    pub mixtures_only: bool,
    /// The truth is the clip of the same take: motion made in pairs, whose true answer is known.
    pub exact: bool,
    /// Gaussian process regression among the baselines.
    pub gaussian_process: bool,
}

/// One test clip in one style by one method.
#[derive(Debug, Clone)]
pub struct Row {
    /// Name of the method.
    pub method: String,
    /// Action of the test clip.
    pub action: usize,
    /// Output style.
    pub style: usize,
    /// Name of the test clip.
    pub clip: String,
    /// Name of the truth clip.
    pub truth: String,
    /// Mean joint error, centimetres.
    pub joint_error_cm: f64,
    /// Mean error of a time step, milliseconds; of methods that predict it.
    pub step_error_ms: Option<f64>,
    /// Error of the whole duration, a fraction.
    pub duration_error: Option<f64>,
    /// Third difference, relative to the truth's.
    pub third_difference: f64,
    /// Cycle-to-cycle variability relative to the truth's; of clips with two cycles or more.
    pub variability: Option<f64>,
    /// F1 of standing feet against the truth's; of methods that say which foot stands.
    pub contact_f1: Option<f64>,
}

/// The configurations that are compared: the shipped one, the paper's own, fewer neighbors, and the normalised ridge.
pub fn default_configs() -> Vec<(String, Config)> {
    vec![
        ("mixture".into(), Config::new()),
        ("mixture-paper".into(), Config::paper()),
        ("mixture-near".into(), Config::near()),
        ("mixture-normalised".into(), Config::normalised()),
    ]
}

/// Runs the evaluation and draws its plots.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn evaluate(corpus: &Corpus, options: &LooOptions) -> Result<Evaluation, BuildError> {
    let bar = progress::bar(folds(corpus, options), "leave one out");
    let results = run(corpus, options, &|| bar.inc(1))?;
    bar.finish_and_clear();
    let rows: Vec<table::Row> = results.iter().map(|r| r.to_json(corpus)).collect();
    let figures = vec![error_bars(corpus, &results), trade_off(&results), one_dof(corpus, options)?];
    Ok(Evaluation {
        what: "loo",
        about: "Every method translates clips that the database has never seen. Errors are mean joint distances, \
                hips-centred and facing ahead, to a held-out clip of the output style at equal canonical time. Mean \
                error rewards averaging: read it beside variability and third difference, which are relative to the \
                truth clip's."
            .into(),
        keys: vec!["method"],
        rows,
        figures,
    })
}

/// The same on pairs made by rule from the clips of one style: the true answer is known.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn exact(corpus: &Corpus, options: &LooOptions) -> Result<Evaluation, BuildError> {
    let pairs = affine::pairs(corpus, options.from, &affine::Options::default())?;
    let build = BuildOptions { pairing: Scheme::Take, ..options.build.clone() };
    let options = LooOptions { from: 0, to: vec![1], exact: true, build, ..options.clone() };
    let evaluation = evaluate(&pairs.corpus, &options)?;
    Ok(Evaluation {
        what: "exact",
        about: "Every clip of the style has an output made by rule: an affine map of each dof on a warped timeline. The \
                truth is exact, so a method that averages gains nothing by it."
            .into(),
        ..evaluation
    })
}

fn methods_of(results: &[Row]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for row in results {
        if !names.contains(&row.method) {
            names.push(row.method.clone());
        }
    }
    names
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    values.iter().sum::<f64>() / values.len() as f64
}

/// Errors of each method by action: paper 000, Figure 6.
fn error_bars(corpus: &Corpus, results: &[Row]) -> Figure {
    let series: Vec<(String, Vec<f64>)> = methods_of(results)
        .into_iter()
        .filter(|m| {
            [
                "unchanged",
                "other-clip",
                "global-affine",
                "nearest",
                "knn",
                "local-ar",
                "mixture",
                "mixture-paper",
                "lti",
                "statistic",
            ]
            .contains(&m.as_str())
        })
        .map(|m| {
            let of =
                |a| mean(results.iter().filter(|r| r.method == m && r.action == a).map(|r| r.joint_error_cm));
            let values = (0..corpus.actions.len()).map(of).collect();
            (m, values)
        })
        .collect();
    let labels = Labels { title: "Joint error of each method", x: "action", y: "cm" };
    Figure {
        name: "errors".into(),
        caption: "Mean joint error by action, leave one clip out (paper 000, Figure 6).".into(),
        svg: plot::bars(labels, &corpus.actions, &series),
    }
}

/// Error against variability: what averages hide.
fn trade_off(results: &[Row]) -> Figure {
    let points: Vec<(String, f64, f64)> = methods_of(results)
        .into_iter()
        .filter(|m| m != "unchanged" && m != "global-ar")
        .map(|m| {
            let of = || results.iter().filter(|r| r.method == m);
            (m.clone(), mean(of().filter_map(|r| r.variability)), mean(of().map(|r| r.joint_error_cm)))
        })
        .collect();
    let labels = Labels {
        title: "Error against variability",
        x: "cycle-to-cycle variability, real motion = 1",
        y: "joint error, cm",
    };
    Figure {
        name: "trade-off".into(),
        caption: "Averages come nearer to the truth than another real clip does, and move less than any."
            .into(),
        svg: plot::points(labels, &points),
    }
}

/// One dof over time for each method against the truth, and the output's time: paper 000, Figures 3 and 4.
pub(super) fn one_dof(corpus: &Corpus, options: &LooOptions) -> Result<Figure, BuildError> {
    let body = Body::of(corpus)?;
    let empty = || Figure { name: "dof".into(), caption: String::new(), svg: String::new() };
    let (Some(&test), Some(&style)) = (test_clips(corpus, options.from, 1).first(), options.to.first())
    else {
        return Ok(empty());
    };
    let Some((fold, bytes)) = Fold::new(corpus, &body, options, test, style)? else { return Ok(empty()) };
    let database = Database::open(&bytes)?;
    let example = &corpus.examples[test];
    let request = Request { config: options.configs[0].1, ..Request::style(style as u16) };
    let mut record = Record::of(&database);
    let Ok(_) = stream(&database, &example.clip, &request, &mut record) else { return Ok(empty()) };
    let predicted = own_dofs(&fold, &database, &record.predicted);
    let dof = dof::JOINTS + 3 * (body.landmarks.knees[0] - 1);
    let dof =
        (dof..dof + 3).max_by(|&a, &b| spread(&fold.x, a).total_cmp(&spread(&fold.x, b))).unwrap_or(dof);
    let series = |rows: &[Vec<f64>]| {
        rows.iter().enumerate().map(|(t, r)| (t as f64 / corpus.rate_hz, r[dof])).collect::<Vec<_>>()
    };
    let (cycles, truth_cycles) = fold.cycles();
    let truth: Vec<(f64, f64)> = (0..fold.x.len())
        .filter_map(|t| {
            let at = matched(cycles, t, truth_cycles, fold.shift)?;
            Some((t as f64 / corpus.rate_hz, row_at(&fold.truth_rows, at)[dof]))
        })
        .collect();
    let mut all = vec![
        ("input".to_owned(), series(&fold.x)),
        ("mixture".to_owned(), series(&predicted)),
        ("truth".to_owned(), truth),
    ];
    if let Some(class) = class_of(&database, example.action, example.style) {
        for (name, autoregressive) in [("global affine", false), ("global AR", true)] {
            let model = GlobalModel::fit(&database, &[class], style, autoregressive);
            all.push((name.into(), series(&own_dofs(&fold, &database, &model.run(&fold.x, &fold.x[0])))));
        }
    }
    let names = body.dof_names();
    let title = format!("{} of {} in the style {}", names[dof], example.clip.name, corpus.styles[style]);
    Ok(Figure {
        name: "dof".into(),
        caption: "One dof over the input's time, each method against the truth at equal canonical time (paper 000, Figure 3).".into(),
        svg: plot::lines(Labels { title: &title, x: "input time, s", y: "rad" }, &all),
    })
}

fn spread(rows: &[Vec<f64>], d: usize) -> f64 {
    let mean = rows.iter().map(|r| r[d]).sum::<f64>() / rows.len() as f64;
    rows.iter().map(|r| (r[d] - mean).powi(2)).sum()
}

impl Row {
    pub(super) fn to_json(&self, corpus: &Corpus) -> table::Row {
        super::row(json!({
            "method": self.method,
            "action": corpus.actions[self.action],
            "style": corpus.styles[self.style],
            "clip": self.clip,
            "truth": self.truth,
            "joint_error_cm": self.joint_error_cm,
            "step_error_ms": self.step_error_ms,
            "duration_error": self.duration_error,
            "third_difference": self.third_difference,
            "variability": self.variability,
            "contact_f1": self.contact_f1,
        }))
    }
}

/// The clip and what it is compared with.
pub(super) struct Fold<'a> {
    pub(super) corpus: &'a Corpus,
    pub(super) body: Body,
    pub(super) test: usize,
    pub(super) truth: usize,
    pub(super) other: Option<usize>,
    pub(super) style: usize,
    shift: usize,
    x: Vec<Vec<f64>>,
    truth_rows: Vec<Vec<f64>>,
}

/// Test clips: of each action in the style `from`, the first `folds` by name.
pub fn test_clips(corpus: &Corpus, from: usize, folds: usize) -> Vec<usize> {
    let mut tests = Vec::new();
    for action in 0..corpus.actions.len() {
        let mut clips: Vec<usize> = (0..corpus.examples.len())
            .filter(|&i| corpus.examples[i].action == action && corpus.examples[i].style == from)
            .collect();
        clips.sort_by(|&a, &b| corpus.examples[a].clip.name.cmp(&corpus.examples[b].clip.name));
        tests.extend(clips.into_iter().take(folds));
    }
    tests
}

/// Runs the evaluation; `progress` is called once a fold.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn run(
    corpus: &Corpus,
    options: &LooOptions,
    progress: &(dyn Fn() + Sync),
) -> Result<Vec<Row>, BuildError> {
    let body = Body::of(corpus)?;
    let folds: Vec<(usize, usize)> = test_clips(corpus, options.from, options.folds)
        .into_iter()
        .flat_map(|t| options.to.iter().map(move |&s| (t, s)))
        .collect();
    let rows: Vec<Vec<Row>> = folds
        .par_iter()
        .map(|&(test, style)| {
            let rows = fold(corpus, &body, options, test, style);
            progress();
            rows
        })
        .collect::<Result<_, _>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// A test clip and the truth clip for it in a style: what a fold leaves out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct HeldOut {
    /// The test clip.
    pub test: usize,
    /// The clip of the output style that is nearest in content.
    pub truth: usize,
    /// The output style.
    pub style: usize,
}

/// The folds that [`run`] goes through, with their clips.
pub fn held_out(corpus: &Corpus, body: &Body, options: &LooOptions) -> Vec<HeldOut> {
    let mut folds = Vec::new();
    for test in test_clips(corpus, options.from, options.folds) {
        for &style in &options.to {
            if let Some(&truth) = by_content(corpus, body, test, style).first() {
                folds.push(HeldOut { test, truth, style });
            }
        }
    }
    folds
}

/// How many folds [`run`] goes through.
pub fn folds(corpus: &Corpus, options: &LooOptions) -> usize {
    test_clips(corpus, options.from, options.folds).len() * options.to.len()
}

/// The clips of an action and style, nearest first in mean speed (m/s) and yaw rate (rad/s) to a clip.
fn by_content(corpus: &Corpus, body: &Body, test: usize, style: usize) -> Vec<usize> {
    let content = |i: usize| {
        let rows = body.clip_dofs(&corpus.examples[i].clip);
        [dof::FORWARD, dof::YAW].map(|d| rows.iter().map(|r| r[d]).sum::<f64>() / rows.len() as f64)
    };
    let action = corpus.examples[test].action;
    let mut clips: Vec<(usize, [f64; 2])> = (0..corpus.examples.len())
        .filter(|&i| i != test && corpus.examples[i].action == action && corpus.examples[i].style == style)
        .map(|i| (i, content(i)))
        .collect();
    let wanted = content(test);
    let distance = |c: &[f64; 2]| (c[0] - wanted[0]).powi(2) + (c[1] - wanted[1]).powi(2);
    clips.sort_by(|a, b| distance(&a.1).total_cmp(&distance(&b.1)));
    clips.into_iter().map(|c| c.0).collect()
}

/// The clip of the same take.
fn by_take(corpus: &Corpus, test: usize, style: usize) -> Vec<usize> {
    let wanted = &corpus.examples[test];
    let same =
        |e: &crate::corpus::Example| e.action == wanted.action && e.style == style && e.take == wanted.take;
    (0..corpus.examples.len()).filter(|&i| same(&corpus.examples[i])).collect()
}

fn fold(
    corpus: &Corpus,
    body: &Body,
    options: &LooOptions,
    test: usize,
    style: usize,
) -> Result<Vec<Row>, BuildError> {
    let Some((fold, bytes)) = Fold::new(corpus, body, options, test, style)? else { return Ok(Vec::new()) };
    let database = Database::open(&bytes)?;
    let mut rows = Vec::new();
    if !options.mixtures_only {
        baselines(&fold, &database, &mut rows);
        super::models::rows(&fold, &database, &mut rows);
    }
    if options.gaussian_process {
        let settings = gaussian_process::Options::default();
        let own = gaussian(&fold, &database, &settings, true).map(|g| g.0);
        // Of one action both are the same.
        let all = (corpus.actions.len() > 1).then(|| gaussian(&fold, &database, &settings, false)).flatten();
        rows.extend(own.into_iter().chain(all.map(|g| g.0)));
    }
    let example = &corpus.examples[test];
    let (action, from) = (Some(example.action as u16), Some(example.style as u16));
    for (name, config) in &options.configs {
        let conditions = [
            ("", None, None),
            ("-action-known", action, None),
            ("-style-known", None, from),
            ("-labelled", action, from),
        ];
        for (suffix, action, input_style) in conditions {
            let method = if suffix == "-labelled" {
                name.replace("mixture", "local-ar")
            } else {
                format!("{name}{suffix}")
            };
            let request = Request { config: *config, action, input_style, ..Request::style(style as u16) };
            let mut record = Record::of(&database);
            let Ok(streamed) = stream(&database, &example.clip, &request, &mut record) else { continue };
            let predicted = own_dofs(&fold, &database, &record.predicted);
            rows.push(fold.row(&method, &predicted, Some(&streamed)));
            if name != "mixture" || options.mixtures_only {
                continue;
            }
            if suffix == "-labelled" {
                for (name, most) in [("nearest", 1), ("knn", usize::MAX)] {
                    let of = |classes: &[ClassNeighbors]| {
                        interpolated(&database, &classes.iter().collect::<Vec<_>>(), most, style)
                    };
                    rows.push(fold.row(name, &own_dofs(&fold, &database, &record.each(of)), None));
                }
            } else if suffix.is_empty() && corpus.actions.len() > 1 {
                let most = usize::from(config.neighborhood().0);
                let of = |classes: &[ClassNeighbors]| {
                    interpolated(&database, &classes.iter().collect::<Vec<_>>(), most, style)
                };
                let predicted = own_dofs(&fold, &database, &record.each(of));
                rows.push(fold.row("knn-unlabelled", &predicted, None));
            }
        }
    }
    Ok(rows)
}

/// Dofs relative to the database's means as dofs relative to the evaluation's.
pub(super) fn own_dofs(fold: &Fold<'_>, database: &Database<'_>, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let theirs = fold.body.with_means_of(database);
    rows.iter()
        .map(|row| {
            let frame = theirs.pose(row, [0.0; 2], 0.0);
            let mut own = row.clone();
            for j in 0..frame.rotations.len() {
                let map = crate::body::log(&(fold.body.means[j].inverse() * frame.rotations[j]));
                let at = if j == 0 { 1 } else { 4 + 3 * j };
                own[at..at + 3].copy_from_slice(map.as_slice());
            }
            own
        })
        .collect()
}

/// The classes of a style, of whatever action.
pub(super) fn classes_of(database: &Database<'_>, style: usize) -> Vec<usize> {
    database.classes().enumerate().filter(|(_, c)| usize::from(c.style) == style).map(|c| c.0).collect()
}

pub(super) fn class_of(database: &Database<'_>, action: usize, style: usize) -> Option<usize> {
    database.classes().position(|c| usize::from(c.action) == action && usize::from(c.style) == style)
}

fn baselines(fold: &Fold<'_>, database: &Database<'_>, rows: &mut Vec<Row>) {
    rows.push(fold.row("unchanged", &fold.x, None));
    if let Some(other) = fold.other {
        let example = &fold.corpus.examples[other];
        let theirs = fold.body.clip_dofs(&example.clip);
        let cycles = &fold.corpus.examples[fold.test].cycles;
        let shift = best_shift(&fold.x, cycles, &theirs, &example.cycles);
        let matched_rows: Vec<Vec<f64>> = (0..fold.x.len())
            .map(|t| {
                matched(cycles, t, &example.cycles, shift)
                    .map_or_else(|| theirs[0].clone(), |p| row_at(&theirs, p))
            })
            .collect();
        rows.push(fold.row("other-clip", &matched_rows, None));
    }
    let example = &fold.corpus.examples[fold.test];
    let Some(class) = class_of(database, example.action, example.style) else { return };
    // The models live in the database's dofs.
    let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
    let affine = GlobalModel::fit(database, &[class], fold.style, false);
    let autoregressive = GlobalModel::fit(database, &[class], fold.style, true);
    let first = affine.run(&x[..1], &x[0]);
    for (name, model) in [("global-ar", &autoregressive), ("global-affine", &affine)] {
        let predicted = own_dofs(fold, database, &model.run(&x, &first[0]));
        rows.push(fold.row(name, &predicted, None));
    }
    // Of one action both are the same.
    if fold.corpus.actions.len() > 1 {
        let model = GlobalModel::fit(database, &classes_of(database, example.style), fold.style, false);
        let predicted = own_dofs(fold, database, &model.run(&x, &first[0]));
        rows.push(fold.row("global-affine-unlabelled", &predicted, None));
    }
}

/// Gaussian process regression over the labelled class, or over all actions of the input's style; and what it is, and
/// seconds a frame.
fn gaussian(
    fold: &Fold<'_>,
    database: &Database<'_>,
    options: &gaussian_process::Options,
    labelled: bool,
) -> Option<(Row, Editor, f64)> {
    let example = &fold.corpus.examples[fold.test];
    let (name, classes) = if labelled {
        ("gaussian-process", vec![class_of(database, example.action, example.style)?])
    } else {
        ("gaussian-process-unlabelled", classes_of(database, example.style))
    };
    let pairs = Pairs::of(database, &classes, fold.style).thinned(options.most);
    let editor = Editor::fit(&pairs, options)?;
    let x = fold.body.with_means_of(database).clip_dofs(&example.clip);
    let start = std::time::Instant::now();
    let predicted = editor.run(&x);
    let seconds = start.elapsed().as_secs_f64() / x.len() as f64;
    Some((fold.row(name, &own_dofs(fold, database, &predicted), None), editor, seconds))
}

/// Gaussian process regression as its examples double, on the first test clips: accuracy, time and memory.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn growth(corpus: &Corpus, options: &LooOptions) -> Result<Evaluation, BuildError> {
    let body = Body::of(corpus)?;
    let tests = test_clips(corpus, options.from, options.folds);
    let sizes = [64, 128, 256, 512, 1024, 2048];
    let bar = progress::bar(tests.len() * sizes.len(), "gaussian process");
    let mut rows = Vec::new();
    for &test in &tests {
        let Some(&style) = options.to.first() else { continue };
        let Some((fold, bytes)) = Fold::new(corpus, &body, options, test, style)? else { continue };
        let database = Database::open(&bytes)?;
        for most in sizes {
            let gp = gaussian_process::Options { most, ..gaussian_process::Options::default() };
            bar.inc(1);
            let Some((row, editor, seconds)) = gaussian(&fold, &database, &gp, true) else { continue };
            // The class holds no more than it does.
            if editor.examples() < most {
                continue;
            }
            let mut row = row.to_json(corpus);
            row.insert("n".into(), editor.examples().into());
            row.insert("fit_s".into(), editor.fit_s.into());
            row.insert("evidence".into(), editor.evidence().into());
            row.insert("predict_ms".into(), (1e3 * seconds).into());
            row.insert("memory_bytes".into(), editor.bytes().into());
            rows.push(row);
        }
    }
    bar.finish_and_clear();
    let means = table::means(&rows, &["n"]);
    let series = |key: &str| -> Vec<(f64, f64)> {
        let number =
            |r: &table::Row, k: &str| r.get(k).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN);
        means.iter().map(|r| (number(r, "n"), number(r, key))).collect()
    };
    let labels = Labels { title: "Gaussian process as its data grows", x: "examples", y: "s, ms, cm" };
    let keys =
        [("fit_s", "seconds to fit"), ("predict_ms", "ms a frame"), ("joint_error_cm", "joint error, cm")];
    let lines: Vec<_> = keys.iter().map(|(k, name)| ((*name).to_owned(), series(k))).collect();
    Ok(Evaluation {
        what: "gaussian-process",
        about: "Gaussian process regression with a stabilised predictor, leave one clip out, conditioned on more and more \
                of the labelled class's examples. Hyperparameters are chosen on a subset of 160 in every row, the best of three starts by \
                marginal likelihood (`evidence`: its negative logarithm, a mean over outputs and examples)."
            .into(),
        keys: vec!["method", "n"],
        rows,
        figures: vec![Figure {
            name: "growth".into(),
            caption: "Time grows with the cube of the examples, memory and prediction with their square.".into(),
            svg: plot::lines(labels, &lines),
        }],
    })
}

impl<'a> Fold<'a> {
    /// A test clip, its truth, and the database without either; `None` where the style has no clip of the action.
    pub(super) fn new(
        corpus: &'a Corpus,
        body: &Body,
        options: &LooOptions,
        test: usize,
        style: usize,
    ) -> Result<Option<(Self, Vec<u8>)>, BuildError> {
        let Some(fold) = Self::of(corpus, body, options, test, style) else { return Ok(None) };
        let wanted = BuildOptions {
            models: !options.mixtures_only,
            models_by_action: true,
            from: corpus.styles.get(options.from).cloned(),
            ..options.build.clone()
        };
        let built = build(&corpus.without(&[test, fold.truth]), &wanted)?;
        Ok(Some((fold, built.bytes)))
    }

    /// A test clip and its truth.
    pub(super) fn of(
        corpus: &'a Corpus,
        body: &Body,
        options: &LooOptions,
        test: usize,
        style: usize,
    ) -> Option<Self> {
        let near =
            if options.exact { by_take(corpus, test, style) } else { by_content(corpus, body, test, style) };
        let &truth = near.first()?;
        let (x, truth_rows) =
            (body.clip_dofs(&corpus.examples[test].clip), body.clip_dofs(&corpus.examples[truth].clip));
        let shift = if options.exact {
            0
        } else {
            best_shift(&x, &corpus.examples[test].cycles, &truth_rows, &corpus.examples[truth].cycles)
        };
        let (body, other) = (body.clone(), near.get(1).copied());
        Some(Self { corpus, body, test, truth, other, style, shift, x, truth_rows })
    }

    /// Seconds in the truth clip from the match of each frame's predecessor to that of the frame, where both have one.
    pub(super) fn true_steps(&self) -> Vec<Option<f64>> {
        let (cycles, truth_cycles) = self.cycles();
        let at = |t: usize| matched(cycles, t, truth_cycles, self.shift);
        (0..self.x.len())
            .map(|t| {
                let (now, before) = (at(t)?, at(t.checked_sub(1)?)?);
                (now > before).then_some((now - before) / self.corpus.rate_hz)
            })
            .collect()
    }

    fn cycles(&self) -> (&[Cycle], &[Cycle]) {
        (&self.corpus.examples[self.test].cycles, &self.corpus.examples[self.truth].cycles)
    }

    /// The figures of a method's output, one pose a frame of the test clip.
    pub(super) fn row(&self, method: &str, output: &[Vec<f64>], streamed: Option<&Streamed>) -> Row {
        let (cycles, truth_cycles) = self.cycles();
        let rate = self.corpus.rate_hz;
        let (mut error, mut count) = (0.0, 0.0);
        let (mut step_error, mut steps, mut predicted_s, mut truth_s) = (0.0, 0.0, 0.0, 0.0);
        let truth_contacts = &self.corpus.examples[self.truth].contacts;
        let (mut hit, mut off) = (0.0, 0.0);
        for (t, row) in output.iter().enumerate() {
            let Some(at) = matched(cycles, t, truth_cycles, self.shift) else { continue };
            error += joint_distance(
                &centred(&self.body, row),
                &centred(&self.body, &row_at(&self.truth_rows, at)),
            );
            count += 1.0;
            if let (Some(streamed), Some(truth)) = (streamed, truth_contacts.get(at.round() as usize)) {
                for (said, stands) in streamed.steps[t].report.contacts.iter().zip(truth) {
                    hit += f64::from(u8::from(*said && *stands));
                    off += f64::from(u8::from(said != stands));
                }
            }
            if let (Some(streamed), Some(before)) =
                (streamed, t.checked_sub(1).and_then(|b| matched(cycles, b, truth_cycles, self.shift)))
                && at > before
            {
                let (predicted, truth) =
                    (f64::from(streamed.steps[t].report.predicted_step_s), (at - before) / rate);
                step_error += (predicted - truth).abs();
                predicted_s += predicted;
                truth_s += truth;
                steps += 1.0;
            }
        }
        let poses = |rows: &[Vec<f64>]| -> Vec<_> { rows.iter().map(|r| centred(&self.body, r)).collect() };
        let resampled = streamed.map(|s| at_times(output, &s.times(), rate));
        let truth_third = third_difference(&poses(&self.truth_rows));
        let truth_variability = variability(&self.body, &self.truth_rows, truth_cycles);
        let example = &self.corpus.examples[self.test];
        Row {
            method: method.to_owned(),
            action: example.action,
            style: self.style,
            clip: example.clip.name.clone(),
            truth: self.corpus.examples[self.truth].clip.name.clone(),
            joint_error_cm: 100.0 * error / f64::max(count, 1.0),
            step_error_ms: (steps > 0.0).then(|| 1000.0 * step_error / steps),
            duration_error: (truth_s > 0.0).then(|| (predicted_s - truth_s).abs() / truth_s),
            third_difference: third_difference(&poses(resampled.as_deref().unwrap_or(output))) / truth_third,
            variability: variability(&self.body, output, cycles).zip(truth_variability).map(|(a, b)| a / b),
            contact_f1: (hit + off > 0.0).then(|| 2.0 * hit / (2.0 * hit + off)),
        }
    }
}

/// Rows at their time stamps, resampled to a rate.
fn at_times(rows: &[Vec<f64>], times: &[f64], rate_hz: f64) -> Vec<Vec<f64>> {
    let end = times.last().copied().unwrap_or(0.0);
    let mut i = 0;
    (0..=(end * rate_hz) as usize)
        .map(|k| {
            let time = k as f64 / rate_hz;
            while i + 2 < times.len() && times[i + 1] <= time {
                i += 1;
            }
            let span = (times[(i + 1).min(times.len() - 1)] - times[i]).max(1e-9);
            row_at(rows, i as f64 + ((time - times[i]) / span).clamp(0.0, 1.0))
        })
        .collect()
}
