//! `gestus evaluate deviations`: a walk that steps over something, ducks, or leans back under a bar (Hsu 2005, section
//! 5.2). The output should deviate as the input does, and be as if nothing had happened soon after.
//!
//! Every method translates a held-out clip as it is and with the deviation (`make`). The distance of the two outputs is
//! what is measured: the deviation, as it comes out.

mod make;

use std::time::Instant;

use gestus_core::{Config, ConfigError, Database, Method};
use gestus_database::{
    command_line::progress,
    models::lti::{Model, clip::blend},
    stream::{Request, stream},
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
    corpus::Example,
    statistics::{mean, mean_or_zero, quantile, sorted},
};
use nalgebra::Vector3;
use serde_json::json;

use crate::{
    baselines::{hsu, models::NO_BLEND},
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut},
    fold::each_with,
    measures::{OnClips, Uses},
    metrics::{joint_distance, third_difference},
    plots::{self, Labels, Series},
    report::{html::Figure, table},
};
use make::{DEVIATIONS, Deviating, deviating};

/// Options of `gestus evaluate deviations`.
#[derive(clap::Args, Debug)]
pub struct Args;

/// Distance of two outputs below which the deviation is over, metres: two real takes of a style are 2.4 cm apart
/// (`docs/PAPERS.md`, `other-clip`).
const OVER_M: f64 = 0.02;
/// kc and kp of the curves of Figure 4.
const FIGURE_4: [(f64, f64); 5] = [(3.0, 2.0), (2.0, 2.0), (1.0, 2.0), (1.0, 4.0), (1.0, 8.0)];
/// Bins of a cycle in the plot of the distances, and its cycles before and after the end of a deviation.
const BINS: usize = 12;
const SHOWN: [f64; 2] = [-1.0, 1.0];

type Positions = Vec<Vector3<f64>>;

/// A motion as a method gives it.
struct Output {
    /// Joint positions of each frame, over the ground and facing ahead.
    poses: Vec<Positions>,
    /// Part of the input that was blended in, by frame.
    passed: Vec<f64>,
}

/// A method by name, and what it makes of a clip.
type Translator<'a> = (&'static str, Box<dyn Fn(&Clip) -> Result<Output, ConfigError> + 'a>);

/// What a fold gives: rows, and for the plot a method's name, the cycles since the end of the deviation, and the distance.
type Found = (Vec<table::Row>, Vec<(String, f64, f64)>);

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let (body, folds) = experiment.folds()?;
        let bar = progress::bar(folds.len(), "deviations");
        let options = experiment.build_with_models();
        let paper = |corpus: &_| hsu::Models::of(corpus, &options, &experiment.to);
        let found = each_with(experiment, &folds, &options, paper, |held, database, paper| {
            let found = Run { experiment, body: &body, database, held, paper }.found();
            bar.inc(1);
            found
        })?;
        bar.finish_and_clear();
        let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        let (rows, distances): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        Ok(Evaluation {
            what: "deviations",
            about: "A held-out walk or run is translated as it is and with a deviation that a rule makes of it. `kept` is the \
                    part of the deviation that is in the output: 1 as the input has it. `off_cm` is how far the output's \
                    deviation is from the input's. `after_cm` is the distance from the output without the deviation in the \
                    cycle behind it, `recovery_cycles` when it stays below 2 cm, or what is left of the clip."
                .into(),
            keys: vec!["method", "deviation"],
            rows: rows.into_iter().flatten().collect(),
            figures: vec![course(&distances.concat()), blends()],
        })
    }
}

/// A fold's clips through its database.
struct Run<'a> {
    experiment: &'a Experiment,
    body: &'a Body,
    database: &'a Database<'a>,
    held: HeldOut,
    paper: &'a hsu::Models,
}

impl Run<'_> {
    fn found(&self) -> Result<Found, ConfigError> {
        let corpus = &self.experiment.corpus;
        let example = &corpus.examples[self.held.test];
        let (mut rows, mut distances) = (Vec::new(), Vec::new());
        let methods = self.methods();
        let plain: Vec<Output> = methods.iter().map(|(_, of)| of(&example.clip)).collect::<Result<_, _>>()?;
        for (name, deviation) in DEVIATIONS {
            // A clip of fewer than three cycles has no such row.
            let Some(made) = deviating(self.body, example, deviation) else { continue };
            let input =
                Change::of(example, &made, &self.poses(&example.clip.frames), &self.poses(&made.clip.frames));
            for ((method, of), plain) in methods.iter().zip(&plain) {
                let deviates = of(&made.clip)?;
                let output = Change::of(example, &made, &plain.poses, &deviates.poses);
                let mut row = row(json!({
                    "method": method,
                    "deviation": name,
                    "action": corpus.actions[example.action],
                    "style": corpus.styles[self.held.style],
                    "clip": example.clip.name,
                    "passed": mean(deviates.passed[made.frames[0]..made.frames[1]].iter().copied()),
                    "third_difference": output.third_difference / input.third_difference,
                }));
                row.extend(output.figures(&input));
                rows.push(row);
                distances.extend(output.course.iter().map(|&(at, d)| (method.to_string(), at, d)));
            }
        }
        rows.extend(self.speed(&example.clip));
        Ok((rows, distances))
    }

    /// The methods whose data the fold has, by name.
    fn methods(&self) -> Vec<Translator<'_>> {
        let lti = Config::new().method(Method::Lti);
        let streamed = [
            ("mixture", Config::new()),
            ("phase", Config::new().method(Method::Phase)),
            ("statistic", Config::new().method(Method::Statistic)),
            ("lti", lti),
            ("lti-raw", lti.confidence(NO_BLEND)),
        ];
        let mut methods: Vec<Translator<'_>> = Vec::new();
        for (name, config) in streamed.into_iter().filter(|(_, c)| c.method.is_available_in(self.database)) {
            methods.push((name, Box::new(move |clip| self.streamed(clip, config))));
        }
        if let Some(model) = self.paper.style(self.held.style) {
            for (name, generalise) in hsu::METHODS {
                methods.push((name, Box::new(move |clip| Ok(self.simulated(model, clip, generalise)))));
            }
        }
        methods
    }

    /// A clip through the core, as it leaves it.
    fn streamed(&self, clip: &Clip, config: Config) -> Result<Output, ConfigError> {
        let request = Request { config, ..Request::style(self.held.style as u16) };
        let steps = stream(self.database, clip, &request, &mut ())?.steps;
        let frames: Vec<Frame> = steps.iter().map(|s| s.frame.clone()).collect();
        Ok(Output {
            poses: self.poses(&frames),
            passed: steps.iter().map(|s| f64::from(s.report.passed)).collect(),
        })
    }

    /// A clip through the model of Hsu 2005.
    fn simulated(&self, model: &Model, clip: &Clip, generalise: Option<(f64, f64)>) -> Output {
        let out = hsu::translate(model, self.body, self.database, clip, generalise);
        let theirs = self.body.with_means_of(self.database);
        let frames: Vec<Frame> = out.rows.iter().map(|row| theirs.pose(row, [0.0; 2], 0.0)).collect();
        Output { poses: self.poses(&frames), passed: out.passed }
    }

    /// The size and the speed of the model of Hsu 2005, which section 5.2 prints: of its simulation alone, without the
    /// clip's way to dofs, the median of five.
    fn speed(&self, clip: &Clip) -> Option<table::Row> {
        let model = self.paper.style(self.held.style)?;
        let dofs = self.body.with_means_of(self.database).clip_dofs(clip);
        let times = (0..5).map(|_| {
            let start = Instant::now();
            hsu::simulate(model, &dofs, Some(hsu::BLEND));
            start.elapsed().as_secs_f64()
        });
        let seconds = quantile(&sorted(times), 0.5)?;
        Some(row(json!({
            "method": hsu::METHODS[0].0,
            "deviation": "none",
            "style": self.experiment.corpus.styles[self.held.style],
            "clip": clip.name,
            "states": model.states(),
            "frames_per_s": clip.frames.len() as f64 / seconds,
        })))
    }

    fn poses(&self, frames: &[Frame]) -> Vec<Positions> {
        frames.iter().map(|frame| self.body.local_positions(frame)).collect()
    }
}

/// What a deviation changes in a motion.
struct Change {
    /// How far each joint is moved in each frame of the deviation.
    during: Vec<Positions>,
    /// Mean third difference in these frames, with the deviation.
    third_difference: f64,
    /// Mean distance of the joints by the cycles since the deviation's end, metres.
    course: Vec<(f64, f64)>,
}

impl Change {
    fn of(example: &Example, made: &Deviating, plain: &[Positions], deviates: &[Positions]) -> Self {
        let [start, end] = made.frames;
        let moved = |t: usize| deviates[t].iter().zip(&plain[t]).map(|(a, b)| a - b).collect();
        let cycle = mean(example.cycles.iter().map(|c| c.span().1 - c.span().0));
        let since = |t: usize| (t as f64 - end as f64) / cycle;
        Self {
            during: (start..end).map(moved).collect(),
            third_difference: third_difference(&deviates[start..end]),
            course: (0..plain.len()).map(|t| (since(t), joint_distance(&deviates[t], &plain[t]))).collect(),
        }
    }

    /// The figures of an output's change against the input's.
    fn figures(&self, input: &Self) -> table::Row {
        let pairs = || self.during.iter().flatten().zip(input.during.iter().flatten());
        let kept = pairs().map(|(out, own)| out.dot(own)).sum::<f64>();
        let whole: f64 = input.during.iter().flatten().map(|own| own.norm_squared()).sum();
        let after = || self.course.iter().filter(|at| at.0 >= 0.0);
        let last = self.course.last().map_or(0.0, |at| at.0);
        // Behind the last frame that is still off.
        let recovery = after().rfind(|at| at.1 > OVER_M).map_or(0.0, |at| at.0);
        row(json!({
            "kept": kept / whole,
            "off_cm": 100.0 * mean(pairs().map(|(out, own)| (out - own).norm())),
            "deviation_cm": 100.0 * mean(input.during.iter().flatten().map(|own| own.norm())),
            "after_cm": 100.0 * mean_or_zero(after().filter(|at| at.0 < 1.0).map(|at| at.1)),
            "recovery_cycles": recovery,
            "recovered": u8::from(recovery < last.min(1.0)),
        }))
    }
}

/// Distance of the outputs with and without the deviation, by the cycles since its end.
fn course(distances: &[(String, f64, f64)]) -> Figure {
    let [first, last] = SHOWN;
    let mut series: Vec<Series> = Vec::new();
    for (method, _, _) in distances {
        if series.iter().any(|s| s.0 == *method) {
            continue;
        }
        let point = |bin: usize| {
            let at = first + bin as f64 / BINS as f64;
            let inside = |d: &&(String, f64, f64)| d.0 == *method && (d.1 - at).abs() <= 0.5 / BINS as f64;
            (at, 100.0 * mean(distances.iter().filter(inside).map(|d| d.2)))
        };
        let bins = ((last - first) * BINS as f64) as usize;
        series.push((method.clone(), (0..=bins).map(point).collect()));
    }
    let labels = Labels {
        title: "Outputs with and without the deviation",
        x: "cycles since the deviation's end",
        y: "mean distance of the joints, cm",
    };
    Figure {
        name: "recovery".into(),
        caption: "All deviations. Behind 0 the input is the same in both.".into(),
        svg: plots::lines(labels, &series),
    }
}

/// Hsu 2005, Figure 4.
fn blends() -> Figure {
    let curve = |(kc, kp)| -> Series {
        let points = (-100..=100).map(|i| 0.06 * f64::from(i));
        (format!("kc {kc}, kp {kp}"), points.map(|d| (d, blend(d, (kc, kp)))).collect())
    };
    let labels = Labels {
        title: "The blend of unexpected input",
        x: "standard deviations of a dof from its mean",
        y: "part of the input",
    };
    Figure {
        name: "blend".into(),
        caption: "Hsu 2005, Figure 4: eqs. 7 and 8.".into(),
        svg: plots::lines(labels, &FIGURE_4.map(curve)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_blend_keeps_what_the_model_does_not_know_and_all_recover() {
        let found = Args.evaluate(&Experiment::generated(&["walk"], &["neutral", "old"], 4, 6.0)).unwrap();
        let of = |method: &str, deviation: &str, key: &str| {
            let row =
                found.rows.iter().find(|r| r["method"] == method && r["deviation"] == deviation).unwrap();
            row[key].as_f64().unwrap_or_else(|| panic!("{method} {deviation} {key}"))
        };
        for (deviation, _) in DEVIATIONS {
            let off = of("mixture", deviation, "deviation_cm");
            assert!(off > 1.0, "{deviation} moves nothing: {off}");
            for method in ["mixture", "phase", "statistic", "lti", "lti-raw", "lti-paper", "lti-paper-raw"] {
                assert!(
                    of(method, deviation, "kept").is_finite() && of(method, deviation, "after_cm") < 10.0
                );
            }
            // Eqs. 7 and 8: what is far from the data is the input's.
            assert!(
                of("lti-paper", deviation, "passed") > 0.5 && of("lti-paper-raw", deviation, "passed") == 0.0
            );
        }
        for deviation in ["duck", "limbo"] {
            assert!(of("lti-paper", deviation, "off_cm") < 0.7 * of("lti-paper-raw", deviation, "off_cm"));
        }
        assert!(of("lti-paper", "none", "states") > 0.0);
    }

    #[test]
    fn a_change_like_the_inputs_is_kept_and_one_that_stays_is_not_recovered() {
        let corpus = Experiment::generated(&["walk"], &["neutral"], 1, 6.0).corpus;
        let (body, example) = (Body::of(&corpus).unwrap(), &corpus.examples[0]);
        let made = deviating(&body, example, make::Deviation::Duck).unwrap();
        let plain: Vec<Positions> =
            example.clip.frames.iter().map(|f| f.positions(&corpus.skeleton)).collect();
        let deviates: Vec<Positions> =
            made.clip.frames.iter().map(|f| f.positions(&corpus.skeleton)).collect();
        let input = Change::of(example, &made, &plain, &deviates);
        let own = input.figures(&input);
        assert_eq!((own["kept"].as_f64(), own["off_cm"].as_f64()), (Some(1.0), Some(0.0)));
        assert_eq!(own["recovered"], 1);
        let stays: Vec<Positions> = plain
            .iter()
            .map(|pose| pose.iter().map(|p| p + Vector3::new(0.0, 0.0, 0.05)).collect())
            .collect();
        let figures = Change::of(example, &made, &plain, &stays).figures(&input);
        assert!(figures["recovered"] == 0 && (figures["after_cm"].as_f64().unwrap() - 5.0).abs() < 1e-6);
    }
}
