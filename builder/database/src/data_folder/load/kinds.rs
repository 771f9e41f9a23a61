//! Kinds of actions where the clips say another than the action's name. What the configuration says stays.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::Bound;
use crate::{
    data_folder::config::{Config, FILE_NAME},
    registration::{has_cycles, timeline::Kind, walked},
};

/// Share of a clip in gait cycles that get along, from which its body walks: walks and runs of the Bandai-Namco folders have
/// 0.7 on average, a dance 0.23, and waves, bows, punches and kicks none.
const WALKS: f64 = 0.4;
/// Share of an action's clips that walk, from which it is a gait.
const NEARLY_ALL: f64 = 0.8;

/// Takes an action whose name is no gait's as one if nearly all its clips walk, and one whose name is a gait's as a whole
/// if no clip has a gait cycle. Returns a message for each.
pub(super) fn of_motion(config: &Config, clips: &mut [Bound]) -> Vec<String> {
    let mut actions = BTreeMap::<String, (Kind, Vec<usize>)>::new();
    for (i, clip) in clips.iter().enumerate() {
        let annotation = &clip.annotation;
        if !config.kind.contains_key(&annotation.action) {
            let of = actions.entry(annotation.action.clone()).or_insert((annotation.kind, Vec::new()));
            of.1.push(i);
        }
    }
    let mut notes = Vec::new();
    for (action, (kind, places)) in actions {
        let (other, said) = match kind {
            Kind::Gait if places.iter().all(|&i| !clips[i].has_cycles) => (
                Kind::Whole,
                "no clip has a gait cycle, so each is taken as a whole, from its start to its end, and if they walk or run \
                 the feet will slide: a cycle takes two strikes of the left foot, so give longer clips",
            ),
            Kind::Whole if nearly_all_walk(clips, &places) => (
                Kind::Gait,
                "its clips walk or run, so it is taken as a gait, cut at the strikes of the feet",
            ),
            _ => continue,
        };
        notes.push(format!(
            "action {action}: {said} (to choose: `[kind]` with `{action} = \"gait\"` or `{action} = \"whole\"` in {FILE_NAME})"
        ));
        for i in places {
            clips[i].annotation.kind = other;
            clips[i].has_cycles = has_cycles(&clips[i].clip, other);
        }
    }
    notes
}

/// Whether nearly all of those clips walk.
fn nearly_all_walk(clips: &[Bound], places: &[usize]) -> bool {
    let walk = places.par_iter().filter(|&&i| walked(&clips[i].clip) >= WALKS).count();
    walk as f64 >= NEARLY_ALL * places.len() as f64
}
