//! Foot contacts of a clip, from where its feet are and how fast they move.
//!
//! A foot stands where the lower of ankle and toe, less its usual height over the floor, is low and slow; with
//! hysteresis, so that noise does not make it flicker. Thresholds follow the size of the body.

use crate::{landmarks::Landmarks, motion::Clip};

/// Which foot stands, left and right, in every frame. Shape `[frames]`.
pub fn contacts(clip: &Clip, landmarks: &Landmarks) -> Vec<[bool; 2]> {
    let positions: Vec<_> = clip.frames.iter().map(|f| f.positions(&clip.skeleton)).collect();
    let frames = positions.len();
    let leg =
        landmarks.knees.iter().chain(&landmarks.feet).map(|&j| clip.skeleton.offsets[j].norm()).sum::<f64>()
            / 2.0;
    let mut result = vec![[false; 2]; frames];
    for side in [0, 1] {
        let joints = [landmarks.feet[side], landmarks.toes[side]];
        // Height over the joint's own low: its 5% quantile, so that one bad frame does not count.
        let lows = joints.map(|j| {
            let mut heights: Vec<f64> = positions.iter().map(|p| p[j].y).collect();
            heights.sort_by(f64::total_cmp);
            heights[frames / 20]
        });
        let state = |t: usize| -> (f64, f64) {
            let (before, after) = (t.saturating_sub(1), (t + 1).min(frames - 1));
            let seconds = (after - before).max(1) as f64 / clip.rate_hz;
            let of = |i: usize| {
                let j = joints[i];
                let speed = (positions[after][j] - positions[before][j]).norm() / seconds;
                (positions[t][j].y - lows[i], speed)
            };
            let (ankle, toe) = (of(0), of(1));
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
    tidy(&mut result, clip.rate_hz);
    result
}

/// Removes contacts and gaps shorter than 50 ms.
fn tidy(contacts: &mut [[bool; 2]], rate_hz: f64) {
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
