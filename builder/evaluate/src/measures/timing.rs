//! The output's time under each timing policy: error against the truth's time, and lead and lag against the input's.

use std::path::Path;

use anyhow::{Context, Result};
use gestus_core::output::retime::Bounds;
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    fold::{Fold, each},
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    command_line::stylizer_args::bounds,
    stream::{Request, Streamed, stream},
};
use gestus_motion::corpus::Corpus;

/// Default of both bounds, seconds.
const BOUND_S: f32 = 0.2;

/// Options of `gestus evaluate timing`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Longest time by which a pose may come early, seconds from 0 to 10
    #[arg(long, default_value_t = BOUND_S)]
    lead: f32,
    /// Longest time by which a pose may come late, seconds from 0 to 10
    #[arg(long, default_value_t = BOUND_S)]
    lag: f32,
}

impl Default for Args {
    fn default() -> Self {
        Self { lead: BOUND_S, lag: BOUND_S }
    }
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn check(&self, _output: &Path) -> Result<()> {
        bounds(self.lead, self.lag).map(drop)
    }

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        evaluate(experiment, bounds(self.lead, self.lag)?)
    }
}

/// Runs the evaluation and draws its plots.
fn evaluate(experiment: &Experiment, bounds: Bounds) -> Result<Evaluation> {
    let corpus = &experiment.corpus;
    let (body, folds) = experiment.folds()?;
    let results = each("timing", experiment, &folds, &experiment.build, |held, database| {
        let fold = Fold::of(experiment, &body, held);
        let request = Request { bounds: Some(bounds), ..Request::style(held.style as u16) };
        let streamed = stream(database, &corpus.examples[held.test].clip, &request, &mut ())
            .with_context(|| format!("--lead {} --lag {}", bounds.lead_s, bounds.lag_s))?;
        let rows = rows(corpus, &fold, held.style, &streamed, bounds);
        anyhow::Ok((rows, figure(corpus, held.test, held.style, &streamed)))
    })?;
    let results = results.into_iter().collect::<Result<Vec<_>>>()?;
    let (rows, figures): (Vec<_>, Vec<_>) = results.into_iter().unzip();
    Ok(Evaluation {
        what: "timing",
        about: "The output's time. `free` follows the predicted steps, `sync` the input's, `bounded` the predicted ones \
                within a stated lead and lag of the input, one pose a tick. Errors are against the truth clip's time \
                between matched moments."
            .into(),
        keys: vec!["method", "action", "style"],
        rows: rows.into_iter().flatten().collect(),
        figures: figures.into_iter().flatten().take(8).collect(),
    })
}

fn rows(
    corpus: &Corpus,
    fold: &Fold<'_>,
    style: usize,
    streamed: &Streamed,
    bounds: Bounds,
) -> Vec<table::Row> {
    let rate = corpus.rate_hz;
    let truth = fold.true_steps();
    let count = streamed.steps.len();
    let free: Vec<Option<f64>> =
        streamed.steps.iter().map(|s| Some(f64::from(s.report.predicted_step_s))).collect();
    let sync = vec![Some(1.0 / rate); count];
    let shown = streamed.retimed.as_ref().map_or_else(Vec::new, |r| r.shown_at(rate));
    let bounded: Vec<Option<f64>> =
        (0..count).map(|t| Some((*shown.get(t)?)? - (*shown.get(t.checked_sub(1)?)?)?)).collect();
    // How far the free timeline runs from the input's, and the bounded one.
    let mut time = 0.0;
    let astray: Vec<f64> = free
        .iter()
        .enumerate()
        .map(|(t, s)| {
            time += if t > 0 { s.unwrap_or(0.0) } else { 0.0 };
            time - t as f64 / rate
        })
        .collect();
    let lags: Vec<f64> = streamed.retimed.iter().flat_map(|r| &r.ticks).map(|t| f64::from(t.lag_s)).collect();
    let example = &corpus.examples[fold.test];
    [("free", free, astray), ("sync", sync, vec![0.0]), ("bounded", bounded, lags)]
        .into_iter()
        .map(|(method, steps, lags)| {
            let (mut error, mut ours, mut theirs, mut n) = (0.0, 0.0, 0.0, 0.0);
            for (step, truth) in steps.iter().zip(&truth) {
                if let (Some(step), Some(truth)) = (step, truth) {
                    error += (step - truth).abs();
                    ours += step;
                    theirs += truth;
                    n += 1.0;
                }
            }
            let most = |sign: f64| lags.iter().map(|l| sign * l).fold(0.0, f64::max);
            row(json!({
                "method": method,
                "action": corpus.actions[example.action],
                "style": corpus.styles[style],
                "clip": example.clip.name,
                "truth": corpus.examples[fold.truth].clip.name,
                "step_error_ms": (n > 0.0).then(|| 1000.0 * error / n),
                "duration_error": (theirs > 0.0).then(|| (ours - theirs).abs() / theirs),
                "lag_s_max": most(1.0),
                "lead_s_max": most(-1.0),
                "lag_s_bound": (method == "bounded").then_some(bounds.lag_s),
                "lead_s_bound": (method == "bounded").then_some(bounds.lead_s),
            }))
        })
        .collect()
}

fn figure(corpus: &Corpus, test: usize, style: usize, streamed: &Streamed) -> Option<Figure> {
    let retimed = streamed.retimed.as_ref()?;
    let rate = corpus.rate_hz;
    let mut time = 0.0;
    let free = streamed
        .steps
        .iter()
        .enumerate()
        .map(|(t, s)| {
            time += if t > 0 { f64::from(s.report.step_s) } else { 0.0 };
            (t as f64 / rate, 1000.0 * (time - t as f64 / rate))
        })
        .collect();
    let bounded = retimed
        .ticks
        .iter()
        .enumerate()
        .map(|(k, t)| (k as f64 / rate, 1000.0 * f64::from(t.lag_s)))
        .collect();
    let (name, style) = (&corpus.examples[test].clip.name, &corpus.styles[style]);
    let title = format!("Lag of {name} in the style {style}");
    Some(Figure {
        name: format!("{name}-{style}"),
        caption: format!(
            "How far the output lags behind its input (below zero: leads), {name} in the style {style}, on its own time \
             and within bounds."
        ),
        svg: plots::lines(
            Labels { title: &title, x: "input time, s", y: "lag, ms" },
            &[("free".to_owned(), free), ("bounded".to_owned(), bounded)],
        ),
    })
}
