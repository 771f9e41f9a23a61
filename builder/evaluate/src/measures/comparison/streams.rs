//! Several actions in one stream: the test clips of all actions, one after the other, through one database.

use std::ops::Range;

use gestus_core::{Config, Database, Method};
use gestus_database::{
    build::{BuildError, build},
    stream::{Request, Streamed, stream_with_labels},
};
use gestus_motion::{
    body::{Body, about_y},
    clip::{Clip, Frame, interpolate},
};
use rayon::prelude::*;

use crate::{
    baselines::{
        gaussian_process::{self, Editor, Pairs},
        outputs::{ClassNeighbors, GlobalModel, Outputs, Record, Variables, interpolated},
    },
    experiment::{Experiment, HeldOut},
    fold::{Fold, Row, class_of, classes_of, own_dofs},
};

/// Frames of the transition between two clips of a stream.
const BETWEEN: usize = 8;

/// A test clip within a stream.
struct Part<'a> {
    fold: Fold<'a>,
    frames: Range<usize>,
    action: usize,
}

/// One stream, and the database without its clips.
struct Stream<'a> {
    experiment: &'a Experiment,
    database: Database<'a>,
    clip: Clip,
    parts: Vec<Part<'a>>,
    style: usize,
    rows: Vec<Row>,
}

/// One stream through all actions for each test clip and style.
pub(super) fn rows(experiment: &Experiment, body: &Body, folds: &[HeldOut]) -> Result<Vec<Row>, BuildError> {
    let tests = experiment.test_clips();
    let action = |test: usize| experiment.corpus.examples[test].action;
    let jobs: Vec<Vec<HeldOut>> = (0..experiment.folds)
        .flat_map(|k| {
            let of = |a: usize| tests.iter().filter(|&&t| action(t) == a).nth(k).copied();
            let takes: Vec<usize> = (0..experiment.corpus.actions.len()).filter_map(of).collect();
            experiment.to.iter().map(move |&style| {
                let fold = |t: &usize| folds.iter().find(|f| (f.test, f.style) == (*t, style)).copied();
                takes.iter().filter_map(fold).collect()
            })
        })
        // One action alone is no stream through several.
        .filter(|folds: &Vec<HeldOut>| folds.len() > 1)
        .collect();
    let rows: Vec<Vec<Row>> =
        jobs.par_iter().map(|folds| one(experiment, body, folds)).collect::<Result<_, _>>()?;
    Ok(rows.into_iter().flatten().collect())
}

/// Every method on one stream.
fn one(experiment: &Experiment, body: &Body, folds: &[HeldOut]) -> Result<Vec<Row>, BuildError> {
    let corpus = &experiment.corpus;
    let left_out: Vec<usize> = folds.iter().flat_map(|f| [f.test, f.truth]).collect();
    let bytes = build(&corpus.without(&left_out), &experiment.build_with_models())?.bytes;
    let clips: Vec<&Clip> = folds.iter().map(|f| &corpus.examples[f.test].clip).collect();
    let Some((clip, starts)) = joined(body, &clips) else { return Ok(Vec::new()) };
    let part = |(held, start): (&HeldOut, usize)| {
        let example = &corpus.examples[held.test];
        let frames = start..start + example.clip.frames.len();
        Part { fold: Fold::of(experiment, body, *held), frames, action: example.action }
    };
    let mut stream = Stream {
        experiment,
        database: Database::open(&bytes)?,
        clip,
        parts: folds.iter().zip(starts).map(part).collect(),
        style: folds[0].style,
        rows: Vec::new(),
    };
    stream.core_methods();
    stream.baselines(body);
    Ok(stream.rows)
}

impl Stream<'_> {
    /// Adds a row for each test clip.
    fn add(&mut self, name: &str, output: &[Vec<f64>], streamed: Option<&Streamed>) {
        for Part { fold, frames, .. } in &self.parts {
            let steps = |s: &Streamed| Streamed { steps: s.steps[frames.clone()].to_vec(), ..s.clone() };
            let part = streamed.map(steps);
            let own = own_dofs(fold, &self.database, &output[frames.clone()]);
            self.rows.push(fold.row(name, &own, part.as_ref()));
        }
    }

    /// The core's methods, unlabelled, and labelled with the action at the frames where it changes.
    fn core_methods(&mut self) {
        let changes: Vec<(usize, u16)> =
            self.parts.iter().map(|p| (p.frames.start, p.action as u16)).collect();
        let from = Some(self.experiment.from as u16);
        let (lti, statistic) = (Config::new().method(Method::Lti), Config::new().method(Method::Statistic));
        let unlabelled: &[(usize, u16)] = &[];
        let methods = [
            ("mixture", Config::new(), unlabelled, None),
            ("mixture-paper", Config::paper(), unlabelled, None),
            ("mixture-action-known", Config::new(), &changes[..], None),
            ("local-ar", Config::new(), &changes[..], from),
            ("lti", lti, unlabelled, None),
            ("lti-labelled", lti, &changes[..], None),
            ("statistic", statistic, unlabelled, None),
            ("statistic-labelled", statistic, &changes[..], None),
        ];
        for (name, config, actions, input_style) in methods {
            let request = Request { config, input_style, ..Request::style(self.style as u16) };
            let mut record = Record::of(&self.database);
            let Ok(streamed) = stream_with_labels(&self.database, &self.clip, &request, actions, &mut record)
            else {
                continue;
            };
            self.add(name, &record.predicted, Some(&streamed));
            if name == "mixture" {
                self.add("unchanged", &record.x, None);
                self.neighbors(&record, usize::from(config.k));
            }
        }
    }

    /// Interpolation of the neighbors that the unlabelled search found. It searches every class, so that those of the
    /// right class are among them.
    fn neighbors(&mut self, record: &Record, k: usize) {
        let (database, style) = (&self.database, self.style);
        let all = |outputs: Outputs| {
            record.each(|near| interpolated(database, &near.iter().collect::<Vec<_>>(), k, style, outputs))
        };
        let of_action = |most: usize, outputs: Outputs| {
            let mut output = record.x.clone();
            for Part { frames, action, .. } in &self.parts {
                let class = class_of(database, *action, self.experiment.from);
                let own = record.each(|near| {
                    let of: Vec<&ClassNeighbors> = near.iter().filter(|n| Some(n.0) == class).collect();
                    interpolated(database, &of, most, style, outputs)
                });
                output[frames.clone()].clone_from_slice(&own[frames.clone()]);
            }
            output
        };
        let mut found = Vec::new();
        for &(outputs, ending) in Outputs::each(database) {
            found.push((format!("knn-unlabelled{ending}"), all(outputs)));
            found.push((format!("nearest{ending}"), of_action(1, outputs)));
            found.push((format!("knn{ending}"), of_action(k, outputs)));
        }
        for (name, output) in found {
            self.add(&name, &output, None);
        }
    }

    /// Affine maps and Gaussian processes: one of all actions, and one of each action for its part.
    fn baselines(&mut self, body: &Body) {
        let (database, style, from) = (&self.database, self.style, self.experiment.from);
        let x = body.with_means_of(database).clip_dofs(&self.clip);
        let every = classes_of(database, from);
        let settings = gaussian_process::Options::default();
        // A method that can't be fitted for one part has no rows.
        let each = |method: OfClasses<'_>| {
            let mut output = x.clone();
            for Part { frames, action, .. } in &self.parts {
                let class = class_of(database, *action, from)?;
                output[frames.clone()].clone_from_slice(&method(&[class], &x[frames.clone()])?);
            }
            Some(output)
        };
        let mut found = Vec::new();
        for &(outputs, ending) in Outputs::each(database) {
            let process = |classes: &[usize], x: &[Vec<f64>]| {
                let pairs = Pairs::of(database, classes, style, outputs).thinned(settings.most);
                Editor::fit(&pairs, &settings).map(|editor| editor.run(x))
            };
            let affine = |classes: &[usize], x: &[Vec<f64>]| {
                Some(GlobalModel::fit(database, classes, style, Variables::Affine, outputs).run(x, &x[0]))
            };
            found.extend([
                (format!("global-affine-unlabelled{ending}"), affine(&every, &x)),
                (format!("gaussian-process-unlabelled{ending}"), process(&every, &x)),
                (format!("global-affine{ending}"), each(&affine)),
                (format!("gaussian-process{ending}"), each(&process)),
            ]);
        }
        for (name, output) in found {
            if let Some(output) = output {
                self.add(&name, &output, None);
            }
        }
    }
}

/// A method fitted on some classes, applied to the rows of a clip; `None` where it can't be fitted.
type OfClasses<'a> = &'a dyn Fn(&[usize], &[Vec<f64>]) -> Option<Vec<Vec<f64>>>;

/// Joins clips into one: each is moved to where the one before ended, with a short transition between them. Also gives
/// the first frame of each.
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
