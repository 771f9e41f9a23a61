//! The page of an outputs sheet, on which each output can be seen beside its input, with the Effort that was wanted.

use crate::pages::{Page, Scene, Track, render};
use gestus_database::effort::{model::Model, outputs::Row, sheet::caveat, synthesize::Output};
use gestus_motion::clip::Clip;

/// The page of the outputs of some clips, in the order of [`outputs`](gestus_database::effort::outputs::outputs).
pub fn page(model: &Model, clips: &[Clip], outputs: &[(Row, Output)]) -> String {
    let each = outputs.len() / clips.len().max(1);
    let delivered: Vec<Clip> = outputs
        .iter()
        .enumerate()
        .map(|(n, (_, output))| Clip { frames: output.frames.clone(), ..clips[n / each].clone() })
        .collect();
    let scenes = outputs
        .iter()
        .zip(&delivered)
        .enumerate()
        .map(|(n, ((row, output), clip))| Scene {
            title: format!("{}: {}", row.id, row.target()),
            subtitle: "Is the output consistent with this target (flow free -3 to bound 3, weight light -3 to strong 3, time \
                       sustained -3 to sudden 3)?"
                .into(),
            facts: vec![("input".into(), row.clip.clone()), ("labels".into(), caveat(model.source).into())],
            tracks: vec![Track::of("input", &clips[n / each], &[]), Track::of("output", clip, &output.stands)],
            ..Scene::default()
        })
        .collect();
    render(&Page { title: "Effort of outputs".into(), scenes })
}
