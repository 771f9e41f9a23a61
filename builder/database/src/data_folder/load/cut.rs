//! Clips that are several motions in one file, and bodies that walk in place.

use gestus_motion::{body::Body, clip::Clip, corpus::Corpus, landmarks::Landmarks};
use rayon::prelude::*;

use super::Bound;
use crate::{
    data_folder::left_out::{LeftOut, Reason},
    registration::{contact::low_legs, has_cycles, timeline::Kind},
    stream::course::{Course, leaps},
};

/// Most clips that a message names.
const NAMED: usize = 3;
/// Least part of a whole action's clip that is the action: a calibration pose before or after it is less than the rest.
const NEARLY_ALL: f64 = 0.9;

/// Cuts clips where the body leaps, as it does where takes were joined: a walk into its parts, of an action the longest if
/// that is nearly all of it. Returns a message for each.
pub(super) fn at_leaps(clips: Vec<Bound>, left_out: &mut Vec<LeftOut>) -> (Vec<Bound>, Vec<String>) {
    let (mut whole, mut notes) = (Vec::new(), Vec::new());
    for clip in clips {
        let leaps = leaps(&clip.clip);
        let Some(&first) = leaps.first() else {
            whole.push(clip);
            continue;
        };
        let Clip { name, frames, rate_hz, .. } = &clip.clip;
        let by = (frames[first].root - frames[first - 1].root).norm();
        let more =
            if leaps.len() > 1 { format!(", and {} times more", leaps.len() - 1) } else { String::new() };
        let said =
            format!("{name}: the body leaps by {by:.1} m into frame {first}, at {rate_hz} a second{more}");
        let ends = leaps.iter().copied().chain([frames.len()]);
        let starts = [0].into_iter().chain(leaps.iter().copied());
        let mut parts: Vec<[usize; 2]> = starts.zip(ends).map(|(start, end)| [start, end]).collect();
        if clip.annotation.kind == Kind::Whole {
            parts.retain(|[start, end]| (end - start) as f64 >= NEARLY_ALL * frames.len() as f64);
        }
        let before = whole.len();
        whole.extend(parts.iter().map(|part| clip.part(*part)).filter(|part| part.has_cycles));
        if whole.len() == before {
            let said = format!("{said}, and no part of it can be used");
            left_out.push(LeftOut::new(Reason::Leap, &clip.below, said));
        } else {
            notes.push(format!("{said}: it is cut there"));
        }
    }
    (whole, notes)
}

impl Bound {
    /// The frames from the first of a range to before its end, as a clip of their own.
    fn part(&self, [start, end]: [usize; 2]) -> Self {
        let frames = self.clip.frames[start..end].to_vec();
        let name = if start == 0 { self.clip.name.clone() } else { format!("{}@{start}", self.clip.name) };
        let clip = Clip { name, frames, ..self.clip.clone() };
        Self { has_cycles: has_cycles(&clip, self.annotation.kind), clip, ..self.clone() }
    }
}

/// Moves bodies that walk in place over the ground, at the speed of their feet. Returns what to tell.
pub(super) fn over_the_ground(clips: &mut [Bound]) -> Option<String> {
    let moved: Vec<(String, f64)> = clips
        .par_iter_mut()
        .filter_map(|bound| {
            let clip = &mut bound.clip;
            let marks = Landmarks::find(&clip.skeleton).ok()?;
            if !has_cycles(clip, Kind::Gait) {
                return None;
            }
            let body = Body::of(&Corpus::of_clip(clip)).ok()?;
            let course = Course::find(clip, &body, &low_legs(clip, &marks), None)?;
            course.apply(clip);
            Some((clip.name.clone(), course.speed_m_s))
        })
        .collect();
    let named = moved.iter().take(NAMED).map(|(name, speed)| format!("{name} at {speed:.2} m/s"));
    let mut list: Vec<String> = named.collect();
    list.extend(moved.len().checked_sub(NAMED).filter(|&n| n > 0).map(|more| format!("{more} more clips")));
    (!list.is_empty())
        .then(|| format!("{}: walking in place, so moved over the ground by their feet", list.join(", ")))
}
