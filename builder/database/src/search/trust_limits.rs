//! What input of a class is like: how near captured frames are to what is stored of other clips, and how fast they go. The
//! core passes input on that is not. And how fast the joints of the class turn, which bounds the output where it begins.

use std::ops::Range;

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

/// A class: its action, its first stored row, and the features of its rows.
pub type OfClass<'a> = (usize, (usize, ClassFeatures<'a>));

/// All captured frames. A condensed database stores a part of them.
pub struct Captured<'a> {
    /// Class, first frame and number of frames of each clip.
    pub clips: &'a [(usize, usize, usize)],
    /// The feature of each frame.
    pub codes: &'a [Vec<i8>],
    /// Velocity of the root in each frame, forward and left, m/s.
    pub velocities: &'a [[f64; 2]],
    /// Speed of the fastest joint in each frame ([`turning`]), rad/s.
    pub turning: &'a [f64],
    /// Whether each frame is part of a cycle.
    pub in_cycle: &'a [bool],
    /// The frame of each stored row, ascending.
    pub stored: &'a [usize],
}

impl Captured<'_> {
    /// Whether only some cycles are stored. Frames of no cycle are not measured then.
    fn is_condensed(&self) -> bool {
        self.stored.len() < self.codes.len()
    }

    /// The stored rows whose frames are in that range.
    fn rows(&self, frames: &Range<usize>) -> Range<usize> {
        let row = |end: usize| self.stored.partition_point(|&frame| frame < end);
        row(frames.start)..row(frames.end)
    }

    /// The frames of a class that are measured, each with the rows that are held out.
    fn queries(&self, class: usize, rows: &Range<usize>, rate_hz: f64) -> Vec<(usize, Range<usize>)> {
        let own: Vec<_> = self.clips.iter().filter(|clip| clip.0 == class).collect();
        let [lead, near] = [f64::from(LEAD_S), HELD_OUT_S].map(|seconds| (seconds * rate_hz) as usize);
        let of_clip = |&&(_, start, count): &&(usize, usize, usize)| {
            let clip = start..start + count;
            let is_alone = own.len() == 1;
            (start + lead.min(count)..clip.end).map(move |t| match is_alone {
                true => (t, t.saturating_sub(near).max(clip.start)..(t + near + 1).min(clip.end)),
                false => (t, clip.clone()),
            })
        };
        let queries = own.iter().flat_map(of_clip).filter(|(t, _)| self.in_cycle[*t] || !self.is_condensed());
        // Where nothing is left of the class, the nearest frames would be those of other styles.
        queries
            .map(|(t, held_out)| (t, self.rows(&held_out)))
            .filter(|(_, held_out)| held_out != rows)
            .collect()
    }
}

/// What input of each class is like.
///
/// Captured frames of a class are searched exhaustively in what is stored of all classes of the action, without the frames
/// of their own clip, or, where it is the class's only one, without those within a quarter of a second: without the whole
/// clip they would be as far as the other styles are, and unlike input nearer. Where a class stores few cycles, a frame may
/// well be nearest to another action, as in the core: classes of all actions are searched then. Speeds are those of the
/// action in any style.
pub fn trust_limits(captured: &Captured<'_>, classes: &[OfClass<'_>], rate_hz: f64) -> Vec<TrustLimits> {
    let k = usize::from(Config::new().k);
    let lead = (f64::from(LEAD_S) * rate_hz) as usize;
    let each: Vec<TrustLimits> = classes
        .par_iter()
        .enumerate()
        .map(|(number, (action, (first, class)))| {
            let queries = captured.queries(number, &(*first..first + class.codes.len()), rate_hz);
            let distances =
                queries.iter().step_by(queries.len().div_ceil(FRAMES).max(1)).map(|(t, held_out)| {
                    let query: Vec<f32> = captured.codes[*t].iter().map(|&c| f32::from(c)).collect();
                    let held_out = (held_out.start, held_out.len());
                    let same = classes.iter().filter(|(other, _)| captured.is_condensed() || other == action);
                    let nearest = same.map(|(_, class)| mean_distance2(class, held_out, &query, k));
                    f64::from(nearest.fold(f32::INFINITY, f32::min))
                });
            let distances = sorted(distances.filter(|distance| distance.is_finite()));
            let own = || {
                captured.clips.iter().filter(|clip| clip.0 == number).map(|&(_, start, count)| (start, count))
            };
            let speeds = sorted(own().flat_map(|(start, count)| {
                smoothed(&captured.velocities[start + lead.min(count)..start + count], rate_hz)
            }));
            let turns =
                sorted(own().flat_map(|(start, count)| captured.turning[start..start + count].to_vec()));
            let at = |ascending: &[f64], part: f64| quantile(ascending, part).unwrap_or(0.0) as f32;
            TrustLimits {
                far: at(&distances, if own().count() == 1 { NEARER_ALONE } else { NEARER }),
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

    /// Two classes of 120 frames, one feature, of which that part of each is stored; clips have so many frames.
    fn limits(
        codes: [Vec<i8>; 2],
        actions: [usize; 2],
        stored: Range<usize>,
        clip: usize,
    ) -> [TrustLimits; 2] {
        let searchable = vec![true; stored.len()];
        let parts: Vec<Vec<Vec<i8>>> = codes
            .iter()
            .map(|codes| codes[stored.clone()].iter().map(|&code| vec![code]).collect())
            .collect();
        let class = |c: usize| ClassFeatures { codes: &parts[c], weights: &[0.25], searchable: &searchable };
        let classes = [0, 1].map(|c| (actions[c], (c * stored.len(), class(c))));
        let captured = Captured {
            clips: &(0..240 / clip).map(|i| (i * clip / 120, i * clip, clip)).collect::<Vec<_>>(),
            codes: &codes.iter().flatten().map(|&code| vec![code]).collect::<Vec<_>>(),
            velocities: &[vec![[3.0, 4.0]; 120], vec![[0.5, 0.0]; 120]].concat(),
            turning: &[vec![2.0; 120], vec![3.0; 120]].concat(),
            // The last third of every clip belongs to no cycle.
            in_cycle: &(0..240).map(|t| t % clip < 2 * clip / 3).collect::<Vec<_>>(),
            stored: &stored.clone().chain(stored.map(|frame| 120 + frame)).collect::<Vec<_>>(),
        };
        trust_limits(&captured, &classes, 30.0).try_into().unwrap()
    }

    /// Two clips of 60 frames a class: class c at code 8 c, its second clip `off` higher.
    fn codes(off: i8) -> [Vec<i8>; 2] {
        [0, 8].map(|code| [vec![code; 60], vec![code + off; 60]].concat())
    }

    fn of(off: i8, actions: [usize; 2]) -> [TrustLimits; 2] {
        limits(codes(off), actions, 0..120, 60)
    }

    #[test]
    fn a_condensed_class_is_measured_by_cycles_that_were_left_out() {
        let codes = [0, 20].map(|code| [vec![code; 60], vec![code + 4; 40], vec![code + 10; 20]].concat());
        for class in limits(codes, [0, 1], 0..60, 60) {
            assert_eq!(class.far, 4.0);
        }
    }

    #[test]
    fn a_condensed_class_may_be_nearest_to_another_action() {
        // What is left out of class 0 is as what is stored of class 1.
        assert_eq!(limits(codes(8), [0, 1], 0..60, 60).map(|class| class.far), [0.0, 16.0]);
        assert_eq!(limits(codes(8), [0, 1], 0..120, 60).map(|class| class.far), [16.0; 2]);
    }

    #[test]
    fn the_only_clip_of_a_class_is_measured_by_its_parts() {
        // Half a second a code. Without the whole clip, its frames would be as far as the other style: 784.
        let climbs = |from: i8| (0..120).map(|t| from + (t / 15) as i8).collect();
        for class in limits([climbs(0), climbs(56)], [0, 0], 0..120, 120) {
            assert!(class.far > 0.0 && class.far <= 4.0, "{}", class.far);
        }
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
