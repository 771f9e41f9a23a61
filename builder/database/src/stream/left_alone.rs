//! Clips that are mostly left alone.
//!
//! The core passes motion through that is unlike the database. It takes half a second to see that, and now and then a few
//! frames of such a clip look like something that it knows: for these moments the output has another pose and another speed,
//! and its feet slide as it leaves the input and returns. A file is known to its end. Where most of a clip is left alone,
//! moments between spans that are, and before the first, are left alone too:
//!
//! ```text
//! q[t] = between q[a] x[a]⁻¹ x[t] and q[b] x[b]⁻¹ x[t],     root[t] = root[t-1] + x_root[t] - x_root[t-1]
//! ```
//!
//! with x the input, a and b the frames around the moment. Digests and reports stay as streamed.

use gestus_motion::{
    clip::{Frame, interpolate},
    statistics::mean_or_zero,
};

/// Share of the motion that is passed through from which a clip is mostly unlike the database.
pub(super) const MOSTLY_UNLIKE: f64 = 0.5;
/// A frame is left alone if that share of its motion is, and if no joint is turned by more from the input, radians: the
/// output takes its time to return.
const WHOLLY: f64 = 0.95;
const RETURNED: f64 = 0.1;
/// Longest moment, seconds, beside the time that the output takes to return.
const MOMENT_S: f64 = 1.5;

/// Leaves such moments alone. `frames` are the output's and `inputs` the input's, with Y up on one skeleton; `passed` is the
/// share of each that was passed through.
pub fn leave_moments_alone(frames: &mut [Frame], inputs: &[Frame], passed: &[f64], rate_hz: f64) {
    let count = frames.len();
    if count != inputs.len() || count != passed.len() || mean_or_zero(passed.iter().copied()) <= MOSTLY_UNLIKE
    {
        return;
    }
    let alone = |t: usize| passed[t] >= WHOLLY && frames[t].angle_to(&inputs[t]) < RETURNED;
    let alone: Vec<bool> = (0..count).map(alone).collect();
    let mut replaced = vec![false; count];
    let mut from = 0;
    while from < count {
        let to = (from..count).find(|&t| alone[t] != alone[from]).unwrap_or(count);
        let translated = passed[from..to].iter().filter(|share| **share < WHOLLY).count();
        if !alone[from] && to < count && translated as f64 <= MOMENT_S * rate_hz {
            replaced[from..to].fill(true);
            let before = from.checked_sub(1).map(|a| frames[a].clone());
            let after = frames[to].clone();
            for t in from..to {
                let share = (t + 1 - from) as f64 / (to + 1 - from) as f64;
                let end = follow(&after, &inputs[to], &inputs[t]);
                frames[t] = match (&before, from.checked_sub(1)) {
                    (Some(before), Some(a)) => {
                        let start = follow(before, &inputs[a], &inputs[t]);
                        interpolate(&start, &end, share)
                    }
                    _ => end,
                };
            }
        }
        from = to;
    }
    if !replaced.contains(&true) {
        return;
    }
    // The path over the ground, step by step: every change of a step moves all frames after it.
    let old: Vec<_> = frames.iter().map(|frame| frame.root).collect();
    for t in 1..count {
        let from = if replaced[t] || replaced[t - 1] {
            [inputs[t].root, inputs[t - 1].root]
        } else {
            [old[t], old[t - 1]]
        };
        let step = from[0] - from[1];
        frames[t].root.x = frames[t - 1].root.x + step.x;
        frames[t].root.z = frames[t - 1].root.z + step.z;
    }
}

/// The pose that differs from the input at `t` as `pose` does from the input at its own frame.
fn follow(pose: &Frame, own: &Frame, input: &Frame) -> Frame {
    let joints = pose.rotations.iter().zip(&own.rotations).zip(&input.rotations);
    Frame {
        root: pose.root + input.root - own.root,
        rotations: joints.map(|((q, x), now)| *q * x.inverse() * now).collect(),
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    const RATE_HZ: f64 = 30.0;

    fn frame(x: f64, angle: f64) -> Frame {
        Frame {
            root: Vector3::new(x, 0.9, 0.0),
            rotations: vec![UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)],
        }
    }

    /// A walk at 1 m/s, and an output that leaves it, slower, in those frames.
    fn walk(left: impl Fn(usize) -> bool) -> (Vec<Frame>, Vec<Frame>, Vec<f64>) {
        let sway = |t: usize| 0.3 * (0.2 * t as f64).sin();
        let inputs = (0..120).map(|t| frame(t as f64 / RATE_HZ, sway(t))).collect();
        let mut x = 0.0;
        let output = (0..120).map(|t| {
            x += if left(t) { 0.3 } else { 1.0 } / RATE_HZ;
            frame(x, sway(t) + if left(t) { 0.5 } else { 0.0 })
        });
        (inputs, output.collect(), (0..120).map(|t| if left(t) { 0.0 } else { 1.0 }).collect())
    }

    #[test]
    fn the_beginning_and_moments_follow_the_input() {
        let (inputs, mut output, passed) = walk(|t| t < 18 || (60..66).contains(&t));
        leave_moments_alone(&mut output, &inputs, &passed, RATE_HZ);
        for t in 1..120 {
            let step = |frames: &[Frame]| frames[t].root - frames[t - 1].root;
            assert!((step(&output) - step(&inputs)).norm() < 1e-9, "{t}");
            assert!(output[t].rotations[0].angle_to(&inputs[t].rotations[0]) < 1e-9, "{t}");
        }
    }

    /// A foot that was held returns with its next step, when the core has passed the input for long.
    #[test]
    fn what_takes_long_to_return_counts_by_what_was_translated() {
        let (inputs, mut output, mut passed) = walk(|t| t < 55);
        passed[18..55].fill(1.0);
        leave_moments_alone(&mut output, &inputs, &passed, RATE_HZ);
        assert!((output[54].root - output[0].root - inputs[54].root + inputs[0].root).norm() < 1e-9);
    }

    #[test]
    fn clips_that_are_mostly_translated_and_long_parts_stay() {
        let cases: [&dyn Fn(usize) -> bool; 3] = [&|t| t < 70, &|t| (40..90).contains(&t), &|_| false];
        for left in cases {
            let (inputs, streamed, passed) = walk(left);
            let mut output = streamed.clone();
            leave_moments_alone(&mut output, &inputs, &passed, RATE_HZ);
            assert!(output == streamed);
        }
    }
}
