//! Whether motion goes where Effort is set: the core's dial, and the whole-clip path.

use gestus_core::{Config, Database, Effort, blob::layout::section, stylizer::effort_dial::Dial};
use gestus_database::{
    blob::assemble::with_section,
    build::{BuildError, build},
    effort::{NAMES, estimate::Estimator, fragment::Library, model::Model, response, synthesize},
    registration::contact,
    stream::{Request, Streamed, stream},
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
    corpus::{Corpus, Example},
    statistics::{mean, rank_correlation},
};
use rayon::prelude::*;
use serde_json::json;

use crate::{
    evaluation,
    experiment::Experiment,
    metrics::{centred, feet, performance::Performance, third_difference},
    plots::{self, Labels, Series},
    report::{html::Figure, table},
};

/// Targets along each factor.
const TARGETS: usize = 9;

/// Whether the class of each test clip has other clips than the test clips.
pub(super) fn spare(corpus: &Corpus, tests: &[usize]) -> bool {
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

/// Evenly spaced targets of one factor within the dial's reach, with the other factors at rest.
fn targets(dial: &Dial<'_>, factor: usize) -> Vec<f64> {
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

/// Factor, and pairs of its target and its estimate on the output.
pub(super) type Curve = (usize, Vec<(f64, f64)>);

/// Streams every test clip whose action the database holds with the dial at several targets of each factor.
pub(super) fn dialled(
    experiment: &Experiment,
    model: &Model,
    tests: &[usize],
    tick: &(dyn Fn() + Sync),
) -> Result<(Vec<table::Row>, Vec<Curve>), BuildError> {
    let corpus = &experiment.corpus;
    let spared = spare(corpus, tests);
    let held_out = spared && unseen(corpus, model, tests);
    let rest = corpus.without(tests);
    let seen = if spared { &rest } else { corpus };
    let built = build(seen, &experiment.build)?;
    let solved = {
        let database = Database::open(&built.bytes)?;
        response::solve(&database, seen, model, experiment.from)?
    };
    let solved = match solved {
        Ok(dial) => dial,
        Err(reason) => {
            gestus_database::command_line::outputs::note(format_args!("no effort dial: {reason}"));
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
                // Of the prediction, and of the output with its feet held.
                let seen = |contacts: bool| {
                    let config = Config::new().contacts(contacts);
                    let request = Request { config, style: style.clone(), ..Request::style(0) };
                    Some(measure(&stream(&database, &example.clip, &request, &mut ()).ok()?)?[k])
                };
                curve.push((target, seen(false)?));
                held.push(seen(true)?);
            }
            tick();
            let (targets, estimates): (Vec<f64>, Vec<f64>) = curve.iter().copied().unzip();
            let row = evaluation::row(json!({
                "part": "dial", "method": "dial", "corpus": "data", "labels": solved.source.name(),
                "factor": NAMES[k], "action": corpus.actions[example.action], "style": null, "clip": example.clip.name,
                "rank_correlation": rank_correlation(&targets, &estimates),
                "rank_correlation_feet_held": rank_correlation(&targets, &held),
                "low": targets.first(), "high": targets.last(),
                "moved": estimates.last().zip(estimates.first()).map(|(a, b)| a - b),
                "held_out": held_out, "targets": targets, "estimates": estimates, "estimates_feet_held": held,
            }));
            Some((row, (k, curve)))
        })
        .collect();
    Ok(results.into_iter().flatten().unzip())
}

/// Translates every test clip by the whole-clip path at several targets of each factor.
pub(super) fn clips(
    corpus: &Corpus,
    model: &Model,
    tests: &[usize],
    tick: &(dyn Fn() + Sync),
) -> Vec<table::Row> {
    let library = &model.library;
    let held_out = unseen(corpus, model, tests);
    let estimator = Estimator::of(library);
    let (low, high) = (-1.0, 1.0);
    tests
        .iter()
        .flat_map(|&t| (0..3).map(move |k| (t, k)))
        .filter_map(|(test, k)| {
            let example = &corpus.examples[test];
            let mut asked = Vec::new();
            let (mut got, mut predicted, mut delivered) = (Vec::new(), Vec::new(), Vec::new());
            for i in 0..5 {
                let target = low + (high - low) * f64::from(i) / 4.0;
                let mut wanted = [None; 3];
                wanted[k] = Some(target);
                let output = synthesize::translate(model, &example.clip, &wanted);
                delivered.push(Delivered::of(model, example, &output));
                let action = Some(example.action);
                got.push(estimator.estimate(&library.body, &output.rows, library.rate_hz, action)?[k]);
                predicted.push((mean(output.choices.iter().map(|c| c.effort[k])) - target).abs());
                asked.push(target);
            }
            tick();
            Some(evaluation::row(json!({
                "part": "clip", "method": "effort", "corpus": "data", "labels": model.source.name(),
                "factor": NAMES[k], "action": corpus.actions[example.action], "style": null, "clip": example.clip.name,
                "rank_correlation": rank_correlation(&asked, &got),
                "low": low, "high": high,
                "moved": got[got.len() - 1] - got[0],
                "predicted_off": mean(predicted),
                "third_difference": mean(delivered.iter().map(|d| d.third_difference)),
                "third_difference_blended": mean(delivered.iter().map(|d| d.third_difference_blended)),
                "skate_cm_s": mean(delivered.iter().map(|d| d.skate_cm_s)),
                "skate_blended_cm_s": mean(delivered.iter().map(|d| d.skate_blended_cm_s)),
                "targets": asked, "estimates": got,
                "held_out": held_out,
            })))
        })
        .collect()
}

/// How a clip that was rebuilt of fragments moves.
struct Delivered {
    /// Third difference over that of the fragments, weighted as they are blended; and before feet were cleaned up.
    third_difference: f64,
    third_difference_blended: f64,
    /// Mean speed on the ground of feet that stand in the fragments, cm/s; and before feet were cleaned up.
    skate_cm_s: f64,
    skate_blended_cm_s: f64,
}

impl Delivered {
    fn of(model: &Model, input: &Example, output: &synthesize::Output) -> Self {
        let body = &model.library.body;
        let roughness = |frames: &[Frame]| {
            let clip = Clip { frames: frames.to_vec(), ..input.clip.clone() };
            rough(body, &body.clip_dofs(&clip))
        };
        let real = |i: usize| rough(body, &model.library.fragments[i].rows);
        let (mut sum, mut count) = (0.0, 0.0);
        for choice in &output.choices {
            let frames = (choice.snippet.to - choice.snippet.from) as f64;
            let share = choice.alpha.clamp(0.0, 1.0);
            sum += frames * ((1.0 - share) * real(choice.first) + share * real(choice.second));
            count += frames;
        }
        let legs = contact::legs(&[input], &body.landmarks);
        let skate = |frames: &[Frame]| {
            let performance = Performance {
                frames: frames.to_vec(),
                steps_s: vec![1.0 / input.clip.rate_hz; frames.len()],
                stands: output.stands.clone(),
            };
            feet::skate_cm_s(&body.skeleton, &legs, &performance)
        };
        Self {
            third_difference: roughness(&output.frames) / (sum / count),
            third_difference_blended: roughness(&output.blended) / (sum / count),
            skate_cm_s: skate(&output.frames),
            skate_blended_cm_s: skate(&output.blended),
        }
    }
}

/// Third difference of rows.
fn rough(body: &Body, rows: &[Vec<f64>]) -> f64 {
    third_difference(&rows.iter().map(|row| centred(body, row)).collect::<Vec<_>>())
}

/// Where the dial was set and what came out, mean over the clips.
pub(super) fn dial_figure(curves: &[Curve]) -> Figure {
    let series: Vec<Series> = NAMES
        .iter()
        .enumerate()
        .map(|(k, name)| {
            let own: Vec<&Vec<(f64, f64)>> =
                curves.iter().filter(|c| c.0 == k && !c.1.is_empty()).map(|c| &c.1).collect();
            let count = own.iter().map(|c| c.len()).min().unwrap_or(0);
            let mean = |i: usize| mean(own.iter().map(|c| c[i].1));
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
    use super::{super::estimated, *};
    use gestus_database::effort::{POLE, labels, sheet::sheet};

    /// Labels of the very clips that are tested are not held out, and an action that lacks a style costs its own rows alone.
    #[test]
    fn a_dial_says_whether_its_tests_were_held_out() {
        let mut experiment = Experiment::generated(&["walk", "run"], &["neutral", "angry"], 2, 4.0);
        experiment.corpus.examples.retain(|e| (e.action, e.style) != (1, 1));
        let corpus = &experiment.corpus;
        let tests = experiment.test_clips();
        assert!(tests.len() == 2 && spare(corpus, &tests));
        let rows = |model: &Model| dialled(&experiment, model, &tests, &|| ()).unwrap().0;
        let estimates = rows(&estimated(&Library::found(&corpus.without(&tests)).unwrap()));
        assert_eq!(estimates.len(), 3);
        assert!(estimates.iter().all(|r| r["action"] == "walk" && r["held_out"] == true), "{estimates:?}");
        let library = Library::found(corpus).unwrap();
        let mut table = labels::parse(sheet(&library, 60, 1).csv.as_bytes(), "s.csv", 30.0).unwrap();
        for (i, row) in table.iter_mut().enumerate() {
            row.effort =
                Some([0.05 * i as f64 - 1.0, 1.0 - 0.05 * i as f64, 0.5].map(|v: f64| v.clamp(-POLE, POLE)));
        }
        let given = Model::given(&table, "s.csv", |s| Library::annotated(corpus, s)).unwrap();
        let given = rows(&given);
        assert_eq!(given.len(), 3);
        assert!(given.iter().all(|r| r["labels"] == "given" && r["held_out"] == false), "{given:?}");
    }
}
