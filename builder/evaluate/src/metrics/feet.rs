//! How fast feet move on the ground while they stand, and how high they are: by the core's contacts, by those of another
//! clip, and by no contacts at all.

use gestus_core::blob::Leg;
use gestus_database::registration::contact::orientation;
use gestus_motion::{
    clip::{Frame, Skeleton},
    statistics::{mean, quantile, sorted},
};
use nalgebra::Vector3;

use crate::metrics::performance::Performance;

/// Speeds on the ground, m/s, of the point that a foot stands on: of the joint that carries the foot, less what the roll
/// of the sole moves it by ([`Leg::rolls`]). `None` where the foot does not stand in this frame and the one before. Shape
/// `[frames][side]`.
pub fn standing_speeds(skeleton: &Skeleton, legs: &[Leg; 2], of: &Performance) -> Vec<[Option<f64>; 2]> {
    let positions: Vec<Vec<Vector3<f64>>> = of.frames.iter().map(|f| f.positions(skeleton)).collect();
    (0..positions.len())
        .map(|t| {
            [0, 1].map(|side| {
                let before = t.checked_sub(1).filter(|&b| of.stands[b][side] && of.stands[t][side])?;
                let leg = &legs[side];
                let over = |joint: usize, height: f32| positions[t][joint].y - f64::from(height);
                let (joint, roll) = match leg.toe {
                    Some(toe) if over(toe, leg.heights[1]) <= over(leg.ankle, leg.heights[0]) => {
                        (toe, leg.rolls[1])
                    }
                    _ => (leg.ankle, leg.rolls[0]),
                };
                let turn = |t: usize| orientation(skeleton, &of.frames[t], leg.ankle);
                let rolled = (turn(t) * turn(before).inverse() * Vector3::y()) * f64::from(roll);
                let way = positions[t][joint] - positions[before][joint] - rolled;
                Some(way.x.hypot(way.z) / of.steps_s[t])
            })
        })
        .collect()
}

/// Mean speed on the ground of standing feet, cm/s. Not a number where no foot stands, which tables leave empty: 0 would be
/// perfect.
pub fn skate_cm_s(skeleton: &Skeleton, legs: &[Leg; 2], of: &Performance) -> f64 {
    mean(standing_speeds(skeleton, legs, of).into_iter().flatten().flatten().map(|v| 100.0 * v))
}

/// Height of ankle or toes, whichever is lower, relative to their height while the foot stands, metres.
fn height_m(positions: &[Vector3<f64>], leg: &Leg) -> f64 {
    let over = |joint: usize, height: f32| positions[joint].y - f64::from(height);
    let ankle = over(leg.ankle, leg.heights[0]);
    leg.toe.map_or(ankle, |toe| ankle.min(over(toe, leg.heights[1])))
}

/// Lowest and highest place of standing feet over the floor, cm: 5% and 95% quantiles over frames.
pub fn heights_cm(skeleton: &Skeleton, legs: &[Leg; 2], of: &Performance) -> [Option<f64>; 2] {
    let heights = of
        .frames
        .iter()
        .zip(&of.stands)
        .flat_map(|(frame, stands)| {
            let p = frame.positions(skeleton);
            [0, 1].map(|side| stands[side].then(|| 100.0 * height_m(&p, &legs[side])))
        })
        .flatten();
    let heights = sorted(heights);
    [0.05, 0.95].map(|share| quantile(&heights, share))
}

/// Lowest height of ankle or toes of either foot, relative to their height while the foot stands, over all frames, cm: 0 or
/// less.
pub fn deepest_cm(skeleton: &Skeleton, legs: &[Leg; 2], of: &Performance) -> f64 {
    let over = |frame: &Frame| {
        let p = frame.positions(skeleton);
        height_m(&p, &legs[0]).min(height_m(&p, &legs[1]))
    };
    100.0 * of.frames.iter().map(over).fold(0.0, f64::min)
}

/// Mean over frames of the speed on the ground of the stillest of all ankles and toes, cm/s: the skate of a body whose
/// contacts nobody knows. Not zero for real motion, and large in flight: it is read beside that of real clips.
pub fn stillest_cm_s(skeleton: &Skeleton, legs: &[Leg; 2], of: &Performance) -> f64 {
    let joints: Vec<usize> = legs.iter().flat_map(|l| [Some(l.ankle), l.toe]).flatten().collect();
    let positions: Vec<Vec<Vector3<f64>>> = of.frames.iter().map(|f| f.positions(skeleton)).collect();
    mean(positions.windows(2).zip(of.steps_s.iter().skip(1)).map(|(w, step_s)| {
        let speed = |&j: &usize| (w[1][j].x - w[0][j].x).hypot(w[1][j].z - w[0][j].z) / step_s;
        100.0 * joints.iter().map(speed).fold(f64::INFINITY, f64::min)
    }))
}
