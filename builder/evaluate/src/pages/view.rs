//! The page of a translated clip: input and output side by side, with contacts, class proportions and time steps.

use anyhow::Result;
use gestus_core::Database;

use crate::pages::{self, Page, Proportions, Track, times_at};
use gestus_database::{
    blob::export::class_names,
    registration::contact::contacts,
    stream::{Streamed, translate::figures},
};
use gestus_motion::{
    clip::{Clip, Frame},
    landmarks::Landmarks,
};

type Contacts = Vec<[bool; 2]>;

/// A translated clip.
#[derive(Debug)]
pub struct Scene<'a> {
    /// Heading.
    pub title: String,
    /// The input on the database's skeleton.
    pub input: &'a Clip,
    /// The output.
    pub streamed: &'a Streamed,
}

/// The page of some translated clips.
///
/// # Errors
/// Not after `open`.
pub fn page(database: &Database<'_>, title: &str, scenes: &[Scene<'_>]) -> Result<String> {
    let manifest = database.manifest()?;
    let labels: Vec<String> = database
        .classes()
        .map(|c| class_names(&manifest, c).map(|name| name.unwrap_or("?")).join(" "))
        .collect();
    // The tracks borrow from these until the page is rendered.
    let parts: Vec<(Contacts, Vec<Frame>, Contacts)> = scenes
        .iter()
        .map(|scene| {
            let input =
                Landmarks::find(&scene.input.skeleton).map(|l| contacts(scene.input, &l)).unwrap_or_default();
            let frames = scene.streamed.steps.iter().map(|s| s.frame.clone()).collect();
            (input, frames, scene.streamed.steps.iter().map(|s| s.report.contacts).collect())
        })
        .collect();
    let scenes = scenes
        .iter()
        .zip(&parts)
        .map(|(scene, (input_contacts, frames, output_contacts))| {
            let figures = figures(scene.streamed);
            let facts =
                ["frames", "seconds", "median_us", "classes_mean", "visits_mean", "degraded", "digest"]
                    .map(|key| (key.to_owned(), crate::report::table::text(figures.get(key))));
            let values = scene.streamed.steps.iter().map(|s| {
                let mut row = vec![0.0; labels.len()];
                for share in &s.report.classes {
                    row[usize::from(share.class)] = share.proportion;
                }
                row
            });
            pages::Scene {
                title: scene.title.clone(),
                subtitle: format!(
                    "input {}, one pose at a time; only the poses of the input are known",
                    scene.input.name
                ),
                facts: facts.to_vec(),
                tracks: vec![
                    Track {
                        label: "input".into(),
                        skeleton: &scene.input.skeleton,
                        times_s: times_at(scene.input.rate_hz, scene.input.frames.len()),
                        frames: &scene.input.frames,
                        contacts: input_contacts,
                    },
                    Track {
                        label: "output".into(),
                        skeleton: &scene.input.skeleton,
                        times_s: scene.streamed.times(),
                        frames,
                        contacts: output_contacts,
                    },
                ],
                proportions: Some(Proportions { labels: labels.clone(), values: values.collect() }),
                steps_s: Some(scene.streamed.steps.iter().map(|s| f64::from(s.report.step_s)).collect()),
            }
        })
        .collect();
    Ok(pages::render(&Page { title: title.to_owned(), scenes }))
}
