//! The figures, from poses as dofs. See `docs/METRICS.md`.

pub mod annotator;
pub mod feet;
pub mod figures;
pub mod performance;
pub mod speed;

use gestus_core::blob::layout::dof;
use nalgebra::Vector3;

use gestus_motion::{
    body::{Body, row_at},
    corpus::Cycle,
    statistics::mean,
};

pub use gestus_motion::clip::joint_distance;

/// Joint positions of a pose, hips-centred and facing +Z, metres. Shape `[joints]`.
pub fn centred(body: &Body, dofs: &[f64]) -> Vec<Vector3<f64>> {
    let frame = body.pose(dofs, [0.0; 2], 0.0);
    let root = frame.root;
    frame.positions(&body.skeleton).into_iter().map(|p| p - root).collect()
}

/// Where the frames of one clip are in another: at equal canonical time. Gaits repeat, so canonical time is known
/// up to whole cycles: `shift` of them lie between the two, and cycles beyond the other's last start again at its
/// first.
pub fn matched(cycles: &[Cycle], frame: usize, other: &[Cycle], shift: usize) -> Option<f64> {
    let index = cycles.iter().position(|c| {
        let (start, end) = c.span();
        start <= frame as f64 && (frame as f64) < end
    })?;
    Some(other[(index + shift) % other.len()].position(cycles[index].phase(frame as f64)))
}

/// The shift, in whole cycles, at which the turns of two clips agree best: least squared difference of the cycles'
/// mean yaw rates.
pub fn best_shift(rows: &[Vec<f64>], cycles: &[Cycle], other_rows: &[Vec<f64>], other: &[Cycle]) -> usize {
    let yaw = |rows: &[Vec<f64>], c: &Cycle| {
        let (start, end) = c.span();
        let span = &rows[start.max(0.0) as usize..(end.ceil() as usize).clamp(1, rows.len())];
        mean(span.iter().map(|r| r[dof::YAW]))
    };
    let (own, theirs): (Vec<f64>, Vec<f64>) =
        (cycles.iter().map(|c| yaw(rows, c)).collect(), other.iter().map(|c| yaw(other_rows, c)).collect());
    let misfit = |shift: usize| -> f64 {
        own.iter().enumerate().map(|(i, y)| (y - theirs[(i + shift) % theirs.len()]).powi(2)).sum()
    };
    (0..theirs.len()).min_by(|&a, &b| misfit(a).total_cmp(&misfit(b))).unwrap_or(0)
}

/// Third differences of joint positions, mean norm, metres a frame cubed.
pub fn third_difference(poses: &[Vec<Vector3<f64>>]) -> f64 {
    let mut sum = 0.0;
    let mut count = 0;
    for w in poses.windows(4) {
        for j in 0..w[0].len() {
            sum += (w[3][j] - w[2][j] * 3.0 + w[1][j] * 3.0 - w[0][j]).norm();
            count += 1;
        }
    }
    sum / f64::from(count.max(1))
}

/// The greatest acceleration of a joint in each frame but the first and the last, m/s². Shape `[frames - 2]`.
pub fn accelerations(poses: &[Vec<Vector3<f64>>], rate_hz: f64) -> Vec<f64> {
    let of = |w: &[Vec<Vector3<f64>>]| {
        let joints = (0..w[0].len()).map(|j| (w[2][j] - w[1][j] * 2.0 + w[0][j]).norm());
        joints.fold(0.0, f64::max) * rate_hz * rate_hz
    };
    poses.windows(3).map(of).collect()
}

/// Time on either side of a frame whose mean place a joint swings about, seconds.
const SWING_S: f64 = 0.75;

/// How far joints swing: root mean square distance of each from its mean place in the second and a half around, over joints
/// and frames, metres. `None` of a motion that is shorter.
pub fn amplitude(poses: &[Vec<Vector3<f64>>], rate_hz: f64) -> Option<f64> {
    let reach = (SWING_S * rate_hz).round() as usize;
    let (mut sum, mut count) = (0.0, 0.0);
    for window in poses.windows(2 * reach + 1) {
        for (j, now) in window[reach].iter().enumerate() {
            let place = window.iter().map(|pose| pose[j]).sum::<Vector3<f64>>() / window.len() as f64;
            sum += (now - place).norm_squared();
            count += 1.0;
        }
    }
    (count > 0.0).then(|| (sum / count).sqrt())
}

/// Cycle-to-cycle variability: root mean square distance of the joints from the mean cycle, at equal phases, metres.
/// `None` of fewer than two cycles.
pub fn variability(body: &Body, rows: &[Vec<f64>], cycles: &[Cycle]) -> Option<f64> {
    const PHASES: usize = 16;
    if cycles.len() < 2 {
        return None;
    }
    let (mut sum, mut count) = (0.0, 0.0);
    for p in 0..PHASES {
        let phase = p as f64 / PHASES as f64;
        let poses: Vec<Vec<Vector3<f64>>> =
            cycles.iter().map(|c| centred(body, &row_at(rows, c.position(phase)))).collect();
        for j in 0..poses[0].len() {
            let mean = poses.iter().map(|p| p[j]).sum::<Vector3<f64>>() / poses.len() as f64;
            sum += poses.iter().map(|p| (p[j] - mean).norm_squared()).sum::<f64>();
            count += poses.len() as f64 - 1.0;
        }
    }
    Some((sum / count).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A joint that swings by `size` while its place moves on. Its mean place of a window is on the way: the 47 frames that
    /// are a second and a half at 30 Hz are three periods.
    fn swinging(size: f64) -> Vec<Vec<Vector3<f64>>> {
        let place = |t: usize| {
            let frames = t as f64;
            vec![Vector3::new(
                0.2 / 30.0 * frames,
                1.0,
                size * (std::f64::consts::TAU * 3.0 / 47.0 * frames).sin(),
            )]
        };
        (0..300).map(place).collect()
    }

    #[test]
    fn an_acceleration_is_that_of_the_fastest_joint() {
        let falls = |g: f64, t: f64| Vector3::new(3.0 * t, -0.5 * g * t * t, 0.0);
        let poses: Vec<_> =
            (0..5).map(|t| f64::from(t) / 30.0).map(|t| vec![falls(1.0, t), falls(9.81, t)]).collect();
        let all = accelerations(&poses, 30.0);
        assert_eq!(all.len(), 3);
        assert!(all.iter().all(|a| (a - 9.81).abs() < 1e-9), "{all:?}");
        assert!(accelerations(&poses[..2], 30.0).is_empty());
    }

    #[test]
    fn an_amplitude_is_that_of_the_swing_and_not_of_the_way() {
        let swing = amplitude(&swinging(0.1), 30.0).unwrap();
        assert!((swing - 0.1 / 2f64.sqrt()).abs() < 0.001, "{swing}");
        assert!(amplitude(&swinging(0.0), 30.0).unwrap() < 1e-9);
        assert_eq!(amplitude(&swinging(0.1)[..40], 30.0), None, "shorter than a second and a half");
    }
}
