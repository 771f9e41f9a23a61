//! Registration: every clip gets contacts and a canonical timeline, on which equal times of different clips of an action
//! are the same moment (Xia 2015, section 4).
//!
//! Gaits are cut into cycles at foot strikes. Whole-clip actions are warped onto a reference clip of the action, the one
//! of median length, by iterative motion warping (Hsu 2005, section 3).

pub mod contact;
pub mod floor;
pub mod gait_cycles;
pub mod timeline;
pub mod warp;

use nalgebra::{Quaternion, UnitQuaternion};
use rayon::prelude::*;

use crate::registration::{
    timeline::Kind,
    warp::imw::{Config, imw},
};
use gestus_motion::{
    body::log,
    clip::{Clip, Frame},
    corpus::{Corpus, Cycle, Example},
    landmarks::{LandmarkError, Landmarks},
};

/// Segments of a whole-clip action's timeline, one less than its knots; canonical time is linear in each.
const WHOLE_SEGMENTS: usize = 12;
/// Fewest frames of a whole-clip action: the search excludes the first and the last.
const MIN_FRAMES: usize = 3;
/// Least distance of knots, frames: in a blob they are 0.01 apart and rounded to `f32`.
const MIN_KNOT_DISTANCE: f64 = 0.02;

/// A clip and its labels.
#[derive(Debug, Clone)]
pub struct Performance {
    /// The motion.
    pub clip: Clip,
    /// Its action.
    pub action: String,
    /// Its style.
    pub style: String,
    /// Its take.
    pub take: String,
    /// Kind of the action's timeline.
    pub kind: Kind,
    /// Licence or source.
    pub licence: String,
}

/// Registers clips of one skeleton and one rate. Clips without a cycle are left out: they are the second value.
///
/// # Errors
/// [`LandmarkError`] if no legs are found in the skeleton.
pub fn register(performances: Vec<Performance>) -> Result<(Corpus, Vec<Performance>), LandmarkError> {
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
            Kind::Gait => gait_cycles::gait_cycles(&p.clip, &landmarks),
            Kind::Whole if is_short(&p.clip) => Vec::new(),
            Kind::Whole => {
                let reference = references.iter().find(|(action, _)| *action == p.action);
                let whole = |r: usize| whole(&p.clip, &performances[r].clip, warp::MAX_FRAMES);
                reference.map_or(Vec::new(), |(_, r)| vec![whole(*r)])
            }
        })
        .collect();
    let mut left_out = Vec::new();
    for (performance, cycles) in performances.into_iter().zip(timelines) {
        if cycles.is_empty() {
            left_out.push(performance);
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
    contact::apply_majority(&mut corpus.examples);
    Ok((corpus, left_out))
}

/// True if a clip of that kind can be registered on its own. Also true if no legs are found: registration reports that
/// error.
pub fn has_cycles(clip: &Clip, kind: Kind) -> bool {
    match kind {
        Kind::Gait => Landmarks::find(&clip.skeleton)
            .map_or(true, |landmarks| !gait_cycles::gait_cycles(clip, &landmarks).is_empty()),
        Kind::Whole => !is_short(clip),
    }
}

/// Share of a clip that is in gait cycles whose hips get along, 0 to 1.
pub fn walked(clip: &Clip) -> f64 {
    /// Least speed from strike to strike, m/s: a body that punches steps to and fro.
    const ALONG_M_S: f64 = 0.3;
    let Ok(landmarks) = Landmarks::find(&clip.skeleton) else { return 0.0 };
    let along = |cycle: &Cycle| {
        let (start, end) = cycle.span();
        let moved = clip.at(end).root - clip.at(start).root;
        (moved.x.hypot(moved.z) * clip.rate_hz > ALONG_M_S * (end - start)).then_some(end - start)
    };
    let cycles = gait_cycles::gait_cycles(clip, &landmarks);
    cycles.iter().filter_map(along).sum::<f64>() / clip.frames.len().max(1) as f64
}

/// Whether a clip is too short for a whole-clip action.
fn is_short(clip: &Clip) -> bool {
    clip.frames.len() < MIN_FRAMES
}

/// The message for a clip without a timeline.
pub fn no_cycle(clip: &Clip, kind: Kind) -> String {
    let Clip { name, frames, rate_hz, .. } = clip;
    match kind {
        Kind::Gait => format!(
            "{name}: no gait cycle found in {:.1} s; it takes two strikes of the left foot",
            clip.duration_s()
        ),
        Kind::Whole => format!(
            "{name}: too short: {} of the {MIN_FRAMES} frames that an action takes at least, at {rate_hz} a second; \
             leave a pose that is no motion out of the folder",
            frames.len()
        ),
    }
}

/// For each whole-clip action the clip of median length, among those that are long enough.
fn references(performances: &[Performance]) -> Vec<(String, usize)> {
    let mut found: Vec<(String, usize)> = Vec::new();
    let counts = |p: &Performance| p.kind == Kind::Whole && !is_short(&p.clip);
    for p in performances.iter().filter(|p| counts(p)) {
        if found.iter().any(|(action, _)| *action == p.action) {
            continue;
        }
        let mut clips: Vec<usize> = (0..performances.len())
            .filter(|&i| performances[i].action == p.action && counts(&performances[i]))
            .collect();
        clips.sort_by_key(|&i| performances[i].clip.frames.len());
        found.push((p.action.clone(), clips[clips.len() / 2]));
    }
    found
}

/// The timeline of a whole-clip action: the clip's frame at uniform steps of the reference's time.
///
/// The clip is resampled to the reference's length first, so that the slope limit applies to the course of the action
/// rather than its duration. Both are reduced to at most `most` frames. A clip that can't be warped gets a linear timeline.
fn whole(clip: &Clip, reference: &Clip, most: usize) -> Cycle {
    let last = (clip.frames.len() - 1) as f64;
    let straight =
        Cycle { knots: (0..=WHOLE_SEGMENTS).map(|i| last * i as f64 / WHOLE_SEGMENTS as f64).collect() };
    let count = reference.frames.len().min(most);
    let end = (count - 1) as f64;
    let [to, from] = [reference, clip].map(|clip| evenly_spaced(clip, count));
    let means = mean_rotations(&to);
    let (u, y) = warp::standardised(&angles(&to, &means), &angles(&from, &means));
    let Ok(solution) = imw(&u, &y, &Config::default()) else { return straight };
    let mut knots = straight.knots.clone();
    for (i, knot) in knots.iter_mut().enumerate().take(WHOLE_SEGMENTS).skip(1) {
        *knot = solution.warp.at(end * i as f64 / WHOLE_SEGMENTS as f64) / end * last;
    }
    if knots.windows(2).all(|w| w[1] - w[0] >= MIN_KNOT_DISTANCE) { Cycle { knots } } else { straight }
}

/// That many frames of a clip, evenly spaced from the first to the last.
fn evenly_spaced(clip: &Clip, count: usize) -> Vec<Frame> {
    let [last, end] = [clip.frames.len() - 1, count - 1].map(|n| n as f64);
    (0..count).map(|i| clip.at(last * i as f64 / end)).collect()
}

/// Mean rotation of each joint: the normalised sum of quaternions with signs matched to the first. Shape `[joints]`.
fn mean_rotations(frames: &[Frame]) -> Vec<UnitQuaternion<f64>> {
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

/// The dofs that are warped: height of the hips, and exponential maps of the joints about their means, without position
/// and heading. Shape `[frames x dofs]`.
///
/// The linear models' warp ([`warp::shape`]) also uses the tilt of the hips, which here would need a body to separate it
/// from the heading. It makes no difference: generated jumps, punches and kicks are off by 0.374 frames with it and 0.380
/// without (mean over six seeds, as in `tests/register.rs`).
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
    use gestus_motion::clip::Skeleton;

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
        let cycle = whole(&other, &reference, 512);
        assert_eq!(cycle.knots.len(), WHOLE_SEGMENTS + 1);
        assert_eq!(cycle.span(), (0.0, 150.0));
        for (i, knot) in cycle.knots.iter().enumerate() {
            let phase = i as f64 / WHOLE_SEGMENTS as f64;
            let error = (course(knot / 150.0) - phase).abs();
            assert!(error < 0.02, "phase {phase}: off by {error}");
        }
    }

    /// A warp takes time by the square of the frames: 3,000 took 18 s, for twelve knots. Thinning moves those by less than
    /// what they are off, and towards the truth: the more frames, the freer is the space warp, which is smooth from one
    /// to the next.
    #[test]
    fn a_long_clip_is_thinned_and_its_knots_stay() {
        let course = |x: f64| x - 0.06 * (std::f64::consts::TAU * x).sin();
        let measured = |frames: usize, most: usize| {
            let [reference, other] = [clip(frames, 0.8, |x| x), clip(frames + frames / 4, 1.0, course)];
            let knots = whole(&other, &reference, most).knots;
            // In shares of the clip.
            let off = |(i, knot): (usize, &f64)| {
                (course(knot / knots[WHOLE_SEGMENTS]) - i as f64 / WHOLE_SEGMENTS as f64).abs()
            };
            knots.iter().enumerate().map(off).sum::<f64>() / knots.len() as f64
        };
        let full = measured(1000, usize::MAX);
        let [thinned, long] = [1000, 3000].map(|frames| measured(frames, warp::MAX_FRAMES));
        assert!(full < 0.005 && thinned < full && long < full, "{full} {thinned} {long}");
    }

    /// A calibration pose had 13 knots that were all 0, and `build` reported a fault of its own.
    #[test]
    fn knots_of_the_shortest_clips_are_apart() {
        for frames in MIN_FRAMES..16 {
            for reference in [MIN_FRAMES, 4, 7, 60] {
                let bent = clip(frames, 1.0, |x| x * x);
                let knots = whole(&bent, &clip(reference, 0.8, |x| x), 512).knots;
                assert!(
                    knots.windows(2).all(|w| w[1] - w[0] >= MIN_KNOT_DISTANCE),
                    "{frames} frames: {knots:?}"
                );
                assert_eq!([knots[0], knots[WHOLE_SEGMENTS]], [0.0, (frames - 1) as f64]);
            }
        }
    }

    /// Where most clips of an action are poses, one of them was of middle length, and all others got straight lines.
    #[test]
    fn a_clip_too_short_for_an_action_is_no_reference_of_it() {
        let of = |frames: usize, kind: Kind| Performance {
            clip: Clip { frames: clip(9, 1.0, |x| x).frames[..frames].to_vec(), ..clip(9, 1.0, |x| x) },
            action: "punch".into(),
            style: "proud".into(),
            take: String::new(),
            kind,
            licence: String::new(),
        };
        let whole = |frames: usize| of(frames, Kind::Whole);
        assert_eq!(references(&[whole(1), whole(2), whole(5), whole(9), whole(1)]), [("punch".into(), 3)]);
        assert_eq!(references(&[whole(1), whole(2), of(9, Kind::Gait)]), []);
        assert!(has_cycles(&whole(3).clip, Kind::Whole) && !has_cycles(&whole(2).clip, Kind::Whole));
        let said = no_cycle(&whole(1).clip, Kind::Whole);
        assert!(
            said.contains("swing: too short: 1 of the 3 frames") && said.contains("at 60 a second"),
            "{said}"
        );
    }
}
