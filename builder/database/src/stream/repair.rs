//! Repairs what is no motion in a file: poses that are held for several frames, and a first pose that is elsewhere.
//!
//! Both are leaps to a stylizer, which holds its pose at a leap. Held poses are keys, each at the first of its frames, and the
//! motion goes straight from key to key. A first pose from which the body leaps, such as a calibration pose, is
//! streamed as the second one, and comes out as it was.

use gestus_motion::clip::{Clip, Frame, interpolate};

use super::course::leaps;

/// Longest that a pose is held by the rate of its keys, seconds: longer, the body stands.
const HELD_S: f64 = 0.13;
/// Part of the frames that repeat the one before, of those in which the body does not stand, from which poses are held.
const REPEATED: f64 = 0.4;
/// Change of a pose that is rounding, metres and radians.
const SAME: f64 = 1e-6;

/// A clip to stream.
pub struct Repaired {
    /// The clip, of as many frames.
    pub clip: Clip,
    /// Its first pose, where that is not streamed.
    pub first: Option<Frame>,
    /// What to tell.
    pub notes: Vec<String>,
}

impl Repaired {
    /// Repairs a clip at its file's rate.
    pub fn of(clip: &Clip) -> Self {
        let mut repaired = Self { clip: clip.clone(), first: None, notes: Vec::new() };
        let frames = &mut repaired.clip.frames;
        if leaps(clip) == [1] && frames.len() > 2 {
            let by = (frames[1].root - frames[0].root).norm();
            repaired.notes.push(format!(
                "the body leaps by {by:.1} m after its first pose, which is left as it is: the motion begins with the second"
            ));
            repaired.first = Some(std::mem::replace(&mut frames[0], clip.frames[1].clone()));
            frames[0].root = clip.frames[1].root * 2.0 - clip.frames[2].root;
        }
        if let Some(keys) = keys(frames, clip.rate_hz) {
            let rate_hz = clip.rate_hz;
            let frames_a_key = frames.len() as f64 / keys.len() as f64;
            repaired.notes.push(format!(
                "its poses are held for {frames_a_key:.1} frames of {rate_hz:.0} a second: taken as keys, with motion between them"
            ));
            for pair in keys.windows(2) {
                let [from, to] = [pair[0], pair[1]].map(|key| frames[key].clone());
                for t in pair[0] + 1..pair[1] {
                    frames[t] = interpolate(&from, &to, (t - pair[0]) as f64 / (pair[1] - pair[0]) as f64);
                }
            }
        }
        repaired
    }
}

/// The frames that are keys where poses are held; frames in which the body stands are keys too.
fn keys(poses: &[Frame], rate_hz: f64) -> Option<Vec<usize>> {
    let count = poses.len();
    let longest = (HELD_S * rate_hz).round() as usize;
    let repeats = |t: usize| {
        let (now, before) = (&poses[t], &poses[t - 1]);
        (now.root - before.root).norm() < SAME && now.angle_to(before) < SAME
    };
    let mut keys: Vec<usize> = (0..count).filter(|&t| t == 0 || !repeats(t)).collect();
    let (mut moving, mut repeated, mut stands) = (0, 0, Vec::new());
    for (i, &key) in keys.iter().enumerate() {
        let frames = keys.get(i + 1).copied().unwrap_or(count) - key;
        if frames > longest {
            stands.extend(key + 1..key + frames);
        } else {
            moving += frames;
            repeated += frames - 1;
        }
    }
    keys.extend(stands);
    keys.sort_unstable();
    (moving > 0 && repeated as f64 >= REPEATED * moving as f64 && keys.len() > 2).then_some(keys)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use gestus_motion::clip::Skeleton;
    use nalgebra::{UnitQuaternion, Vector3};

    use super::*;

    /// A root that goes along x at that place in each frame, at 30 Hz.
    fn clip(places: impl Iterator<Item = f64>) -> Clip {
        let skeleton =
            Skeleton { names: vec!["hips".into()], parents: vec![None], offsets: vec![Vector3::zeros()] };
        let frames = places
            .map(|x| Frame { root: Vector3::new(x, 1.0, 0.0), rotations: vec![UnitQuaternion::identity()] })
            .collect();
        Clip { name: "c".into(), skeleton: Arc::new(skeleton), rate_hz: 30.0, frames }
    }

    fn places(clip: &Clip) -> Vec<f64> {
        clip.frames.iter().map(|frame| frame.root.x).collect()
    }

    /// Every second frame of a walk at 15 poses a second was a leap, and its output stood.
    #[test]
    fn poses_that_are_held_are_keys() {
        for held in [2, 3] {
            let repaired = Repaired::of(&clip((0..60).map(|t| f64::from(t / held * held) * 0.04)));
            assert_eq!(repaired.notes.len(), 1);
            for (t, x) in places(&repaired.clip).into_iter().take(57).enumerate() {
                assert!((x - 0.04 * t as f64).abs() < 1e-9, "{held}: frame {t} at {x}");
            }
        }
        // A body that moves in every frame, and one that stands, goes and stands.
        let plain = clip((0..60).map(|t| f64::from(t) * 0.04));
        let stops = clip((0..90).map(|t| f64::from((t - 30i32).clamp(0, 30)) * 0.04));
        for clip in [plain, stops] {
            let repaired = Repaired::of(&clip);
            assert!(repaired.notes.is_empty() && places(&repaired.clip) == places(&clip));
        }
    }

    /// The whole output was as far from the input as the calibration pose.
    #[test]
    fn a_first_pose_that_is_elsewhere_is_not_streamed() {
        let away = |t: i32| if t == 0 { 4.0 } else { f64::from(t) * 0.04 };
        let repaired = Repaired::of(&clip((0..30).map(away)));
        assert_eq!(repaired.first.unwrap().root.x, 4.0);
        assert!(repaired.clip.frames[0].root.x.abs() < 1e-9 && repaired.notes.len() == 1);
        // Two places are two takes.
        let twice = |t: i32| if t < 9 { away(t) } else { 8.0 };
        assert!(Repaired::of(&clip((0..30).map(twice))).first.is_none());
    }
}
