//! How fast the distance of a class falls that is too far to matter: core leaves such classes unsearched until they may be
//! near.

use gestus_core::{Config, blob::layout::distances::FALLS, methods::mixture::candidates};
use rayon::prelude::*;

use super::graph::{ClassFeatures, exact_knn};
use crate::blob::classes::k_cap;

/// Frames from which the falls of every class are measured.
const STARTS: usize = 200;
/// Part of the falls that is faster than what is stored.
const FASTER: f64 = 0.005;
/// Fewest falls that tell.
const MIN_FALLS: usize = 400;

/// Part of a class's mean squared distance that is left after 1, 2, ... frames, but for the fastest of the classes that
/// have no weight. Every class is searched exhaustively from frames spread evenly over the clips, without the frames of the
/// clip itself. 0 where there is too little motion to tell.
///
/// `classes` come with their first captured frame, `clips` are first row and number of rows of each.
pub fn falls(clips: &[(usize, usize)], classes: &[(usize, ClassFeatures<'_>)]) -> [f32; FALLS] {
    let starts: Vec<(usize, (usize, usize))> = clips
        .iter()
        .flat_map(|&(first, rows)| {
            (first..(first + rows).saturating_sub(FALLS)).map(move |t| (t, (first, rows)))
        })
        .collect();
    let config = Config::new();
    let reach = candidates::relative_cutoff(&config, classes.len());
    let samples: Vec<[Vec<f32>; FALLS]> = starts
        .par_iter()
        .step_by(starts.len().div_ceil(STARTS).max(1))
        .map(|&(start, own)| {
            let means = |t: usize| -> Vec<f32> {
                let query = query(classes, t);
                classes
                    .iter()
                    .map(|class| mean_distance2(class, own, &query, usize::from(config.k)))
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
        let fall = if falls.len() < MIN_FALLS { 0.0 } else { falls[(FASTER * falls.len() as f64) as usize] };
        // Never more after more frames.
        least = least.min(fall);
        least
    })
}

/// A captured frame's feature, in steps of the scales.
fn query(classes: &[(usize, ClassFeatures<'_>)], t: usize) -> Vec<f32> {
    let of_class = classes.iter().find_map(|(first, class)| class.codes.get(t.checked_sub(*first)?));
    of_class.into_iter().flatten().map(|&code| f32::from(code)).collect()
}

/// Mean squared distance of the `k` nearest frames of a class to a query, fewer in a small class as in the core, without those
/// of a clip; infinite where there are none.
pub(super) fn mean_distance2(
    (first, class): &(usize, ClassFeatures<'_>),
    (own, rows): (usize, usize),
    query: &[f32],
    k: usize,
) -> f32 {
    let others = |(i, searchable): (usize, &bool)| *searchable && !(own..own + rows).contains(&(first + i));
    let searchable: Vec<bool> = class.searchable.iter().enumerate().map(others).collect();
    let k = k.min(k_cap(class.searchable.iter().filter(|s| **s).count()));
    let nearest = exact_knn(&ClassFeatures { searchable: &searchable, ..*class }, query, k);
    if nearest.is_empty() {
        return f32::INFINITY;
    }
    nearest.iter().map(|n| n.0).sum::<f32>() / nearest.len() as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Classes of one feature, a clip each; `code` of a class and frame.
    fn falls_of(classes: i32, frames: i32, code: impl Fn(i32, i32) -> i32) -> [f32; FALLS] {
        let codes: Vec<Vec<Vec<i8>>> =
            (0..classes).map(|c| (0..frames).map(|t| vec![code(c, t) as i8]).collect()).collect();
        let searchable = vec![true; frames as usize];
        let firsts = (0..classes as usize).map(|c| c * frames as usize);
        let clips: Vec<(usize, usize)> = firsts.clone().map(|first| (first, frames as usize)).collect();
        let of_class = |codes| ClassFeatures { codes, weights: &[1.0], searchable: &searchable };
        let classes: Vec<_> = firsts.zip(codes.iter().map(|codes| of_class(codes))).collect();
        falls(&clips, &classes)
    }

    #[test]
    fn classes_that_stay_where_they_are_do_not_fall() {
        assert_eq!(falls_of(6, 100, |c, _| 20 * c), [1.0; FALLS]);
    }

    #[test]
    fn distances_to_a_moving_clip_fall_more_with_every_frame() {
        let falls = falls_of(6, 100, |c, t| 10 * c + t / 4);
        assert!(
            falls.is_sorted_by(|a, b| a >= b) && falls[0] < 1.0 && falls[FALLS - 1] < falls[0],
            "{falls:?}"
        );
        assert!(falls.iter().all(|fall| (0.0..=1.0).contains(fall)), "{falls:?}");
    }

    #[test]
    fn small_classes_have_few_neighbors() {
        let codes: Vec<Vec<i8>> = (0..40).map(|t| vec![t]).collect();
        let class = ClassFeatures { codes: &codes, weights: &[1.0], searchable: &[true; 40] };
        // 0, 1, 4, 9 and 16: a class of 40 frames has at most 5.
        assert_eq!(mean_distance2(&(0, class), (0, 0), &[0.0], 8), 6.0);
    }

    #[test]
    fn too_few_far_classes_tell_nothing() {
        assert_eq!(falls_of(2, 100, |c, _| 100 * c), [0.0; FALLS]);
        assert_eq!(falls_of(6, FALLS as i32, |c, t| 10 * c + t / 4), [0.0; FALLS]);
    }
}
