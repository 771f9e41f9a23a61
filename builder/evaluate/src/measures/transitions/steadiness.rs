//! How often a joint of a stream is jolted, by every method.

use gestus_core::Database;
use gestus_motion::{
    body::Body,
    clip::Clip,
    statistics::{mean, quantile, sorted},
};
use serde_json::json;

use super::held::{Held, Stream};
use crate::{
    evaluation::row,
    measures::streamed,
    metrics::{accelerations, centred},
    report::table,
};

/// Share of the frames that have less acceleration than a jolt, both in the input and in the real clips of the output style.
const USUAL_SHARE: f64 = 0.999;

/// For each output style, a row of the input and one of each method.
pub(super) fn rows(
    held: &Held<'_>,
    database: &Database<'_>,
    of: &Stream,
    done: &dyn Fn(),
) -> Vec<table::Row> {
    let corpus = &held.experiment.corpus;
    let input = of_clip(&held.body, &of.walk.clip);
    let usual_input = usual(input.iter().copied());
    let mut rows = Vec::new();
    for &style in &held.experiment.to {
        let real = corpus.examples.iter().filter(|e| e.style == style);
        let real = usual(real.flat_map(|e| of_clip(&held.body, &e.clip)));
        let jolt = real.max(usual_input);
        let mut add = |method: &str, all: &[f64]| {
            let jolts = all.iter().filter(|&&a| a > jolt).count();
            rows.push(row(json!({
                "part": "steadiness",
                "method": method,
                "style": corpus.styles[style],
                // Neither the first frame nor the last has an acceleration.
                "frames": all.len() + 2,
                "jolts_per_minute": 60.0 * corpus.rate_hz * jolts as f64 / all.len().max(1) as f64,
                "jolt_m_s2": jolt,
                "acceleration_mean_m_s2": mean(all.iter().copied()),
                "acceleration_most_m_s2": all.iter().copied().fold(0.0, f64::max),
            })));
        };
        add("unchanged", &input);
        for (method, _, _, streamed) in streamed(database, &of.walk.clip, style) {
            let output = streamed.clip(&of.walk.clip, corpus.rate_hz);
            add(method, &of_clip(&held.body, &output));
        }
        done();
    }
    rows
}

/// The acceleration that [`USUAL_SHARE`] of the frames stay below; 0 where there are none.
fn usual(accelerations: impl IntoIterator<Item = f64>) -> f64 {
    quantile(&sorted(accelerations), USUAL_SHARE).unwrap_or(0.0)
}

/// The greatest acceleration of a joint in each frame of a clip, relative to the hips and the body's heading, m/s².
fn of_clip(body: &Body, clip: &Clip) -> Vec<f64> {
    let poses: Vec<_> = body.clip_dofs(clip).iter().map(|dofs| centred(body, dofs)).collect();
    accelerations(&poses, clip.rate_hz)
}
