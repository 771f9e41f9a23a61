//! How well frames of different styles are set into correspondence (paper 001, section 5.1): iterative motion warping,
//! its time warp alone, and dynamic time warping of types I and III.
//!
//! Gait cycles of every style at three speeds are warped onto the medium cycle of one style. They begin and end with
//! left strikes, which every method is told; where the right foot strikes in between is known from the feet and told
//! to none. The error is how far from the true right strike the warp puts it, in milliseconds. Beside it stand pairs of
//! motions whose warp is known throughout ([`crate::warp::demo`]): generated clips, and sums of sines.

use serde_json::json;

use super::Evaluation;
use crate::{
    body::Body,
    corpus::Corpus,
    models::bilinear::{BilinearError, Cut, SPEEDS, cuts, shape},
    report::{
        html::Figure,
        plot::{self, Labels},
        table,
    },
    synth::STYLES,
    warp::{
        self, Warp, WarpError,
        demo::{self, KnownPair, generated_pair, known_pair},
        dtw::{Constraint, dtw},
        imw::{Config, imw},
    },
};

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

/// Share of the steps of a warp that stand still or jump: slopes below a quarter or above four.
fn stalls(warp: &Warp) -> f64 {
    let steps = warp.positions.windows(2).map(|w| w[1] - w[0]);
    let bad = steps.clone().filter(|s| !(0.25..=4.0).contains(s)).count();
    bad as f64 / steps.count().max(1) as f64
}

/// Every method on a pair whose warp is known.
fn known(rows: &mut Vec<table::Row>, pair: &KnownPair, data: &str, action: &str, style: &str) {
    for (method, warp) in warps(&pair.u, &pair.y) {
        let Ok(warp) = warp else { continue };
        rows.push(super::row(json!({
            "method": method, "data": data, "action": action, "style": style,
            "error_frames": warp.mean_error(&pair.truth), "stalled": stalls(&warp),
        })));
    }
}

/// Runs the evaluation; actions whose clips are no gaits have no right strike, and are left out.
///
/// # Errors
/// [`BilinearError`] where a style has too few cycles.
pub fn evaluate(corpus: &Corpus, from: usize) -> Result<Evaluation, BilinearError> {
    let mut rows: Vec<table::Row> = Vec::new();
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
    let body = Body::of(corpus).map_err(|_| none(corpus, from))?;
    for (action, name) in corpus.actions.iter().enumerate() {
        let gait = corpus.examples.iter().filter(|e| e.action == action).flat_map(|e| &e.cycles);
        if !gait.clone().all(|c| c.knots.len() == 3) {
            continue;
        }
        let base: Cut = cuts(corpus, &body, action, from)?[1].clone();
        for (style, label) in corpus.styles.iter().enumerate() {
            for (cut, (speed, _)) in cuts(corpus, &body, action, style)?.iter().zip(SPEEDS) {
                if style == from && speed == "medium" {
                    continue;
                }
                let (u, y) = warp::standardised(&shape(&cut.rows), &shape(&base.rows));
                for (method, warp) in warps(&u, &y) {
                    let Ok(warp) = warp else { continue };
                    let error = (warp.at(cut.middle) - base.middle).abs() / corpus.rate_hz;
                    rows.push(super::row(json!({
                        "method": method, "data": "cycles", "action": name, "style": label, "speed": speed,
                        "strike_error_ms": 1000.0 * error, "stalled": stalls(&warp),
                    })));
                }
            }
        }
    }
    let mean = |method: &str, key: &str| {
        let of = rows.iter().filter(|r| r["method"] == method).filter_map(|r| r.get(key)?.as_f64());
        of.clone().sum::<f64>() / of.count().max(1) as f64
    };
    let names = ["imw", "time-warp-alone", "dtw-1", "dtw-3"];
    let series: Vec<(String, Vec<f64>)> =
        names.iter().map(|m| ((*m).to_owned(), vec![mean(m, "strike_error_ms")])).collect();
    let labels = Labels { title: "Error of the right strike", x: "gait cycles", y: "ms" };
    let mut figures = vec![Figure {
        name: "strikes".into(),
        caption: "How far each method puts the right strike from where it is, mean over styles and speeds."
            .into(),
        svg: plot::bars(labels, &["all styles".to_owned()], &series),
    }];
    figures.extend(known_warp());
    Ok(Evaluation {
        what: "correspondence",
        about: "Cycles of every style at three speeds, warped onto one medium cycle by four methods (paper 001, \
                section 5.1). The error is that of the right strike, which no method is told; for pairs with a known \
                warp, the mean error of all frames."
            .into(),
        keys: vec!["data", "method"],
        rows,
        figures,
    })
}

/// One pair whose warp is known: the warps, and a dof moved by each (paper 001, Figure 2). The pair can be generated
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
            "The input on the output's timeline by each method (paper 001, Figure 2).",
            moved,
            demo::figure2(&pair),
        ),
    ];
    let figure =
        |(name, caption, labels, curves): (&str, &str, Labels<'_>, Result<Vec<demo::Curve>, WarpError>)| {
            let svg = plot::lines(labels, &curves.ok()?);
            Some(Figure { name: name.into(), caption: caption.into(), svg })
        };
    curves.into_iter().filter_map(figure).collect()
}

fn none(corpus: &Corpus, from: usize) -> BilinearError {
    BilinearError::Cycles {
        action: corpus.actions.join(", "),
        style: corpus.styles.get(from).cloned().unwrap_or_default(),
        have: 0,
        need: SPEEDS.len(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
