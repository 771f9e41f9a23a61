//! A fold: a test clip, the clip that is its truth, and the database without either.

use crate::evaluation::row;
use gestus_core::{Config, Database, blob::layout::dof};
use serde_json::json;

use crate::metrics::{best_shift, centred, joint_distance, matched, third_difference, variability};
use crate::report::table;
use gestus_database::{
    build::{BuildError, BuildOptions, build},
    stream::Streamed,
};
use gestus_motion::{
    body::{Body, row_at},
    corpus::{Corpus, Cycle},
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
    /// Mean joint error, centimetres; not a number where no frame is in a cycle.
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

impl Row {
    pub(super) fn to_json(&self, corpus: &Corpus) -> table::Row {
        row(json!({
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
    pub(super) shift: usize,
    pub(super) x: Vec<Vec<f64>>,
    pub(super) truth_rows: Vec<Vec<f64>>,
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

/// The folds that [`run`](crate::measures::loo::run) goes through, with their clips.
pub fn held_out(corpus: &Corpus, body: &Body, options: &LooOptions) -> Vec<HeldOut> {
    asked(corpus, body, options).filter_map(Result::ok).collect()
}

/// One line for each fold that is left out: no method can answer for an action that the database lacks, and means of
/// methods count for as much as they are over the same folds.
pub fn left_out(corpus: &Corpus, body: &Body, options: &LooOptions) -> Vec<String> {
    asked(corpus, body, options).filter_map(Result::err).collect()
}

/// Says on standard error which folds are left out.
pub(super) fn say_left_out(corpus: &Corpus, body: &Body, options: &LooOptions) {
    left_out(corpus, body, options).iter().for_each(|line| eprintln!("{line}"));
}

/// Every fold that was asked for, or why it can't be measured.
fn asked<'a>(
    corpus: &'a Corpus,
    body: &'a Body,
    options: &'a LooOptions,
) -> impl Iterator<Item = Result<HeldOut, String>> + 'a {
    let tests = test_clips(corpus, options.from, options.folds);
    tests.into_iter().flat_map(move |test| {
        options.to.iter().map(move |&style| {
            let example = &corpus.examples[test];
            let (clip, action) = (&example.clip.name, &corpus.actions[example.action]);
            let to = &corpus.styles[style];
            let Some(&truth) = truths(corpus, body, options, test, style).first() else {
                return Err(format!("left out: {clip} to {to}: no clip of {action} in {to} to compare with"));
            };
            let missing = lacking(corpus, example.action, &[test, truth]);
            if missing.is_empty() {
                return Ok(HeldOut { test, truth, style });
            }
            let (truth, missing) = (&corpus.examples[truth].clip.name, missing.join(", "));
            Err(format!(
                "left out: {clip} to {to}: without it and its truth {truth} no clip of {action} is left in {missing}"
            ))
        })
    })
}

/// The styles in which an action has no clip once some are left out: a database then has none of the action.
pub(super) fn lacking<'a>(corpus: &'a Corpus, action: usize, left_out: &[usize]) -> Vec<&'a str> {
    let there = |style: usize| {
        let mut clips = corpus.examples.iter().enumerate();
        clips.any(|(i, e)| {
            (e.action, e.style) == (action, style) && !e.cycles.is_empty() && !left_out.contains(&i)
        })
    };
    (0..corpus.styles.len()).filter(|&s| !there(s)).map(|s| corpus.styles[s].as_str()).collect()
}

/// The clips that a test clip can be compared with, the best first.
fn truths(corpus: &Corpus, body: &Body, options: &LooOptions, test: usize, style: usize) -> Vec<usize> {
    if options.exact { by_take(corpus, test, style) } else { by_content(corpus, body, test, style) }
}

/// How many folds [`run`](crate::measures::loo::run) goes through at most.
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
    let same = |e: &gestus_motion::corpus::Example| {
        e.action == wanted.action && e.style == style && e.take == wanted.take
    };
    (0..corpus.examples.len()).filter(|&i| same(&corpus.examples[i])).collect()
}

impl<'a> Fold<'a> {
    /// A test clip, its truth, and the database without either; `None` where that has nothing of the action.
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

    /// A test clip and its truth; `None` where nothing of the action would be left.
    pub(super) fn of(
        corpus: &'a Corpus,
        body: &Body,
        options: &LooOptions,
        test: usize,
        style: usize,
    ) -> Option<Self> {
        let near = truths(corpus, body, options, test, style);
        let &truth = near.first()?;
        if !lacking(corpus, corpus.examples[test].action, &[test, truth]).is_empty() {
            return None;
        }
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

    pub(super) fn cycles(&self) -> (&[Cycle], &[Cycle]) {
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
            joint_error_cm: 100.0 * error / count,
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

/// Dofs relative to the database's means as dofs relative to the evaluation's.
pub(super) fn own_dofs(fold: &Fold<'_>, database: &Database<'_>, rows: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let theirs = fold.body.with_means_of(database);
    rows.iter()
        .map(|row| {
            let frame = theirs.pose(row, [0.0; 2], 0.0);
            let mut own = row.clone();
            for j in 0..frame.rotations.len() {
                let map = gestus_motion::body::log(&(fold.body.means[j].inverse() * frame.rotations[j]));
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

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;
    use crate::measures::loo;
    use gestus_database::synth;

    /// Walks enough; one neutral punch of two is there, and both proud ones.
    fn sparse() -> (Corpus, LooOptions) {
        let names = |n: [&str; 2]| n.map(String::from).to_vec();
        let corpus = synth::corpus(&synth::Options {
            actions: names(["walk", "punch"]),
            styles: names(["neutral", "proud"]),
            clips: 2,
            seconds: 4.0,
            ..synth::Options::default()
        })
        .unwrap();
        let punch = corpus.action("punch").unwrap();
        let neutral = corpus.style("neutral").unwrap();
        let one = corpus.examples.iter().position(|e| (e.action, e.style) == (punch, neutral)).unwrap();
        let options = LooOptions {
            from: neutral,
            to: vec![corpus.style("proud").unwrap()],
            folds: 1,
            build: BuildOptions { models: false, ..BuildOptions::default() },
            configs: vec![("mixture".into(), Config::new())],
            mixtures_only: false,
            exact: false,
            gaussian_process: false,
        };
        (corpus.without(&[one]), options)
    }

    #[test]
    fn a_fold_without_its_action_is_left_out_and_named() {
        let (corpus, options) = sparse();
        let body = Body::of(&corpus).unwrap();
        let folds = held_out(&corpus, &body, &options);
        let walk = corpus.action("walk").unwrap();
        assert!(folds.len() == 1 && corpus.examples[folds[0].test].action == walk);
        let said = left_out(&corpus, &body, &options);
        assert!(said.len() == 1 && said[0].contains("no clip of punch is left in neutral"), "{said:?}");
    }

    #[test]
    fn every_method_is_measured_over_the_same_folds() {
        let (corpus, options) = sparse();
        let rows = loo::run(&corpus, &options, &|| ()).unwrap();
        let clips = |method: &str| -> BTreeSet<&str> {
            rows.iter().filter(|r| r.method == method).map(|r| r.clip.as_str()).collect()
        };
        let all = clips("mixture");
        assert_eq!(all.len(), 1);
        for method in ["unchanged", "global-affine", "nearest", "knn", "local-ar"] {
            assert_eq!(clips(method), all, "{method}");
        }
    }
}
