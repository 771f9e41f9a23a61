//! Foot contacts of a clip, from the height and speed of its feet.
//!
//! A foot is in contact while the slower of ankle and toe is slow and low, with hysteresis against flicker. Thresholds
//! scale with the size of the body. The slower joint is used since it carries the foot; the lower one does as well in
//! gaits, jumps and kicks, and worse when a foot pivots on its ball (generated punches: F1 0.986 instead of 0.989).

use gestus_core::blob::Leg;
use nalgebra::{UnitQuaternion, Vector3};

use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    corpus::{Cycle, Example},
    landmarks::Landmarks,
    statistics::{gaussian, sorted},
};

/// Contacts of the left and right foot in every frame. Shape `[frames]`.
pub fn contacts(clip: &Clip, landmarks: &Landmarks) -> Vec<[bool; 2]> {
    let positions = positions(clip);
    let frames = positions.len();
    let leg = leg_m(&clip.skeleton, landmarks);
    let mut result = vec![[false; 2]; frames];
    for side in [0, 1] {
        let joints = [landmarks.feet[side], landmarks.toes[side]];
        let lows = joints.map(|j| low_height(&positions, j));
        let state = |t: usize| -> (f64, f64) {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(frames - 1));
            let seconds = (after - before).max(1) as f64 / clip.rate_hz;
            let of = |i: usize| {
                let j = joints[i];
                let speed = (positions[after][j] - positions[before][j]).norm() / seconds;
                (positions[t][j].y - lows[i], speed)
            };
            let (ankle, toe) = (of(0), of(1));
            // By speed.
            if ankle.1 < toe.1 { ankle } else { toe }
        };
        let mut standing = false;
        for (t, slot) in result.iter_mut().enumerate() {
            let (height, speed) = state(t);
            // A leg is about 0.8 m: 4 to 6.5 cm, 0.4 to 0.7 m/s.
            let slack = if standing { 1.6 } else { 1.0 };
            standing = height < 0.05 * leg * slack && speed < 0.55 * leg * slack;
            slot[side] = standing;
        }
    }
    remove_short_runs(&mut result, clip.rate_hz);
    result
}

/// Heights of ankle and toes above the floor while they carry the foot, metres, `[side][ankle, toe]`: medians over the
/// frames of contact in which the joint is the lower of the two.
pub fn sole_heights(examples: &[&Example], landmarks: &Landmarks) -> [[f64; 2]; 2] {
    let mut samples: [[Vec<f64>; 2]; 2] = Default::default();
    for example in examples {
        let positions = positions(&example.clip);
        for side in [0, 1] {
            let joints = [landmarks.feet[side], landmarks.toes[side]];
            let lows = joints.map(|j| low_height(&positions, j));
            for (position, _) in positions.iter().zip(&example.contacts).filter(|(_, c)| c[side]) {
                let over = [0, 1].map(|i| position[joints[i]].y - lows[i]);
                let lower = lower(joints, over);
                samples[side][lower].push(position[joints[lower]].y);
            }
        }
    }
    samples.map(|joints| {
        joints.map(|heights| {
            let heights = sorted(heights);
            heights.get(heights.len() / 2).copied().unwrap_or(0.0)
        })
    })
}

/// How far ankle and toes are over the point that a standing foot rolls about, metres, `[side][ankle, toe]`: where the
/// foot turns by a small rotation, its joint moves on the ground by this times the tip of the vertical. Least squares over
/// the frames, within contacts, in which the joint carries the foot; 0 to the joint's height.
pub fn rolls(examples: &[&Example], landmarks: &Landmarks, heights: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
    let mut moved = [[0.0; 2]; 2];
    let mut turned = [[0.0; 2]; 2];
    for example in examples {
        let clip = &example.clip;
        let positions = positions(clip);
        for side in [0, 1] {
            let joints = [landmarks.feet[side], landmarks.toes[side]];
            let turns: Vec<_> =
                clip.frames.iter().map(|f| orientation(&clip.skeleton, f, joints[0])).collect();
            for (t, stands) in example.contacts.windows(3).enumerate() {
                // The frames about foot-down and foot-up are those of a foot that moves.
                if !stands.iter().all(|s| s[side]) {
                    continue;
                }
                let over = [0, 1].map(|i| positions[t + 1][joints[i]].y - heights[side][i]);
                let lower = lower(joints, over);
                let shift = positions[t + 1][joints[lower]] - positions[t][joints[lower]];
                let tip = turns[t + 1] * turns[t].inverse() * Vector3::y();
                moved[side][lower] += shift.x * tip.x + shift.z * tip.z;
                turned[side][lower] += tip.x * tip.x + tip.z * tip.z;
            }
        }
    }
    let roll = |side: usize, i: usize| {
        let roll = moved[side][i] / turned[side][i].max(1e-9);
        roll.clamp(0.0, heights[side][i].max(0.0))
    };
    [0, 1].map(|side| [0, 1].map(|i| roll(side, i)))
}

/// The legs of a body, with the heights and rolls of feet that stand in some clips.
pub fn legs(examples: &[&Example], landmarks: &Landmarks) -> [Leg; 2] {
    let heights = sole_heights(examples, landmarks);
    let rolls = rolls(examples, landmarks, heights);
    [0, 1].map(|side| Leg {
        hip: landmarks.hip_joints[side],
        knee: landmarks.knees[side],
        ankle: landmarks.feet[side],
        toe: (landmarks.toes[side] != landmarks.feet[side]).then_some(landmarks.toes[side]),
        heights: heights[side].map(|h| h as f32),
        rolls: rolls[side].map(|r| r as f32),
    })
}

/// The legs of a body whose feet may slide, by the heights of the lowest of their joints in one clip; rolls are 0.
pub fn low_legs(clip: &Clip, landmarks: &Landmarks) -> [Leg; 2] {
    let positions = positions(clip);
    legs(&[], landmarks).map(|leg| {
        let heights = [leg.ankle, leg.toe.unwrap_or(leg.ankle)].map(|j| low_height(&positions, j) as f32);
        Leg { heights, ..leg }
    })
}

/// Length of a leg from the hip joint to the ankle, the mean of both, metres.
pub fn leg_m(skeleton: &Skeleton, landmarks: &Landmarks) -> f64 {
    landmarks.knees.iter().chain(&landmarks.feet).map(|&j| skeleton.offsets[j].norm()).sum::<f64>() / 2.0
}

/// Positions of the joints in each frame, metres. Shape `[frames][joints]`.
fn positions(clip: &Clip) -> Vec<Vec<Vector3<f64>>> {
    clip.frames.iter().map(|frame| frame.positions(&clip.skeleton)).collect()
}

/// Which of ankle and toes carries a foot: 0 or 1. Without toes it is the ankle.
fn lower(joints: [usize; 2], over: [f64; 2]) -> usize {
    usize::from(joints[0] != joints[1] && over[1] <= over[0])
}

/// Orientation of a joint in the world.
pub fn orientation(skeleton: &Skeleton, frame: &Frame, joint: usize) -> UnitQuaternion<f64> {
    let (mut turn, mut above) = (frame.rotations[joint], skeleton.parents[joint]);
    while let Some(parent) = above {
        turn = frame.rotations[parent] * turn;
        above = skeleton.parents[parent];
    }
    turn
}

/// A joint's lowest height: its 5% quantile, so that a bad frame does not matter.
fn low_height(positions: &[Vec<Vector3<f64>>], joint: usize) -> f64 {
    sorted(positions.iter().map(|p| p[joint].y))[positions.len() / 20]
}

/// Removes contacts and gaps shorter than 50 ms.
fn remove_short_runs(contacts: &mut [[bool; 2]], rate_hz: f64) {
    let shortest = (0.05 * rate_hz).ceil() as usize;
    for side in [0, 1] {
        let mut start = 0;
        for t in 1..=contacts.len() {
            if t == contacts.len() || contacts[t][side] != contacts[start][side] {
                let inside = start > 0 && t < contacts.len();
                if inside && t - start < shortest {
                    let flipped = !contacts[start][side];
                    contacts[start..t].iter_mut().for_each(|c| c[side] = flipped);
                }
                start = t;
            }
        }
    }
}

/// Standard deviation of the Gaussian on contact likelihoods, seconds: 0.6 frames at 30 Hz. Xia 2015, section 6, prints
/// none; this one is ours.
pub const GAUSSIAN_S: f64 = 0.02;

/// Contacts from likelihoods: smoothed by a Gaussian of that standard deviation in frames, then compared with one half
/// (Xia 2015, section 6, with [`GAUSSIAN_S`] times the rate). It uses later frames, so it is for files; a stream has
/// `gestus_core::methods::mixture::contact_votes`.
pub fn smoothed(likelihoods: &[[f64; 2]], sigma: f64) -> Vec<[bool; 2]> {
    let reach = (3.0 * sigma).ceil() as isize;
    let kernel = gaussian(reach, sigma);
    let total: f64 = kernel.iter().sum();
    let last = likelihoods.len() as isize - 1;
    let at = |t: isize, side: usize| likelihoods[t.clamp(0, last) as usize][side];
    (0..likelihoods.len() as isize)
        .map(|t| {
            [0, 1].map(|side| {
                let sum: f64 = kernel.iter().zip(-reach..).map(|(k, i)| k * at(t + i, side)).sum();
                sum > 0.5 * total
            })
        })
        .collect()
}

/// Steps of a canonical timeline.
const TIMELINE_STEPS: usize = 48;

/// Share of cycles that have to agree on a phase. Fewer agree near foot-down and foot-up.
const MIN_AGREEMENT: f64 = 0.9;

/// Annotates the canonical timeline of every action and style, and transfers the annotation to the clips: if nearly all
/// cycles agree on the contact at a phase, all get it (Xia 2015, section 4). Near foot-down and foot-up, and outside of
/// the cycles, a clip keeps its own contacts, since steps differ in length. Noise in single clips is removed this way.
pub fn apply_majority(examples: &mut [Example]) {
    let mut classes: Vec<(usize, usize)> = examples.iter().map(|e| (e.action, e.style)).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let mut stands = [[0.0f64; 2]; TIMELINE_STEPS];
        let mut samples = [0.0f64; TIMELINE_STEPS];
        for example in examples.iter().filter(|e| (e.action, e.style) == class) {
            for (frame, phase) in phases(example) {
                let step = timeline_step(phase);
                samples[step] += 1.0;
                for side in [0, 1] {
                    stands[step][side] += f64::from(u8::from(example.contacts[frame][side]));
                }
            }
        }
        for example in examples.iter_mut().filter(|e| (e.action, e.style) == class) {
            for (frame, phase) in phases(example) {
                let step = timeline_step(phase);
                // A few cycles leave no majority to speak of.
                if samples[step] < 3.0 {
                    continue;
                }
                for side in [0, 1] {
                    let share = stands[step][side] / samples[step];
                    if !(1.0 - MIN_AGREEMENT..=MIN_AGREEMENT).contains(&share) {
                        example.contacts[frame][side] = share > 0.5;
                    }
                }
            }
        }
    }
}

fn timeline_step(phase: f64) -> usize {
    ((phase * TIMELINE_STEPS as f64) as usize).min(TIMELINE_STEPS - 1)
}

/// The frames of a clip within cycles, with their phases.
fn phases(example: &Example) -> Vec<(usize, f64)> {
    let frames = example.clip.frames.len();
    let of = |c: &Cycle| {
        let (start, end) = c.span();
        let range = start.ceil().max(0.0) as usize..(end.ceil().max(0.0) as usize).min(frames);
        range.map(|f| (f, c.phase(f as f64))).collect::<Vec<_>>()
    };
    example.cycles.iter().flat_map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gaussian_takes_out_a_stray_frame_and_moves_no_edge() {
        let mut likelihoods = vec![[1.0, 0.0]; 20];
        likelihoods[8][0] = 0.1;
        likelihoods[10..].iter_mut().for_each(|l| l[1] = 1.0);
        let found = smoothed(&likelihoods, 1.0);
        assert!(found.iter().all(|c| c[0]), "{found:?}");
        assert!(found.iter().enumerate().all(|(t, c)| c[1] == (t >= 10)), "{found:?}");
        // No smoothing: the bare vote.
        assert!(!smoothed(&likelihoods, 0.0)[8][0]);
    }
}
