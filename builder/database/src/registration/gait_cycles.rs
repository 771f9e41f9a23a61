//! Gait cycles of a clip.
//!
//! The fore-aft distance of the feet (left minus right, along the heading) oscillates once per cycle: the left foot
//! strikes near its maximum, the right foot near its minimum. A cycle goes from a left strike to the right strike and the
//! next left strike: phases 0, 0.5 and 1 of canonical time.

use gestus_motion::{
    body::about_y,
    clip::Clip,
    corpus::Cycle,
    landmarks::Landmarks,
    statistics::{quantile, smooth, sorted},
};

/// Shortest half cycle, seconds: a sprint has about 0.25.
const MIN_HALF_CYCLE_S: f64 = 0.16;
/// Longest half cycle, seconds: slower is standing.
const MAX_HALF_CYCLE_S: f64 = 1.6;

/// A strike: an extreme of the distance.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Strike {
    left: bool,
    at: f64,
    value: f64,
}

/// The gait cycles of a clip, in order; empty if there are none.
pub fn gait_cycles(clip: &Clip, landmarks: &Landmarks) -> Vec<Cycle> {
    let separation = separation(clip, landmarks);
    let strikes = strikes(&separation, clip.rate_hz);
    strikes
        .windows(3)
        .filter(|w| w[0].left)
        .filter(|w| w.windows(2).all(|p| p[1].at - p[0].at <= MAX_HALF_CYCLE_S * clip.rate_hz))
        .map(|w| Cycle { knots: w.iter().map(|s| s.at).collect() })
        .collect()
}

/// Left foot minus right foot along the heading, smoothed, metres. Shape `[frames]`.
pub fn separation(clip: &Clip, landmarks: &Landmarks) -> Vec<f64> {
    let raw: Vec<f64> = clip
        .frames
        .iter()
        .map(|frame| {
            let p = frame.positions(&clip.skeleton);
            let line = p[landmarks.hip_joints[0]] - p[landmarks.hip_joints[1]];
            let heading = (-line.z).atan2(line.x);
            let between_feet = p[landmarks.feet[0]] - p[landmarks.feet[1]];
            (about_y(-heading) * between_feet).z
        })
        .collect();
    smooth(&raw, 0.045 * clip.rate_hz)
}

/// Alternating extremes of a signal whose difference is a sufficient part of its range.
fn strikes(signal: &[f64], rate_hz: f64) -> Vec<Strike> {
    let sorted = sorted(signal.iter().copied());
    let quantile = |q: f64| quantile(&sorted, q).unwrap_or(0.0);
    if signal.len() < 3 {
        return Vec::new();
    }
    let swing = quantile(0.95) - quantile(0.05);
    // Feet that hardly part are not walking.
    if swing < 0.06 {
        return Vec::new();
    }
    let mut found: Vec<Strike> = Vec::new();
    for t in 1..signal.len() - 1 {
        let (a, b, c) = (signal[t - 1], signal[t], signal[t + 1]);
        let left = b > a && b >= c;
        let right = b < a && b <= c;
        if !left && !right {
            continue;
        }
        // The vertex of the parabola through the three.
        let bend = a - 2.0 * b + c;
        let offset = if bend.abs() > 1e-12 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 };
        let strike = Strike { left, at: t as f64 + offset, value: b - 0.25 * (a - c) * offset };
        insert(&mut found, strike, 0.3 * swing, MIN_HALF_CYCLE_S * rate_hz);
    }
    found
}

/// Adds an extreme. Of two consecutive maxima or minima the more extreme one is kept; a pair that is too close in time or
/// value is dropped as noise.
fn insert(found: &mut Vec<Strike>, strike: Strike, prominence: f64, distance: f64) {
    match found.last() {
        Some(last) if last.left == strike.left => {
            let more = if strike.left { strike.value > last.value } else { strike.value < last.value };
            if more {
                found.pop();
                found.push(strike);
            }
        }
        Some(last) if (last.value - strike.value).abs() < prominence || strike.at - last.at < distance => {}
        _ => found.push(strike),
    }
}
