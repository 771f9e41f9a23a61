//! The effect of one parameter at a time.

use gestus_core::{Config, Method, config::Ridge};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{
        OnClips, Uses,
        loo::{Methods, run_folds},
    },
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{build::BuildOptions, command_line::progress, pairing::Scheme};
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

/// Options of `gestus evaluate ablation`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// Parameters to vary, besides the default; default: all
    #[arg(long, value_delimiter = ',', value_parser = PARAMETERS)]
    parameters: Vec<String>,
}

/// What can be varied.
const PARAMETERS: [&str; 13] = [
    "bias",
    "kappa-rho",
    "k",
    "prune",
    "ridge",
    "delta",
    "settle",
    "follow",
    "liveliness",
    "lti-kc",
    "pairing",
    "window",
    "frame-rate",
];

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        // Variants of one build follow each other, and share its databases.
        let mut variants = variants(experiment);
        let wanted = |name: &str| self.parameters.is_empty() || self.parameters.iter().any(|p| p == name);
        variants.retain(|v| v.parameter == "default" || wanted(v.parameter));
        let same = |a: &Variant, b: &Variant| a.every == b.every && a.build == b.build;
        let bar = progress::bar(variants.chunk_by(same).count() * experiment.max_folds(), "ablation");
        let mut rows: Vec<table::Row> = Vec::new();
        let mut said: Vec<String> = Vec::new();
        for group in variants.chunk_by(same) {
            let Some(first) = group.first() else { continue };
            let mut experiment = Experiment { build: first.build.clone(), ..experiment.clone() };
            if first.every > 1 {
                reduce_rate(&mut experiment.corpus, first.every as f64);
            }
            let corpus = &experiment.corpus;
            let configs =
                group.iter().enumerate().map(|(i, v)| (format!("mixture{MARK}{i}"), v.config)).collect();
            let methods = Methods { configs, partly_labelled: false, ..Methods::none() };
            let body = Body::of(corpus)?;
            let (folds, left_out) = experiment.held_out(&body);
            // The same folds every time, but for frame rates that leave a class without a cycle.
            for line in left_out {
                if !said.contains(&line) {
                    gestus_database::command_line::outputs::note(&line);
                    said.push(line);
                }
            }
            let results = match run_folds(&experiment, &body, &folds, &methods, &|| bar.inc(1)) {
                // Clips that one scheme of pairing can't pair, others can.
                Err(error) if first.parameter == "pairing" => {
                    let line = format!("left out: pairing {}: {error}", first.value);
                    gestus_database::command_line::outputs::note(line);
                    continue;
                }
                results => results?,
            };
            for result in results {
                let Some((method, variant)) = result.method.split_once(MARK) else { continue };
                let Some(variant) = variant.parse().ok().and_then(|i: usize| group.get(i)) else { continue };
                let method = named(method, variant.config.method);
                let mut measured = row(json!({
                    "parameter": variant.parameter,
                    "value": variant.value,
                    "method": method,
                    "action": corpus.actions[result.action],
                    "style": corpus.styles[result.style],
                    "clip": result.clip,
                    "truth": result.truth,
                }));
                measured.extend(result.measured());
                rows.push(measured);
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
}

/// The row's method: [`run_folds`] calls every configuration a mixture, and a labelled one `local-ar`.
fn named(row: &str, method: Method) -> &str {
    match (method, row) {
        (Method::Lti, "local-ar") => "lti-labelled",
        (Method::Lti, _) => "lti",
        _ => row,
    }
}

fn variants(experiment: &Experiment) -> Vec<Variant> {
    let (base, build) = (Config::new(), &experiment.build);
    let mut variants = Vec::new();
    let mut add = |parameter, value: String, config, changed: Option<BuildOptions>, every| {
        let build = changed.unwrap_or_else(|| build.clone());
        variants.push(Variant { parameter, value, config, build, every });
    };
    add("default", String::new(), base, None, 1);
    add("bias", "off".into(), base.kappa(1e6), None, 1);
    for kappa in [0.25, 0.5, 1.0, 2.0] {
        for rho in [0.0, 0.3, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0] {
            add("kappa-rho", format!("{kappa}, {rho}"), base.kappa(kappa).rho(rho), None, 1);
        }
    }
    for k in [4, 6, 8, 10, 12, 16, 20, 30, 40] {
        add("k", k.to_string(), base.k(k), None, 1);
    }
    for prune in [0.001, 0.01, 0.05, 0.1, 0.2] {
        add("prune", prune.to_string(), base.prune(prune), None, 1);
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
    for settle_s in [0.0, 0.04, 0.08, 0.12, 0.16, 0.2, 0.3] {
        add("settle", settle_s.to_string(), base.settle_s(settle_s), None, 1);
    }
    for follow in [0.0, 0.5, 1.0, 2.0, 4.0, 8.0] {
        add("follow", follow.to_string(), base.follow(follow), None, 1);
    }
    for liveliness in [0.8, 1.0, 1.2, 1.4, 1.6] {
        add("liveliness", liveliness.to_string(), base.liveliness(liveliness), None, 1);
    }
    let models = BuildOptions { models_by_action: false, ..experiment.build_with_models() };
    for kc in [2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 1e6] {
        let config = base.method(Method::Lti).confidence(kc);
        add("lti-kc", kc.to_string(), config, Some(models.clone()), 1);
    }
    for (name, pairing) in Scheme::ALL {
        add("pairing", name.into(), base, Some(BuildOptions { pairing, ..build.clone() }), 1);
    }
    for window in [1, 3, 5, 8] {
        add("window", window.to_string(), base, Some(BuildOptions { window, ..build.clone() }), 1);
    }
    for every in [2, 3] {
        add("frame-rate", format!("1/{every}"), base, None, every);
    }
    variants
}

/// Divides the frame rate of a corpus; cycles keep their times.
fn reduce_rate(corpus: &mut Corpus, divisor: f64) {
    let rate_hz = corpus.rate_hz / divisor;
    let factor = rate_hz / corpus.rate_hz;
    corpus.rate_hz = rate_hz;
    for example in &mut corpus.examples {
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
    corpus.examples.retain(|e| !e.cycles.is_empty());
}

/// Error against variability of every variant, unlabelled.
fn trade_off(rows: &[table::Row]) -> Figure {
    let unlabelled: Vec<table::Row> =
        rows.iter().filter(|r| r["method"] == "mixture" || r["method"] == "lti").cloned().collect();
    let points: Vec<(String, f64, f64)> = table::means(&unlabelled, &["parameter", "value"])
        .iter()
        .map(|r| {
            let name = format!("{} {}", table::text(r.get("parameter")), table::text(r.get("value")));
            let number = |key: &str| r.get(key).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN);
            (name, number("delivered_variability"), number("delivered_error_cm"))
        })
        .collect();
    let labels = Labels {
        title: "Delivered error against variability, unlabelled",
        x: "variability, real motion = 1",
        y: "delivered error, cm",
    };
    Figure {
        name: "trade-off".into(),
        caption: "Variants with less error have less variability.".into(),
        svg: plots::points(labels, &points),
    }
}
