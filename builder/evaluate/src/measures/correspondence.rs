//! How well frames of different styles are set into correspondence (Hsu 2005, section 5.1): iterative motion warping,
//! its time warp alone, and dynamic time warping of types I and III.
//!
//! Gait cycles of every style at three speeds are warped onto the medium cycle of one style. They begin and end with left
//! strikes, which every method knows. The right strike in between is known from the feet and hidden from the methods. The
//! error is the distance of the warped right strike from the true one, milliseconds. Further rows are pairs of motions
//! whose warp is known in every frame ([`gestus_database::registration::warp::demo`]): generated clips, and sums of sines.

use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    measures::{OnClips, Uses, bilinear::is_gait},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    models::bilinear::{Cut, SPEEDS, cuts},
    registration::warp::{
        self, Warp, WarpError,
        demo::{self, KnownPair, generated_pair, known_pair},
        dtw::{Constraint, dtw},
        imw::{Config, imw},
    },
    synth::STYLES,
};
use gestus_motion::{body::Body, corpus::Corpus, landmarks::LandmarkError, statistics::mean};

/// Generated actions whose clips are warped as a whole, and those whose cycles are known by their strikes.
const ACTS: [&str; 3] = ["jump", "punch", "kick"];
const GAITS: [&str; 2] = ["walk", "run"];

/// Every method on one pair of motions.
fn warps(u: &[Vec<f64>], y: &[Vec<f64>]) -> Vec<(&'static str, Result<Warp, WarpError>)> {
    let alone = Config { iterations: 1, ..Config::default() };
    vec![
        ("imw", imw(u, y, &Config::default()).map(|s| s.warp)),
        ("time-warp-alone", imw(u, y, &alone).map(|s| s.warp)),
        ("dtw-1", dtw(u, y, Constraint::TypeI)),
        ("dtw-3", dtw(u, y, Constraint::TypeIII)),
    ]
}

/// Share of the steps of a warp with slopes below a quarter or above four.
fn stalls(warp: &Warp) -> f64 {
    let steps = warp.positions.windows(2).map(|w| w[1] - w[0]);
    let bad = steps.clone().filter(|s| !(0.25..=4.0).contains(s)).count();
    bad as f64 / steps.count().max(1) as f64
}

/// Every method on a pair whose warp is known.
fn known(rows: &mut Vec<table::Row>, pair: &KnownPair, data: &str, action: &str, style: &str) {
    for (method, warp) in warps(&pair.u, &pair.y) {
        let Ok(warp) = warp else { continue };
        rows.push(row(json!({
            "method": method, "data": data, "action": action, "style": style,
            "error_frames": warp.mean_error(&pair.truth), "stalled": stalls(&warp),
        })));
    }
}

/// Options of `gestus evaluate correspondence`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnClips for Args {
    const USES: Uses = Uses { from: true, ..Uses::NONE };

    fn evaluate(&self, experiment: &Experiment) -> anyhow::Result<Evaluation> {
        Ok(evaluate(&experiment.corpus, experiment.from)?)
    }
}

/// Runs the evaluation. Actions that are no gaits have no right strike; they and classes of too few cycles are left out, and
/// named on standard error.
fn evaluate(corpus: &Corpus, from: usize) -> Result<Evaluation, LandmarkError> {
    let (found, left_out) = gaits(corpus, &Body::of(corpus)?, from);
    left_out.iter().for_each(gestus_database::command_line::outputs::note);
    let mut figures: Vec<Figure> = strikes(&found).into_iter().collect();
    figures.extend(known_warp());
    let mut rows = known_pairs();
    rows.extend(found);
    Ok(Evaluation {
        what: "correspondence",
        about: "Cycles of every style at three speeds, warped onto one medium cycle by four methods (Hsu 2005, \
                section 5.1). The error is that of the right strike, which is hidden from the methods; for pairs with a \
                known warp, the mean error of all frames."
            .into(),
        keys: vec!["data", "method"],
        rows,
        figures,
    })
}

/// Rows of the pairs whose warp is known throughout.
fn known_pairs() -> Vec<table::Row> {
    let mut rows = Vec::new();
    for seed in 1..=20 {
        known(&mut rows, &known_pair(seed, 120, 8, 1.0), "known", "sines", &format!("pair-{seed}"));
    }
    for (kind, actions) in [("generated acts", &ACTS[..]), ("generated gaits", &GAITS[..])] {
        for action in actions {
            for style in STYLES.iter().filter(|s| **s != "neutral") {
                for content in 0..4 {
                    // Of names that the generator has.
                    let Ok(pair) = generated_pair(content, action, style) else { continue };
                    known(&mut rows, &pair, kind, action, style);
                }
            }
        }
    }
    rows
}

/// Rows of the corpus's own gait cycles, and a line for each action without gait and each class that has too few of them.
fn gaits(corpus: &Corpus, body: &Body, from: usize) -> (Vec<table::Row>, Vec<String>) {
    let (mut rows, mut left_out) = (Vec::new(), Vec::new());
    for action in 0..corpus.actions.len() {
        if !is_gait(corpus, action) {
            left_out.push(format!("left out: {} is no gait", corpus.actions[action]));
            continue;
        }
        let mut of = |style: usize| {
            cuts(corpus, body, action, style).map_err(|e| left_out.push(format!("left out: {e}"))).ok()
        };
        // The others are warped onto it.
        let Some(base) = of(from).map(|cuts| cuts[1].clone()) else { continue };
        for style in 0..corpus.styles.len() {
            for (cut, (speed, _)) in of(style).unwrap_or_default().iter().zip(SPEEDS) {
                if style != from || speed != "medium" {
                    onto(&mut rows, corpus, [action, style], speed, cut, &base);
                }
            }
        }
    }
    (rows, left_out)
}

/// Every method on a cycle and the one that it is warped onto.
fn onto(
    rows: &mut Vec<table::Row>,
    corpus: &Corpus,
    [action, style]: [usize; 2],
    speed: &str,
    cut: &Cut,
    base: &Cut,
) {
    let (u, y) = warp::standardised(&warp::shapes(&cut.rows), &warp::shapes(&base.rows));
    for (method, warp) in warps(&u, &y) {
        let Ok(warp) = warp else { continue };
        let error = (warp.at(cut.middle) - base.middle).abs() / corpus.rate_hz;
        rows.push(row(json!({
            "method": method, "data": "cycles", "action": corpus.actions[action],
            "style": corpus.styles[style], "speed": speed,
            "strike_error_ms": 1000.0 * error, "stalled": stalls(&warp),
        })));
    }
}

/// The mean error of each method's strikes; nothing where no cycle was warped.
fn strikes(rows: &[table::Row]) -> Option<Figure> {
    let of_method = |method: &str| {
        let of =
            rows.iter().filter(|r| r["method"] == method).filter_map(|r| r.get("strike_error_ms")?.as_f64());
        Some(mean(of)).filter(|m| !m.is_nan()).map(|mean| (method.to_owned(), vec![mean]))
    };
    let series: Vec<(String, Vec<f64>)> =
        ["imw", "time-warp-alone", "dtw-1", "dtw-3"].into_iter().filter_map(of_method).collect();
    let labels = Labels { title: "Error of the right strike", x: "gait cycles", y: "ms" };
    (!series.is_empty()).then(|| Figure {
        name: "strikes".into(),
        caption: "How far each method puts the right strike from where it is, mean over styles and speeds."
            .into(),
        svg: plots::bars(labels, &["all styles".to_owned()], &series),
    })
}

/// One pair whose warp is known: the warps, and a dof moved by each (Hsu 2005, Figure 2). The pair can be generated
/// and warped.
fn known_warp() -> Vec<Figure> {
    let Ok(pair) = demo::drawn_pair() else { return Vec::new() };
    let warps = Labels { title: "Finding a known time warp", x: "input, frames", y: "output, frames" };
    let moved = Labels { title: "A dof moved by each warp", x: "output, frames", y: "standard deviations" };
    let curves = [
        (
            "warps",
            "Where each method puts every frame of the input in the output, against the truth.",
            warps,
            demo::warps(&pair),
        ),
        (
            "warped",
            "The input on the output's timeline by each method (Hsu 2005, Figure 2).",
            moved,
            demo::figure2(&pair),
        ),
    ];
    let figure =
        |(name, caption, labels, curves): (&str, &str, Labels<'_>, Result<Vec<demo::Curve>, WarpError>)| {
            let svg = plots::lines(labels, &curves.ok()?);
            Some(Figure { name: name.into(), caption: caption.into(), svg })
        };
    curves.into_iter().filter_map(figure).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gestus_database::synth;

    /// One style of one gait of few clips took every row with it, those of the known warps too, and where no gait was left
    /// a plot said that no method errs.
    #[test]
    fn a_class_of_too_few_cycles_is_left_out_and_named() {
        let options = synth::Options::of(&["walk", "run", "punch"], &["neutral", "old", "proud"], 1, 5.0);
        let mut corpus = synth::corpus(&options).unwrap();
        let body = Body::of(&corpus).unwrap();
        let mut thin = |action: &str, style: &str| {
            let class = (corpus.action(action).unwrap(), corpus.style(style).unwrap());
            let example = corpus.examples.iter_mut().find(|e| (e.action, e.style) == class).unwrap();
            example.cycles.truncate(2);
        };
        thin("walk", "old");
        thin("run", "neutral");
        let (rows, left_out) = gaits(&corpus, &body, 0);
        let mut lines = Vec::from([("old", "walk"), ("neutral", "run")].map(|(s, a)| {
            format!("left out: {s} has 2 cycles of {a}, and needs 3: slow, medium and fast ones")
        }));
        lines.push("left out: punch is no gait".into());
        assert_eq!(left_out, lines);
        // Two of the base's own style, three of the other one, by four methods.
        assert_eq!(rows.len(), 4 * (2 + 3));
        assert!(rows.iter().all(|r| r["action"] == "walk" && r["style"] != "old"));
        assert!(strikes(&rows).is_some());
        let mut others = Vec::new();
        known(&mut others, &known_pair(1, 60, 3, 1.0), "known", "sines", "pair-1");
        assert!(others.len() == 4 && strikes(&others).is_none());
    }

    #[test]
    fn the_known_warp_is_drawn_with_every_method() {
        let figures = known_warp();
        assert_eq!(figures.iter().map(|f| f.name.as_str()).collect::<Vec<_>>(), ["warps", "warped"]);
        for figure in figures {
            for method in ["truth", "DTW, Type I", "DTW, Type III", "IMW"] {
                assert!(figure.svg.contains(method), "{}: no {method}", figure.name);
            }
        }
    }
}
