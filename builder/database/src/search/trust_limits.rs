//! What input of a class is like: how near it is to clips that it is not part of, and how fast it goes. The core passes
//! input on that is not. And how fast the joints of the class turn, which bounds the output where it begins.

use gestus_core::{
    Config,
    blob::{TrustLimits, layout::dof},
    output::trust::{LEAD_S, SMOOTHED_S},
};
use gestus_motion::{
    body::about_y,
    statistics::{quantile, sorted},
};
use nalgebra::{UnitQuaternion, Vector3};
use rayon::prelude::*;

use super::{falls::mean_distance2, graph::ClassFeatures};

/// Most frames of a class whose distance is measured.
const FRAMES: usize = 120;
/// Part of the frames that is nearer than what is stored.
const NEARER: f64 = 0.9;
/// Half of the part of a class's only clip that is held out about a frame, seconds, and the part of its frames that is
/// nearer than what is stored: beginning and end of a clip are like nothing else in it.
const HELD_OUT_S: f64 = 0.25;
const NEARER_ALONE: f64 = 0.8;
/// Part of the frames whose speed is beyond what is stored, at each end.
const BEYOND: f64 = 0.01;

/// A class: its action, its first captured frame, and the features of its frames.
pub type OfClass<'a> = (usize, (usize, ClassFeatures<'a>));

/// What input of each class is like. `clips` are first row and number of rows of each. Of each row come the velocity of the
/// root, forward and left, m/s, and the speed of the fastest joint ([`turning`]).
///
/// Frames of a class are searched exhaustively in all classes of the action, without the frames of their own clip, or, where
/// it is the class's only one, without those within a quarter of a second: without the whole clip they would be as far as
/// the other styles are, and unlike input nearer. Speeds are those of the action in any style.
pub fn trust_limits(
    clips: &[(usize, usize)],
    classes: &[OfClass<'_>],
    (velocities, turning): (&[[f64; 2]], &[f64]),
    rate_hz: f64,
) -> Vec<TrustLimits> {
    let k = usize::from(Config::new().k);
    let lead = (f64::from(LEAD_S) * rate_hz) as usize;
    let near = (HELD_OUT_S * rate_hz) as usize;
    let each: Vec<TrustLimits> = classes
        .par_iter()
        .map(|(action, (first, class))| {
            let rows = *first..*first + class.codes.len();
            let own: Vec<(usize, usize)> = clips.iter().copied().filter(|c| rows.contains(&c.0)).collect();
            let alone = own.len() == 1;
            // Each with the first and the number of the frames that are held out with it.
            let frames: Vec<(usize, (usize, usize))> = own
                .iter()
                .flat_map(|&(start, count)| {
                    (start + lead.min(count)..start + count).map(move |t| {
                        let from = if alone { t.saturating_sub(near).max(start) } else { start };
                        let to = if alone { (t + near + 1).min(start + count) } else { start + count };
                        (t, (from, to - from))
                    })
                })
                .collect();
            let distances = frames
                .iter()
                .step_by(frames.len().div_ceil(FRAMES).max(1))
                .map(|&(t, held_out)| {
                    let query: Vec<f32> = class.codes[t - first].iter().map(|&c| f32::from(c)).collect();
                    let same = classes.iter().filter(|(other, _)| other == action);
                    let nearest = same.map(|(_, class)| mean_distance2(class, held_out, &query, k));
                    f64::from(nearest.fold(f32::INFINITY, f32::min))
                })
                .filter(|distance| distance.is_finite());
            let distances = sorted(distances);
            let speeds = sorted(own.iter().flat_map(|&(start, count)| {
                smoothed(&velocities[start + lead.min(count)..start + count], rate_hz)
            }));
            let turns = sorted(own.iter().flat_map(|&(start, count)| turning[start..start + count].to_vec()));
            let at = |ascending: &[f64], part: f64| quantile(ascending, part).unwrap_or(0.0) as f32;
            TrustLimits {
                far: at(&distances, if alone { NEARER_ALONE } else { NEARER }),
                speeds: [BEYOND, 1.0 - BEYOND].map(|part| at(&speeds, part)),
                turning: at(&turns, 1.0 - BEYOND),
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
    each.iter().enumerate().map(|(class, own)| TrustLimits { speeds: widest(class), ..*own }).collect()
}

/// Speed of the fastest joint from the row before to each row of a clip, rad/s; 0 in the first. The root's turn counts as
/// a joint's.
pub fn turning(rows: &[Vec<f64>], rate_hz: f64) -> Vec<f64> {
    let map = |row: &[f64], at: usize| {
        UnitQuaternion::from_scaled_axis(Vector3::from_column_slice(&row[at..at + 3]))
    };
    let fastest = |pair: &[Vec<f64>]| {
        let (before, now) = (&pair[0], &pair[1]);
        let root = about_y(now[dof::YAW] / rate_hz) * map(now, dof::TILT);
        let joints = (dof::JOINTS..now.len()).step_by(3).map(|at| map(before, at).angle_to(&map(now, at)));
        rate_hz * joints.fold(map(before, dof::TILT).angle_to(&root), f64::max)
    };
    std::iter::once(0.0).chain(rows.windows(2).map(fastest)).take(rows.len()).collect()
}

/// Speeds over the ground, negative backwards, as the core smooths them.
fn smoothed(velocities: &[[f64; 2]], rate_hz: f64) -> Vec<f64> {
    let (mut speed, mut age) = (0.0, 0.0f64);
    let smoothed = f64::from(SMOOTHED_S);
    let of_frame = |v: &[f64; 2]| {
        age = (age + 1.0 / rate_hz).min(smoothed);
        speed += (v[0].hypot(v[1]).copysign(v[0]) - speed) / (rate_hz * age);
        speed
    };
    velocities.iter().map(of_frame).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two clips of 60 frames a class, one feature: class c at code 8 c, its second clip `off` higher.
    fn of(off: i8, actions: [usize; 2]) -> [TrustLimits; 2] {
        let codes: Vec<Vec<Vec<i8>>> =
            (0..2).map(|c| (0..120).map(|t| vec![8 * c + if t < 60 { 0 } else { off }]).collect()).collect();
        let searchable = [true; 120];
        let clips = [(0, 60), (60, 60), (120, 60), (180, 60)];
        let of_class =
            |c: usize| ClassFeatures { codes: &codes[c], weights: &[0.25], searchable: &searchable };
        let classes = [(actions[0], (0, of_class(0))), (actions[1], (120, of_class(1)))];
        let velocities: Vec<[f64; 2]> =
            (0..240).map(|t| if t < 120 { [3.0, 4.0] } else { [0.5, 0.0] }).collect();
        let turning: Vec<f64> = (0..240).map(|t| f64::from(t / 120) + 2.0).collect();
        trust_limits(&clips, &classes, (&velocities, &turning), 30.0).try_into().unwrap()
    }

    #[test]
    fn a_clip_is_as_far_as_the_other_clip_of_its_class() {
        // 4 codes of half a metre: 2 m, squared.
        for trust_limits in of(4, [0, 1]) {
            assert_eq!(trust_limits.far, 4.0);
        }
        assert_eq!(of(4, [0, 1])[0].speeds, [5.0; 2]);
        assert_eq!(of(4, [0, 1])[1].speeds, [0.5; 2]);
        // Of its own class alone, whatever the action.
        assert_eq!(of(4, [0, 0]).map(|class| class.turning), [2.0, 3.0]);
    }

    /// Without the whole clip, its frames would be as far as the other style: 784.
    #[test]
    fn the_only_clip_of_a_class_is_measured_by_its_parts() {
        // Half a second a code.
        let code = |row: usize| vec![(56 * (row / 120) + row % 120 / 15) as i8];
        let codes: Vec<Vec<i8>> = (0..240).map(code).collect();
        let searchable = [true; 120];
        let class = |c: usize| ClassFeatures {
            codes: &codes[120 * c..120 * (c + 1)],
            weights: &[0.25],
            searchable: &searchable,
        };
        let classes = [0, 1].map(|c| (0, (120 * c, class(c))));
        let rows = (vec![[0.0; 2]; 240], vec![0.0; 240]);
        let limits = trust_limits(&[(0, 120), (120, 120)], &classes, (&rows.0, &rows.1), 30.0);
        assert!(limits.iter().all(|class| class.far > 0.0 && class.far <= 4.0), "{limits:?}");
    }

    #[test]
    fn speeds_backwards_are_negative() {
        let back = |t: usize| if t < 60 { [-3.0, 4.0] } else { [3.0, -4.0] };
        let speeds = smoothed(&(0..240).map(back).collect::<Vec<_>>(), 30.0);
        assert!((speeds[59] + 5.0).abs() < 1e-9 && (speeds[239] - 5.0).abs() < 1e-2);
    }

    #[test]
    fn the_fastest_joint_turns_in_the_room_of_its_parent() {
        let still = vec![0.0; dof::JOINTS + 6];
        let [mut turned, mut bent] = [still.clone(), still.clone()];
        // The root turns about two axes at once; a joint goes on about a third turn and back past half a turn.
        (turned[dof::YAW], turned[dof::TILT]) = (3.0, 0.0);
        (bent[dof::JOINTS + 4], bent[dof::YAW]) = (0.2, 3.0);
        let rows = [still.clone(), turned, bent, still];
        let speeds = turning(&rows, 30.0);
        for (speed, expected) in speeds.iter().zip([0.0, 3.0, 6.0, 6.0]) {
            assert!((speed - expected).abs() < 1e-9, "{speeds:?}");
        }
        let far =
            |angle: f64| vec![0.0; dof::JOINTS].into_iter().chain([angle, 0.0, 0.0]).collect::<Vec<f64>>();
        assert!((turning(&[far(3.1), far(-3.1)], 1.0)[1] - (std::f64::consts::TAU - 6.2)).abs() < 1e-9);
    }

    #[test]
    fn the_nearest_class_of_the_action_counts() {
        // Clips lie 56 codes from their class's other one, and 8 from one of the other class.
        assert_eq!(of(56, [0, 1]).map(|class| class.far), [784.0; 2]);
        assert_eq!(of(56, [0, 0]).map(|class| class.far), [16.0; 2]);
    }
}
