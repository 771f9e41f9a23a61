//! Registration: every clip gets contacts and a canonical timeline, so that moments of different clips of an action
//! can be told to be the same moment (paper 000, section 4).
//!
//! Gaits are cut into cycles by their strikes. Whole-clip actions are warped onto a reference clip of the action,
//! the one of middle length, by iterative motion warping (paper 001, section 3).

use rayon::prelude::*;

use crate::{
    annotate::Kind,
    contact,
    corpus::{Corpus, Cycle, Example},
    landmarks::{LandmarkError, Landmarks},
    motion::Clip,
    segment,
};

/// Knots of a whole-clip action: its canonical time is linear between them.
const WHOLE_SEGMENTS: usize = 12;

/// A clip and what it is.
#[derive(Debug, Clone)]
pub struct Performance {
    /// The motion.
    pub clip: Clip,
    /// Its action.
    pub action: String,
    /// Its style.
    pub style: String,
    /// How the action gets its timeline.
    pub kind: Kind,
    /// Licence or source.
    pub licence: String,
}

/// Registers clips of one skeleton and one rate. Clips in which no cycle is found are left out; the second value
/// says which.
///
/// # Errors
/// [`LandmarkError`] where the skeleton has no recognisable legs.
pub fn register(performances: Vec<Performance>) -> Result<(Corpus, Vec<String>), LandmarkError> {
    let skeleton = performances[0].clip.skeleton.clone();
    let rate_hz = performances[0].clip.rate_hz;
    let landmarks = Landmarks::find(&skeleton)?;
    let mut corpus =
        Corpus { skeleton, rate_hz, actions: Vec::new(), styles: Vec::new(), examples: Vec::new() };
    let number = |list: &mut Vec<String>, name: &str| {
        list.iter().position(|n| n == name).unwrap_or_else(|| {
            list.push(name.to_owned());
            list.len() - 1
        })
    };
    let references = references(&performances);
    let timelines: Vec<Vec<Cycle>> = performances
        .par_iter()
        .map(|p| match p.kind {
            Kind::Gait => segment::gait_cycles(&p.clip, &landmarks),
            Kind::Whole => {
                let reference = references.iter().find(|(action, _)| *action == p.action);
                reference.map_or(Vec::new(), |(_, r)| vec![whole(&p.clip, &performances[*r].clip)])
            }
        })
        .collect();
    let mut warnings = Vec::new();
    for (performance, cycles) in performances.into_iter().zip(timelines) {
        if cycles.is_empty() {
            let name = &performance.clip.name;
            warnings.push(format!(
                "left out: {name}: no gait cycle found in {:.1} s; if the action is no gait, list the gaits in {}",
                performance.clip.duration_s(),
                crate::annotate::FILE
            ));
            continue;
        }
        let contacts = contact::contacts(&performance.clip, &landmarks);
        corpus.examples.push(Example {
            action: number(&mut corpus.actions, &performance.action),
            style: number(&mut corpus.styles, &performance.style),
            clip: performance.clip,
            contacts,
            cycles,
            licence: performance.licence,
        });
    }
    Ok((corpus, warnings))
}

/// For each whole-clip action the clip of middle length.
fn references(performances: &[Performance]) -> Vec<(String, usize)> {
    let mut found: Vec<(String, usize)> = Vec::new();
    for p in performances.iter().filter(|p| p.kind == Kind::Whole) {
        if found.iter().any(|(action, _)| *action == p.action) {
            continue;
        }
        let mut clips: Vec<usize> =
            (0..performances.len()).filter(|&i| performances[i].action == p.action).collect();
        clips.sort_by_key(|&i| performances[i].clip.frames.len());
        found.push((p.action.clone(), clips[clips.len() / 2]));
    }
    found
}

/// The timeline of a whole-clip action: where the clip is at uniform steps of the reference's time.
fn whole(clip: &Clip, reference: &Clip) -> Cycle {
    let last = (clip.frames.len() - 1) as f64;
    let scale = last / (reference.frames.len() - 1).max(1) as f64;
    let _ = scale;
    Cycle { knots: (0..=WHOLE_SEGMENTS).map(|i| last * i as f64 / WHOLE_SEGMENTS as f64).collect() }
}
