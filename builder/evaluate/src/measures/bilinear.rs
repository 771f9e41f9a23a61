//! The bilinear model of style and speed against real cycles at speeds that it has not seen (Hsu 2005, section 5.1).
//!
//! One of the slow, medium and fast cycles of every style is left out of the model, which then makes a cycle at the
//! speed of a real one: between the two that it knows, or beyond them.

use anyhow::{Result, bail};
use rayon::prelude::*;
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{OnClips, Uses},
    metrics::{centred, joint_distance},
    report::table,
};
use gestus_database::{
    command_line::outputs::note,
    models::bilinear::{Bilinear, Cut, SPEEDS, aligned, at_quantile, by_speed},
    registration::timeline::Kind,
};
use gestus_motion::{body::Body, corpus::Corpus, statistics::mean};

/// What is left out, by its place among [`SPEEDS`].
const PARTS: [(&str, usize); 3] = [("between", 1), ("slower", 0), ("faster", 2)];

/// Options of `gestus evaluate bilinear`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses { from: true, folds: true, ..Uses::NONE };

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let corpus = &experiment.corpus;
        let body = Body::of(corpus)?;
        let mut rows = Vec::new();
        for action in 0..corpus.actions.len() {
            if !is_gait(corpus, action) {
                continue;
            }
            let all = (0..corpus.styles.len()).map(|style| by_speed(corpus, &body, action, style)).collect();
            let gait = Gait { corpus, body: &body, from: experiment.from, all };
            let tests: Vec<usize> = (0..corpus.styles.len())
                .flat_map(|style| {
                    let of = move |i: &usize| {
                        let example = &corpus.examples[*i];
                        (example.action, example.style) == (action, style) && experiment.may_be_tested(*i)
                    };
                    (0..corpus.examples.len()).filter(of).take(experiment.folds)
                })
                .collect();
            let found: Vec<Result<Vec<table::Row>>> = tests.par_iter().map(|&clip| gait.rows(clip)).collect();
            for (clip, found) in tests.iter().zip(found) {
                match found {
                    Ok(found) => rows.extend(found),
                    Err(e) => note(format_args!("left out: {}: {e:#}", corpus.examples[*clip].clip.name)),
                }
            }
        }
        Ok(Evaluation {
            what: "bilinear",
            about:
                "Cycles at speeds that the bilinear model of style and speed has not seen, against real ones \
                    (Hsu 2005, section 5.1)."
                    .into(),
            keys: vec!["action", "part", "method"],
            rows,
            figures: Vec::new(),
        })
    }
}

/// An action, and its cycles in every style, the slowest first.
struct Gait<'a> {
    corpus: &'a Corpus,
    body: &'a Body,
    from: usize,
    all: Vec<Vec<Cut>>,
}

impl Gait<'_> {
    /// The rows of a test clip, of which the models know nothing.
    fn rows(&self, clip: usize) -> Result<Vec<table::Row>> {
        let style = self.corpus.examples[clip].style;
        let mut known = self.all.clone();
        known[style].retain(|c| c.clip != clip);
        let tests: Vec<Cut> = self.all[style].iter().filter(|c| c.clip == clip).cloned().collect();
        let counts = known.iter().map(Vec::len).zip(&self.corpus.styles);
        if let Some((have, style)) = counts.into_iter().find(|(have, _)| *have < SPEEDS.len()) {
            bail!("{style} has {have} cycles in other clips, and needs {}", SPEEDS.len());
        }
        let mut rows = Vec::new();
        for part in PARTS.iter().filter(|_| !tests.is_empty()) {
            rows.extend(self.part(&known, &tests, style, *part)?);
        }
        Ok(rows)
    }

    /// One part: every method against a real cycle of the test clip.
    fn part(
        &self,
        known: &[Vec<Cut>],
        tests: &[Cut],
        style: usize,
        (part, left_out): (&str, usize),
    ) -> Result<Vec<table::Row>> {
        let (corpus, body, rate_hz) = (self.corpus, self.body, self.corpus.rate_hz);
        let at = |cuts: &[Cut], speed: usize| cuts[at_quantile(SPEEDS[speed].1, cuts.len())].clone();
        let two =
            |cuts: &Vec<Cut>| (0..SPEEDS.len()).filter(|v| *v != left_out).map(|v| at(cuts, v)).collect();
        let modelled: Vec<Vec<Cut>> = known.iter().map(two).collect();
        let base = &modelled[self.from][0];
        let model = Bilinear::of_cuts(&corpus.styles, &modelled, base, rate_hz)?;
        // Joint positions on the base's timeline, shape `[frames][joints]`.
        let warped = |cut: &Cut| -> Result<Vec<_>> {
            let vector = aligned(base, cut, rate_hz)?;
            let width = vector.len() / base.rows.len();
            Ok(vector.chunks_exact(width).map(|r| centred(body, &r[..body.dofs()])).collect())
        };
        let truth = at(tests, left_out);
        let (positions, duration) = (warped(&truth)?, duration_s(&truth, rate_hz));
        let mut rows = Vec::new();
        let mut add = |method: &str, of: &[Vec<_>], length: f64, speed: f64| {
            let error = mean(of.iter().zip(&positions).map(|(a, b)| joint_distance(a, b)));
            rows.push(row(json!({
                "part": part, "action": corpus.actions[corpus.examples[truth.clip].action],
                "style": corpus.styles[style], "clip": corpus.examples[truth.clip].clip.name, "method": method,
                "error_cm": 100.0 * error, "duration_error": (length / duration - 1.0).abs(),
                "speed_ratio": speed / truth.speed,
            })));
        };
        let mut weights = vec![0.0; corpus.styles.len()];
        weights[style] = 1.0;
        for (method, beyond) in [("bilinear", 0.0), ("bilinear-extrapolated", 2.0)] {
            let cycle = model.cycle(&weights, truth.speed, beyond)?;
            let made: Vec<_> = cycle.rows.iter().map(|r| centred(body, r)).collect();
            add(method, &made, cycle.duration_s(), cycle.speed_m_s());
        }
        let distance = |c: &Cut| (c.speed - truth.speed).abs();
        for (method, cuts) in [("nearest-known", &modelled[style]), ("other-cycle", &known[style])] {
            let near = cuts.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
            let Some(cut) = near else { continue };
            let (of, length) = (warped(cut)?, duration_s(cut, rate_hz));
            add(method, &of, length, cut.speed);
            if method == "nearest-known" {
                add("nearest-known-cadence", &of, length * cut.speed / truth.speed, truth.speed);
            }
        }
        Ok(rows)
    }
}

/// Whether all cycles of an action are those of a gait.
pub(super) fn is_gait(corpus: &Corpus, action: usize) -> bool {
    let mut cycles = corpus.examples.iter().filter(|e| e.action == action).flat_map(|e| &e.cycles);
    cycles.all(|c| Kind::of_cycle(c) == Kind::Gait)
}

fn duration_s(cut: &Cut, rate_hz: f64) -> f64 {
    (cut.rows.len() - 1) as f64 / rate_hz
}

#[cfg(test)]
mod tests {
    use super::*;
    use gestus_database::{build::BuildOptions, synth};

    #[test]
    fn cycles_at_unseen_speeds_have_them_and_are_near_real_ones() {
        let corpus = || {
            let options = synth::Options::of(&["walk"], &["neutral", "old", "proud"], 3, 8.0);
            synth::corpus(&options).unwrap()
        };
        let of = |corpus: Corpus, folds: usize| {
            let experiment = Experiment { folds, ..Experiment::new(corpus, BuildOptions::default()) };
            Args.evaluate(&experiment).unwrap().rows
        };
        let rows = of(corpus(), 2);
        // Methods, parts, clips, styles.
        assert_eq!(rows.len(), 5 * 3 * 2 * 3);
        for (part, _) in PARTS {
            let of = |method: &str, key: &str| {
                let of = rows.iter().filter(|r| r["part"] == part && r["method"] == method);
                mean(of.map(|r| r[key].as_f64().unwrap()))
            };
            assert!((of("bilinear", "speed_ratio") - 1.0).abs() < 1e-6);
            assert!((of("nearest-known", "speed_ratio") - 1.0).abs() > 1e-3);
            assert!(of("bilinear", "error_cm") < 3.0, "{part}: {}", of("bilinear", "error_cm"));
            assert!(of("other-cycle", "error_cm") > 0.0);
        }
        // A style whose cycles are all of the test clip is left out, and what it needs is said.
        let mut thin = corpus();
        let old = thin.style("old").unwrap();
        let mut clips = 0;
        thin.examples.retain(|e| {
            clips += usize::from(e.style == old);
            e.style != old || clips == 1
        });
        let rows = of(thin, 1);
        assert!(!rows.is_empty() && rows.iter().all(|r| r["style"] != "old"));
    }
}
