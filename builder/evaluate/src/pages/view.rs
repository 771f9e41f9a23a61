//! The page of a translated clip: input and output side by side as the files have them, with contacts, class proportions
//! and time steps. Over the output lies the body of the database that was streamed, faint.

use anyhow::Result;
use gestus_core::Database;

use crate::pages::{self, Page, Proportions, Track};
use gestus_database::{
    blob::export::class_names,
    registration::contact::contacts,
    stream::{
        Request, Streamed,
        translate::{degraded_words, figures},
    },
};
use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    landmarks::Landmarks,
};

type Contacts = Vec<[bool; 2]>;

/// A translated clip.
#[derive(Debug)]
pub struct Scene<'a> {
    /// Heading.
    pub title: String,
    /// The verdict on the clip; may be empty.
    pub words: String,
    /// The input on its own skeleton, Y up, on a floor at zero.
    pub given: Clip,
    /// The output that was delivered, likewise.
    pub output: Clip,
    /// The database's skeleton.
    pub body: &'a Skeleton,
    /// The stream of it.
    pub streamed: &'a Streamed,
}

/// What is known of the input besides its poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Known {
    /// Nothing.
    Poses,
    /// Its action.
    Action,
    /// Its style.
    Style,
    /// Both.
    Both,
}

impl Known {
    /// What a request says about the input.
    pub const fn of(request: &Request) -> Self {
        match (request.action.is_some(), request.input_style.is_some()) {
            (false, false) => Self::Poses,
            (true, false) => Self::Action,
            (false, true) => Self::Style,
            (true, true) => Self::Both,
        }
    }

    const fn words(self) -> &'static str {
        match self {
            Self::Poses => "only the poses of the input are known",
            Self::Action => "its action is known, its style is not",
            Self::Style => "its style is known, its action is not",
            Self::Both => "its action and style are known",
        }
    }
}

/// The page of some translated clips of which only the poses were known.
///
/// # Errors
/// A manifest that can't be read, which `open` excludes.
pub fn page(database: &Database<'_>, title: &str, scenes: &[Scene<'_>]) -> Result<String> {
    page_of(database, title, scenes, Known::Poses)
}

/// The page of some translated clips.
///
/// # Errors
/// A manifest that can't be read, which `open` excludes.
pub fn page_of(database: &Database<'_>, title: &str, scenes: &[Scene<'_>], known: Known) -> Result<String> {
    let manifest = database.manifest()?;
    let labels: Vec<String> = database
        .classes()
        .map(|c| class_names(&manifest, c).map(|name| name.unwrap_or("?")).join(" "))
        .collect();
    // The tracks borrow from these until the page is rendered.
    let parts: Vec<(Contacts, Vec<Frame>, Contacts)> = scenes
        .iter()
        .map(|scene| {
            let input = Landmarks::find(&scene.given.skeleton)
                .map(|l| contacts(&scene.given, &l))
                .unwrap_or_default();
            let frames = scene.streamed.steps.iter().map(|s| s.frame.clone()).collect();
            (input, frames, scene.streamed.steps.iter().map(|s| s.report.contacts).collect())
        })
        .collect();
    let scenes = scenes
        .iter()
        .zip(&parts)
        .map(|(scene, (input_contacts, frames, output_contacts))| {
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
                    "input {}, one pose at a time; {}. {}",
                    scene.given.name,
                    known.words(),
                    scene.words
                ),
                facts: facts(scene.streamed),
                tracks: vec![
                    Track::of("input", &scene.given, input_contacts),
                    Track::of("output", &scene.output, &[]),
                    Track {
                        label: "database's body".into(),
                        skeleton: scene.body,
                        times_s: scene.streamed.times(),
                        frames,
                        contacts: output_contacts,
                        over: true,
                    },
                ],
                proportions: Some(Proportions { labels: labels.clone(), values: values.collect() }),
                steps_s: Some(scene.streamed.steps.iter().map(|s| f64::from(s.report.step_s)).collect()),
            }
        })
        .collect();
    Ok(pages::render(&Page { title: title.to_owned(), scenes }))
}

/// The key facts of a stream, with their units.
fn facts(streamed: &Streamed) -> Vec<(String, String)> {
    let figures = figures(streamed);
    let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
    let frames = streamed.steps.len();
    let facts = [
        ("Length", format!("{:.2} s, {frames} frames", number("seconds"))),
        ("Time for a frame, median, where this page was made", format!("{:.0} µs", number("median_us"))),
        ("Classes mixed in a frame, mean", format!("{:.2}", number("classes_mean"))),
        ("Distances computed in a frame, mean", format!("{:.0}", number("visits_mean"))),
        ("Frames with a flag in their report", degraded_words(&figures)),
        ("Digest of all output bits", figures["digest"].as_str().unwrap_or("").to_owned()),
    ];
    facts.map(|(name, value)| (name.to_owned(), value)).to_vec()
}
