//! The floors of a folder's clips. A database is on a floor at zero, so a clip on another is moved there.
//!
//! The clips have one skeleton, so that its unknown soles shift what is found in all of them alike: heights are
//! relative to those of the clips that are on a floor at zero already. Clips on one floor stay together: they are moved by the median of
//! what was found for each. Clips whose floor is within 4 cm of zero stay as they are: calibrations differ (over the 561
//! clips of the two Bandai-Namco folders the heights found differ by 2.5 cm). So do clips in which nothing stands.
//!
//! Cost: forward kinematics of each frame.

use rayon::prelude::*;

use super::config::FILE_NAME;
use crate::{
    list::first_of,
    registration::floor::{LEVEL_M, Supports, standing},
};
use gestus_motion::{
    clip::Clip,
    landmarks::Landmarks,
    statistics::{quantile, sorted},
};

/// Moves each clip onto a floor at zero, from the height that is given for it or found. Returns by how much each was
/// lowered, metres.
pub(super) fn lower(clips: &mut [(&mut Clip, Option<f64>)]) -> Vec<f64> {
    let Some(marks) = clips.first().and_then(|(clip, _)| Landmarks::find(&clip.skeleton).ok()) else {
        // Registration reports the error.
        return vec![0.0; clips.len()];
    };
    let supports = Supports::of_landmarks(clips[0].0, &marks);
    let level = |(clip, told): &(&mut Clip, Option<f64>)| match told {
        Some(_) => None,
        // Bodies of one folder may differ in size.
        None => standing(clip, &Supports::of_landmarks(clip, &marks)),
    };
    let found: Vec<Option<f64>> = clips.par_iter().map(level).collect();
    let floors = floors(&found, supports.near_m(), LEVEL_M * supports.scale());
    let heights: Vec<f64> =
        clips.iter().zip(floors).map(|((_, told), floor)| told.unwrap_or(floor)).collect();
    for ((clip, _), height) in clips.iter_mut().zip(&heights).filter(|(_, height)| **height != 0.0) {
        clip.frames.iter_mut().for_each(|frame| frame.root.y -= height);
    }
    heights
}

/// The floor of each clip, from the heights at which their soles seem to stand; `near_m` is how far those of a floor at zero
/// may be from zero, `same_m` from each other.
fn floors(found: &[Option<f64>], near_m: f64, same_m: f64) -> Vec<f64> {
    let median = |values: &[f64]| quantile(&sorted(values.iter().copied()), 0.5).unwrap_or(0.0);
    let at_zero: Vec<f64> = found.iter().flatten().copied().filter(|height| height.abs() <= near_m).collect();
    let zero = median(&at_zero);
    let mut floors = vec![0.0; found.len()];
    let mut others: Vec<(f64, usize)> =
        found.iter().enumerate().filter_map(|(i, height)| Some(((*height)? - zero, i))).collect();
    others.retain(|(height, _)| height.abs() > same_m);
    others.sort_by(|a, b| a.0.total_cmp(&b.0));
    for together in others.chunk_by(|a, b| b.0 - a.0 <= same_m) {
        let heights: Vec<f64> = together.iter().map(|(height, _)| *height).collect();
        together.iter().for_each(|(_, i)| floors[*i] = median(&heights));
    }
    floors
}

/// A line about the clips that were moved.
pub(super) fn note(floors: &[(String, f64)]) -> Option<String> {
    let said = |(name, height): &(String, f64)| format!("{name} is on a floor at {height:.2} m");
    let list = first_of(floors.iter().map(said), "more clips on others")?;
    Some(format!(
        "{list}: moved to one at zero (`floor`, or `[floors]` for single files, in {FILE_NAME} states another)"
    ))
}
