//! Deviations of a walk or run, made by rule: what Hsu 2005, section 5.2, captured.
//!
//! Each grows from nothing and is gone again by its end: `sin²`, at most 1, times
//!
//! | deviation | lasts | hip of one leg | knee | spine | root |
//! |---|---|---|---|---|---|
//! | step over | one swing of a leg | 0.8 rad bent | 1.3 rad bent | | |
//! | duck | one cycle | | | 0.9 rad forward | 0.2 of the leg's length down |
//! | limbo | one cycle | | | 0.8 rad back | 0.2 of the leg's length down |
//!
//! Where the root goes down, the legs keep the ankles where they were.

use std::f64::consts::PI;

use gestus_database::{
    retarget::{file::MapFile, identify::Parts},
    stream::cleanup::{Limbs, with_ankles_of},
};
use gestus_motion::{
    body::Body,
    clip::{Clip, Frame, Skeleton},
    corpus::Example,
};
use nalgebra::{Unit, UnitQuaternion, Vector3};

/// What the input does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Deviation {
    StepOver,
    Duck,
    Limbo,
}

/// All of them, by name.
pub const DEVIATIONS: [(&str, Deviation); 3] =
    [("step-over", Deviation::StepOver), ("duck", Deviation::Duck), ("limbo", Deviation::Limbo)];

/// A clip that deviates.
pub struct Deviating {
    /// The clip, as long as the one that it is made of.
    pub clip: Clip,
    /// First frame of the deviation, and the first behind it.
    pub frames: [usize; 2],
}

/// An example that deviates in its middle cycle, behind which lies another. `None` where it has fewer cycles, no swing of a
/// leg in that one, or no feet or spine that are found.
pub fn deviating(body: &Body, example: &Example, deviation: Deviation) -> Option<Deviating> {
    let clip = &example.clip;
    let middle =
        &example.cycles[..example.cycles.len().checked_sub(1)?].get((example.cycles.len() - 1) / 2)?;
    let (start, end) = middle.span();
    let cycle = [start.ceil().max(0.0) as usize, (end.ceil() as usize).min(clip.frames.len())];
    let (side, [start, end]) = match deviation {
        Deviation::StepOver => swing(&example.contacts, cycle)?,
        Deviation::Duck | Deviation::Limbo => (0, cycle),
    };
    let (limbs, _) = Limbs::of_clip(body, clip)?;
    let spine = Parts::find(&clip.skeleton, &clip.frames[..1], &MapFile::default()).ok()?.spine;
    let marks = &body.landmarks;
    let [thigh, shin] = [marks.knees, marks.feet].map(|joints| clip.skeleton.offsets[joints[0]].norm());
    let mut frames = clip.frames.clone();
    for (t, frame) in frames.iter_mut().enumerate().take(end).skip(start) {
        let part = (PI * (t - start) as f64 / (end - start) as f64).sin().powi(2);
        let left = frame.rotations[0] * body.hips_line;
        let turns: Vec<(usize, f64)> = match deviation {
            Deviation::StepOver => vec![(marks.hip_joints[side], -0.8), (marks.knees[side], 1.3)],
            Deviation::Duck => spine.iter().map(|&joint| (joint, 0.9 / spine.len() as f64)).collect(),
            Deviation::Limbo => spine.iter().map(|&joint| (joint, -0.8 / spine.len() as f64)).collect(),
        };
        for (joint, angle) in turns {
            turn(frame, &clip.skeleton, joint, left, part * angle);
        }
        if deviation != Deviation::StepOver {
            frame.root.y -= 0.2 * part * (thigh + shin);
        }
    }
    if deviation != Deviation::StepOver {
        let kept = with_ankles_of(&limbs, &frames[start..end], &clip.frames[start..end]);
        frames.splice(start..end, kept);
    }
    Some(Deviating { clip: Clip { frames, ..clip.clone() }, frames: [start, end] })
}

/// The longest swing of a leg that begins and ends in some frames: the side, the first frame of it, the first behind it.
fn swing(contacts: &[[bool; 2]], [first, end]: [usize; 2]) -> Option<(usize, [usize; 2])> {
    let mut longest: Option<(usize, [usize; 2])> = None;
    for side in [0, 1] {
        let stands = |t: usize| contacts[t][side];
        let mut t = first.max(1);
        while t < end {
            if stands(t) || !stands(t - 1) {
                t += 1;
                continue;
            }
            let Some(down) = (t..end).find(|&t| stands(t)) else { break };
            if longest.is_none_or(|(_, [a, b])| down - t > b - a) {
                longest = Some((side, [t, down]));
            }
            t = down;
        }
    }
    longest
}

/// Turns a joint, and all that hangs on it, about an axis of the world.
fn turn(frame: &mut Frame, skeleton: &Skeleton, joint: usize, axis: Vector3<f64>, angle: f64) {
    let mut above = UnitQuaternion::identity();
    let mut parent = skeleton.parents[joint];
    while let Some(j) = parent {
        above = frame.rotations[j] * above;
        parent = skeleton.parents[j];
    }
    let axis = Unit::new_normalize(above.inverse() * axis);
    frame.rotations[joint] = UnitQuaternion::from_axis_angle(&axis, angle) * frame.rotations[joint];
}

#[cfg(test)]
mod tests {
    use gestus_database::{retarget::parts::Part, synth};

    use super::*;

    #[test]
    fn a_leg_is_lifted_a_head_goes_down_and_standing_feet_stay() {
        let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral"], 1, 6.0)).unwrap();
        let (body, example) = (Body::of(&corpus).unwrap(), &corpus.examples[0]);
        let marks = &body.landmarks;
        let frames = &example.clip.frames[..1];
        let head =
            Parts::find(&corpus.skeleton, frames, &MapFile::default()).unwrap().get(Part::Head).unwrap();
        for (name, deviation) in DEVIATIONS {
            let made = deviating(&body, example, deviation).unwrap();
            let [start, end] = made.frames;
            let positions = |clip: &Clip, t: usize| clip.frames[t].positions(&clip.skeleton);
            let middle = (start + end) / 2;
            let (plain, deviates) = (positions(&example.clip, middle), positions(&made.clip, middle));
            let side = deviates[0];
            let ahead = body.heading(&made.clip.frames[middle]).sin_cos();
            let forward = |p: Vector3<f64>| (p - side).dot(&Vector3::new(ahead.0, 0.0, ahead.1));
            match deviation {
                Deviation::StepOver => {
                    let lift = marks.feet.map(|foot| deviates[foot].y - plain[foot].y);
                    assert!(lift[0].max(lift[1]) > 0.15 && lift[0].min(lift[1]).abs() < 1e-6, "{lift:?}");
                }
                Deviation::Duck | Deviation::Limbo => {
                    assert!(deviates[head].y < plain[head].y - 0.2, "{name}");
                    assert_eq!(forward(deviates[head]) > 0.0, deviation == Deviation::Duck, "{name}");
                    for foot in marks.feet {
                        assert!((deviates[foot] - plain[foot]).norm() < 0.01, "{name}");
                    }
                }
            }
            // Nothing is left of it where it ends.
            for t in [start, end] {
                let moved = positions(&made.clip, t)
                    .iter()
                    .zip(positions(&example.clip, t))
                    .map(|(a, b)| (a - b).norm())
                    .fold(0.0, f64::max);
                assert!(moved < 0.01, "{name}: {moved}");
            }
        }
    }
}
