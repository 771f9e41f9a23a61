//! The beginning of a clip that begins at rest.
//!
//! A stream begins with the posture of its input and takes up that of its style within a second: a board knows no better. A
//! file's body that stands still would so be seen to turn its joints four times as fast as it ever does. It is taken to have
//! stood in its style before: until the posture is taken up, poses are the first one that has it, moved as the input moves,
//!
//! ```text
//! q[t] = q[e] · x[e]⁻¹ · x[t],     root[t] = root[e] + x_root[t] - x_root[e],     t < e
//! ```
//!
//! with x the input and e the first pose from which on, within `SPAN_S`, no joint turns faster than the input's fastest.
//! Bodies that begin in motion keep what was streamed, and so do loops, bodies that walk in place, digests and reports.

use gestus_core::{
    Config,
    output::speed_limit::{MIN_SPEED, SOFT_START_S},
};
use gestus_motion::clip::Frame;

/// The posture of a style is taken up within this time, seconds: while the core limits joints to the style's own speeds.
const SPAN_S: f64 = SOFT_START_S as f64;
/// A body whose joints turn slower is at rest, rad/s: the core's limit for bodies that stand.
const REST: f64 = MIN_SPEED as f64;
/// How much faster than the input's fastest joint the output's may turn: the core's default.
const FASTER: f64 = Config::new().speed_limit as f64;

/// Lets an output begin in its style where its input begins at rest. `frames` are the output's and `inputs` the input's, on
/// one skeleton.
pub fn in_style(frames: &mut [Frame], inputs: &[Frame], rate_hz: f64) {
    let span = (SPAN_S * rate_hz).ceil() as usize;
    let count = frames.len().min(inputs.len()).min(span + 1);
    let (now, before) = (&mut frames[..count], &inputs[..count]);
    let shown = turns(before).into_iter().fold(0.0, f64::max);
    let Some(last) = turns(now).into_iter().rposition(|turn| turn > FASTER * shown) else { return };
    if shown * rate_hz >= REST {
        return;
    }
    let (pose, input) = (now[last + 1].clone(), &before[last + 1]);
    for (frame, moved) in now[..=last].iter_mut().zip(before) {
        frame.root = pose.root + moved.root - input.root;
        for (j, q) in frame.rotations.iter_mut().enumerate() {
            *q = pose.rotations[j] * input.rotations[j].inverse() * moved.rotations[j];
        }
    }
}

/// Fastest turn of a joint from each pose to the next, radians.
fn turns(frames: &[Frame]) -> Vec<f64> {
    frames.windows(2).map(|pair| pair[0].angle_to(&pair[1])).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    const RATE_HZ: f64 = 30.0;

    fn about_x(angle: f64) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle)
    }

    /// A body whose joint sways at up to `speed` rad/s, and what a stream makes of it: the joint goes to another posture.
    fn swaying(speed: f64) -> (Vec<Frame>, Vec<Frame>) {
        let sway = |t: usize| speed / 3.0 * (3.0 * t as f64 / RATE_HZ).sin();
        let taken = |t: usize| 0.3 * (1.0 - 0.7f64.powi(t as i32));
        let frame = |t: usize, angle: f64| Frame {
            root: Vector3::new(0.01 * t as f64, 1.0, 0.0),
            rotations: vec![UnitQuaternion::identity(), about_x(angle)],
        };
        let input = (0..90).map(|t| frame(t, sway(t))).collect();
        (input, (0..90).map(|t| frame(t, sway(t) + taken(t))).collect())
    }

    #[test]
    fn a_body_at_rest_begins_in_its_style() {
        let (input, streamed) = swaying(0.3);
        let mut output = streamed.clone();
        in_style(&mut output, &input, RATE_HZ);
        let fastest = |frames: &[Frame]| turns(frames).into_iter().fold(0.0, f64::max);
        assert!(fastest(&streamed) > 4.0 * fastest(&input));
        assert!(fastest(&output) <= FASTER * fastest(&input) + 1e-9, "{}", fastest(&output));
        assert!(output[0].rotations[1].angle() > 0.2);
        assert!(output[16..] == streamed[16..]);
        // The path is the input's.
        assert!((output[0].root - input[0].root).norm() < 1e-9);
    }

    #[test]
    fn a_body_in_motion_keeps_what_was_streamed() {
        for (input, streamed) in [swaying(1.5), (Vec::new(), Vec::new())] {
            let mut output = streamed.clone();
            in_style(&mut output, &input, RATE_HZ);
            assert!(output == streamed);
        }
        // Nor is anything changed where nothing is taken up.
        let (input, _) = swaying(0.3);
        let mut output = input.clone();
        in_style(&mut output, &input, RATE_HZ);
        assert!(output == input);
    }
}
