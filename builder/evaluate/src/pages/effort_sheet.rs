//! The page of an effort sheet, on which each fragment and blend can be seen under its number.
//!
//! It does not show estimates: people who label should look at the motion alone.

use crate::pages::{Page, Scene, Track, render, times_at};
use gestus_database::effort::{fragment::Library, sheet::Sheet};

/// The page of a sheet of that library.
pub fn page(library: &Library, sheet: &Sheet) -> String {
    let frames: Vec<_> = sheet.motions.iter().map(|m| library.frames(m)).collect();
    let scenes = sheet.rows
        .iter()
        .zip(&frames)
        .map(|(row, frames)| Scene {
            title: row.id.clone(),
            subtitle: "What is its flow (free -3 to bound 3), weight (light -3 to strong 3), time (sustained -3 to sudden 3)?".into(),
            facts: vec![("action".into(), row.action.clone()), ("frames".into(), frames.len().to_string())],
            tracks: vec![Track {
                label: row.id.clone(),
                skeleton: &library.body.skeleton,
                times_s: times_at(library.rate_hz, frames.len()),
                frames,
                contacts: &[],
                over: false,
            }],
            ..Scene::default()
        })
        .collect();
    render(&Page { title: "Effort of fragments".into(), scenes })
}
