//! The fastest joint of an output on its own body, and of a clip that took another's style.
//!
//! The core limits joints on the database's body to a multiple of the input's fastest. On the file's body a knee can still be
//! faster: near the stretched leg a millimetre of the hips turns it by degrees, and where the database's knee is bent the
//! file's may be straight. Such a turn moves the foot hardly at all, so it can take its time.
//!
//! Each joint that exceeds the limit follows its curve at that speed, once from the front and once from the end. Each
//! is late at its own end; their mean is not. A leg that is late may reach into the floor, so the root is raised where a joint
//! that comes near the floor would be lower than it ever was.

use gestus_motion::clip::{Clip, Frame, Skeleton, slerp};
use nalgebra::{UnitQuaternion, Vector3};

/// How much faster than the input's fastest joint a joint may turn in any output.
pub const FASTER: f64 = 1.6;
/// A body whose joints turn by less from frame to frame is a pose, radians.
const STILL: f64 = 1e-4;
/// How far over the lowest joint of a clip joints still come near the floor, metres.
const NEAR_FLOOR_M: f64 = 0.2;

/// An output whose joints turn by no more than `limit` from a frame to the next, radians. A loop's last pose is its first.
/// `up` is a unit vector in the clip's world.
pub fn limited(mut output: Clip, limit: f64, up: &Vector3<f64>, looped: bool) -> Clip {
    if limit < FASTER * STILL || fastest(&output.frames) <= limit {
        return output;
    }
    let lowest = lowest(&output, up);
    // A loop goes on turning, so its root is no loop.
    for joint in usize::from(looped)..output.skeleton.joints() {
        let curve: Vec<_> = output.frames.iter().map(|frame| frame.rotations[joint]).collect();
        if curve.windows(2).any(|pair| pair[0].angle_to(&pair[1]) > limit) {
            let eased = if looped { eased_loop(&curve, limit) } else { eased(&curve, limit) };
            output.frames.iter_mut().zip(eased).for_each(|(frame, turn)| frame.rotations[joint] = turn);
        }
    }
    for frame in &mut output.frames {
        let heights = heights(frame, &output.skeleton, up);
        let rise = lowest.iter().zip(heights).map(|(lowest, height)| lowest - height).fold(0.0, f64::max);
        frame.root += rise * up;
    }
    output
}

/// Height of each joint, metres.
fn heights(frame: &Frame, skeleton: &Skeleton, up: &Vector3<f64>) -> Vec<f64> {
    frame.positions(skeleton).iter().map(|position| position.dot(up)).collect()
}

/// The lowest height of each joint in a clip, metres; minus infinity for joints that do not come near the floor.
fn lowest(clip: &Clip, up: &Vector3<f64>) -> Vec<f64> {
    let mut lowest = vec![f64::INFINITY; clip.skeleton.joints()];
    for frame in &clip.frames {
        lowest.iter_mut().zip(heights(frame, &clip.skeleton, up)).for_each(|(l, height)| *l = l.min(height));
    }
    let near = NEAR_FLOOR_M + lowest.iter().copied().fold(f64::INFINITY, f64::min);
    lowest.iter_mut().filter(|height| **height > near).for_each(|height| *height = f64::NEG_INFINITY);
    lowest
}

/// A joint's curve at a limited speed.
fn eased(curve: &[UnitQuaternion<f64>], limit: f64) -> Vec<UnitQuaternion<f64>> {
    let ahead = followed(curve.iter(), limit);
    let back = followed(curve.iter().rev(), limit);
    ahead.iter().zip(back.iter().rev()).map(|(a, b)| slerp(a, b, 0.5)).collect()
}

/// The same of a loop: that of the middle of three rounds.
fn eased_loop(curve: &[UnitQuaternion<f64>], limit: f64) -> Vec<UnitQuaternion<f64>> {
    let period = curve.len() - 1;
    let rounds: Vec<_> = curve[..period].iter().cycle().take(3 * period + 1).copied().collect();
    eased(&rounds, limit)[period..=2 * period].to_vec()
}

/// A curve followed from its beginning.
fn followed<'a>(
    curve: impl Iterator<Item = &'a UnitQuaternion<f64>>,
    limit: f64,
) -> Vec<UnitQuaternion<f64>> {
    let mut at = None;
    curve
        .map(|goal| {
            let here = *at.get_or_insert(*goal);
            let share = limit / here.angle_to(goal).max(1e-12);
            let next = if share >= 1.0 { *goal } else { slerp(&here, goal, share) };
            at = Some(next);
            next
        })
        .collect()
}

/// Fastest turn of a joint from a frame to the next, radians.
pub fn fastest(frames: &[Frame]) -> f64 {
    frames.windows(2).map(|pair| pair[0].angle_to(&pair[1])).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;

    /// A clip of one joint below a root, turned about X.
    fn clip(angles: impl Iterator<Item = f64>) -> Clip {
        let skeleton = Skeleton {
            names: vec!["root".into(), "knee".into()],
            parents: vec![None, Some(0)],
            offsets: vec![Vector3::zeros(); 2],
        };
        let frame = |angle| Frame {
            root: Vector3::zeros(),
            rotations: vec![
                UnitQuaternion::identity(),
                UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle),
            ],
        };
        Clip {
            name: "knee".into(),
            skeleton: Arc::new(skeleton),
            rate_hz: 30.0,
            frames: angles.map(frame).collect(),
        }
    }

    fn angle(frame: &Frame) -> f64 {
        frame.rotations[1].scaled_axis().x
    }

    #[test]
    fn a_leap_is_spread_about_its_middle_and_the_rest_stays() {
        let input = clip((0..60).map(|t| 0.5 * (0.1 * f64::from(t)).sin()));
        let output = clip((0..60).map(|t| if t < 30 { 0.2 } else { 0.8 }));
        let limited = limited(output.clone(), FASTER * fastest(&input.frames), &Vector3::y(), false);
        let limit = FASTER * fastest(&input.frames);
        assert!(fastest(&output.frames) > 7.0 * limit);
        assert!(fastest(&limited.frames) <= limit + 1e-9, "{}", fastest(&limited.frames));
        assert!((angle(&limited.frames[29]) + angle(&limited.frames[30]) - 1.0).abs() < 1e-9);
        for t in [0, 10, 20, 40, 50, 59] {
            assert!((angle(&limited.frames[t]) - angle(&output.frames[t])).abs() < 1e-9, "{t}");
        }
    }

    #[test]
    fn what_is_slow_enough_and_what_has_no_speed_stays() {
        let input = clip((0..60).map(|t| 0.5 * (0.1 * f64::from(t)).sin()));
        let output = clip((0..60).map(|t| 0.5 * (0.15 * f64::from(t)).sin()));
        assert!(
            limited(output.clone(), FASTER * fastest(&input.frames), &Vector3::y(), false).frames
                == output.frames
        );
        let pose = clip((0..60).map(|_| 0.3));
        assert!(
            limited(output.clone(), FASTER * fastest(&pose.frames), &Vector3::y(), false).frames
                == output.frames
        );
    }

    #[test]
    fn a_loop_stays_one() {
        let input = clip((0..=60).map(|t| 0.5 * (std::f64::consts::TAU * f64::from(t) / 60.0).sin()));
        // It leaps at its seam.
        let output = clip((0..=60).map(|t| if t % 60 < 30 { 0.8 } else { 0.2 }));
        let limited = limited(output, FASTER * fastest(&input.frames), &Vector3::y(), true);
        let [first, last] = [0, 60].map(|t| angle(&limited.frames[t]));
        assert!((first - last).abs() < 1e-9, "{first} {last}");
        assert!(fastest(&limited.frames) <= FASTER * fastest(&input.frames) + 1e-9);
    }

    #[test]
    fn a_late_leg_does_not_reach_into_the_floor() {
        let skeleton = Skeleton {
            names: ["root", "knee", "foot"].map(String::from).into(),
            parents: vec![None, Some(0), Some(1)],
            offsets: vec![Vector3::zeros(), -0.5 * Vector3::y(), -0.5 * Vector3::y()],
        };
        let skeleton = Arc::new(skeleton);
        let on_floor = |angles: &mut dyn Iterator<Item = f64>| {
            let mut clip =
                Clip { skeleton: skeleton.clone(), ..clip(angles.collect::<Vec<_>>().into_iter()) };
            for frame in &mut clip.frames {
                frame.rotations.push(UnitQuaternion::identity());
                // The foot stays on the floor while the knee bends.
                frame.root.y = 0.5 + 0.5 * frame.rotations[1].angle().cos();
            }
            clip
        };
        let input = on_floor(&mut (0..60).map(|t| 0.5 * (0.1 * f64::from(t)).sin()));
        let output = on_floor(&mut (0..60).map(|t| if t < 30 { 1.2 } else { 0.2 }));
        let foot = |clip: &Clip| {
            clip.frames.iter().map(|f| f.positions(&skeleton)[2].y).fold(f64::INFINITY, f64::min)
        };
        let mut sunk = limited(output.clone(), FASTER * fastest(&input.frames), &Vector3::y(), false);
        assert!(foot(&sunk) > -1e-9, "{}", foot(&sunk));
        // Where the root is not raised, it does reach into the floor.
        sunk.frames.iter_mut().zip(&output.frames).for_each(|(frame, before)| frame.root = before.root);
        assert!(foot(&sunk) < -0.05, "{}", foot(&sunk));
    }
}
