//! Translates a clip to another style, for `gestus translate` and `gestus-sim run`.

use std::{path::Path, sync::Arc};

use anyhow::{Context, Result};
use gestus_core::Database;

use crate::{
    retarget::{MapFile, Retarget},
    stream::{
        Request, Streamed, Watcher,
        cleanup::{Limbs, above_floor},
        stream,
    },
};
use gestus_motion::{
    animation::Recording,
    binding::{Binding, Options},
    body::{Body, database_skeleton},
    capture::{self, Document},
    clip::{Clip, Frame, Skeleton},
    corpus::Corpus,
    unit::Unit,
};

/// Depth below its standing height that a foot of another skeleton may reach, metres: as in the core's foot lock.
const SOFT_M: f64 = 0.01;

/// A clip that is ready to be streamed through a database.
#[derive(Debug)]
pub struct Input {
    /// The file.
    pub document: Document,
    /// The conversion between the file's joints and the clip's.
    pub binding: Binding,
    /// The clip at the database's rate, on the file's joints.
    pub clip: Clip,
    /// The clip on the database's joints.
    pub mapped: Clip,
    way: Way,
}

/// The conversion between the clip's joints and the database's.
#[derive(Debug)]
enum Way {
    /// The same body: for each joint of the database, the clip's joint of the same name and position.
    Same(Vec<usize>),
    /// By a retargeting map; with the legs of the file's body, if found, to keep its feet above the floor.
    Map(Box<Retarget>, Option<Box<Limbs>>),
}

/// Reads a motion file for a database: the document, its binding, and the clip at its own rate.
///
/// Without a unit, the unit is the one in which the body is the database's, or else guessed by an adult's height.
///
/// # Errors
/// Where it can't be read.
pub fn read_clip(
    path: &Path,
    database: &Database<'_>,
    unit: Option<Unit>,
) -> Result<(Document, Binding, Clip)> {
    bind(capture::read(path)?, path, database, unit)
}

/// The same for a document that was read before.
fn bind(
    document: Document,
    path: &Path,
    database: &Database<'_>,
    unit: Option<Unit>,
) -> Result<(Document, Binding, Clip)> {
    let name = path.display();
    let animation = document.animation();
    let bound = |unit| {
        let options = Options { unit, ..Options::default() };
        Binding::new(&*animation, &options).with_context(|| name.to_string())
    };
    let mut binding = bound(unit)?;
    if unit.is_none()
        && let Some(own) = own_unit(&binding, &database_skeleton(database))
    {
        binding = bound(Some(own))?;
    }
    let mut clip = binding.to_clip(&*animation).with_context(|| name.to_string())?;
    drop(animation);
    clip.name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
    Ok((document, binding, clip))
}

/// The unit in which a body is the database's, if it is not the guessed one.
fn own_unit(guessed: &Binding, database: &Skeleton) -> Option<Unit> {
    let is_own = |unit: &Unit| {
        let scale = unit.metres() / guessed.unit().metres();
        let offsets = guessed.skeleton().offsets.iter().map(|offset| offset * scale).collect();
        same_body(&Skeleton { offsets, ..(**guessed.skeleton()).clone() }, database).is_some()
    };
    if is_own(&guessed.unit()) { None } else { Unit::KNOWN.into_iter().find(is_own) }
}

impl Input {
    /// Reads a motion file for a database.
    ///
    /// # Errors
    /// A file that can't be read, or whose skeleton can't be mapped to the database's.
    pub fn read(path: &Path, database: &Database<'_>) -> Result<Self> {
        Self::read_with(path, database, &MapFile::default(), None)
    }

    /// The same, with a file that says which joint is which body part, and the unit of lengths.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_with(
        path: &Path,
        database: &Database<'_>,
        map: &MapFile,
        unit: Option<Unit>,
    ) -> Result<Self> {
        Self::of_document(capture::read(path)?, path, database, map, unit)
    }

    /// The same, of a document that was read before from a file of that name.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn of_document(
        document: Document,
        path: &Path,
        database: &Database<'_>,
        map: &MapFile,
        unit: Option<Unit>,
    ) -> Result<Self> {
        let (document, binding, clip) = bind(document, path, database, unit)?;
        Self::of(document, binding, &clip, database, map).with_context(|| path.display().to_string())
    }

    fn of(
        document: Document,
        binding: Binding,
        original: &Clip,
        database: &Database<'_>,
        map: &MapFile,
    ) -> Result<Self> {
        let clip = original.fitted(f64::from(database.rate_hz()))?;
        let target = Arc::new(database_skeleton(database));
        if let Some(joints) = same_body(&clip.skeleton, &target).filter(|_| map.joints.is_empty()) {
            let frames = clip.frames.iter().map(|f| pick(f, &joints)).collect();
            let mapped = Clip { skeleton: target, frames, ..clip.clone() };
            return Ok(Self { document, binding, clip, mapped, way: Way::Same(joints) });
        }
        // Measured at its own rate, which has more poses.
        let retarget = Retarget::new(database, original, map)?;
        let mapped = retarget.to_target(&clip);
        // The floor is known only if the file has Y up.
        let limbs = (retarget.world.angle() < 1e-3)
            .then(|| Body::of(&Corpus::of_clip(&clip)).ok())
            .flatten()
            .and_then(|body| Limbs::of_clip(&body, &clip))
            .map(|(limbs, _)| Box::new(limbs));
        Ok(Self { document, binding, clip, mapped, way: Way::Map(Box::new(retarget), limbs) })
    }

    /// The output on the database's skeleton, for driving a robot.
    pub fn body(&self, streamed: &Streamed, rate_hz: f64) -> Clip {
        streamed.clip(&self.mapped, rate_hz)
    }

    /// Notes for the user about the reading: a guessed unit, averaged translations, and doubts about the map between the
    /// skeletons.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let doubts = self.retarget().map(Retarget::doubts).unwrap_or_default();
        let doubts = doubts.into_iter().map(|doubt| format!("retargeted; doubt: {doubt}"));
        self.binding.notes().iter().cloned().chain(doubts)
    }

    /// The map between the skeletons, if they differ.
    pub fn retarget(&self) -> Option<&Retarget> {
        match &self.way {
            Way::Same(_) => None,
            Way::Map(map, _) => Some(map),
        }
    }

    /// The output as a clip of the input's skeleton, at the database's rate. Joints that the database lacks move as
    /// in the input.
    pub fn output(&self, streamed: &Streamed) -> Clip {
        let mut whole = streamed.clone();
        let frames: Vec<Frame> = streamed.steps.iter().map(|s| s.frame.clone()).collect();
        for (step, frame) in whole.steps.iter_mut().zip(self.on_input_skeleton(&frames, &self.clip.frames)) {
            step.frame = frame;
        }
        if let Some(retimed) = &mut whole.retimed {
            retimed.frames = self.on_input_skeleton(&retimed.frames, &self.clip.frames);
        }
        whole.clip(&self.clip, self.clip.rate_hz)
    }

    /// Poses of the database's joints as a clip of the input's skeleton, at the database's rate; other joints move as they
    /// do in the input at each pose's `sources`, in frames.
    pub fn carried(&self, frames: &[Frame], sources: &[f64]) -> Clip {
        let inputs: Vec<Frame> = sources.iter().map(|&source| self.clip.at(source)).collect();
        Clip { frames: self.on_input_skeleton(frames, &inputs), ..self.clip.clone() }
    }

    /// Poses of the database's joints on the input's skeleton; what the database lacks is taken from `inputs`.
    fn on_input_skeleton(&self, frames: &[Frame], inputs: &[Frame]) -> Vec<Frame> {
        let joints = match &self.way {
            Way::Same(joints) => joints,
            Way::Map(map, limbs) => {
                let back = map.to_source(frames, inputs);
                // A foot of another shape lands elsewhere: a longer one puts its toes into the floor.
                return match limbs {
                    Some(limbs) => above_floor(limbs, &back, SOFT_M),
                    None => back,
                };
            }
        };
        let carry = |(pose, input): (&Frame, &Frame)| {
            let mut frame = input.clone();
            frame.root = pose.root;
            for (&joint, rotation) in joints.iter().zip(&pose.rotations) {
                frame.rotations[joint] = *rotation;
            }
            frame
        };
        frames.iter().zip(inputs).map(carry).collect()
    }

    /// The output in the form of the input's file, for the file `to`; an animation of glTF under `name`, or in the place
    /// of the input's.
    ///
    /// # Errors
    /// A clip that is not on the input's skeleton, or that the format can't represent.
    pub fn written(&self, output: &Clip, to: &Path, name: Option<&str>) -> Result<Vec<u8>> {
        self.document.write(&self.binding, output, to, name).with_context(|| to.display().to_string())
    }
}

/// A clip on the database's skeleton, whatever skeleton it comes on, at its own rate.
///
/// # Errors
/// A skeleton that can't be mapped.
pub fn onto(database: &Database<'_>, clip: &Clip) -> Result<Clip> {
    let target = Arc::new(database_skeleton(database));
    match same_body(&clip.skeleton, &target) {
        Some(joints) => {
            let frames = clip.frames.iter().map(|f| pick(f, &joints)).collect();
            Ok(Clip { skeleton: target, frames, ..clip.clone() })
        }
        None => Ok(Retarget::new(database, clip, &MapFile::default())?.to_target(clip)),
    }
}

/// For each joint of the database the clip's, if both have the same body: the same names and parents, and about the same
/// bones. A copy of the skeleton of another size or with other axes is another body.
fn same_body(clip: &Skeleton, database: &Skeleton) -> Option<Vec<usize>> {
    let joints: Vec<usize> = database.names.iter().map(|n| clip.find(n)).collect::<Option<_>>()?;
    if joints.first() != Some(&0) {
        return None;
    }
    let length: f64 = database.offsets.iter().skip(1).map(nalgebra::Vector3::norm).sum();
    let mut apart = 0.0;
    for (j, &c) in joints.iter().enumerate().skip(1) {
        // Joints between them that the database lacks would rotate their children.
        if clip.parents[c] != database.parents[j].map(|p| joints[p]) {
            return None;
        }
        apart += (clip.offsets[c] - database.offsets[j]).norm();
    }
    // Calibrations of one performer differ by a few per cent.
    (apart < 0.1 * length).then_some(joints)
}

fn pick(frame: &Frame, joints: &[usize]) -> Frame {
    Frame { root: frame.root, rotations: joints.iter().map(|&j| frame.rotations[j]).collect() }
}

/// Streams an input.
///
/// # Errors
/// Refusals of the stylizer.
pub fn translate(
    database: &Database<'_>,
    input: &Input,
    request: &Request,
    watcher: &mut impl Watcher,
) -> Result<Streamed> {
    stream(database, &input.mapped, request, watcher).map_err(|e| anyhow::anyhow!("{e}"))
}

/// Figures of a stream, as the commands' JSON has them.
pub fn figures(streamed: &Streamed) -> serde_json::Value {
    let steps = &streamed.steps;
    let count = steps.len().max(1) as f64;
    let mut micros: Vec<f64> = steps.iter().map(|s| s.micros).collect();
    micros.sort_by(f64::total_cmp);
    let quantile = |q: f64| {
        micros.get(((micros.len() as f64 * q) as usize).min(micros.len().saturating_sub(1))).copied()
    };
    let mean = |value: &dyn Fn(&gestus_core::Report) -> f64| {
        steps.iter().map(|s| value(&s.report)).sum::<f64>() / count
    };
    let by: serde_json::Map<String, serde_json::Value> = gestus_core::Degraded::NAMES
        .iter()
        .map(|(flag, name)| {
            let frames = steps.iter().filter(|s| s.report.degraded.contains(*flag)).count();
            ((*name).to_owned(), frames.into())
        })
        .collect();
    let seconds = match &streamed.retimed {
        Some(retimed) => retimed.frames.len().saturating_sub(1) as f64 * retimed.tick_s,
        None => streamed.times().last().copied().unwrap_or(0.0),
    };
    let lags = || streamed.retimed.iter().flat_map(|r| &r.ticks).map(|t| t.lag_s);
    let mut figures = serde_json::json!({
        "frames": steps.len(),
        "seconds": seconds,
        "median_us": quantile(0.5),
        "p99_us": quantile(0.99),
        "classes_mean": mean(&|r| r.classes.len() as f64),
        "visits_mean": mean(&|r| f64::from(r.visits)),
        "visits_max": steps.iter().map(|s| s.report.visits).max(),
        "bytes_read_mean": mean(&|r| f64::from(r.bytes_read)),
        "distance2_mean": mean(&|r| f64::from(r.distance2)),
        "passed_mean": mean(&|r| f64::from(r.passed)),
        "degraded": steps.iter().filter(|s| !s.report.degraded.is_empty()).count(),
        "degraded_by": by,
        "ram_bytes": streamed.ram_bytes,
        "digest": format!("{:08x}", streamed.digest),
        "held": steps.iter().filter(|s| s.report.held != [false; 2]).count(),
        "held_cm_max": steps.iter().flat_map(|s| s.report.held_m).fold(0.0, f32::max) * 100.0,
    });
    if let Some(retimed) = &streamed.retimed {
        figures["lag_s_max"] = lags().fold(0.0, f32::max).into();
        figures["lead_s_max"] = lags().map(|l| -l).fold(0.0, f32::max).into();
        figures["latency_s"] = retimed.latency_s.into();
    }
    figures
}

/// Number and causes of degraded frames as text, from [`figures`].
pub fn degraded_words(figures: &serde_json::Value) -> String {
    let by: Vec<String> = figures["degraded_by"]
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(_, count)| count.as_u64() > Some(0))
        .map(|(name, count)| format!("{count} {name}"))
        .collect();
    let all = format!("{} degraded", figures["degraded"]);
    if by.is_empty() { all } else { format!("{all} ({})", by.join(", ")) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        build::{BuildOptions, build},
        synth,
    };
    use gestus_motion::formats::bvh::Bvh;

    /// A corpus of a walk whose bodies are that many times as large.
    fn corpus(scale: f64) -> Corpus {
        let mut corpus = synth::corpus(&synth::Options {
            actions: vec!["walk".into()],
            styles: vec!["neutral".into(), "proud".into()],
            clips: 1,
            seconds: 4.0,
            ..synth::Options::default()
        })
        .unwrap();
        let mut skeleton = (*corpus.skeleton).clone();
        skeleton.offsets.iter_mut().for_each(|offset| *offset *= scale);
        corpus.skeleton = Arc::new(skeleton);
        for example in &mut corpus.examples {
            example.clip.skeleton = corpus.skeleton.clone();
            example.clip.frames.iter_mut().for_each(|frame| frame.root *= scale);
        }
        corpus
    }

    #[test]
    fn a_small_body_keeps_its_databases_unit() {
        let small = corpus(0.18);
        let options = BuildOptions { models: false, ..BuildOptions::default() };
        let blob = build(&small, &options).unwrap().bytes;
        let database = Database::open(&blob).unwrap();
        let path = std::env::temp_dir().join(format!("gestus-unit-{}.bvh", std::process::id()));
        let clip = &small.examples[0].clip;
        std::fs::write(&path, Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
        let input = Input::read(&path, &database).unwrap();
        assert!(input.retarget().is_none(), "{:?}", input.retarget().map(Retarget::doubts));
        assert_eq!(input.binding.unit(), Unit::Centimetres);
        let told = Input::read_with(&path, &database, &MapFile::default(), Some(Unit::Metres)).unwrap();
        assert_eq!(told.binding.unit(), Unit::Metres);
        assert!(told.retarget().is_some());

        // Bounded time: as long as the input, tick by tick; and what was degraded is named.
        let bounds = gestus_core::output::retime::Bounds { lead_s: 0.1, lag_s: 0.1 };
        let request = Request { bounds: Some(bounds), ..Request::style(1) };
        let streamed = translate(&database, &input, &request, &mut ()).unwrap();
        let mut figures = figures(&streamed);
        let seconds = figures["seconds"].as_f64().unwrap();
        assert!((seconds - input.output(&streamed).duration_s()).abs() < 1e-6, "{seconds}");
        figures["degraded"] = 3.into();
        figures["degraded_by"] = serde_json::json!({ "far": 2, "input": 0, "visits": 1 });
        assert_eq!(degraded_words(&figures), "3 degraded (2 far, 1 visits)");
        std::fs::remove_file(path).unwrap();
    }
}
