//! A fold: a test clip, the clip that is its truth, and the database without either.

use gestus_core::Database;
use serde_json::json;

use crate::{
    evaluation::row,
    experiment::{Experiment, HeldOut, Truth},
    metrics::{best_shift, centred, joint_distance, matched, third_difference, variability},
    report::table,
};
use gestus_database::{
    build::{BuildError, BuildOptions, build},
    stream::Streamed,
};
use gestus_motion::{
    body::{Body, row_at},
    corpus::{Corpus, Cycle},
};

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

/// A test clip and the clip that it is compared with.
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

impl<'a> Fold<'a> {
    /// A fold, and the database that is built from all other clips.
    pub(super) fn new(
        experiment: &'a Experiment,
        body: &Body,
        held: HeldOut,
        build_options: &BuildOptions,
    ) -> Result<(Self, Vec<u8>), BuildError> {
        let built = build(&experiment.corpus.without(&[held.test, held.truth]), build_options)?;
        Ok((Self::of(experiment, body, held), built.bytes))
    }

    /// A fold without its database.
    pub(super) fn of(experiment: &'a Experiment, body: &Body, held: HeldOut) -> Self {
        let corpus = &experiment.corpus;
        let HeldOut { test, truth, other, style } = held;
        let (x, truth_rows) =
            (body.clip_dofs(&corpus.examples[test].clip), body.clip_dofs(&corpus.examples[truth].clip));
        let shift = match experiment.truth {
            Truth::SameTake => 0,
            Truth::NearestContent => {
                best_shift(&x, &corpus.examples[test].cycles, &truth_rows, &corpus.examples[truth].cycles)
            }
        };
        Self { corpus, body: body.clone(), test, truth, other, style, shift, x, truth_rows }
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
