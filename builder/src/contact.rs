//! Foot contacts of a clip, from where its feet are and how fast they move.
//!
//! A foot stands where the lower of ankle and toe, less its usual height over the floor, is low and slow; with
//! hysteresis, so that noise does not make it flicker. Thresholds follow the size of the body.

use crate::{
    corpus::{Cycle, Example},
    landmarks::Landmarks,
    motion::Clip,
};

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

/// Marks of a canonical timeline.
const MARKS: usize = 48;

/// Annotates the canonical timeline of every action in every style, and carries it to the clips: at each phase a foot
/// stands where it stands in most cycles (paper 000, section 4). Outside of the cycles the clip's own contacts stay.
///
/// One clip's noise then labels no frame of its own; what a style does at a phase, it does in all its cycles.
pub fn carry(examples: &mut [Example]) {
    let mut classes: Vec<(usize, usize)> = examples.iter().map(|e| (e.action, e.style)).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let mut stands = [[0.0f64; 2]; MARKS];
        let mut seen = [0.0f64; MARKS];
        for example in examples.iter().filter(|e| (e.action, e.style) == class) {
            for (frame, phase) in phases(example) {
                let mark = mark(phase);
                seen[mark] += 1.0;
                for side in [0, 1] {
                    stands[mark][side] += f64::from(u8::from(example.contacts[frame][side]));
                }
            }
        }
        for example in examples.iter_mut().filter(|e| (e.action, e.style) == class) {
            for (frame, phase) in phases(example) {
                let mark = mark(phase);
                // A few cycles leave no majority to speak of.
                if seen[mark] >= 3.0 {
                    example.contacts[frame] = stands[mark].map(|s| s > 0.5 * seen[mark]);
                }
            }
        }
    }
}

fn mark(phase: f64) -> usize {
    ((phase * MARKS as f64) as usize).min(MARKS - 1)
}

/// The frames of a clip that lie in a cycle, with their phases.
fn phases(example: &Example) -> Vec<(usize, f64)> {
    let frames = example.clip.frames.len();
    let of = |c: &Cycle| {
        let (start, end) = c.span();
        let range = start.ceil().max(0.0) as usize..(end.ceil().max(0.0) as usize).min(frames);
        range.map(|f| (f, c.phase(f as f64))).collect::<Vec<_>>()
    };
    example.cycles.iter().flat_map(of).collect()
}
