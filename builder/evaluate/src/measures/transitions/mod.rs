//! Heterogeneous streams (Xia 2015, section 7.1): held-out clips joined by a motion graph, streamed unlabelled through a
//! database without them. What a transition costs, and what the proportions of the mixture recognise.
//!
//! | `part` | stream | rows |
//! |---|---|---|
//! | `error` | held-out clips in the input style, to each output style | one for each output style and time since a transition |
//! | `steadiness` | the same, by every method | one for each method and output style |
//! | `recognition` | held-out clips of all classes | one for each class |
//! | `confusion` | the same | one for each class and each action, and each style, that it is taken for |
//! | `turning` | the same | one for each class and yaw rate of the body |

mod error;
mod held;
mod recognition;
mod steadiness;

use std::path::Path;

use anyhow::{Result, bail};
use gestus_core::Database;
use gestus_database::{build::build, command_line::progress, motion_graph::WalkOptions};
use gestus_motion::body::Body;

use crate::{
    evaluation::Evaluation,
    experiment::Experiment,
    measures::{OnClips, Uses},
    plots::{self, Labels},
    report::{html::Figure, table},
};
use held::{Held, SINCE_S, held_out};

/// Defaults of the options.
const SECONDS: f64 = 600.0;
const STAY_S: f64 = 2.0;

/// Options of `gestus evaluate transitions`.
#[derive(clap::Args, Debug)]
pub struct Args {
    /// Length of each stream, seconds
    #[arg(long, default_value_t = SECONDS)]
    seconds: f64,
    /// Seed of the walks through the graph
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Least time in a clip between two transitions, seconds; at most twice as long
    #[arg(long, default_value_t = STAY_S)]
    stay: f64,
}

impl Default for Args {
    fn default() -> Self {
        Self { seconds: SECONDS, seed: 1, stay: STAY_S }
    }
}

impl OnClips for Args {
    const USES: Uses = Uses::ALL;

    fn check(&self, _: &Path) -> Result<()> {
        if !(10.0..=3600.0).contains(&self.seconds) {
            bail!("--seconds {}: from 10 to 3600", self.seconds);
        }
        if !(0.0..=60.0).contains(&self.stay) {
            bail!("--stay {}: seconds, from 0 to 60", self.stay);
        }
        Ok(())
    }

    fn evaluate(&self, experiment: &Experiment) -> Result<Evaluation> {
        let held = Held { experiment, body: Body::of(&experiment.corpus)?, clips: held_out(experiment) };
        let bar = progress::bar(2 + 2 * experiment.to.len(), "transitions");
        let bytes = build(&experiment.corpus.without(&held.clips), &experiment.build_with_models())?.bytes;
        let database = Database::open(&bytes)?;
        bar.inc(1);
        let options = WalkOptions { seconds: self.seconds, seed: self.seed, stay_s: self.stay };
        let mut rows = recognition::rows(&held, &database, &held.stream(None, &options)?)?;
        bar.inc(1);
        let stream = held.stream(Some(experiment.from), &options)?;
        rows.extend(error::rows(&held, &database, &stream, &|| bar.inc(1))?);
        rows.extend(steadiness::rows(&held, &database, &stream, &|| bar.inc(1)));
        bar.finish_and_clear();
        Ok(Evaluation {
            what: "transitions",
            about: "Held-out clips joined by a motion graph into one stream, unlabelled. `error_cm` is the distance of the \
                    pose that leaves from the truth clip at the matched moment, `alone_cm` that of the same frames where \
                    their clip was streamed alone: their difference is what transitions cost. `action_right` and \
                    `style_right` are the shares of frames in which the class with most weight is of the true action and \
                    style, `action_weight` and `style_weight` the weight that the true ones have. `confusion` has the share of \
                    the steady frames in which each action and style is recognised, `turning` what is recognised by how fast \
                    the body turns. `jolts_per_minute` counts the frames in which a joint accelerates more than in 99.9% of the \
                    frames of the input, and of real clips of the output style."
                .into(),
            keys: vec!["part", "method", "since", "action", "attribute", "recognised", "yaw"],
            figures: vec![costs(&rows), jolts(&rows), recognised(&rows)],
            rows,
        })
    }
}

/// Means of a key in the rows of a part, by another key.
fn series(rows: &[table::Row], part: &str, by: &str, names: &[String], key: &str) -> (String, Vec<f64>) {
    let rows: Vec<table::Row> = rows.iter().filter(|r| r["part"] == part).cloned().collect();
    let means = table::means(&rows, &[by]);
    let of = |name: &String| {
        let row = means.iter().find(|r| r.get(by).and_then(|v| v.as_str()) == Some(name));
        row.and_then(|r| r.get(key)?.as_f64()).unwrap_or(0.0)
    };
    (key.to_owned(), names.iter().map(of).collect())
}

fn costs(rows: &[table::Row]) -> Figure {
    let names: Vec<String> = SINCE_S.iter().map(|s| s.1.to_owned()).collect();
    let bars = ["error_cm", "alone_cm"].map(|key| series(rows, "error", "since", &names, key));
    let labels = Labels { title: "Error after a transition", x: "time since it began", y: "cm" };
    Figure {
        name: "error".into(),
        caption: "Joint error in the stream, and of the same frames in clips streamed alone.".into(),
        svg: plots::bars(labels, &names, &bars),
    }
}

fn jolts(rows: &[table::Row]) -> Figure {
    let of_part = rows.iter().filter(|r| r["part"] == "steadiness");
    let names = table::distinct(of_part.map(|r| table::text(r.get("method"))));
    let bars = [series(rows, "steadiness", "method", &names, "jolts_per_minute")];
    let labels = Labels { title: "Jolts", x: "method", y: "frames a minute" };
    Figure {
        name: "jolts".into(),
        caption:
            "Frames a minute in which a joint accelerates more than in 99.9% of those of the input and of real clips."
                .into(),
        svg: plots::bars(labels, &names, &bars),
    }
}

fn recognised(rows: &[table::Row]) -> Figure {
    let of_part = rows.iter().filter(|r| r["part"] == "recognition");
    let names = table::distinct(of_part.map(|r| table::text(r.get("action"))));
    let bars = ["action_right", "style_right"].map(|key| series(rows, "recognition", "action", &names, key));
    let labels = Labels { title: "Recognition", x: "action", y: "share of the frames" };
    Figure {
        name: "recognition".into(),
        caption: "Frames in which the class with most weight is of the true action and style.".into(),
        svg: plots::bars(labels, &names, &bars),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn measured() -> Vec<table::Row> {
        let all = Experiment::generated(&["walk", "run", "kick"], &["neutral", "old"], 4, 6.0);
        let experiment = Experiment { folds: 2, ..all };
        assert_eq!(held_out(&experiment).len(), 12);
        Args { seconds: 60.0, seed: 1, stay: 1.5 }.evaluate(&experiment).unwrap().rows
    }

    #[test]
    fn generated_actions_and_styles_are_recognised_and_transitions_cost_something() {
        let rows = measured();
        let number =
            |row: &table::Row, key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key}: {row:?}"));
        let classes: Vec<&table::Row> = rows.iter().filter(|r| r["part"] == "recognition").collect();
        assert_eq!(classes.len(), 6);
        let frames: f64 = classes.iter().map(|r| number(r, "frames")).sum();
        assert!((frames - 1800.0).abs() < 0.5);
        for row in &classes {
            let confused = rows.iter().filter(|r| {
                r["part"] == "confusion"
                    && r["attribute"] == "action"
                    && (&r["action"], &r["style"]) == (&row["action"], &row["style"])
            });
            let own = confused.clone().find(|r| r["recognised"] == row["action"]).map(|r| number(r, "share"));
            assert_eq!(own, row["action_right_steady"].as_f64());
            assert!((confused.map(|r| number(r, "share")).sum::<f64>() - 1.0).abs() < 1e-9, "{row:?}");
        }
        for row in classes {
            for key in ["action_right", "style_right", "action_weight", "style_weight"] {
                assert!((0.0..=1.0).contains(&number(row, key)), "{key}: {row:?}");
            }
            assert!(number(row, "action_right") > 0.7, "{row:?}");
        }
        let errors: Vec<&table::Row> = rows.iter().filter(|r| r["part"] == "error").collect();
        assert_eq!(errors.len(), 3);
        let later = errors.iter().find(|r| r["since"] == "later").unwrap();
        // Away from transitions the stream is as its clips are alone, and neither is the input.
        assert!((number(later, "error_cm") - number(later, "alone_cm")).abs() < 0.5, "{later:?}");
        assert!(number(later, "error_cm") < number(later, "unchanged_cm"), "{later:?}");
        let steady: Vec<&table::Row> = rows.iter().filter(|r| r["part"] == "steadiness").collect();
        let methods: Vec<&str> = steady.iter().filter_map(|r| r["method"].as_str()).collect();
        assert_eq!(methods, ["unchanged", "mixture", "phase", "lti", "statistic"]);
        for row in steady {
            let most = number(row, "acceleration_most_m_s2");
            assert!(number(row, "acceleration_mean_m_s2") < most, "{row:?}");
            let jolts = number(row, "jolts_per_minute");
            assert_eq!(jolts > 0.0, most > number(row, "jolt_m_s2"), "{row:?}");
            assert!(jolts < 60.0, "{row:?}");
        }
    }
}
