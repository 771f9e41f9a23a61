//! Sizes and places that no body has: a wrong unit or floor, which would make a database of no use.

use gestus_motion::{
    clip::Clip,
    landmarks::Landmarks,
    statistics::{quantile, sorted},
};

use super::config::FILE_NAME;
use crate::{registration::contact::leg_m, retarget::body::LEGS_M};

/// Lengths of a leg that the hips can be below and above the floor in most frames: on stairs, on a stage.
const BELOW: f64 = 1.0;
const ABOVE: f64 = 10.0;

/// What is wrong with the size or the place of a clip's body, with the line of the configuration that would change it.
/// `floor_m` is the height of its floor, if it is stated.
pub(super) fn problem(clip: &Clip, floor_m: Option<f64>) -> Option<String> {
    // Registration reports a skeleton without legs.
    let leg_m = leg_m(&clip.skeleton, &Landmarks::find(&clip.skeleton).ok()?);
    if !LEGS_M.contains(&leg_m) {
        return Some(format!("its legs are {leg_m:.2} m long: check `unit` in {FILE_NAME}"));
    }
    let floor_m = floor_m?;
    let heights = sorted(clip.frames.iter().map(|frame| frame.root.y - floor_m));
    let hips_m = quantile(&heights, 0.5)?;
    let is_near = (-BELOW * leg_m..=ABOVE * leg_m).contains(&hips_m);
    (!is_near).then(|| {
        format!(
            "its hips are {hips_m:.2} m above the floor at {floor_m} m, and its legs {leg_m:.2} m long: check `floor` and \
             `[floors]` in {FILE_NAME}, in metres"
        )
    })
}
