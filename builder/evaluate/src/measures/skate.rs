//! How fast feet slide while they stand, before and after the foot lock, and how much faster joints turn with it; beside
//! real motion.

use gestus_core::{Config, Database, blob::Leg};
use nalgebra::Vector3;
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut},
    fold::{Fold, each},
    measures::{OnClips, Uses},
    metrics::{
        feet::{deepest_cm, heights_cm, skate_cm_s, stillest_cm_s},
        performance::Performance,
        speed::{self, fastest, peak_speeds},
    },
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    build::BuildError,
    command_line::progress,
    stream::{Request, Streamed, stream},
};
use gestus_motion::{body::Body, corpus::Corpus};

/// Options of `gestus evaluate skate`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let (body, folds) = experiment.folds()?;
        let bar = progress::bar(folds.len(), "skate");
        let results = each(experiment, &folds, &experiment.build, |held, database| {
            let number = folds.iter().position(|f| *f == held).unwrap_or_default();
            let result = one(experiment, &body, &held, number, database);
            bar.inc(1);
            Ok::<_, BuildError>(result)
        })?;
        bar.finish_and_clear();
        let (rows, figures): (Vec<_>, Vec<_>) = results.into_iter().unzip();
        Ok(Evaluation {
            what: "skate",
            about: "How fast the point that a foot stands on slides, and what holding it costs. `input` \
                    is the clip, `raw` its translation, `unlimited` the same with its feet held, `locked` with its joints no faster \
                    than 1.2 times the input's too, as shipped, `real` a held-out clip of the output style. `joint_speed_ratio` \
                    holds the fastest joint against the fastest of the input, whichever each is; `leg_speed_ratio` holds hips, \
                    knees and ankles each against itself."
                .into(),
            keys: vec!["method", "action", "style"],
            rows: rows.into_iter().flatten().collect(),
            figures: figures.into_iter().flatten().take(6).collect(),
        })
    }
}

fn one(
    experiment: &Experiment,
    body: &Body,
    fold: &HeldOut,
    number: usize,
    database: &Database<'_>,
) -> (Vec<table::Row>, Option<Figure>) {
    let corpus = &experiment.corpus;
    let Some(legs) = database.legs() else { return (Vec::new(), None) };
    let (clip, truth) = (&corpus.examples[fold.test].clip, &corpus.examples[fold.truth].clip);
    let run = |config: Config| {
        let request = Request { config, ..Request::style(fold.style as u16) };
        stream(database, clip, &request, &mut ())
    };
    let unlimited = Config::new().speed_limit(0.0);
    let (Ok(raw), Ok(unlimited), Ok(locked)) =
        (run(unlimited.contacts(false)), run(unlimited), run(Config::new()))
    else {
        return (Vec::new(), None);
    };
    let performances = [
        ("input", Performance::of_clip(clip, body)),
        ("raw", Performance::of_stream(&raw)),
        ("unlimited", Performance::of_stream(&unlimited)),
        ("locked", Performance::of_stream(&locked)),
        ("real", Performance::of_clip(truth, body)),
    ];
    let skeleton = &corpus.skeleton;
    let input_peaks = peak_speeds(&performances[0].1);
    let raw_peaks = peak_speeds(&performances[1].1);
    let leg_joints: Vec<usize> = legs.iter().flat_map(|l| [l.hip, l.knee, l.ankle]).collect();
    let input_fastest = fastest(&performances[0].1);
    let raw_fastest = fastest(&performances[1].1);
    // The fastest joint in all clips of the action in the output style, not in the truth alone.
    let style_fastest = corpus
        .examples
        .iter()
        .filter(|e| e.style == fold.style && e.action == corpus.examples[fold.test].action)
        .map(|e| fastest(&Performance::of_clip(&e.clip, body)))
        .fold(0.0, f64::max);
    let counterpart = Fold::of(experiment, body, *fold);
    let of_counterpart =
        |of: &Performance| Performance { stands: counterpart.counterpart_stands().to_vec(), ..of.clone() };
    let rows = performances
        .iter()
        .map(|(method, performance)| {
            let peaks = peak_speeds(performance);
            let ratio =
                |to: &[f64]| leg_joints.iter().map(|&j| peaks[j] / to[j].max(1e-9)).fold(0.0, f64::max);
            let [low, high] = heights_cm(skeleton, &legs, performance);
            let (joint, frame) = speed::where_fastest(performance, &skeleton.names);
            let mut row = row(json!({
                "method": method,
                "action": corpus.actions[corpus.examples[fold.test].action],
                "style": corpus.styles[fold.style],
                "clip": if *method == "real" { &truth.name } else { &clip.name },
                "skate_cm_s": skate_cm_s(skeleton, &legs, performance),
                "skate_counterpart_cm_s": (*method != "real")
                    .then(|| skate_cm_s(skeleton, &legs, &of_counterpart(performance))),
                "skate_stillest_cm_s": stillest_cm_s(skeleton, &legs, performance),
                "joint_speed_ratio": fastest(performance) / input_fastest,
                "joint_speed_over_raw": fastest(performance) / raw_fastest,
                "fastest_rad_s": fastest(performance),
                "fastest_joint": joint,
                "fastest_frame": frame,
                "style_fastest_rad_s": style_fastest,
                "leg_speed_ratio": ratio(&input_peaks),
                "leg_speed_over_raw": ratio(&raw_peaks),
                "lowest_cm": low,
                "highest_cm": high,
                "deepest_cm": deepest_cm(skeleton, &legs, performance),
            }));
            if let Some(streamed) = match *method {
                "unlimited" => Some(&unlimited),
                "locked" => Some(&locked),
                _ => None,
            } {
                let raw = &performances[1].1;
                row.extend(speed::over(&legs, input_fastest, raw, performance, streamed));
                row.insert("held_cm_max".into(), (100.0 * held_most(streamed)).into());
                row.insert("let_go".into(), let_go(streamed, raw).into());
            }
            if *method == "locked" {
                row.extend(speed::held_back(skeleton, &performances[2].1, performance));
            }
            row
        })
        .collect();
    let figure = (number < 12).then(|| foot_speed(corpus, fold, &legs, &performances));
    (rows, figure)
}

/// How often the lock releases a foot that should stand by its neighbors' votes, since it is too far off.
fn let_go(streamed: &Streamed, raw: &Performance) -> usize {
    let held = |t: usize, side: usize| streamed.steps[t].report.held[side];
    (1..streamed.steps.len())
        .flat_map(|t| [0, 1].map(|side| (t, side)))
        .filter(|&(t, side)| held(t - 1, side) && !held(t, side) && raw.stands[t][side])
        .count()
}

fn held_most(streamed: &Streamed) -> f64 {
    let of = |s: &gestus_database::stream::Step| {
        [0, 1].map(|i| if s.report.held[i] { f64::from(s.report.held_m[i]) } else { 0.0 })
    };
    streamed.steps.iter().flat_map(of).fold(0.0, f64::max)
}

/// Speed of the left foot's toes on the ground over time, before and after.
fn foot_speed(
    corpus: &Corpus,
    fold: &HeldOut,
    legs: &[Leg; 2],
    performances: &[(&str, Performance)],
) -> Figure {
    let joint = legs[0].toe.unwrap_or(legs[0].ankle);
    let series: Vec<(String, Vec<(f64, f64)>)> = performances
        .iter()
        .filter(|(name, _)| *name == "raw" || *name == "locked")
        .map(|(name, performance)| {
            let places: Vec<Vector3<f64>> =
                performance.frames.iter().map(|f| f.positions(&corpus.skeleton)[joint]).collect();
            let mut time = 0.0;
            let points = (1..places.len())
                .map(|t| {
                    time += performance.steps_s[t];
                    let way = places[t] - places[t - 1];
                    (time, 100.0 * way.x.hypot(way.z) / performance.steps_s[t])
                })
                .take_while(|(time, _)| *time < 4.0)
                .collect();
            ((*name).to_owned(), points)
        })
        .collect();
    let name = &corpus.examples[fold.test].clip.name;
    let style = &corpus.styles[fold.style];
    let title = format!("Left toes of {name} in the style {style}");
    Figure {
        name: format!("{name}-{style}"),
        caption: format!(
            "Speed on the ground of the left toes, {name} in the style {style}, before and after the lock."
        ),
        svg: plots::lines(Labels { title: &title, x: "output time, s", y: "cm/s" }, &series),
    }
}
