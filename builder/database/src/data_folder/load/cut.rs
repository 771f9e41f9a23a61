//! Clips that are several motions in one file, bodies that walk in place, and bodies that do not move.

use gestus_motion::{
    body::Body,
    clip::{Clip, Frame},
    corpus::Corpus,
    landmarks::Landmarks,
};
use rayon::prelude::*;

use super::Bound;
use crate::{
    data_folder::left_out::{LeftOut, Reason},
    list::first_of,
    registration::{contact::low_legs, has_cycles, timeline::Kind},
    stream::course::{Course, leaps},
};

/// Turn of a joint that is none, radians.
const STILL_RAD: f64 = 1e-4;
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
        let more = match leaps.len() - 1 {
            0 => String::new(),
            1 => ", and in 1 more place".to_owned(),
            more => format!(", and in {more} more places"),
        };
        let said =
            format!("{name}: the body leaps by {by:.1} m at frame {first} ({rate_hz} frames a second){more}");
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
    let named = moved.into_iter().map(|(name, speed)| format!("{name} at {speed:.2} m/s"));
    let list = first_of(named, "more clips")?;
    Some(format!("{list}: walking in place, so moved over the ground by their feet"))
}

/// What to tell about clips in which no joint but the root turns.
pub(super) fn without_motion(clips: &[Bound]) -> Option<String> {
    let stiff = |bound: &&Bound| {
        let frames = &bound.clip.frames;
        let turns = |frame: &Frame| {
            let mut joints = frame.rotations.iter().zip(&frames[0].rotations).skip(1);
            joints.any(|(a, b)| a.angle_to(b) > STILL_RAD)
        };
        !frames.iter().any(turns)
    };
    let list = first_of(clips.iter().filter(stiff).map(|bound| bound.clip.name.clone()), "more clips")?;
    Some(format!(
        "{list}: no joint but the root turns, as where a motion was lost; the database learns such clips too: take them out \
         if they are no motion"
    ))
}
