//! What the proportions of the mixture recognise: the action and the style of the input, against the truth.

use anyhow::Result;
use gestus_core::{Database, Report};
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
    let mut rows = Vec::new();
    for class in classes {
        let frames: Vec<usize> = (0..of.walk.labels.len())
            .filter(|&t| (of.walk.labels[t].action, of.walk.labels[t].style) == class)
            .collect();
        let mut figures = row(json!({
            "part": "recognition",
            "method": "mixture",
            "action": corpus.actions[class.0],
            "style": corpus.styles[class.1],
            "frames": frames.len(),
        }));
        for ((name, found), attribute) in ["action", "style"].into_iter().zip(&found).zip(&attributes) {
            let right = |t: &usize| f64::from(u8::from(found[*t].first == Some(found[*t].truth)));
            let steady = frames.iter().filter(|&&t| of.since_s[t] >= STEADY_S);
            let (delay_s, missed) = delays(found, &frames, corpus.rate_hz);
            let mut put =
                |key: &str, value: serde_json::Value| figures.insert(format!("{name}_{key}"), value);
            put("right", json!(mean(frames.iter().map(right))));
            put("right_steady", json!(Some(mean(steady.map(right))).filter(|m| !m.is_nan())));
            put("weight", json!(mean(frames.iter().map(|&t| found[t].weight))));
            put("delay_s", json!(delay_s));
            put("missed", json!(missed));
            put("taken_for", json!(taken_for(found, &frames).map(|v| &attribute.names[v])));
        }
        rows.push(figures);
    }
    Ok(rows)
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
        assert_eq!(delays(&found[..1], &[0], 10.0), (None, 0));
    }
}
