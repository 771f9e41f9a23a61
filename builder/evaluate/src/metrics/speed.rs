//! Speed on the ground; angular speeds of joints, and whether the style or the foot lock causes those that are faster
//! than the input's.
//!
//! A joint is **over** in a frame where it turns faster than [`ALLOWED`] times the fastest joint of the input clip. Where it is
//! over without the lock too, the style is the cause; else the lock, counted by what it does with that leg in the frame.

use crate::evaluation::row;
use gestus_core::blob::Leg;
use serde_json::json;

use crate::metrics::performance::Performance;
use crate::report::table;
use gestus_database::stream::Streamed;
use gestus_motion::clip::Skeleton;

/// How many times the input's fastest joint an output's may turn: the default of `Config::speed_limit`.
pub const ALLOWED: f64 = 1.2;

/// Angular speeds, rad/s, of every joint in every frame but the first. Shape `[frames - 1][joints]`.
pub fn speeds(of: &Performance) -> Vec<Vec<f64>> {
    of.frames
        .windows(2)
        .zip(of.steps_s.get(1..).unwrap_or(&[]))
        .map(|(w, s)| w[0].rotations.iter().zip(&w[1].rotations).map(|(a, b)| a.angle_to(b) / s).collect())
        .collect()
}

/// Mean speed of the root on the ground, m/s: the length of its way over the time, in the frames that are `inside`. Not a
/// number where none is.
pub fn ground_speed(of: &Performance, inside: &[bool]) -> f64 {
    let (mut way, mut time) = (0.0, 0.0);
    for t in (1..of.frames.len()).filter(|&t| inside[t]) {
        let step = of.frames[t].root - of.frames[t - 1].root;
        way += step.x.hypot(step.z);
        time += of.steps_s[t];
    }
    way / time
}

/// Fastest angular speed of each joint, rad/s. Shape `[joints]`.
pub fn peak_speeds(of: &Performance) -> Vec<f64> {
    let joints = of.frames.first().map_or(0, |f| f.rotations.len());
    let mut peaks = vec![0.0; joints];
    for frame in speeds(of) {
        for (peak, speed) in peaks.iter_mut().zip(frame) {
            *peak = f64::max(*peak, speed);
        }
    }
    peaks
}

/// Fastest angular speed of any joint, rad/s.
pub fn fastest(of: &Performance) -> f64 {
    peak_speeds(of).into_iter().fold(0.0, f64::max)
}

/// Name of the fastest joint, and the frame that it reaches at that speed.
pub fn where_fastest(of: &Performance, names: &[String]) -> (String, usize) {
    let mut most = (0.0, 0, 0);
    for (t, frame) in speeds(of).iter().enumerate() {
        for (j, &speed) in frame.iter().enumerate() {
            if speed > most.0 {
                most = (speed, j, t + 1);
            }
        }
    }
    (names.get(most.1).cloned().unwrap_or_default(), most.2)
}

/// Number of joints and frames that are over, by cause: the style, or the lock while it held, set down or released the
/// foot.
pub fn over(
    legs: &[Leg; 2],
    input_fastest: f64,
    raw: &Performance,
    locked: &Performance,
    streamed: &Streamed,
) -> table::Row {
    let allowed = ALLOWED * input_fastest;
    let [mut style, mut held, mut set_down, mut let_go] = [0; 4];
    for (t, (before, after)) in speeds(raw).iter().zip(speeds(locked)).enumerate() {
        for (j, (raw, locked)) in before.iter().zip(after).enumerate() {
            if locked <= allowed {
                continue;
            }
            let leg = legs.iter().position(|l| [l.hip, l.knee, l.ankle].contains(&j));
            let held_at = |t: usize, side: usize| streamed.steps.get(t).is_some_and(|s| s.report.held[side]);
            *match leg {
                _ if *raw > allowed => &mut style,
                None => &mut style,
                Some(side) if held_at(t, side) && held_at(t + 1, side) => &mut held,
                Some(side) if held_at(t + 1, side) => &mut set_down,
                Some(_) => &mut let_go,
            } += 1;
        }
    }
    row(json!({
        "over_style": style,
        "over_held": held,
        "over_set_down": set_down,
        "over_let_go": let_go,
    }))
}

/// Effect of the speed limit: the number of frames that it changes, and the mean and largest displacement of a joint, cm,
/// over all joints and frames.
pub fn held_back(skeleton: &Skeleton, unlimited: &Performance, limited: &Performance) -> table::Row {
    let (mut frames, mut most, mut sum, mut count) = (0, 0.0f64, 0.0, 0.0);
    for (a, b) in unlimited.frames.iter().zip(&limited.frames) {
        frames += usize::from(a.rotations != b.rotations);
        for (p, q) in a.positions(skeleton).iter().zip(b.positions(skeleton)) {
            let moved = 100.0 * (p - q).norm();
            (most, sum, count) = (most.max(moved), sum + moved, count + 1.0);
        }
    }
    row(json!({
        "limited_frames": frames,
        "limited_cm": sum / f64::max(count, 1.0),
        "limited_cm_max": most,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_allowed_is_the_default_limit() {
        assert_eq!(ALLOWED as f32, gestus_core::Config::new().speed_limit);
    }
}
