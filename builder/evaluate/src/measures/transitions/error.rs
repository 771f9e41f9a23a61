//! Error and flags of a stream by the time since a transition began.

use std::collections::BTreeMap;

use anyhow::Result;
use gestus_core::{Database, Degraded};
use gestus_database::stream::{Request, Step, stream};
use gestus_motion::{body::row_at, clip::Clip, statistics::mean};
use nalgebra::Vector3;
use serde_json::json;

use super::held::{Held, SINCE_S, Stream};
use crate::{
    evaluation::row,
    experiment::HeldOut,
    fold::Fold,
    metrics::{centred, joint_distance, matched},
    report::table,
};

/// Hips-centred joint positions of each frame; none where there is nothing to compare with.
type Poses = Vec<Option<Vec<Vector3<f64>>>>;

/// What is known of a held-out clip in an output style.
struct Counterpart {
    /// The truth at each of its frames.
    truth: Poses,
    /// Its translation, streamed alone.
    alone: Poses,
    /// Itself.
    unchanged: Poses,
}

/// Three rows for each output style.
pub(super) fn rows(
    held: &Held<'_>,
    database: &Database<'_>,
    of: &Stream,
    done: &dyn Fn(),
) -> Result<Vec<table::Row>> {
    let corpus = &held.experiment.corpus;
    let mut rows = Vec::new();
    for &style in &held.experiment.to {
        let request = Request::style(style as u16);
        let streamed = stream(database, &of.walk.clip, &request, &mut ()).map_err(anyhow::Error::msg)?;
        let mut counterparts: BTreeMap<usize, Option<Counterpart>> = BTreeMap::new();
        for &clip in &of.clips {
            if let std::collections::btree_map::Entry::Vacant(slot) = counterparts.entry(clip) {
                slot.insert(counterpart(held, database, clip, style)?);
            }
        }
        let frames: Vec<_> = streamed.steps.iter().map(|s| s.frame.clone()).collect();
        let ours = poses(held, &Clip { frames, ..of.walk.clip.clone() });
        for (i, (until, since)) in SINCE_S.into_iter().enumerate() {
            let after = i.checked_sub(1).map_or(0.0, |i| SINCE_S[i].0);
            let inside: Vec<usize> = (0..ours.len())
                .filter(|&t| {
                    (after..until).contains(&of.since_s[t])
                        || (until.is_infinite() && of.since_s[t].is_infinite())
                })
                .collect();
            let flag = |flag: Degraded| {
                let set = |t: &usize| f64::from(u8::from(streamed.steps[*t].report.degraded.contains(flag)));
                Some(mean(inside.iter().map(set))).filter(|m| !m.is_nan())
            };
            // A blend is nobody's motion: it has no truth.
            let compared: Vec<[f64; 3]> = inside
                .iter()
                .filter(|&&t| !of.walk.labels[t].blend)
                .filter_map(|&t| {
                    let frame = of.walk.labels[t].frame;
                    let counterpart = counterparts.get(&of.clips[t])?.as_ref()?;
                    let truth = counterpart.truth[frame].as_ref()?;
                    let off = |pose: &Option<Vec<Vector3<f64>>>| {
                        Some(100.0 * joint_distance(pose.as_ref()?, truth))
                    };
                    Some([
                        off(&ours[t])?,
                        off(&counterpart.alone[frame])?,
                        off(&counterpart.unchanged[frame])?,
                    ])
                })
                .collect();
            let error = |k: usize| Some(mean(compared.iter().map(|c| c[k]))).filter(|m| !m.is_nan());
            rows.push(row(json!({
                "part": "error",
                "method": "mixture",
                "since": since,
                "action": null,
                "style": corpus.styles[style],
                "frames": inside.len(),
                "compared": compared.len(),
                "error_cm": error(0),
                "alone_cm": error(1),
                "unchanged_cm": error(2),
                "far": flag(Degraded::FAR),
                "jump": flag(Degraded::JUMP),
                "visits": flag(Degraded::VISITS),
                "many_classes": flag(Degraded::CLASSES),
                "prediction": flag(Degraded::PREDICTION),
                "spike": flag(Degraded::SPIKE),
                "degraded": any(&streamed.steps, &inside),
            })));
        }
        done();
    }
    Ok(rows)
}

/// Share of the frames with any flag.
fn any(steps: &[Step], inside: &[usize]) -> Option<f64> {
    let set = |&t: &usize| f64::from(u8::from(!steps[t].report.degraded.is_empty()));
    Some(mean(inside.iter().map(set))).filter(|m| !m.is_nan())
}

/// The truth for a held-out clip is the held-out clip of its action in the output style that is nearest in content.
fn counterpart(
    held: &Held<'_>,
    database: &Database<'_>,
    test: usize,
    style: usize,
) -> Result<Option<Counterpart>> {
    let experiment = held.experiment;
    let truths = experiment.counterparts(&held.body, test, style);
    let Some(truth) = truths.into_iter().find(|i| held.clips.contains(i)) else { return Ok(None) };
    let fold = Fold::of(experiment, &held.body, HeldOut { test, truth, other: None, style });
    let (cycles, truth_cycles) = fold.cycles();
    if truth_cycles.is_empty() {
        return Ok(None);
    }
    let at = |t: usize| {
        let place = matched(cycles, t, truth_cycles, fold.shift)?;
        Some(centred(&held.body, &row_at(&fold.truth_rows, place)))
    };
    let clip = &experiment.corpus.examples[test].clip;
    let streamed =
        stream(database, clip, &Request::style(style as u16), &mut ()).map_err(anyhow::Error::msg)?;
    let frames: Vec<_> = streamed.steps.iter().map(|s| s.frame.clone()).collect();
    Ok(Some(Counterpart {
        truth: (0..fold.x.len()).map(at).collect(),
        alone: poses(held, &Clip { frames, ..clip.clone() }),
        unchanged: poses(held, clip),
    }))
}

fn poses(held: &Held<'_>, clip: &Clip) -> Poses {
    held.body.clip_dofs(clip).iter().map(|row| Some(centred(&held.body, row))).collect()
}
