//! `gestus evaluate starts`: the first second of a stream, and the second after a change. No joint should be faster in it
//! than in the fastest real clip of the action in the output style.
//!
//! | `event` | what is streamed |
//! |---|---|
//! | `clip` | the test clip, from its first frame |
//! | `stride` | the test clip from a quarter, a half and three quarters of its first whole cycle on |
//! | `reset` | the test clip, with [`Stylizer::reset`] in its middle |
//! | `leap` | the test clip to its middle, then from its first frame on, a metre aside |
//! | `style` | the test clip, whose output style changes in its middle from the input's |
//! | `labels` | the test clip, whose labels are set in its middle |
//!
//! What changes from the pose before a `reset` to the one after it is not counted: it is a stream's first pose. A `leap`
//! is counted from the pose that leaps.

use gestus_core::{Config, Database, Method, Pose, Stylizer, blob::layout::MAX_JOINTS};
use gestus_database::stream::{MOST_CLASSES, MOST_NEIGHBORS, from_pose, to_pose};
use gestus_motion::{
    body::Body,
    clip::{Frame, Skeleton},
    corpus::{Corpus, Example},
    statistics::{quantile, sorted},
};
use nalgebra::Vector3;
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::{Experiment, HeldOut},
    fold::each,
    measures::{OnClips, Uses},
    metrics::{
        performance::Performance,
        speed::{fastest, peak_speeds, where_fastest},
    },
    report::table,
};

/// Options of `gestus evaluate starts`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Method of translation
    #[arg(long, default_value = "mar", value_parser = method)]
    method: Method,
}

/// The method of that name.
fn method(name: &str) -> Result<Method, String> {
    Method::named(name).ok_or_else(|| Method::NAMES.join(", "))
}

/// What happens at the beginning of the second that is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Event {
    Clip,
    Stride,
    Reset,
    Leap,
    Style,
    Labels,
}

const EVENTS: [(&str, Event); 6] = [
    ("clip", Event::Clip),
    ("stride", Event::Stride),
    ("reset", Event::Reset),
    ("leap", Event::Leap),
    ("style", Event::Style),
    ("labels", Event::Labels),
];
/// Seconds that are measured.
const MEASURED_S: f64 = 1.0;
/// A leap's way, metres.
const ASIDE: Vector3<f64> = Vector3::new(1.0, 0.0, 0.0);

/// The fastest of the real clips of an action in a style.
struct Fastest {
    /// Of any joint, rad/s.
    any: f64,
    /// Of each joint, rad/s.
    joints: Vec<f64>,
    /// Of any joint's place, m/s.
    place: f64,
}

/// One second that was measured: each figure over that of the fastest real clip.
struct Start {
    event: Event,
    action: usize,
    /// The fastest joint.
    any: f64,
    /// The joint that is the fastest beside itself.
    joint: f64,
    /// The fastest place of a joint.
    place: f64,
    /// Output style, clip, joint and frame.
    what: String,
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        let corpus = &experiment.corpus;
        let (body, folds) = experiment.folds()?;
        let options = if self.method == Method::Mar {
            experiment.build.clone()
        } else {
            experiment.build_with_models()
        };
        let config = Config::new().method(self.method);
        let starts = each("starts", experiment, &folds, &options, |held, database| {
            Run { experiment, body: &body, database, held, config }.starts()
        })?;
        let starts = starts.into_iter().collect::<Result<Vec<_>, _>>()?;
        let starts: Vec<Start> = starts.into_iter().flatten().collect();
        let method = if self.method == Method::Mar { "mixture" } else { self.method.name() };
        let mut rows = Vec::new();
        for (name, event) in EVENTS {
            let of: Vec<&Start> = starts.iter().filter(|s| s.event == event).collect();
            rows.extend(summary(method, name, "all", &of));
            for (action, action_name) in corpus.actions.iter().enumerate() {
                let of: Vec<&Start> = of.iter().filter(|s| s.action == action).copied().collect();
                rows.extend(summary(method, name, action_name, &of));
            }
        }
        Ok(Evaluation {
            what: "starts",
            about: "Speeds of joints in the first second of a stream and after a change, over those of the fastest real clip of \
                    the action in the output style: how many are over 1, the median, and the worst. `turn` is the fastest joint, \
                    rad/s, against the style's fastest, whichever each is; `joint` holds each joint against itself; `place` is \
                    the speed of a joint through the room, m/s."
                .into(),
            keys: vec!["event", "action"],
            rows,
            figures: Vec::new(),
        })
    }
}

/// How many starts are over, the median and the worst, by each of the three measures.
fn summary(method: &str, event: &str, action: &str, starts: &[&Start]) -> Option<table::Row> {
    let worst = starts.iter().max_by(|a, b| a.any.total_cmp(&b.any))?;
    let of = |figure: &dyn Fn(&Start) -> f64| {
        let ascending = sorted(starts.iter().map(|s| figure(s)));
        let over = ascending.iter().filter(|&&ratio| ratio > 1.0).count();
        (over, quantile(&ascending, 0.5), ascending.last().copied())
    };
    let (turn, joint, place) = (of(&|s| s.any), of(&|s| s.joint), of(&|s| s.place));
    Some(row(json!({
        "method": method,
        "event": event,
        "action": action,
        "starts": starts.len(),
        "turn_over": turn.0,
        "turn_median": turn.1,
        "turn_worst": turn.2,
        "joint_over": joint.0,
        "joint_median": joint.1,
        "joint_worst": joint.2,
        "place_over": place.0,
        "place_median": place.1,
        "place_worst": place.2,
        "worst": worst.what,
    })))
}

/// A fold's streams.
struct Run<'a> {
    experiment: &'a Experiment,
    body: &'a Body,
    database: &'a Database<'a>,
    held: HeldOut,
    config: Config,
}

type Gestus<'db> = Stylizer<'db, MAX_JOINTS, MOST_NEIGHBORS, MOST_CLASSES>;

impl Run<'_> {
    fn starts(&self) -> anyhow::Result<Vec<Start>> {
        let corpus = &self.experiment.corpus;
        let example = &corpus.examples[self.held.test];
        let fastest = Fastest::of(corpus, self.body, example.action, self.held.style);
        let count = example.clip.frames.len();
        let length = (MEASURED_S * corpus.rate_hz).round() as usize;
        let middle = count / 2;
        let mut jobs = vec![(Event::Clip, 0)];
        if let Some(cycle) = example.cycles.first() {
            jobs.extend([0.25, 0.5, 0.75].map(|part| (Event::Stride, cycle.position(part) as usize)));
        }
        if middle >= length {
            jobs.extend(
                [Event::Reset, Event::Leap, Event::Style, Event::Labels].map(|event| (event, middle)),
            );
        }
        let mut starts = Vec::new();
        for (event, at) in jobs.into_iter().filter(|(_, at)| at + 2 < count) {
            let (poses, seconds) = self.stream(event, at, length)?;
            let output =
                Performance { steps_s: seconds, stands: vec![[false; 2]; poses.len()], frames: poses };
            let (joint, frame) = where_fastest(&output, &corpus.skeleton.names);
            let style = &corpus.styles[self.held.style];
            starts.push(Start {
                what: format!("{joint}, {frame} frames after {at} of {} to {style}", example.clip.name),
                ..fastest.beside(event, example.action, &corpus.skeleton, &output)
            });
        }
        Ok(starts)
    }

    /// The poses of the second that is measured, with the one before it where there is one, and their steps.
    fn stream(&self, event: Event, at: usize, length: usize) -> anyhow::Result<(Vec<Frame>, Vec<f64>)> {
        let corpus = &self.experiment.corpus;
        let Example { clip, action, style, .. } = &corpus.examples[self.held.test];
        let database = self.database;
        let mut stylizer = Box::new(Gestus::new(*database, self.config)?);
        let to = self.held.style as u16;
        stylizer.set_style(&[(if event == Event::Style { *style as u16 } else { to }, 1.0)])?;
        let moved = |frame: &Frame| Frame { root: frame.root + ASIDE, ..frame.clone() };
        let (before, after): (&[Frame], Vec<Frame>) = match event {
            Event::Clip | Event::Stride => (&[], clip.frames[at..].to_vec()),
            Event::Leap => (&clip.frames[..at], clip.frames.iter().map(moved).collect()),
            _ => (&clip.frames[..at], clip.frames[at..].to_vec()),
        };
        let joints = database.counts().joints;
        let (mut poses, mut seconds, mut output) = (Vec::new(), Vec::new(), Pose::IDENTITY);
        let mut step = |stylizer: &mut Gestus<'_>, frame: &Frame| {
            let report = stylizer.step(&to_pose(frame), &mut output);
            (from_pose(&output, joints), f64::from(report.step_s))
        };
        for frame in before {
            let (pose, step_s) = step(&mut stylizer, frame);
            (poses, seconds) = (vec![pose], vec![step_s]);
        }
        match event {
            Event::Reset => {
                stylizer.reset();
                (poses, seconds) = (Vec::new(), Vec::new());
            }
            Event::Style => stylizer.set_style(&[(to, 1.0)])?,
            Event::Labels => {
                stylizer.set_labels(Some(*action as u16), Some(*style as u16))?;
            }
            Event::Clip | Event::Stride | Event::Leap => {}
        }
        for frame in after.iter().take(length + 1) {
            let (pose, step_s) = step(&mut stylizer, frame);
            poses.push(pose);
            seconds.push(step_s);
        }
        Ok((poses, seconds))
    }
}

impl Fastest {
    fn of(corpus: &Corpus, body: &Body, action: usize, style: usize) -> Self {
        let clips = corpus.examples.iter().filter(|e| (e.action, e.style) == (action, style));
        let clips: Vec<Performance> = clips.map(|e| Performance::of_clip(&e.clip, body)).collect();
        let mut joints = vec![0.0; corpus.skeleton.names.len()];
        for clip in &clips {
            for (most, peak) in joints.iter_mut().zip(peak_speeds(clip)) {
                *most = f64::max(*most, peak);
            }
        }
        let any = joints.iter().copied().fold(0.0, f64::max);
        let place = clips.iter().map(|clip| fastest_place(&corpus.skeleton, clip)).fold(0.0, f64::max);
        Self { any, joints, place }
    }

    /// The speeds of an output over these.
    fn beside(&self, event: Event, action: usize, skeleton: &Skeleton, output: &Performance) -> Start {
        let ratios =
            peak_speeds(output).into_iter().zip(&self.joints).map(|(own, most)| own / most.max(1e-3));
        Start {
            event,
            action,
            any: fastest(output) / self.any,
            joint: ratios.fold(0.0, f64::max),
            place: fastest_place(skeleton, output) / self.place,
            what: String::new(),
        }
    }
}

/// Fastest speed of a joint's place, m/s.
fn fastest_place(skeleton: &Skeleton, of: &Performance) -> f64 {
    let places: Vec<Vec<Vector3<f64>>> = of.frames.iter().map(|f| f.positions(skeleton)).collect();
    let steps = places.windows(2).zip(of.steps_s.get(1..).unwrap_or(&[]));
    steps.flat_map(|(w, s)| w[0].iter().zip(&w[1]).map(move |(a, b)| (b - a).norm() / s)).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_real_clip_is_no_faster_than_the_fastest_one() {
        let corpus = Experiment::generated(&["walk"], &["neutral", "proud"], 3, 5.0).corpus;
        let body = Body::of(&corpus).unwrap();
        let fastest = Fastest::of(&corpus, &body, 0, 1);
        let clips = || corpus.examples.iter().filter(|e| e.style == 1);
        let ratios: Vec<Start> = clips()
            .map(|e| {
                let clip = Performance::of_clip(&e.clip, &body);
                fastest.beside(Event::Clip, 0, &corpus.skeleton, &clip)
            })
            .collect();
        for figure in [|s: &Start| s.any, |s: &Start| s.joint, |s: &Start| s.place] {
            let most = ratios.iter().map(figure).fold(0.0, f64::max);
            assert!((most - 1.0).abs() < 1e-12, "{most}");
        }
        // Twice as fast, and the worst is named.
        let clip = &clips().next().unwrap().clip;
        let half = Performance {
            steps_s: vec![0.5 / clip.rate_hz; clip.frames.len()],
            ..Performance::of_clip(clip, &body)
        };
        let start = fastest.beside(Event::Clip, 0, &corpus.skeleton, &half);
        let row = summary("mixture", "clip", "all", &[&ratios[0], &start]).unwrap();
        assert!(start.any > 1.2 && row["turn_over"] == 1 && row["turn_worst"] == start.any, "{row:?}");
    }

    #[test]
    fn every_event_is_streamed_from_its_frame_on() {
        let walks = Experiment::generated(&["walk"], &["neutral", "proud"], 3, 5.0);
        let rows = Args { method: Method::Mar }.evaluate(&walks).unwrap().rows;
        for (name, starts) in
            [("clip", 1), ("stride", 3), ("reset", 1), ("leap", 1), ("style", 1), ("labels", 1)]
        {
            let row = rows.iter().find(|r| r["event"] == name && r["action"] == "all").unwrap();
            assert_eq!(row["starts"], starts, "{name}");
            // Held-out generated walks, which are all alike.
            assert!(row["turn_worst"].as_f64().unwrap() < 1.1, "{row:?}");
        }
    }
}
