//! What input of a class is like: how near it is to clips that it is not part of, and how fast it goes. The core passes
//! input on that is not.

use gestus_core::{
    Config,
    blob::Familiar,
    output::trust::{LEAD_S, SMOOTHED_S},
};
use gestus_motion::statistics::{quantile, sorted};
use rayon::prelude::*;

use super::{falls::mean_distance2, graph::ClassFeatures};

/// Most frames of a class whose distance is measured.
const FRAMES: usize = 120;
/// Part of the frames that is nearer than what is stored.
const NEARER: f64 = 0.9;
/// Part of the frames whose speed is beyond what is stored, at each end.
const BEYOND: f64 = 0.01;

/// A class: its action, its first captured frame, and the features of its frames.
pub type OfClass<'a> = (usize, (usize, ClassFeatures<'a>));

/// What input of each class is like. `clips` are first row and number of rows of each, `velocities` those of the root of
/// each row, forward and left, m/s.
///
/// Frames of a class are searched exhaustively in all classes of the action, without the frames of their own clip; 0 where
/// the action has no other clip. Speeds are those of the action in any style.
pub fn familiar(
    clips: &[(usize, usize)],
    classes: &[OfClass<'_>],
    velocities: &[[f64; 2]],
    rate_hz: f64,
) -> Vec<Familiar> {
    let k = usize::from(Config::new().k);
    let lead = (f64::from(LEAD_S) * rate_hz) as usize;
    let each: Vec<Familiar> = classes
        .par_iter()
        .map(|(action, (first, class))| {
            let rows = *first..*first + class.codes.len();
            let own: Vec<(usize, usize)> = clips.iter().copied().filter(|c| rows.contains(&c.0)).collect();
            let frames: Vec<(usize, (usize, usize))> = own
                .iter()
                .flat_map(|&(start, count)| {
                    (start + lead.min(count)..start + count).map(move |t| (t, (start, count)))
                })
                .collect();
            let distances = frames
                .iter()
                .step_by(frames.len().div_ceil(FRAMES).max(1))
                .map(|&(t, clip)| {
                    let query: Vec<f32> = class.codes[t - first].iter().map(|&c| f32::from(c)).collect();
                    let same = classes.iter().filter(|(other, _)| other == action);
                    let nearest = same.map(|(_, class)| mean_distance2(class, clip, &query, k));
                    f64::from(nearest.fold(f32::INFINITY, f32::min))
                })
                .filter(|distance| distance.is_finite());
            let distances = sorted(distances);
            let speeds = sorted(own.iter().flat_map(|&(start, count)| {
                smoothed(&velocities[start + lead.min(count)..start + count], rate_hz)
            }));
            let at = |ascending: &[f64], part: f64| quantile(ascending, part).unwrap_or(0.0) as f32;
            Familiar {
                far: at(&distances, NEARER),
                speeds: [BEYOND, 1.0 - BEYOND].map(|part| at(&speeds, part)),
            }
        })
        .collect();
    // A body changes from the speed of one style to that of another.
    let widest = |class: usize| {
        let same = classes.iter().zip(&each).filter(|((action, _), _)| *action == classes[class].0);
        same.fold(each[class].speeds, |[slowest, fastest], (_, other)| {
            [slowest.min(other.speeds[0]), fastest.max(other.speeds[1])]
        })
    };
    each.iter().enumerate().map(|(class, own)| Familiar { speeds: widest(class), ..*own }).collect()
}

/// Speeds over the ground, as the core smooths them.
fn smoothed(velocities: &[[f64; 2]], rate_hz: f64) -> Vec<f64> {
    let (mut speed, mut age) = (0.0, 0.0f64);
    let smoothed = f64::from(SMOOTHED_S);
    let of_frame = |v: &[f64; 2]| {
        age = (age + 1.0 / rate_hz).min(smoothed);
        speed += (v[0].hypot(v[1]) - speed) / (rate_hz * age);
        speed
    };
    velocities.iter().map(of_frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clips of 60 frames a class, one feature: class c at code 8 c, its second clip `off` higher.
    fn of(off: i8, actions: [usize; 2]) -> [Familiar; 2] {
        let codes: Vec<Vec<Vec<i8>>> =
            (0..2).map(|c| (0..120).map(|t| vec![8 * c + if t < 60 { 0 } else { off }]).collect()).collect();
        let searchable = [true; 120];
        let clips = [(0, 60), (60, 60), (120, 60), (180, 60)];
        let of_class =
            |c: usize| ClassFeatures { codes: &codes[c], weights: &[0.25], searchable: &searchable };
        let classes = [(actions[0], (0, of_class(0))), (actions[1], (120, of_class(1)))];
        let velocities: Vec<[f64; 2]> =
            (0..240).map(|t| if t < 120 { [3.0, 4.0] } else { [0.5, 0.0] }).collect();
        familiar(&clips, &classes, &velocities, 30.0).try_into().unwrap()
    }

    #[test]
    fn a_clip_is_as_far_as_the_other_clip_of_its_class() {
        // 4 codes of half a metre: 2 m, squared.
        for familiar in of(4, [0, 1]) {
            assert_eq!(familiar.far, 4.0);
        }
        assert_eq!(of(4, [0, 1])[0].speeds, [5.0; 2]);
        assert_eq!(of(4, [0, 1])[1].speeds, [0.5; 2]);
    }

    #[test]
    fn the_nearest_class_of_the_action_counts() {
        // Clips lie 56 codes from their class's other one, and 8 from one of the other class.
        assert_eq!(of(56, [0, 1]).map(|class| class.far), [784.0; 2]);
        assert_eq!(of(56, [0, 0]).map(|class| class.far), [16.0; 2]);
    }
}
