//! `gestus evaluate transfer`: a clip in the style of one other clip, by the statistics of its joints, as the paper does
//! it and as `gestus transfer` does.
//!
//! | `part` | what |
//! |---|---|
//! | `clips` | every test clip in the style of the clip of `other-clip`: errors of `loo`, and times |
//! | `table-1` | four pairs like those of the paper's Table 1: the time of each step |
//! | `singular` | generated motion at the pole of Euler angles (Figure 2) |

mod methods;
mod singular;

use anyhow::Result;
use gestus_database::models::statistic::transfer::{Options, Transferred, transfer};
use gestus_motion::{body::Body, clip::Clip, statistics::mean};
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    experiment::Experiment,
    fold::Fold,
    measures::{OnClips, Uses},
    report::table,
};
use methods::METHODS;

/// Options of `gestus evaluate transfer`.
#[derive(clap::Args, Debug)]
pub struct Args;

/// Runs of which the median time counts.
const RUNS: usize = 5;

impl OnClips for Args {
    const USES: Uses = Uses { groups: false, ..Uses::ALL };

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let (body, folds) = experiment.folds()?;
        let mut rows = Vec::new();
        for held in folds {
            let fold = Fold::of(experiment, &body, held);
            if let Some(other) = held.other {
                rows.extend(in_style_of(&fold, &experiment.corpus.examples[other].clip)?);
            }
        }
        rows.extend(table_1(experiment, &body)?);
        let (singular, figure) = singular::rows()?;
        rows.extend(singular);
        Ok(Evaluation {
            what: "transfer",
            about: "The style of one clip given to another by mean and standard deviation of its joints. `transfer` weighs \
                    frames by the time warp, `transfer-literal` takes them through the warp and back as the paper does, \
                    `transfer-euler` does so with Euler angles. `from_ours_deg` is the mean angle of a joint from `transfer`'s. \
                    Times are in milliseconds: of one run in rows `clips`, of the run of five whose warp takes the \
                    median time in rows `table-1`. `arm_speed_ratio` is how fast an arm at the pole of its Euler \
                    angles turns at most, over the fastest it does in source and reference."
                .into(),
            keys: vec!["part", "method", "pair"],
            rows,
            figures: vec![figure],
        })
    }
}

/// The rows of a fold: its test clip in the style of a reference.
fn in_style_of(fold: &Fold<'_>, reference: &Clip) -> Result<Vec<table::Row>> {
    let example = &fold.corpus.examples[fold.test];
    let mut rows = Vec::new();
    let mut ours: Option<Clip> = None;
    for (method, options) in METHODS {
        let out = transfer(&fold.body, &example.clip, reference, &options())?;
        let figures = fold.row(method, &fold.body.clip_dofs(&out.clip), None);
        let ours = ours.get_or_insert_with(|| out.clip.clone());
        let mut row = figures.to_json(fold.corpus);
        row.extend(self::row(json!({
            "part": "clips",
            "reference": reference.name,
            "from_ours_deg": off(&out.clip, ours).to_degrees(),
        })));
        row.extend(times(&out));
        rows.push(row);
    }
    Ok(rows)
}

/// Mean angle between the joints of two clips of as many frames, radians.
fn off(a: &Clip, b: &Clip) -> f64 {
    let frames = a.frames.iter().zip(&b.frames);
    mean(frames.flat_map(|(a, b)| a.rotations.iter().zip(&b.rotations).map(|(a, b)| a.angle_to(b))))
}

fn times(out: &Transferred) -> table::Row {
    row(json!({ "warp_ms": out.warp_ms, "transfer_ms": out.transfer_ms, "clean_up_ms": out.clean_up_ms }))
}

/// Two walks and two runs in the style of two walks, as in Table 1. Of a folder without walks or runs, the first and the
/// last of its actions.
fn table_1(experiment: &Experiment, body: &Body) -> Result<Vec<table::Row>> {
    let corpus = &experiment.corpus;
    let action = |name: &str, otherwise: usize| corpus.action(name).unwrap_or(otherwise);
    let (walk, run) = (action("walk", 0), action("run", corpus.actions.len() - 1));
    let longest = |action: usize, style: usize| {
        let own = corpus.examples.iter().filter(|e| (e.action, e.style) == (action, style));
        own.max_by_key(|e| e.clip.frames.len()).map(|e| &e.clip)
    };
    let mut rows = Vec::new();
    for source in [walk, run] {
        for &style in experiment.to.iter().take(2) {
            let (Some(own), Some(reference)) = (longest(source, experiment.from), longest(walk, style))
            else {
                continue;
            };
            let name =
                |action: usize, style: usize| format!("{} {}", corpus.styles[style], corpus.actions[action]);
            let mut runs: Vec<Transferred> = (0..RUNS)
                .map(|_| transfer(body, own, reference, &Options::default()))
                .collect::<Result<_, _>>()?;
            runs.sort_by(|a, b| a.warp_ms.total_cmp(&b.warp_ms));
            let mut row = row(json!({
                "part": "table-1",
                "method": METHODS[0].0,
                "pair": format!("{} - {}", name(source, experiment.from), name(walk, style)),
                "frames": own.frames.len(),
                "reference_frames": reference.frames.len(),
            }));
            row.extend(times(&runs[RUNS / 2]));
            rows.push(row);
        }
    }
    Ok(rows)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_literal_warp_is_near_ours_and_four_pairs_are_timed() {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "proud", "old"], 3, 4.0);
        let rows = Args.evaluate(&experiment).unwrap().rows;
        let of = |part: &str, method: &str| {
            rows.iter().filter(|r| r["part"] == part && r["method"] == method).cloned().collect::<Vec<_>>()
        };
        for method in ["transfer", "transfer-literal", "transfer-euler"] {
            assert_eq!(of("clips", method).len(), 4, "{method}");
        }
        for row in of("clips", "transfer-literal") {
            let off = row["from_ours_deg"].as_f64().unwrap();
            assert!(off > 0.0 && off < 2.0, "{off}");
        }
        let pairs = of("table-1", "transfer");
        assert!(
            pairs.len() == 4 && pairs.iter().all(|p| p["clean_up_ms"].as_f64().unwrap() > 0.0),
            "{pairs:?}"
        );
        assert_eq!(
            (&pairs[0]["pair"], &pairs[3]["pair"]),
            (&json!("neutral walk - proud walk"), &json!("neutral run - old walk"))
        );
    }
}
