//! Methods from outside: the folds are written for them, and what they make of the test clips is measured beside ours.
//!
//! A folder that is written has `folds.json`, and the clips in `clips`. A folder of outputs has a clip for each fold,
//! `NAME.bvh` (or glTF) with the fold's name, on the joints of the clips and at their rate, one pose a frame of the test
//! clip. A method that changes timing adds `NAME.csv` with the column `step_s`: seconds from each pose's predecessor to it.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use gestus_motion::{
    binding::{Options, to_clip},
    body::Body,
    capture,
    clip::{Clip, Frame, Skeleton, at_times},
    files,
    formats::bvh::Bvh,
    unit::Unit,
};
use serde_json::{Value, json};

use crate::{
    experiment::{Experiment, HeldOut},
    fold::Fold,
    metrics::performance::times,
};

/// Options of measures that take methods from outside.
#[derive(clap::Args, Debug, Clone, Default)]
pub struct OutsideArgs {
    /// Write the clips and the folds to a folder, for methods from outside: docs/METRICS.md says how
    #[arg(long, value_name = "DIR")]
    export: Option<PathBuf>,
    /// Measure the outputs of a method from outside as well, which DIR has for every fold; can be given several times
    #[arg(long, value_name = "NAME=DIR", value_parser = named)]
    outputs: Vec<(String, PathBuf)>,
}

fn named(given: &str) -> Result<(String, PathBuf), String> {
    match given.split_once('=') {
        Some((name, folder)) if !name.is_empty() && !folder.is_empty() => {
            Ok((name.to_owned(), folder.into()))
        }
        _ => Err("give the method's name and the folder with its outputs, NAME=DIR".to_owned()),
    }
}

/// The outputs of a method from outside.
#[derive(Debug, Clone)]
pub struct Method {
    /// Its name.
    pub name: String,
    /// One for each fold, in the order of the folds.
    outputs: Vec<(HeldOut, Output)>,
}

/// What a method made of a test clip.
#[derive(Debug, Clone)]
pub struct Output {
    /// One pose a frame of the test clip, at the rate of the corpus.
    pub clip: Clip,
    /// Seconds from each pose's predecessor to it, where the method says it.
    pub steps_s: Option<Vec<f64>>,
}

impl OutsideArgs {
    /// Writes the folds, and reads the outputs for them, where either is asked for.
    ///
    /// # Errors
    /// A folder that can't be written, and outputs that are missing, or that do not belong to their fold.
    pub fn run(&self, experiment: &Experiment) -> Result<Vec<Method>> {
        if self.export.is_none() && self.outputs.is_empty() {
            return Ok(Vec::new());
        }
        let body = Body::of(&experiment.corpus)?;
        let (folds, _) = experiment.held_out(&body);
        if let Some(folder) = &self.export {
            export(experiment, &body, &folds, folder)?;
        }
        self.outputs.iter().map(|(name, folder)| Method::read(experiment, &folds, name, folder)).collect()
    }
}

impl Method {
    fn read(experiment: &Experiment, folds: &[HeldOut], name: &str, folder: &Path) -> Result<Self> {
        if !folder.is_dir() {
            bail!("--outputs {name}: {}: no such folder", folder.display());
        }
        let of = |&fold: &HeldOut| Ok((fold, Output::read(experiment, fold, folder)?));
        Ok(Self { name: name.to_owned(), outputs: folds.iter().map(of).collect::<Result<_>>()? })
    }

    /// What it made of a fold's test clip.
    pub fn output(&self, fold: HeldOut) -> Option<&Output> {
        self.outputs.iter().find(|(held, _)| *held == fold).map(|(_, output)| output)
    }
}

impl Output {
    fn read(experiment: &Experiment, fold: HeldOut, folder: &Path) -> Result<Self> {
        let name = fold_name(experiment, fold);
        let Some(path) = ["bvh", "glb", "gltf"]
            .map(|ending| folder.join(format!("{name}.{ending}")))
            .into_iter()
            .find(|p| p.exists())
        else {
            bail!("{}: no output for the fold {name}: expected {name}.bvh", folder.display())
        };
        let test = &experiment.corpus.examples[fold.test].clip;
        let clip = clip(&path, test).with_context(|| path.display().to_string())?;
        let steps = path.with_extension("csv");
        let steps_s = if steps.exists() {
            Some(read_steps(&steps, clip.frames.len()).with_context(|| steps.display().to_string())?)
        } else {
            None
        };
        Ok(Self { clip, steps_s })
    }

    /// The output at the rate of the corpus: each pose at its own time.
    pub fn resampled(&self) -> Clip {
        match &self.steps_s {
            None => self.clip.clone(),
            Some(steps_s) => {
                let frames: Vec<&Frame> = self.clip.frames.iter().collect();
                let frames = at_times(&frames, &times(steps_s), self.clip.rate_hz);
                Clip { frames, ..self.clip.clone() }
            }
        }
    }
}

/// A clip of a file on the joints of the test clip, in their order.
fn clip(path: &Path, test: &Clip) -> Result<Clip> {
    let (found, _) = to_clip(&capture::read(path)?, &Options::default())?;
    let (theirs, ours) = (&found.skeleton, &test.skeleton);
    let joints: Vec<usize> = ours
        .names
        .iter()
        .enumerate()
        .map(|(joint, name)| {
            let at = theirs
                .find(name)
                .with_context(|| format!("it has no joint `{name}`: outputs have the joints of the clips"))?;
            let parent = |skeleton: &Skeleton, joint: usize| {
                skeleton.parents[joint].map(|parent| skeleton.names[parent].clone())
            };
            if parent(theirs, at) != parent(ours, joint) {
                bail!("its joint `{name}` has another parent than in the clips");
            }
            Ok(at)
        })
        .collect::<Result<_>>()?;
    if (found.rate_hz - test.rate_hz).abs() > 1e-3 * test.rate_hz {
        bail!("it has {} frames a second, and the clips have {}", found.rate_hz, test.rate_hz);
    }
    if found.frames.len() != test.frames.len() {
        bail!(
            "it has {} frames, and the test clip {} has {}: one pose a frame, and their times in a .csv",
            found.frames.len(),
            test.name,
            test.frames.len()
        );
    }
    let frames: Vec<Frame> = found.frames.iter().map(|frame| frame.on_joints(&joints)).collect();
    Ok(Clip { frames, ..test.clone() })
}

fn read_steps(path: &Path, frames: usize) -> Result<Vec<f64>> {
    let mut reader = csv::Reader::from_path(path)?;
    let column = reader
        .headers()?
        .iter()
        .position(|name| name.trim() == "step_s")
        .context("it has no column `step_s`")?;
    let mut steps_s = Vec::new();
    for (line, record) in reader.records().enumerate() {
        let record = record?;
        let value: Option<f64> = record.get(column).and_then(|text| text.trim().parse().ok());
        match value.filter(|s| s.is_finite() && *s >= 0.0) {
            Some(step_s) => steps_s.push(step_s),
            None => bail!("line {}: expected seconds, 0 or more", line + 2),
        }
    }
    if steps_s.len() != frames {
        bail!("it has {} steps for {frames} frames", steps_s.len());
    }
    Ok(steps_s)
}

/// A name as that of a file.
fn as_file(name: &str) -> String {
    name.replace(['/', '\\'], "_")
}

fn fold_name(experiment: &Experiment, fold: HeldOut) -> String {
    let corpus = &experiment.corpus;
    format!("{}--{}", as_file(&corpus.examples[fold.test].clip.name), as_file(&corpus.styles[fold.style]))
}

fn export(experiment: &Experiment, body: &Body, folds: &[HeldOut], folder: &Path) -> Result<()> {
    let clips = folder.join("clips");
    std::fs::create_dir_all(&clips).with_context(|| format!("{} can't be made", clips.display()))?;
    let save = |path: PathBuf, text: String| {
        files::write(&path, text).with_context(|| format!("{} can't be written", path.display()))
    };
    let corpus = &experiment.corpus;
    let file = |clip: usize| format!("clips/{}.bvh", as_file(&corpus.examples[clip].clip.name));
    for (i, example) in corpus.examples.iter().enumerate() {
        save(folder.join(file(i)), Bvh::from_clip(&example.clip, Unit::Centimetres)?.to_text())?;
    }
    let listed: Vec<Value> = (0..corpus.examples.len())
        .map(|i| {
            let e = &corpus.examples[i];
            let cycles: Vec<Value> = e.cycles.iter().map(|cycle| json!(cycle.span())).collect();
            json!({
                "file": file(i), "name": e.clip.name, "action": corpus.actions[e.action],
                "style": corpus.styles[e.style], "frames": e.clip.frames.len(), "cycles": cycles,
            })
        })
        .collect();
    let shared = experiment.sharing(folds);
    let of_fold = |&held: &HeldOut| {
        let group = shared.iter().find(|group| group.contains(&held)).map_or(&[][..], Vec::as_slice);
        let mut unseen: Vec<String> = group.iter().flat_map(|f| [file(f.test), file(f.truth)]).collect();
        unseen.sort();
        unseen.dedup();
        let fold = Fold::of(experiment, body, held);
        json!({
            "name": fold_name(experiment, held),
            "input": file(held.test),
            "style": corpus.styles[held.style],
            "truth": file(held.truth),
            "other": held.other.map(file),
            "truth_frames": fold.matches(),
            "unseen": unseen,
        })
    };
    let folds: Vec<Value> = folds.iter().map(of_fold).collect();
    let all = json!({
        "rate_hz": corpus.rate_hz,
        "from": corpus.styles.get(experiment.from),
        "joints": corpus.skeleton.names,
        "clips": listed,
        "folds": folds,
    });
    save(folder.join("folds.json"), serde_json::to_string_pretty(&all)?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measures::loo::{self, Methods};

    /// A folder of the test `name`, empty.
    fn folder(name: &str) -> PathBuf {
        let folder = std::env::temp_dir().join(format!("gestus-outside-{name}-{}", std::process::id()));
        let _ = std::fs::remove_dir_all(&folder);
        folder
    }

    fn args(export: Option<&Path>, outputs: &[(&str, &Path)]) -> OutsideArgs {
        let outputs = outputs.iter().map(|&(name, folder)| (name.to_owned(), folder.to_owned())).collect();
        OutsideArgs { export: export.map(Path::to_owned), outputs }
    }

    /// An exported experiment, its folds, and a folder in which the output of each is its input.
    fn unchanged(name: &str) -> (Experiment, PathBuf, Value) {
        let experiment = Experiment::generated(&["walk", "run"], &["neutral", "proud"], 3, 4.0);
        let folder = folder(name);
        assert!(args(Some(&folder), &[]).run(&experiment).unwrap().is_empty());
        let all: Value =
            serde_json::from_str(&std::fs::read_to_string(folder.join("folds.json")).unwrap()).unwrap();
        for fold in all["folds"].as_array().unwrap() {
            let [name, input] = ["name", "input"].map(|key| fold[key].as_str().unwrap());
            std::fs::copy(folder.join(input), folder.join(format!("{name}.bvh"))).unwrap();
        }
        (experiment, folder, all)
    }

    #[test]
    fn inputs_as_outputs_have_the_figures_of_unchanged_motion() {
        let (experiment, folder, all) = unchanged("inputs");
        let body = Body::of(&experiment.corpus).unwrap();
        let (folds, _) = experiment.held_out(&body);
        assert_eq!((all["clips"].as_array().unwrap().len(), all["rate_hz"].as_f64()), (12, Some(30.0)));
        // Times that are those of the input: the steps of the truth are not.
        let timed = folder.join("timed");
        std::fs::create_dir(&timed).unwrap();
        for (held, fold) in folds.iter().zip(all["folds"].as_array().unwrap()) {
            let frames = experiment.corpus.examples[held.test].clip.frames.len();
            assert_eq!(fold["truth_frames"].as_array().unwrap().len(), frames);
            assert!(fold["unseen"].as_array().unwrap().contains(&fold["input"]));
            let name = fold["name"].as_str().unwrap();
            std::fs::copy(folder.join(format!("{name}.bvh")), timed.join(format!("{name}.bvh"))).unwrap();
            let steps = format!("step_s\n{}", "0.0333333333333\n".repeat(frames));
            std::fs::write(timed.join(format!("{name}.csv")), steps).unwrap();
        }
        let outside = args(None, &[("ours", &folder), ("timed", &timed)]).run(&experiment).unwrap();
        let rows = loo::run(&experiment, &Methods { outside, ..Methods::none() }, &|| ()).unwrap();
        assert_eq!((folds.len(), rows.len()), (2, 4));
        for (held, rows) in folds.iter().zip(rows.chunks(2)) {
            let fold = Fold::of(&experiment, &body, *held);
            let same = fold.row("unchanged", &fold.x, None).delivered;
            for (row, method) in rows.iter().zip(["ours", "timed"]) {
                let found = row.delivered;
                assert_eq!(row.method, method);
                let pairs = [
                    (found.error_cm, same.error_cm),
                    (found.variability.unwrap(), same.variability.unwrap()),
                    (found.third_difference, same.third_difference),
                    (found.skate_stillest_cm_s, same.skate_stillest_cm_s),
                ];
                for (a, b) in pairs {
                    assert!((a - b).abs() < 2e-3 * b + 1e-3, "{method}: {found:?} {same:?}");
                }
                assert_eq!(found.duration.is_some(), method == "timed");
                assert!(row.floor_cm.is_some());
            }
        }
        std::fs::remove_dir_all(folder).unwrap();
    }

    #[test]
    fn outputs_that_belong_to_no_fold_are_refused_and_named() {
        let (experiment, folder, all) = unchanged("refused");
        let first = all["folds"][0]["name"].as_str().unwrap();
        let path = folder.join(format!("{first}.bvh"));
        let refusal = || {
            let error = args(None, &[("ours", &folder)]).run(&experiment).unwrap_err();
            format!("{error:#}")
        };
        let text = std::fs::read_to_string(&path).unwrap();
        let steps = path.with_extension("csv");
        for (rows, said) in
            [("", "has no column `step_s`"), ("step_s\n0.1\n", "it has 1 steps"), ("step_s\n-1\n", "line 2:")]
        {
            std::fs::write(&steps, rows).unwrap();
            assert!(refusal().contains(said), "{}", refusal());
        }
        std::fs::remove_file(&steps).unwrap();
        let frames = experiment.corpus.examples[0].clip.frames.len();
        let cut: Vec<&str> = text.trim_end().lines().collect();
        let shorter = cut[..cut.len() - 1]
            .join("\n")
            .replace(&format!("Frames: {frames}"), &format!("Frames: {}", frames - 1));
        for (text, said) in [
            (shorter, "one pose a frame"),
            (text.replace("Frame Time: 0.0333333", "Frame Time: 0.0100000"), "frames a second"),
            (text.replacen("JOINT Head", "JOINT Skull", 1), "no joint `Head`"),
        ] {
            std::fs::write(&path, text).unwrap();
            assert!(refusal().contains(said) && refusal().contains(first), "{said}: {}", refusal());
        }
        std::fs::remove_file(&path).unwrap();
        assert!(refusal().contains(&format!("expected {first}.bvh")), "{}", refusal());
        std::fs::remove_dir_all(folder).unwrap();
    }
}
