//! A clip into another style: what `gestus translate` and `gestus-sim run` share.

use std::{path::Path, sync::Arc};

use anyhow::{Context, Result, bail};
use gestus_core::Database;

use crate::{
    bvh::{Binding, Bvh, Options},
    motion::{Clip, Frame, Skeleton},
    stream::{Request, Streamed, Watcher, stream},
};

/// A clip that is ready to be streamed through a database.
#[derive(Debug)]
pub struct Input {
    /// The file.
    pub document: Bvh,
    /// How its joints are the clip's.
    pub binding: Binding,
    /// The clip at the database's rate, on the file's joints.
    pub clip: Clip,
    /// The clip on the database's joints.
    pub mapped: Clip,
    /// For each joint of the database, the file's.
    joints: Vec<usize>,
}

impl Input {
    /// Reads a BVH file for a database.
    ///
    /// # Errors
    /// Where it can't be read, or lacks joints of the database.
    pub fn read(path: &Path, database: &Database<'_>) -> Result<Self> {
        let document = Bvh::read(path)?;
        let name = path.display();
        let binding = Binding::new(&document, &Options::default()).with_context(|| name.to_string())?;
        let mut clip = binding.to_clip(&document).with_context(|| name.to_string())?;
        clip.name = path.file_stem().map_or_else(String::new, |s| s.to_string_lossy().into_owned());
        Self::of(document, binding, clip, database).with_context(|| name.to_string())
    }

    fn of(document: Bvh, binding: Binding, clip: Clip, database: &Database<'_>) -> Result<Self> {
        let clip = clip.resampled(f64::from(database.rate_hz()));
        let names = database.manifest()?.joints;
        let missing: Vec<&str> = names.iter().filter(|n| clip.skeleton.find(n).is_none()).collect();
        if !missing.is_empty() {
            bail!(
                "the clip lacks {} of the database's {} joints ({}): it has to be on the database's skeleton ({})",
                missing.len(),
                names.count(),
                missing.join(", "),
                names.iter().collect::<Vec<_>>().join(", ")
            );
        }
        let joints: Vec<usize> = names.iter().filter_map(|n| clip.skeleton.find(n)).collect();
        if joints.first() != Some(&0) {
            bail!(
                "the clip's body begins at `{}`, the database's at `{}`",
                clip.skeleton.names[0],
                names.get(0).unwrap_or_default()
            );
        }
        let mapped = Clip {
            skeleton: Arc::new(skeleton(database)),
            frames: clip.frames.iter().map(|f| pick(f, &joints)).collect(),
            ..clip.clone()
        };
        Ok(Self { document, binding, clip, mapped, joints })
    }

    /// The output as a clip of the input's skeleton, at the database's rate. Joints that the database lacks move as
    /// they did.
    pub fn output(&self, streamed: &Streamed) -> Clip {
        let mut whole = streamed.clone();
        for (step, input) in whole.steps.iter_mut().zip(&self.clip.frames) {
            let mut frame = input.clone();
            frame.root = step.frame.root;
            for (&joint, rotation) in self.joints.iter().zip(&step.frame.rotations) {
                frame.rotations[joint] = *rotation;
            }
            step.frame = frame;
        }
        whole.clip(&self.clip, self.clip.rate_hz)
    }

    /// Poses of the database's joints as a clip of the input's skeleton, at the database's rate; other joints move as they
    /// do in the input at each pose's `sources`, in frames.
    pub fn carried(&self, frames: &[Frame], sources: &[f64]) -> Clip {
        let carry = |(pose, &source): (&Frame, &f64)| {
            let mut frame = self.clip.at(source);
            frame.root = pose.root;
            for (&joint, rotation) in self.joints.iter().zip(&pose.rotations) {
                frame.rotations[joint] = *rotation;
            }
            frame
        };
        Clip { frames: frames.iter().zip(sources).map(carry).collect(), ..self.clip.clone() }
    }

    /// The output in the form of the input's file.
    ///
    /// # Errors
    /// Where the clip is not the input's.
    pub fn document(&self, output: &Clip) -> Result<Bvh> {
        Ok(self.binding.write(&self.document, output)?)
    }
}

fn pick(frame: &Frame, joints: &[usize]) -> Frame {
    Frame { root: frame.root, rotations: joints.iter().map(|&j| frame.rotations[j]).collect() }
}

/// The database's skeleton.
pub fn skeleton(database: &Database<'_>) -> Skeleton {
    let joints: Vec<_> = (0..database.counts().joints).map(|j| database.joint(j)).collect();
    Skeleton {
        names: database.manifest().map(|m| m.joints.iter().map(String::from).collect()).unwrap_or_default(),
        parents: joints.iter().map(|j| j.parent).collect(),
        offsets: joints.iter().map(|j| j.offset.map(f64::from).into()).collect(),
    }
}

/// Streams an input.
///
/// # Errors
/// What the stylizer refuses.
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
    serde_json::json!({
        "frames": steps.len(),
        "seconds": streamed.times().last().copied().unwrap_or(0.0),
        "median_us": quantile(0.5),
        "p99_us": quantile(0.99),
        "classes_mean": mean(&|r| r.classes.len() as f64),
        "visits_mean": mean(&|r| f64::from(r.visits)),
        "visits_max": steps.iter().map(|s| s.report.visits).max(),
        "bytes_read_mean": mean(&|r| f64::from(r.bytes_read)),
        "distance2_mean": mean(&|r| f64::from(r.distance2)),
        "degraded": steps.iter().filter(|s| !s.report.degraded.is_empty()).count(),
        "degraded_by": by,
        "ram_bytes": streamed.ram_bytes,
        "digest": format!("{:08x}", streamed.digest),
    })
}
