//! What the proportions of the mixture recognise: the action and the style of the input, against the truth; what each class
//! is taken for; and how fast the body turns meanwhile.

use anyhow::Result;
use gestus_core::{Database, Report, blob::layout::dof};
use gestus_database::{
    motion_graph::Label,
    stream::{Request, Step, stream},
};
use gestus_motion::statistics::mean;
use serde_json::json;

use super::held::{Held, Stream};
use crate::{evaluation::row, report::table};

/// Time after a transition began after which a frame counts as steady, seconds.
const STEADY_S: f64 = 0.5;
/// Half the time over which the yaw rate is averaged, seconds: a stride sways the hips by more than a slow turn.
const YAW_S: f64 = 0.5;
/// Yaw rates, degrees a second, that have a row of their own.
const YAW_DEG_S: [(f64, &str); 4] = [
    (10.0, "under 10 deg/s"),
    (30.0, "10-30 deg/s"),
    (60.0, "30-60 deg/s"),
    (f64::INFINITY, "over 60 deg/s"),
];

/// An attribute of classes and labels.
struct Attribute<'a> {
    names: &'a [String],
    /// Number of the attribute of each class of the database.
    of_class: Vec<usize>,
    truth: fn(&Label) -> usize,
}

impl Attribute<'_> {
    /// The weight of each value in a frame.
    fn weights(&self, report: &Report) -> Vec<f64> {
        let mut weights = vec![0.0; self.names.len()];
        for share in &report.classes {
            weights[self.of_class[usize::from(share.class)]] += f64::from(share.proportion);
        }
        weights
    }
}

/// What was recognised in one frame.
struct Found {
    truth: usize,
    /// The value with most weight; none where no class has any.
    first: Option<usize>,
    /// Weight of the truth.
    weight: f64,
}

/// A row for each class.
pub(super) fn rows(held: &Held<'_>, database: &Database<'_>, of: &Stream) -> Result<Vec<table::Row>> {
    let corpus = &held.experiment.corpus;
    let request = Request::style(held.experiment.from as u16);
    let streamed = stream(database, &of.walk.clip, &request, &mut ()).map_err(anyhow::Error::msg)?;
    let attributes = [
        Attribute {
            names: &corpus.actions,
            of_class: database.classes().map(|c| usize::from(c.action)).collect(),
            truth: |l| l.action,
        },
        Attribute {
            names: &corpus.styles,
            of_class: database.classes().map(|c| usize::from(c.style)).collect(),
            truth: |l| l.style,
        },
    ];
    let found = attributes.each_ref().map(|attribute| {
        let found = |(step, label): (&Step, &Label)| {
            let weights = attribute.weights(&step.report);
            let truth = (attribute.truth)(label);
            let first = (0..weights.len()).max_by(|&a, &b| weights[a].total_cmp(&weights[b]));
            Found { truth, first: first.filter(|&f| weights[f] > 0.0), weight: weights[truth] }
        };
        streamed.steps.iter().zip(&of.walk.labels).map(found).collect::<Vec<Found>>()
    });
    let mut classes: Vec<(usize, usize)> = of.walk.labels.iter().map(|l| (l.action, l.style)).collect();
    classes.sort_unstable();
    classes.dedup();
    let steady = |t: &usize| of.since_s[*t] >= STEADY_S;
    let yaw = yaw_rates(held, of);
    let mut rows = Vec::new();
    for class in classes {
        let frames: Vec<usize> = (0..of.walk.labels.len())
            .filter(|&t| (of.walk.labels[t].action, of.walk.labels[t].style) == class)
            .collect();
        let steady_frames: Vec<usize> = frames.iter().copied().filter(steady).collect();
        let named = |part: &str| {
            row(json!({
                "part": part,
                "method": "mixture",
                "action": corpus.actions[class.0],
                "style": corpus.styles[class.1],
            }))
        };
        let mut figures = named("recognition");
        figures.insert("frames".into(), frames.len().into());
        for ((name, found), attribute) in ["action", "style"].into_iter().zip(&found).zip(&attributes) {
            let right = |t: &usize| f64::from(u8::from(found[*t].first == Some(found[*t].truth)));
            let (delay_s, missed) = delays(found, &frames, corpus.rate_hz);
            let mut put =
                |key: &str, value: serde_json::Value| figures.insert(format!("{name}_{key}"), value);
            put("right", json!(mean(frames.iter().map(right))));
            put("right_steady", json!(Some(mean(steady_frames.iter().map(right))).filter(|m| !m.is_nan())));
            put("weight", json!(mean(frames.iter().map(|&t| found[t].weight))));
            put("delay_s", json!(delay_s));
            put("missed", json!(missed));
            put("taken_for", json!(taken_for(found, &frames).map(|v| &attribute.names[v])));
            for (value, share) in shares(found, &steady_frames) {
                let mut confused = named("confusion");
                confused.insert("attribute".into(), name.into());
                confused.insert("recognised".into(), attribute.names[value].clone().into());
                confused.insert("share".into(), share.into());
                rows.push(confused);
            }
        }
        rows.push(figures);
        for figures in turning(&found[0], &steady_frames, &yaw) {
            let mut row = named("turning");
            row.extend(figures);
            rows.push(row);
        }
    }
    Ok(rows)
}

/// How fast the body turns at each frame, either way, over a second, degrees a second.
fn yaw_rates(held: &Held<'_>, of: &Stream) -> Vec<f64> {
    let rows = held.body.clip_dofs(&of.walk.clip);
    let half = (YAW_S * held.experiment.corpus.rate_hz).round() as usize;
    let around = |t: usize| &rows[t.saturating_sub(half)..(t + half + 1).min(rows.len())];
    (0..rows.len()).map(|t| mean(around(t).iter().map(|r| r[dof::YAW])).abs().to_degrees()).collect()
}

/// How the action is recognised in some frames, by how fast the body turns there.
fn turning(found: &[Found], frames: &[usize], yaw: &[f64]) -> Vec<table::Row> {
    let mut slower = 0.0;
    let mut rows = Vec::new();
    for (faster, name) in YAW_DEG_S {
        let within: Vec<usize> =
            frames.iter().copied().filter(|&t| (slower..faster).contains(&yaw[t])).collect();
        slower = faster;
        if within.is_empty() {
            continue;
        }
        let right = |&t: &usize| f64::from(u8::from(found[t].first == Some(found[t].truth)));
        rows.push(row(json!({
            "yaw": name,
            "frames": within.len(),
            "action_right": mean(within.iter().map(right)),
            "action_weight": mean(within.iter().map(|&t| found[t].weight)),
        })));
    }
    rows
}

/// The values that are recognised in some frames, each with its share of these.
fn shares(found: &[Found], frames: &[usize]) -> Vec<(usize, f64)> {
    let mut counts = std::collections::BTreeMap::<usize, usize>::new();
    for value in frames.iter().filter_map(|&t| found[t].first) {
        *counts.entry(value).or_default() += 1;
    }
    counts.into_iter().map(|(value, count)| (value, count as f64 / frames.len() as f64)).collect()
}

/// Mean time from a change to a class's value until it is first recognised, seconds, over the changes after which it is;
/// and how many changes it never is before the next. `None` where the value never changes to the class's.
fn delays(found: &[Found], frames: &[usize], rate_hz: f64) -> (Option<f64>, usize) {
    let changes = frames.iter().filter(|&&t| t > 0 && found[t].truth != found[t - 1].truth);
    let (mut delays, mut missed) = (Vec::new(), 0);
    for &t in changes {
        let during = || found[t..].iter().take_while(|f| f.truth == found[t].truth);
        match during().position(|f| f.first == Some(f.truth)) {
            Some(delay) => delays.push(delay as f64 / rate_hz),
            None => missed += 1,
        }
    }
    (Some(mean(delays.iter().copied())).filter(|m| !m.is_nan()), missed)
}

/// The wrong value that has most weight most often.
fn taken_for(found: &[Found], frames: &[usize]) -> Option<usize> {
    let wrong = |t: &usize| found[*t].first.filter(|&f| f != found[*t].truth);
    let mut counts: Vec<(usize, usize)> = Vec::new();
    for value in frames.iter().filter_map(wrong) {
        match counts.iter_mut().find(|c| c.0 == value) {
            Some(count) => count.1 += 1,
            None => counts.push((value, 1)),
        }
    }
    counts.into_iter().max_by_key(|c| c.1).map(|c| c.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_counts_from_the_change_to_the_first_right_frame() {
        let frame = |truth, first| Found { truth, first: Some(first), weight: 1.0 };
        // Two changes to value 1: recognised after two frames, and never.
        let found: Vec<Found> = [(0, 0), (1, 0), (1, 0), (1, 1), (0, 0), (1, 0), (1, 2), (0, 0)]
            .into_iter()
            .map(|(t, f)| frame(t, f))
            .collect();
        let frames: Vec<usize> = (0..found.len()).filter(|&t| found[t].truth == 1).collect();
        let (delay_s, missed) = delays(&found, &frames, 10.0);
        assert!((delay_s.unwrap() - 0.2).abs() < 1e-12 && missed == 1);
        assert_eq!(taken_for(&found, &frames), Some(0));
        // Of its five frames value 1 is taken for 0 in three, for itself and for 2 in one.
        assert_eq!(shares(&found, &frames), vec![(0, 0.6), (1, 0.2), (2, 0.2)]);
        assert_eq!(delays(&found[..1], &[0], 10.0), (None, 0));
    }
}
