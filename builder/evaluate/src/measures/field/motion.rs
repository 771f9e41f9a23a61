//! Skating ratio and jerk.

use gestus_core::blob::Leg;
use gestus_motion::{
    clip::{Clip, Skeleton},
    statistics::mean,
};
use nalgebra::Vector3;

/// How far above where it stands a foot joint counts as low, metres, and how fast it may move there, m/s: 2.5 cm a frame at
/// 20 frames a second (after Karunratanakul et al. 2023, whose ratio SMooDi reports).
const LOW_M: f64 = 0.05;
const SLIDES_M_S: f64 = 0.5;

/// Share of the frames in which an ankle or toe joint, of either foot, is low in this frame and the one before and slides.
pub fn skating_ratio(skeleton: &Skeleton, legs: &[Leg; 2], clip: &Clip) -> f64 {
    let positions: Vec<Vec<Vector3<f64>>> = clip.frames.iter().map(|f| f.positions(skeleton)).collect();
    let joints: Vec<(usize, f64)> = legs
        .iter()
        .flat_map(|leg| {
            let heights = leg.heights.map(f64::from);
            [Some((leg.ankle, heights[0])), leg.toe.map(|toe| (toe, heights[1]))]
        })
        .flatten()
        .collect();
    let slides = |w: &[Vec<Vector3<f64>>]| {
        joints.iter().any(|&(j, height)| {
            let low = w.iter().all(|p| p[j].y - height < LOW_M);
            low && (w[1][j].x - w[0][j].x).hypot(w[1][j].z - w[0][j].z) * clip.rate_hz > SLIDES_M_S
        })
    };
    mean(positions.windows(2).map(|w| f64::from(u8::from(slides(w)))))
}

/// Mean norm of the third derivative of the joints' positions in the world, m/s³.
pub fn jerk(clip: &Clip) -> f64 {
    let positions: Vec<Vec<Vector3<f64>>> = clip.frames.iter().map(|f| f.positions(&clip.skeleton)).collect();
    let of = |w: &[Vec<Vector3<f64>>]| {
        let joints = 0..w[0].len();
        mean(joints.map(|j| (w[3][j] - w[2][j] * 3.0 + w[1][j] * 3.0 - w[0][j]).norm()))
    };
    mean(positions.windows(4).map(of)) * clip.rate_hz.powi(3)
}
