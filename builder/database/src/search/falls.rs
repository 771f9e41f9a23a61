//! How fast the distance of a class falls that is too far to matter: core leaves such classes unsearched until they may be
//! near.

use gestus_core::{Config, blob::layout::distances::FALLS, methods::mixture::reach};
use rayon::prelude::*;

use super::features::FeatureSpace;

/// Frames from which the falls of every class are measured.
const STARTS: usize = 200;
/// Part of the falls that is faster than what is stored.
const FASTER: f64 = 0.005;
/// Fewest falls that tell.
const FEWEST: usize = 400;

/// A class as this measures it.
#[derive(Debug, Clone, Copy)]
pub struct ClassRows<'a> {
    /// First captured frame.
    pub first: usize,
    /// Which of its frames a search may return.
    pub searchable: &'a [bool],
}

/// Part of a class's mean squared distance that is left after 1, 2, ... frames, but for the fastest of the classes that
/// have no weight. Every class is searched exhaustively from frames spread evenly over the clips, without the frames of the
/// clip itself. 0 where there is too little motion to tell.
///
/// `codes` are the features as stored, shape `[frames][features]`, `clips` first row and number of rows of each clip.
pub fn falls(
    space: &FeatureSpace,
    codes: &[Vec<i8>],
    clips: &[(usize, usize)],
    classes: &[ClassRows<'_>],
) -> [f32; FALLS] {
    let features: Vec<Vec<f32>> = codes
        .iter()
        .map(|codes| {
            codes.iter().zip(&space.scales).map(|(&code, &scale)| f32::from(code) * scale as f32).collect()
        })
        .collect();
    let starts: Vec<(usize, (usize, usize))> = clips
        .iter()
        .flat_map(|&(first, rows)| {
            (first..(first + rows).saturating_sub(FALLS)).map(move |t| (t, (first, rows)))
        })
        .collect();
    let config = Config::new();
    let reach = reach::limit(&config, classes.len());
    let samples: Vec<[Vec<f32>; FALLS]> = starts
        .par_iter()
        .step_by(starts.len().div_ceil(STARTS).max(1))
        .map(|&(start, own)| {
            let means = |t: usize| -> Vec<f32> {
                classes
                    .iter()
                    .map(|class| mean_distance2(&features, class, own, &features[t], usize::from(config.k)))
                    .collect()
            };
            let before = means(start);
            let least = before.iter().copied().fold(f32::INFINITY, f32::min);
            std::array::from_fn(|i| {
                let pairs = before.iter().zip(means(start + i + 1));
                let far = pairs.filter(|(before, _)| **before > reach * least && before.is_finite());
                far.map(|(before, after)| after / before).collect()
            })
        })
        .collect();
    let mut least = 1.0f32;
    std::array::from_fn(|i| {
        let mut falls: Vec<f32> = samples.iter().flat_map(|sample| sample[i].iter().copied()).collect();
        falls.sort_unstable_by(f32::total_cmp);
        let fall = if falls.len() < FEWEST { 0.0 } else { falls[(FASTER * falls.len() as f64) as usize] };
        // Never more after more frames.
        least = least.min(fall);
        least
    })
}

/// Mean squared distance of the `k` nearest frames of a class to a query, without those of a clip; infinite where there are
/// none.
fn mean_distance2(
    features: &[Vec<f32>],
    class: &ClassRows<'_>,
    (own, rows): (usize, usize),
    query: &[f32],
    k: usize,
) -> f32 {
    let mut all: Vec<f32> = (class.first..)
        .zip(class.searchable)
        .filter(|(row, searchable)| **searchable && !(own..own + rows).contains(row))
        .map(|(row, _)| features[row].iter().zip(query).map(|(a, b)| (a - b) * (a - b)).sum())
        .collect();
    let k = k.min(all.len());
    if k == 0 {
        return f32::INFINITY;
    }
    all.select_nth_unstable_by(k - 1, f32::total_cmp);
    all[..k].iter().sum::<f32>() / k as f32
}
