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
        speed::{self, ALLOWED, fastest, peak_speeds},
    },
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::stream::{Request, Streamed, stream};
use gestus_motion::{body::Body, corpus::Corpus};

/// Folds of which a figure is drawn.
const FIGURES: usize = 6;

/// Options of `gestus evaluate skate`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let (body, folds) = experiment.folds()?;
        let results = each("skate", experiment, &folds, &experiment.build, |held, database| {
            let number = folds.iter().position(|f| *f == held).unwrap_or_default();
            one(experiment, &body, &held, number, database)
        })?;
        let (rows, figures): (Vec<_>, Vec<_>) = results.into_iter().unzip();
        Ok(Evaluation {
            what: "skate",
            about: format!(
                "How fast the point that a foot stands on slides, and what holding it costs. `input` \
                    is the clip, `raw` its translation, `unlimited` the same with its feet held, `locked` with its joints no faster \
                    than {ALLOWED} times the input's too, or up to 5/3 of that if the style's are as fast, as shipped, `real` a held-out clip of the output style. `joint_speed_ratio` \
                    holds the fastest joint against the fastest of the input, whichever each is; `leg_speed_ratio` holds hips, \
                    knees and ankles each against itself."
            ),
            keys: vec!["method", "action", "style"],
            rows: rows.into_iter().flatten().collect(),
            figures: figures.into_iter().flatten().take(FIGURES).collect(),
        })
    }
}

/// What is measured of a fold.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Version {
    Input,
    Raw,
    Unlimited,
    Locked,
    Real,
}

impl Version {
    const fn name(self) -> &'static str {
        match self {
            Self::Input => "input",
            Self::Raw => "raw",
            Self::Unlimited => "unlimited",
            Self::Locked => "locked",
            Self::Real => "real",
        }
    }
}

/// The motions of a fold that are compared.
struct Compared {
    input: Performance,
    raw: Performance,
    unlimited: (Performance, Streamed),
    locked: (Performance, Streamed),
    real: Performance,
}

impl Compared {
    /// Streams the test clip; `None` where it can't be streamed.
    fn of(corpus: &Corpus, body: &Body, fold: &HeldOut, database: &Database<'_>) -> Option<Self> {
        let clip = &corpus.examples[fold.test].clip;
        let run = |config: Config| {
            let request = Request { config, ..Request::style(fold.style as u16) };
            let streamed = stream(database, clip, &request, &mut ()).ok()?;
            Some((Performance::of_stream(&streamed), streamed))
        };
        let unlimited = Config::new().speed_limit(0.0);
        Some(Self {
            input: Performance::of_clip(clip, body),
            raw: run(unlimited.contacts(false))?.0,
            unlimited: run(unlimited)?,
            locked: run(Config::new())?,
            real: Performance::of_clip(&corpus.examples[fold.truth].clip, body),
        })
    }

    fn all(&self) -> [(Version, &Performance, Option<&Streamed>); 5] {
        [
            (Version::Input, &self.input, None),
            (Version::Raw, &self.raw, None),
            (Version::Unlimited, &self.unlimited.0, Some(&self.unlimited.1)),
            (Version::Locked, &self.locked.0, Some(&self.locked.1)),
            (Version::Real, &self.real, None),
        ]
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
    let Some(compared) = Compared::of(corpus, body, fold, database) else { return (Vec::new(), None) };
    let rows = rows(experiment, body, fold, &legs, &compared);
    let figure = (number < FIGURES).then(|| foot_speed(corpus, fold, &legs, &compared));
    (rows, figure)
}

fn rows(
    experiment: &Experiment,
    body: &Body,
    fold: &HeldOut,
    legs: &[Leg; 2],
    compared: &Compared,
) -> Vec<table::Row> {
    let corpus = &experiment.corpus;
    let (test, truth) = (&corpus.examples[fold.test], &corpus.examples[fold.truth]);
    let skeleton = &corpus.skeleton;
    let Compared { input, raw, unlimited: (unlimited, _), .. } = compared;
    let (input_peaks, raw_peaks) = (peak_speeds(input), peak_speeds(raw));
    let (input_fastest, raw_fastest) = (fastest(input), fastest(raw));
    let leg_joints: Vec<usize> = legs.iter().flat_map(|l| [l.hip, l.knee, l.ankle]).collect();
    // The fastest joint in all clips of the action in the output style, not in the truth alone.
    let of_style = corpus.examples.iter().filter(|e| e.style == fold.style && e.action == test.action);
    let style_fastest = of_style.map(|e| fastest(&Performance::of_clip(&e.clip, body))).fold(0.0, f64::max);
    let counterpart = Fold::of(experiment, body, *fold);
    let of_counterpart =
        |of: &Performance| Performance { stands: counterpart.counterpart_stands().to_vec(), ..of.clone() };
    let row = |(version, performance, streamed): (Version, &Performance, Option<&Streamed>)| {
        let peaks = peak_speeds(performance);
        let ratio = |to: &[f64]| leg_joints.iter().map(|&j| peaks[j] / to[j].max(1e-9)).fold(0.0, f64::max);
        let [low, high] = heights_cm(skeleton, legs, performance);
        let (joint, frame) = speed::where_fastest(performance, &skeleton.names);
        let is_real = version == Version::Real;
        let mut row = row(json!({
            "method": version.name(),
            "action": corpus.actions[test.action],
            "style": corpus.styles[fold.style],
            "clip": if is_real { &truth.clip.name } else { &test.clip.name },
            "truth": truth.clip.name,
            "skate_cm_s": skate_cm_s(skeleton, legs, performance),
            "skate_counterpart_cm_s":
                (!is_real).then(|| skate_cm_s(skeleton, legs, &of_counterpart(performance))),
            "skate_stillest_cm_s": stillest_cm_s(skeleton, legs, performance),
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
            "deepest_cm": deepest_cm(skeleton, legs, performance),
        }));
        if let Some(streamed) = streamed {
            row.extend(speed::over(legs, input_fastest, raw, performance, streamed));
            row.insert("held_cm_max".into(), (100.0 * held_most(streamed)).into());
            row.insert("let_go".into(), let_go(streamed, raw).into());
        }
        if version == Version::Locked {
            row.extend(speed::held_back(skeleton, unlimited, performance));
        }
        row
    };
    compared.all().map(row).into()
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
fn foot_speed(corpus: &Corpus, fold: &HeldOut, legs: &[Leg; 2], compared: &Compared) -> Figure {
    let joint = legs[0].toe.unwrap_or(legs[0].ankle);
    let series = [(Version::Raw, &compared.raw), (Version::Locked, &compared.locked.0)].map(
        |(version, performance)| {
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
            (version.name().to_owned(), points)
        },
    );
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
