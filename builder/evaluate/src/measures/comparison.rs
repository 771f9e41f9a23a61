//! Every method on the same clips, as in Xia 2015's Table 3 and Figures 3, 4 and 6: `gestus evaluate methods`.
//!
//! | set | database and test clips |
//! |---|---|
//! | `homogeneous` | one action: the walk, or the first there is |
//! | `heterogeneous` | all actions at once |
//! | `stream` | all actions, and the test clips of all of them as one stream, one action after the other; labelled rows are told the action when it changes |
//! | `homogeneous-exact`, `heterogeneous-exact`, `stream-exact` | outputs made by rule, whose answer is known ([`gestus_database::synth::affine`]) |
//! | `homogeneous-generated`, `heterogeneous-generated`, `stream-generated` | [`gestus_database::synth`]'s walk, and four of its actions, neutral to old: inputs too are generated, and the truth is the same content in the style |
//!
//! Rows are those of [`super::loo`], labelled and unlabelled, with their set; Gaussian processes are among them, as the
//! paper has it. The verdict is put in words by the figures themselves.

use std::ops::Range;

use gestus_core::{Config, Database, Method};
use rayon::prelude::*;
use serde_json::json;

use crate::{
    baselines::{
        gaussian_process::{self, Editor, Pairs},
        outputs::{ClassNeighbors, GlobalModel, Outputs, Record, interpolated},
    },
    evaluation::{self, Evaluation},
    fold::{Fold, LooOptions, Row, class_of, classes_of, folds, own_dofs, say_left_out, test_clips},
    measures::loo,
};
use crate::{
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    build::{BuildError, BuildOptions, build},
    command_line::progress,
    pairing::Scheme,
    stream::{Request, Streamed, stream_told},
    synth::{self, affine},
};
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame, interpolate},
    corpus::Corpus,
};

/// Frames between two clips of a stream: nobody jumps from one gait into another.
const BETWEEN: usize = 8;
/// Generated clips of an action in a style.
const GENERATED: usize = 8;

/// Runs the comparison.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn evaluate(corpus: &Corpus, options: &LooOptions) -> Result<Evaluation, BuildError> {
    let walk = corpus.actions.iter().position(|a| a == "walk").unwrap_or(0);
    let one = only(corpus, walk);
    let pairs = |corpus: &Corpus| affine::pairs(corpus, options.from, &affine::Options::default());
    let exact = LooOptions {
        from: 0,
        to: vec![1],
        exact: true,
        build: BuildOptions { pairing: Scheme::Take, ..options.build.clone() },
        gaussian_process: true,
        ..options.clone()
    };
    let many = corpus.actions.len() > 1;
    let options = &LooOptions { gaussian_process: true, ..options.clone() };
    let generated = |actions: &[&str]| {
        let wanted = synth::Options {
            actions: actions.iter().map(|a| (*a).to_owned()).collect(),
            styles: ["neutral", "old"].map(String::from).to_vec(),
            clips: GENERATED,
            seconds: 6.0,
            ..synth::Options::default()
        };
        // The names are the generator's own.
        synth::corpus(&wanted).map_err(|e| BuildError::Unpaired(e.to_string()))
    };
    let mut sets: Vec<(&str, Corpus, &LooOptions)> = vec![("homogeneous", one.clone(), options)];
    if many {
        sets.push(("heterogeneous", corpus.clone(), options));
    }
    sets.push(("homogeneous-exact", pairs(&one)?.corpus, &exact));
    if many {
        sets.push(("heterogeneous-exact", pairs(corpus)?.corpus, &exact));
    }
    sets.push(("homogeneous-generated", generated(&["walk"])?, &exact));
    sets.push(("heterogeneous-generated", generated(&["walk", "run", "punch", "kick"])?, &exact));
    let count = sets.iter().map(|(_, c, o)| folds(c, o)).sum();
    let bar = progress::bar(count, "methods");
    let mut rows: Vec<table::Row> = Vec::new();
    for (set, corpus, options) in &sets {
        say_left_out(corpus, &Body::of(corpus)?, options);
        for row in loo::run(corpus, options, &|| bar.inc(1))? {
            rows.push(labelled(set, row.to_json(corpus)));
        }
        if let Some(kind) = set.strip_prefix("heterogeneous") {
            let set = format!("stream{kind}");
            rows.extend(streams(corpus, options)?.into_iter().map(|r| labelled(&set, r.to_json(corpus))));
        }
    }
    bar.finish_and_clear();
    let mut figures = vec![
        bars(&rows, "joint_error_cm", "Joint error", "cm"),
        bars(&rows, "step_error_ms", "Timing error", "ms"),
    ];
    figures.extend(loo::one_dof(corpus, options)?);
    Ok(Evaluation { what: "methods", about: verdict(&rows), keys: vec!["set", "method"], rows, figures })
}

fn labelled(set: &str, row: table::Row) -> table::Row {
    let mut with = evaluation::row(json!({ "set": set }));
    with.extend(row);
    with
}

fn only(corpus: &Corpus, action: usize) -> Corpus {
    let others: Vec<usize> =
        (0..corpus.examples.len()).filter(|&i| corpus.examples[i].action != action).collect();
    let mut one = corpus.without(&others);
    one.actions = vec![corpus.actions[action].clone()];
    one.examples.iter_mut().for_each(|e| e.action = 0);
    one
}

/// One stream through all actions for each fold and style.
fn streams(corpus: &Corpus, options: &LooOptions) -> Result<Vec<Row>, BuildError> {
    let body = Body::of(corpus)?;
    let tests = test_clips(corpus, options.from, options.folds);
    let takes: Vec<Vec<usize>> = (0..options.folds)
        .map(|k| {
            let of = |a: usize| tests.iter().filter(|&&t| corpus.examples[t].action == a).nth(k).copied();
            (0..corpus.actions.len()).filter_map(of).collect()
        })
        .filter(|t: &Vec<usize>| t.len() > 1)
        .collect();
    let jobs: Vec<(&Vec<usize>, usize)> =
        takes.iter().flat_map(|t| options.to.iter().map(move |&s| (t, s))).collect();
    let rows: Vec<Vec<Row>> = jobs
        .par_iter()
        .map(|(tests, style)| one_stream(corpus, &body, options, tests, *style))
        .collect::<Result<_, _>>()?;
    Ok(rows.into_iter().flatten().collect())
}

fn one_stream(
    corpus: &Corpus,
    body: &Body,
    options: &LooOptions,
    tests: &[usize],
    style: usize,
) -> Result<Vec<Row>, BuildError> {
    let folds: Vec<Fold<'_>> =
        tests.iter().filter_map(|&t| Fold::of(corpus, body, options, t, style)).collect();
    // One action alone is no stream through several.
    if folds.len() < 2 {
        return Ok(Vec::new());
    }
    let left_out: Vec<usize> = folds.iter().flat_map(|f| [f.test, f.truth]).collect();
    let wanted = BuildOptions {
        models: true,
        models_by_action: true,
        from: corpus.styles.get(options.from).cloned(),
        ..options.build.clone()
    };
    let bytes = build(&corpus.without(&left_out), &wanted)?.bytes;
    let database = Database::open(&bytes)?;
    let clips: Vec<&Clip> = folds.iter().map(|f| &corpus.examples[f.test].clip).collect();
    let Some((clip, starts)) = joined(body, &clips) else { return Ok(Vec::new()) };
    let parts: Vec<Part<'_>> = folds
        .into_iter()
        .zip(starts)
        .map(|(fold, start)| {
            let example = &corpus.examples[fold.test];
            Part { frames: start..start + example.clip.frames.len(), action: example.action, fold }
        })
        .collect();
    let mut rows = Vec::new();
    let mut add = |name: &str, output: &[Vec<f64>], streamed: Option<&Streamed>| {
        for Part { fold, frames, .. } in &parts {
            let steps = |s: &Streamed| Streamed { steps: s.steps[frames.clone()].to_vec(), ..s.clone() };
            let part = streamed.map(steps);
            rows.push(fold.row(name, &own_dofs(fold, &database, &output[frames.clone()]), part.as_ref()));
        }
    };
    let told: Vec<(usize, u16)> = parts.iter().map(|p| (p.frames.start, p.action as u16)).collect();
    let from = Some(options.from as u16);
    let (lti, statistic) = (Config::new().method(Method::Lti), Config::new().method(Method::Statistic));
    let untold: &[(usize, u16)] = &[];
    let methods = [
        ("mixture", Config::new(), untold, None),
        ("mixture-paper", Config::paper(), untold, None),
        ("mixture-action-known", Config::new(), &told[..], None),
        ("local-ar", Config::new(), &told[..], from),
        ("lti", lti, untold, None),
        ("lti-labelled", lti, &told[..], None),
        ("statistic", statistic, untold, None),
        ("statistic-labelled", statistic, &told[..], None),
    ];
    for (name, config, told, input_style) in methods {
        let request = Request { config, input_style, ..Request::style(style as u16) };
        let mut record = Record::of(&database);
        let Ok(streamed) = stream_told(&database, &clip, &request, told, &mut record) else { continue };
        add(name, &record.predicted, Some(&streamed));
        if name == "mixture" {
            add("unchanged", &record.x, None);
            // Every class is searched, so that neighbors of the right one are among them.
            let most = usize::from(config.k);
            let all = |near: &[ClassNeighbors]| {
                interpolated(&database, &near.iter().collect::<Vec<_>>(), most, style, Outputs::One)
            };
            add("knn-unlabelled", &record.each(all), None);
            for (name, most) in [("nearest", 1), ("knn", most)] {
                let mut output = record.x.clone();
                for Part { frames, action, .. } in &parts {
                    let class = class_of(&database, *action, options.from);
                    let own = record.each(|near: &[ClassNeighbors]| {
                        let of: Vec<&ClassNeighbors> = near.iter().filter(|n| Some(n.0) == class).collect();
                        interpolated(&database, &of, most, style, Outputs::One)
                    });
                    output[frames.clone()].clone_from_slice(&own[frames.clone()]);
                }
                add(name, &output, None);
            }
        }
    }
    // Models of one map, and processes: of each action for its part, and one of all.
    let x = body.with_means_of(&database).clip_dofs(&clip);
    let every = classes_of(&database, options.from);
    let settings = gaussian_process::Options::default();
    let process = |classes: &[usize], x: &[Vec<f64>]| {
        let pairs = Pairs::of(&database, classes, style).thinned(settings.most);
        Editor::fit(&pairs, &settings).map(|editor| editor.run(x))
    };
    let affine = |classes: &[usize], x: &[Vec<f64>]| {
        GlobalModel::fit(&database, classes, style, false, Outputs::One).run(x, &x[0])
    };
    add("global-affine-unlabelled", &affine(&every, &x), None);
    if let Some(output) = process(&every, &x) {
        add("gaussian-process-unlabelled", &output, None);
    }
    // A part without an answer would be the input: then the method has no rows.
    let each = |of: Answer<'_>| {
        let mut output = x.clone();
        for Part { frames, action, .. } in &parts {
            let class = class_of(&database, *action, options.from)?;
            output[frames.clone()].clone_from_slice(&of(&[class], &x[frames.clone()])?);
        }
        Some(output)
    };
    if let Some(output) = each(&|classes, x| Some(affine(classes, x))) {
        add("global-affine", &output, None);
    }
    if let Some(output) = each(&process) {
        add("gaussian-process", &output, None);
    }
    Ok(rows)
}

/// What a method that is told the class answers to rows; `None` where it has no answer.
type Answer<'a> = &'a dyn Fn(&[usize], &[Vec<f64>]) -> Option<Vec<Vec<f64>>>;

/// A test clip within a stream.
struct Part<'a> {
    fold: Fold<'a>,
    frames: Range<usize>,
    action: usize,
}

/// Clips one after the other, each set on where the last one ended, a few frames between them; and where each starts.
fn joined(body: &Body, clips: &[&Clip]) -> Option<(Clip, Vec<usize>)> {
    let mut frames: Vec<Frame> = Vec::new();
    let mut starts = Vec::new();
    for clip in clips {
        let first = clip.frames.first()?;
        let placed: Vec<Frame> = match frames.last() {
            None => clip.frames.clone(),
            Some(last) => {
                let turn = about_y(body.heading(last) - body.heading(first));
                let onto = last.root - turn * first.root;
                let place = |f: &Frame| {
                    let mut frame = f.clone();
                    let root = turn * f.root + onto;
                    frame.root = nalgebra::Vector3::new(root.x, f.root.y, root.z);
                    frame.rotations[0] = turn * f.rotations[0];
                    frame
                };
                clip.frames.iter().map(place).collect()
            }
        };
        if let Some(last) = frames.last().cloned() {
            let share = |k: usize| (k + 1) as f64 / (BETWEEN + 1) as f64;
            frames.extend((0..BETWEEN).map(|k| interpolate(&last, &placed[0], share(k))));
        }
        starts.push(frames.len());
        frames.extend(placed);
    }
    Some((Clip { name: "stream".into(), frames, ..(*clips.first()?).clone() }, starts))
}

fn mean(rows: &[table::Row], set: &str, method: &str, key: &str) -> Option<f64> {
    let of = rows.iter().filter(|r| r["set"] == set && r["method"] == method);
    let values: Vec<f64> = of.filter_map(|r| r.get(key)?.as_f64()).collect();
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

const SETS: [&str; 9] = [
    "homogeneous",
    "heterogeneous",
    "stream",
    "homogeneous-exact",
    "heterogeneous-exact",
    "stream-exact",
    "homogeneous-generated",
    "heterogeneous-generated",
    "stream-generated",
];

/// Errors of each method by set: Xia 2015, Table 3 and Figure 6.
fn bars(rows: &[table::Row], key: &str, title: &str, unit: &str) -> Figure {
    let methods = [
        "unchanged",
        "global-affine",
        "global-affine-unlabelled",
        "gaussian-process",
        "gaussian-process-unlabelled",
        "statistic",
        "statistic-labelled",
        "lti",
        "lti-labelled",
        "knn",
        "knn-unlabelled",
        "local-ar",
        "mixture",
    ];
    let sets: Vec<String> =
        SETS.iter().filter(|s| rows.iter().any(|r| r["set"] == **s)).map(|s| (*s).to_owned()).collect();
    let series: Vec<(String, Vec<f64>)> = methods
        .iter()
        .filter(|m| sets.iter().any(|s| mean(rows, s, m, key).is_some()))
        .map(|m| ((*m).to_owned(), sets.iter().map(|s| mean(rows, s, m, key).unwrap_or(0.0)).collect()))
        .collect();
    Figure {
        name: key.replace('_', "-"),
        caption: format!(
            "{title} of each method, mean over test clips and styles (Xia 2015, Table 3, Figure 6)."
        ),
        svg: plots::bars(Labels { title, x: "data", y: unit }, &sets, &series),
    }
}

/// Which of both is better, and by how much.
fn better(mixture: f64, lti: f64, which: &str) -> String {
    if mixture <= lti {
        format!("the mixture is {:.0}% better than the linear model {which}", 100.0 * (1.0 - mixture / lti))
    } else {
        format!("the linear model {which} is {:.0}% better than the mixture", 100.0 * (1.0 - lti / mixture))
    }
}

/// The verdict in words: every number in it is in the table.
fn verdict(rows: &[table::Row]) -> String {
    let mut text = String::from(
        "Every method translates clips that it has never seen; errors are mean joint distances, hips-centred and \
         facing ahead, to a held-out clip of the output style at equal canonical time, or to the exact answer. That \
         answer is one affine map for all actions, which is what linear models can say and mixtures have to learn.",
    );
    for set in SETS {
        let of = |method: &str| mean(rows, set, method, "joint_error_cm");
        let (Some(mixture), Some(lti)) = (of("mixture"), of("lti")) else { continue };
        text += &format!(
            " {set}: mixture {mixture:.2} cm, linear model {lti:.2} cm; {}",
            better(mixture, lti, "of all actions")
        );
        if let Some(labelled) = of("lti-labelled") {
            text += &format!("; {}", better(mixture, labelled, "of the action alone"));
        }
        if let (Some(affine), Some(statistic)) = (of("global-affine"), of("statistic")) {
            text += &format!("; the global affine map has {affine:.2} cm, statistics {statistic:.2} cm");
        }
        if let Some(affine) = of("global-affine-unlabelled") {
            text += &format!("; one affine map of all actions {affine:.2} cm");
        }
        if let Some(knn) = of("knn") {
            text += &format!("; interpolation of neighbors of the action {knn:.2} cm");
        }
        if let Some(knn) = of("knn-unlabelled") {
            text += &format!(", of all actions {knn:.2} cm");
        }
        if let Some(process) = of("gaussian-process") {
            text += &format!("; the Gaussian process of the action {process:.2} cm");
        }
        if let Some(process) = of("gaussian-process-unlabelled") {
            text += &format!(", of all actions {process:.2} cm");
        }
        let step = |method: &str| mean(rows, set, method, "step_error_ms");
        if let (Some(mixture), Some(lti), Some(kept)) = (step("mixture"), step("lti"), step("statistic")) {
            text += &format!(
                ". A time step of the mixture is {mixture:.2} ms off, of the linear model {lti:.2} ms, of the input's \
                 own time {kept:.2} ms"
            );
        }
        text.push('.');
    }
    text
}
