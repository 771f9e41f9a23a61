//! One parameter at a time: what each is worth.

use gestus_core::{Config, config::Ridge};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    fold::{LooOptions, folds, left_out},
    measures::loo::run,
};
use crate::{
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    build::{BuildError, BuildOptions},
    command_line::progress,
    pairing::Scheme,
};
use gestus_motion::{body::Body, corpus::Corpus};

/// Between a method and the number of its variant.
const MARK: char = '#';

/// A change of one parameter.
struct Variant {
    parameter: &'static str,
    value: String,
    config: Config,
    build: BuildOptions,
    /// Every how many frames of the corpus; 1 is its own rate.
    every: usize,
}

/// Runs the ablations: bias, ρ, K, ridge, δ, pairing, window, frame rate.
///
/// # Errors
/// [`BuildError`] where what is left is no database.
pub fn evaluate(corpus: &Corpus, options: &LooOptions) -> Result<Evaluation, BuildError> {
    // Variants of one build follow each other, and share its databases.
    let variants = variants(options);
    let same = |a: &Variant, b: &Variant| a.every == b.every && a.build == b.build;
    let bar = progress::bar(variants.chunk_by(same).count() * folds(corpus, options), "ablation");
    let mut rows: Vec<table::Row> = Vec::new();
    let mut said: Vec<String> = Vec::new();
    for group in variants.chunk_by(same) {
        let reduced;
        let every = group.first().map_or(1, |v| v.every);
        let corpus = if every == 1 {
            corpus
        } else {
            reduced = at_rate(corpus, corpus.rate_hz / every as f64);
            &reduced
        };
        let options = LooOptions {
            configs: group.iter().enumerate().map(|(i, v)| (format!("mixture{MARK}{i}"), v.config)).collect(),
            build: group.first().map_or_else(|| options.build.clone(), |v| v.build.clone()),
            mixtures_only: true,
            ..options.clone()
        };
        // The same folds every time, but for frame rates that leave a class without a cycle.
        for line in left_out(corpus, &Body::of(corpus)?, &options) {
            if !said.contains(&line) {
                eprintln!("{line}");
                said.push(line);
            }
        }
        for result in run(corpus, &options, &|| bar.inc(1))? {
            // A known action alone or a known style alone is not a number.
            let Some((method, variant)) = result.method.split_once(MARK) else { continue };
            let Some(variant) = variant.parse().ok().and_then(|i: usize| group.get(i)) else { continue };
            rows.push(row(json!({
                "parameter": variant.parameter,
                "value": variant.value,
                "method": method,
                "action": corpus.actions[result.action],
                "style": corpus.styles[result.style],
                "clip": result.clip,
                "joint_error_cm": result.joint_error_cm,
                "step_error_ms": result.step_error_ms,
                "duration_error": result.duration_error,
                "third_difference": result.third_difference,
                "variability": result.variability,
            })));
        }
    }
    bar.finish_and_clear();
    let figures = vec![trade_off(&rows)];
    Ok(Evaluation {
        what: "ablation",
        about:
            "One parameter at a time is changed from the shipped default; leave one clip out, as in `loo`."
                .into(),
        keys: vec!["parameter", "value", "method"],
        rows,
        figures,
    })
}

fn variants(options: &LooOptions) -> Vec<Variant> {
    let base = options.configs.first().map_or_else(Config::new, |c| c.1);
    let mut variants = Vec::new();
    let mut add = |parameter, value: String, config, build: Option<BuildOptions>, every| {
        let build = build.unwrap_or_else(|| options.build.clone());
        variants.push(Variant { parameter, value, config, build, every });
    };
    add("default", String::new(), base, None, 1);
    add("bias", "off".into(), base.kappa(1e6), None, 1);
    for kappa in [0.25, 1.0, 2.0] {
        for rho in [0.0, 0.3, 0.7, 1.0] {
            add("kappa, rho", format!("{kappa}, {rho}"), base.kappa(kappa).rho(rho), None, 1);
        }
    }
    for k in [8, 12, 20, 30, 40] {
        add("k", k.to_string(), base.k(k), None, 1);
    }
    for (ridge, name) in [(Ridge::Raw, "raw"), (Ridge::Normalised, "norm")] {
        for lambda in [0.01, 0.1, 1.0, 10.0] {
            add("ridge", format!("{name} {lambda}"), base.ridge(ridge).lambda(lambda), None, 1);
        }
    }
    for (lambda, feedback) in [(0.1, 10.0), (0.1, 30.0), (0.3, 10.0)] {
        let value = format!("norm {lambda}, feedback {feedback}");
        add("ridge", value, base.ridge(Ridge::Normalised).lambda(lambda).feedback(feedback), None, 1);
    }
    for delta in [0.05, 0.1, 0.2, 0.35, 0.7] {
        add("delta", delta.to_string(), base.delta(delta), None, 1);
    }
    for (name, pairing) in Scheme::ALL {
        add("pairing", name.into(), base, Some(BuildOptions { pairing, ..options.build.clone() }), 1);
    }
    for window in [1, 3, 5, 8] {
        add("window", window.to_string(), base, Some(BuildOptions { window, ..options.build.clone() }), 1);
    }
    for every in [2, 3] {
        add("frame rate", format!("1/{every}"), base, None, every);
    }
    variants
}

/// The corpus at another rate; cycles keep their times.
fn at_rate(corpus: &Corpus, rate_hz: f64) -> Corpus {
    let factor = rate_hz / corpus.rate_hz;
    let mut reduced = corpus.clone();
    reduced.rate_hz = rate_hz;
    for example in &mut reduced.examples {
        let contacts = std::mem::take(&mut example.contacts);
        example.clip = example.clip.resampled(rate_hz);
        let last = contacts.len().saturating_sub(1);
        example.contacts = (0..example.clip.frames.len())
            .map(|f| contacts[((f as f64 / factor).round() as usize).min(last)])
            .collect();
        for cycle in &mut example.cycles {
            cycle.knots.iter_mut().for_each(|k| *k *= factor);
        }
        let end = example.clip.frames.len() as f64;
        example.cycles.retain(|c| c.span().1 <= end);
    }
    reduced.examples.retain(|e| !e.cycles.is_empty());
    reduced
}

/// Error against variability of every variant, unlabelled.
fn trade_off(rows: &[table::Row]) -> Figure {
    let unlabelled: Vec<table::Row> = rows.iter().filter(|r| r["method"] == "mixture").cloned().collect();
    let points: Vec<(String, f64, f64)> = table::means(&unlabelled, &["parameter", "value"])
        .iter()
        .map(|r| {
            let name = format!("{} {}", table::text(r.get("parameter")), table::text(r.get("value")));
            let number = |key: &str| r.get(key).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN);
            (name, number("variability"), number("joint_error_cm"))
        })
        .collect();
    let labels = Labels {
        title: "Error against variability, unlabelled",
        x: "variability, real motion = 1",
        y: "joint error, cm",
    };
    Figure {
        name: "trade-off".into(),
        caption: "What is gained in error is lost in variability.".into(),
        svg: plots::points(labels, &points),
    }
}
