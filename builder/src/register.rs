//! Registration: every clip gets contacts and a canonical timeline, so that moments of different clips of an action
//! can be told to be the same moment (paper 000, section 4).
//!
//! Gaits are cut into cycles by their strikes. Whole-clip actions are warped onto a reference clip of the action,
//! the one of middle length, by iterative motion warping (paper 001, section 3).

use nalgebra::{Quaternion, UnitQuaternion};
use rayon::prelude::*;

use crate::{
    annotate::Kind,
    body::log,
    contact,
    corpus::{Corpus, Cycle, Example},
    landmarks::{LandmarkError, Landmarks},
    motion::{Clip, Frame},
    segment,
    warp::{
        self,
        imw::{Config, imw},
    },
};

/// Knots of a whole-clip action: its canonical time is linear between them.
const WHOLE_SEGMENTS: usize = 12;

/// A clip and what it is.
#[derive(Debug, Clone)]
pub struct Performance {
    /// The motion.
    pub clip: Clip,
    /// Its action.
    pub action: String,
    /// Its style.
    pub style: String,
    /// Which take it is.
    pub take: String,
    /// How the action gets its timeline.
    pub kind: Kind,
    /// Licence or source.
    pub licence: String,
}

/// Registers clips of one skeleton and one rate. Clips in which no cycle is found are left out; the second value
/// says which.
///
/// # Errors
/// [`LandmarkError`] where the skeleton has no recognisable legs.
pub fn register(performances: Vec<Performance>) -> Result<(Corpus, Vec<String>), LandmarkError> {
    let skeleton = performances[0].clip.skeleton.clone();
    let rate_hz = performances[0].clip.rate_hz;
    let landmarks = Landmarks::find(&skeleton)?;
    let mut corpus =
        Corpus { skeleton, rate_hz, actions: Vec::new(), styles: Vec::new(), examples: Vec::new() };
    let number = |list: &mut Vec<String>, name: &str| {
        list.iter().position(|n| n == name).unwrap_or_else(|| {
            list.push(name.to_owned());
            list.len() - 1
        })
    };
    let references = references(&performances);
    let timelines: Vec<Vec<Cycle>> = performances
        .par_iter()
        .map(|p| match p.kind {
            Kind::Gait => segment::gait_cycles(&p.clip, &landmarks),
            Kind::Whole => {
                let reference = references.iter().find(|(action, _)| *action == p.action);
                reference.map_or(Vec::new(), |(_, r)| vec![whole(&p.clip, &performances[*r].clip)])
            }
        })
        .collect();
    let mut warnings = Vec::new();
    for (performance, cycles) in performances.into_iter().zip(timelines) {
        if cycles.is_empty() {
            warnings.push(no_cycle(&performance.clip));
            continue;
        }
        let contacts = contact::contacts(&performance.clip, &landmarks);
        corpus.examples.push(Example {
            action: number(&mut corpus.actions, &performance.action),
            style: number(&mut corpus.styles, &performance.style),
            clip: performance.clip,
            contacts,
            cycles,
            licence: performance.licence,
            take: performance.take,
        });
    }
    contact::carry(&mut corpus.examples);
    Ok((corpus, warnings))
}

/// Why a gait is left out.
pub fn no_cycle(clip: &Clip) -> String {
    format!(
        "{}: no gait cycle found in {:.1} s; if the action is no gait, set its `kind` in {}",
        clip.name,
        clip.duration_s(),
        crate::annotate::FILE_NAME
    )
}

/// For each whole-clip action the clip of middle length.
fn references(performances: &[Performance]) -> Vec<(String, usize)> {
    let mut found: Vec<(String, usize)> = Vec::new();
    for p in performances.iter().filter(|p| p.kind == Kind::Whole) {
        if found.iter().any(|(action, _)| *action == p.action) {
            continue;
        }
        let mut clips: Vec<usize> =
            (0..performances.len()).filter(|&i| performances[i].action == p.action).collect();
        clips.sort_by_key(|&i| performances[i].clip.frames.len());
        found.push((p.action.clone(), clips[clips.len() / 2]));
    }
    found
}

/// The timeline of a whole-clip action: where the clip is at uniform steps of the reference's time.
///
/// The clip is brought to the reference's length first, so that the slope limit is about the course of the action and
/// not about its duration. A clip that can't be warped gets a straight line.
fn whole(clip: &Clip, reference: &Clip) -> Cycle {
    let last = clip.frames.len().saturating_sub(1) as f64;
    let straight =
        Cycle { knots: (0..=WHOLE_SEGMENTS).map(|i| last * i as f64 / WHOLE_SEGMENTS as f64).collect() };
    let count = reference.frames.len();
    if count < 2 || clip.frames.len() < 2 {
        return straight;
    }
    let end = (count - 1) as f64;
    let even: Vec<Frame> = (0..count).map(|i| clip.at(last * i as f64 / end)).collect();
    let means = middles(&reference.frames);
    let (u, y) = warp::standardised(&angles(&reference.frames, &means), &angles(&even, &means));
    let Ok(solution) = imw(&u, &y, &Config::default()) else { return straight };
    let mut knots = straight.knots.clone();
    for (i, knot) in knots.iter_mut().enumerate().take(WHOLE_SEGMENTS).skip(1) {
        *knot = solution.warp.at(end * i as f64 / WHOLE_SEGMENTS as f64) / end * last;
    }
    if knots.windows(2).all(|w| w[0] < w[1]) { Cycle { knots } } else { straight }
}

/// Mean rotation of each joint: the normalised sum of quaternions, each on the first one's side. Shape `[joints]`.
fn middles(frames: &[Frame]) -> Vec<UnitQuaternion<f64>> {
    (0..frames[0].rotations.len())
        .map(|j| {
            let first = frames[0].rotations[j];
            let mut sum = Quaternion::default();
            for frame in frames {
                let q = frame.rotations[j].into_inner();
                sum += if first.coords.dot(&q.coords) < 0.0 { -q } else { q };
            }
            UnitQuaternion::try_new(sum, 1e-9).unwrap_or(first)
        })
        .collect()
}

/// What is warped: height of the hips, and exponential maps of the joints about their means; where the body is and which
/// way it faces don't count. Shape `[frames x dofs]`.
fn angles(frames: &[Frame], means: &[UnitQuaternion<f64>]) -> Vec<Vec<f64>> {
    frames
        .iter()
        .map(|frame| {
            let joints = frame.rotations.iter().zip(means).skip(1);
            let maps = joints.flat_map(|(q, mean)| {
                let v = log(&(mean.inverse() * q));
                [v.x, v.y, v.z]
            });
            std::iter::once(frame.root.y).chain(maps).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use nalgebra::Vector3;

    use super::*;
    use crate::motion::Skeleton;

    /// A clip of two joints that swing; `course` maps time 0 to 1 to progress 0 to 1.
    fn clip(frames: usize, size: f64, course: impl Fn(f64) -> f64) -> Clip {
        let skeleton = Skeleton {
            names: vec!["Hips".into(), "A".into(), "B".into()],
            parents: vec![None, Some(0), Some(0)],
            offsets: vec![Vector3::zeros(), Vector3::y(), -Vector3::y()],
        };
        let turn = |x: f64, y: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, 0.2));
        let frames = (0..frames)
            .map(|i| {
                let x = course(i as f64 / (frames - 1) as f64) * std::f64::consts::TAU;
                Frame {
                    root: Vector3::y(),
                    rotations: vec![
                        UnitQuaternion::identity(),
                        turn(size * x.sin(), size * (2.0 * x).cos() + 0.4 * (size - 1.0)),
                        turn(0.6 * size * (x + 0.7).cos(), size * (1.5 * x).sin()),
                    ],
                }
            })
            .collect();
        Clip { name: "swing".into(), skeleton: Arc::new(skeleton), rate_hz: 60.0, frames }
    }

    #[test]
    fn a_whole_action_is_warped_onto_its_reference() {
        let reference = clip(100, 0.8, |x| x);
        // Slow at first, of another length and size.
        let course = |x: f64| x - 0.06 * (std::f64::consts::TAU * x).sin();
        let other = clip(151, 1.0, course);
        let cycle = whole(&other, &reference);
        assert_eq!(cycle.knots.len(), WHOLE_SEGMENTS + 1);
        assert_eq!(cycle.span(), (0.0, 150.0));
        for (i, knot) in cycle.knots.iter().enumerate() {
            let phase = i as f64 / WHOLE_SEGMENTS as f64;
            let error = (course(knot / 150.0) - phase).abs();
            assert!(error < 0.02, "phase {phase}: off by {error}");
        }
    }

    #[test]
    fn a_clip_of_one_frame_has_a_timeline() {
        let one = Clip { frames: clip(3, 1.0, |x| x).frames[..1].to_vec(), ..clip(3, 1.0, |x| x) };
        assert_eq!(whole(&one, &clip(50, 1.0, |x| x)).knots.len(), WHOLE_SEGMENTS + 1);
    }
}
