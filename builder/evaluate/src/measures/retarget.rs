//! Clips of other skeletons retargeted to a database's and back: errors of limb directions and of contact times.
//!
//! Two rows a clip. `database` compares the incoming body with the database's: seen from shoulder or hip, do hands and
//! feet lie in the same direction? `round-trip` compares it with itself after going there and back, where joints
//! without a counterpart stay at rest rather than being copied from the input. `docs/METRICS.md` defines the
//! figures.

use std::path::Path;

use anyhow::{Result, bail};
use gestus_core::Database;
use nalgebra::Vector3;
use serde_json::json;

use crate::{
    evaluation::{Evaluation, row},
    measures::OnDatabase,
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    command_line::progress,
    data_folder::config::Config,
    registration::contact::contacts,
    retarget::{
        MapFile, Retarget,
        body::Body,
        parts::{Part, Side},
    },
};
use gestus_motion::{
    binding::{Binding, Options},
    capture::read_folder,
    clip::{Clip, Frame},
    landmarks::Landmarks,
    statistics::{mean, mean_or_zero},
};

/// An end effector, seen from where its limb begins.
type Limb = (&'static str, fn(Side) -> Part, fn(Side) -> Part);

const LIMBS: [Limb; 4] = [
    ("hand", Part::UpperArm, Part::Hand),
    ("foot", Part::UpperLeg, Part::Foot),
    ("lower_arm", Part::LowerArm, Part::Hand),
    ("lower_leg", Part::LowerLeg, Part::Foot),
];

/// How the same limb of two bodies differs over a clip.
#[derive(Debug, Clone, Copy, Default)]
pub struct Directions {
    /// Mean angle between the two, degrees.
    pub mean_deg: f64,
    /// Largest angle of a frame, degrees.
    pub max_deg: f64,
}

/// Differences of the contacts of two clips.
#[derive(Debug, Clone, Copy, Default)]
pub struct Offsets {
    /// Starts and ends of contacts that both clips have, where each is nearest to the other.
    pub matched: usize,
    /// Those that only one clip has.
    pub unmatched: usize,
    /// Mean distance in time of the matched, frames at the database's rate.
    pub mean_frames: f64,
    /// Largest of them.
    pub max_frames: f64,
}

/// Angles between a limb of two bodies, frame by frame. The frames have to be in the same world.
pub fn directions(a: (&Body, &[Frame]), b: (&Body, &[Frame]), from: Part, to: Part) -> Option<Directions> {
    let joints = |body: &Body| Some((body.parts.get(from)?, body.parts.get(to)?));
    let (ja, jb) = (joints(a.0)?, joints(b.0)?);
    let way = |frame: &Frame, body: &Body, (from, to): (usize, usize)| -> Vector3<f64> {
        let p = frame.positions(&body.skeleton);
        p[to] - p[from]
    };
    let angles: Vec<f64> =
        a.1.iter().zip(b.1).map(|(f, g)| way(f, a.0, ja).angle(&way(g, b.0, jb)).to_degrees()).collect();
    Some(Directions {
        mean_deg: mean_or_zero(angles.iter().copied()),
        max_deg: angles.iter().copied().fold(0.0, f64::max),
    })
}

/// Angles of a limb over the sides on which both bodies have it; `None` where there are none, since 0 would be a perfect
/// fit.
fn both_sides(of: impl Fn(Side) -> Option<Directions>) -> Option<Directions> {
    let found: Vec<Directions> = Side::BOTH.into_iter().filter_map(of).collect();
    let max_deg = found.iter().map(|d| d.max_deg).reduce(f64::max)?;
    Some(Directions { mean_deg: mean(found.iter().map(|d| d.mean_deg)), max_deg })
}

/// Starts and ends of two clips' contacts, matched in time. `window` is the largest difference of a match, frames.
pub fn offsets(a: &[[bool; 2]], b: &[[bool; 2]], window: usize) -> Offsets {
    let mut result = Offsets::default();
    for side in [0, 1] {
        for on in [true, false] {
            let steps = |c: &[[bool; 2]]| -> Vec<usize> {
                (1..c.len()).filter(|&t| c[t][side] == on && c[t - 1][side] != on).collect()
            };
            let (x, y) = (steps(a), steps(b));
            let nearest = |t: usize, of: &[usize]| of.iter().copied().min_by_key(|&u| u.abs_diff(t));
            let matches = |&t: &usize| {
                let frames = nearest(t, &y).filter(|&u| nearest(u, &x) == Some(t))?.abs_diff(t);
                (frames <= window).then_some(frames as f64)
            };
            let matched: Vec<f64> = x.iter().filter_map(matches).collect();
            result.matched += matched.len();
            result.unmatched += x.len() + y.len() - 2 * matched.len();
            result.mean_frames += matched.iter().sum::<f64>();
            result.max_frames = matched.into_iter().fold(result.max_frames, f64::max);
        }
    }
    result.mean_frames /= result.matched.max(1) as f64;
    result
}

/// Options of `gestus evaluate retarget`.
#[derive(clap::Args, Debug)]
pub struct Args;

impl OnDatabase for Args {
    fn evaluate(&self, database: &Database<'_>, folder: &Path) -> Result<Evaluation> {
        evaluate(database, folder)
    }
}

/// Evaluates every clip of a folder that has another skeleton than the database, or the same.
///
/// # Errors
/// Where nothing in the folder can be mapped, or its `gestus.toml` can't be read.
pub fn evaluate(database: &Database<'_>, folder: &Path) -> Result<Evaluation> {
    let (config, files) = (Config::of_folder(folder)?, read_folder(folder)?);
    let options = Options { unit: config.unit(), ..Options::default() };
    let target = Body::of_database(database)?;
    let mut rows: Vec<table::Row> = Vec::new();
    let mut notes: Vec<String> = files.skipped.iter().map(ToString::to_string).collect();
    let bar = progress::bar(files.documents.len(), "retarget");
    for (path, document) in &files.documents {
        bar.inc(1);
        let mapped = || -> Result<_> {
            let clip = Binding::new(document, &options).and_then(|b| b.to_clip(document))?;
            Ok((Retarget::onto(database, target.clone(), &clip, &MapFile::default())?, clip))
        };
        match mapped() {
            Ok((retarget, clip)) => {
                rows.extend(compare(database, &retarget, &clip, config.class(folder, path).unzip()));
            }
            Err(e) => notes.push(format!("{}: {e:#}", path.display())),
        }
    }
    bar.finish_and_clear();
    for note in &notes {
        gestus_database::command_line::outputs::note(format_args!("left out: {note}"));
    }
    if files.documents.is_empty() {
        bail!("{}: there is no clip in it that can be read", folder.display());
    }
    if rows.is_empty() {
        bail!(
            "{}: none of its {} clips can be mapped to the database's skeleton; the lines above say why",
            folder.display(),
            files.documents.len()
        );
    }
    let trips = || rows.iter().filter(|r| r.get("method").is_some_and(|m| m == "round-trip"));
    let clips: Vec<String> = trips().map(|r| table::text(r.get("clip"))).collect();
    let of = |key: &str| {
        trips().map(|r| r.get(key).and_then(serde_json::Value::as_f64).unwrap_or(f64::NAN)).collect()
    };
    let figures = vec![Figure {
        name: "directions".into(),
        caption: "Largest direction error of a frame, after going to the database's skeleton and back."
            .into(),
        svg: plots::bars(
            Labels { title: "Round trip", x: "clip", y: "degrees" },
            &clips,
            &[("hands".into(), of("hand_max_deg")), ("feet".into(), of("foot_max_deg"))],
        ),
    }];
    Ok(Evaluation {
        what: "retarget",
        about: "Clips of other skeletons, mapped to the database's and back. Angles between hands or feet of two \
                bodies, seen from shoulder or hip, degrees; steps on and off of the feet, frames at the database's \
                rate."
            .into(),
        keys: vec!["method"],
        rows,
        figures,
    })
}

/// The two rows of a clip of that action and style, where they are known.
fn compare(
    database: &Database<'_>,
    retarget: &Retarget,
    original: &Clip,
    (action, style): (Option<String>, Option<String>),
) -> Vec<table::Row> {
    let clip = original.resampled(f64::from(database.rate_hz()));
    // In an upright world, where the database's body is.
    let lift = |frame: &Frame| {
        let mut frame = frame.clone();
        frame.root = retarget.world * frame.root;
        frame.rotations[0] = retarget.world * frame.rotations[0];
        frame
    };
    let input: Vec<Frame> = clip.frames.iter().map(lift).collect();
    let mapped = retarget.to_target(&clip);
    // As `gestus translate` does: joints without a counterpart are as in the input.
    let back: Vec<Frame> = retarget.to_source(&mapped.frames, &clip.frames).iter().map(lift).collect();
    let (source, target) = (&retarget.source, &retarget.target);
    let stands = |body: &Body, frames: &[Frame]| {
        let clip = Clip { skeleton: body.skeleton.clone(), frames: frames.to_vec(), ..clip.clone() };
        Landmarks::find(&body.skeleton).ok().map(|l| contacts(&clip, &l))
    };
    let truth = stands(source, &input);
    let cases: [(&str, &Body, &[Frame]); 2] =
        [("database", target, &mapped.frames), ("round-trip", source, &back)];
    cases
        .into_iter()
        .map(|(method, body, frames)| {
            let mut row = row(json!({
                "method": method, "action": action, "style": style, "clip": original.name, "frames": clip.frames.len(),
                "joints": source.skeleton.joints(), "scale": retarget.scale,
                "doubts": retarget.doubts().len(),
            }));
            for (name, from, to) in LIMBS {
                let angles = both_sides(|side| {
                    directions((source, &input), (body, frames), from(side), to(side))
                });
                row.insert(format!("{name}_mean_deg"), json!(angles.map(|a| a.mean_deg)));
                row.insert(format!("{name}_max_deg"), json!(angles.map(|a| a.max_deg)));
            }
            let place = |frames: &[Frame], body: &Body| -> Vec<Vec<Vector3<f64>>> {
                frames.iter().map(|f| f.positions(&body.skeleton)).collect()
            };
            if method == "round-trip" {
                let (a, b) = (place(&input, source), place(frames, source));
                let sum: f64 =
                    a.iter().flatten().zip(b.iter().flatten()).map(|(p, q)| (p - q).norm()).sum();
                let count = (a.len() * source.skeleton.joints()).max(1) as f64;
                row.insert("joint_error_cm".into(), json!(100.0 * sum / count));
            }
            let window = clip.rate_hz as usize / 4;
            let steps = truth.as_ref().zip(stands(body, frames)).map(|(a, b)| offsets(a, &b, window));
            let offsets = steps.filter(|o| o.matched > 0);
            row.insert("contact_steps".into(), json!(steps.map(|o| o.matched)));
            row.insert("contact_unmatched".into(), json!(steps.map(|o| o.unmatched)));
            row.insert("contact_mean_frames".into(), json!(offsets.map(|o| o.mean_frames)));
            row.insert("contact_max_frames".into(), json!(offsets.map(|o| o.max_frames)));
            row
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_limb_that_nobody_has_is_no_angle() {
        let left = Directions { mean_deg: 4.0, max_deg: 9.0 };
        let one = both_sides(|side| (side == Side::BOTH[0]).then_some(left)).unwrap();
        assert_eq!((one.mean_deg, one.max_deg), (4.0, 9.0), "the other side does not count as fitting");
        assert!(both_sides(|_| None).is_none());
    }

    #[test]
    fn steps_are_matched_one_to_one() {
        let clip = |on: std::ops::Range<usize>| -> Vec<[bool; 2]> {
            (0..30).map(|t| [on.contains(&t), false]).collect()
        };
        let same = offsets(&clip(5..12), &clip(5..12), 7);
        assert_eq!((same.matched, same.unmatched, same.max_frames), (2, 0, 0.0));
        let late = offsets(&clip(5..12), &clip(6..15), 7);
        assert_eq!((late.matched, late.unmatched, late.mean_frames, late.max_frames), (2, 0, 2.0, 3.0));
        let gone = offsets(&clip(5..12), &clip(0..0), 7);
        assert_eq!((gone.matched, gone.unmatched), (0, 2));
        let apart = offsets(&clip(5..8), &clip(25..28), 7);
        assert_eq!((apart.matched, apart.unmatched), (0, 4));
    }
}
