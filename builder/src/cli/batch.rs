//! Several clips in one call: folders, patterns and lists of files.

use std::{
    collections::{BTreeMap, VecDeque},
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use gestus_motion::{
    capture::{CaptureError, Format, file_and_animation, motion_files},
    formats::gltf::GltfErrorKind,
};
use serde_json::{Value, json};

use super::open;

/// A clip and the name of its output below the output folder: with the ending of the input, as which it comes out.
#[derive(Debug, Clone, PartialEq)]
pub struct Clip {
    pub input: PathBuf,
    name: PathBuf,
}

/// The clips that are meant; `None` if it is one file, which has one output file.
///
/// Files in `output` that are below a folder of clips are outputs of an earlier call, and left out.
///
/// # Errors
/// A pattern that is none or that no file matches, a folder that can't be read or holds no clip, and two clips whose
/// outputs would be one.
pub fn clips(inputs: &[&PathBuf], output: &Path) -> Result<Option<Vec<Clip>>> {
    let is_pattern = |path: &Path| !path.exists() && path.to_string_lossy().contains(['*', '?', '[']);
    if let [one] = inputs
        && !one.is_dir()
        && !is_pattern(one)
    {
        return Ok(None);
    }
    let mut clips = Vec::new();
    for input in inputs {
        let shown = input.display();
        let before = clips.len();
        if is_pattern(input) {
            let found = glob::glob(&input.to_string_lossy()).with_context(|| format!("--input {shown}"))?;
            for path in found {
                let path = path.with_context(|| format!("--input {shown}"))?;
                if path.is_dir() || Format::of(&path).is_some() {
                    of_path(&path, output, &mut clips)?;
                }
            }
        } else {
            of_path(input, output, &mut clips)?;
        }
        if clips.len() == before {
            bail!(
                "--input {shown}: there is no file that ends in one of {}",
                Format::endings_that_are_read()
            );
        }
    }
    let mut inputs = BTreeMap::new();
    for clip in &clips {
        check_unwritten(&mut inputs, clip)?;
    }
    Ok(Some(clips))
}

/// Refuses a clip whose output another clip has. `inputs` holds the clips of the outputs so far.
fn check_unwritten(inputs: &mut BTreeMap<PathBuf, PathBuf>, clip: &Clip) -> Result<()> {
    if let Some(other) = inputs.insert(clip.name.clone(), clip.input.clone()) {
        bail!(
            "{} and {} would both be written to {}: translate them one by one",
            other.display(),
            clip.input.display(),
            clip.name.display()
        );
    }
    Ok(())
}

/// A file, one animation of a file, or the clips below a folder, named by their paths below it.
fn of_path(path: &Path, output: &Path, clips: &mut Vec<Clip>) -> Result<()> {
    if !path.is_dir() {
        let (file, animation) = file_and_animation(path);
        let name = output_name(Path::new(file.file_name().unwrap_or_default()), file);
        let clip = Clip { input: file.to_path_buf(), name };
        clips.push(match animation {
            Some(name) => clip.animation(name),
            None => clip,
        });
        return Ok(());
    }
    let (files, errors) = motion_files(path)?;
    errors.iter().for_each(super::note);
    let own = |folder: &Path| folder.canonicalize().ok();
    let outputs = own(output).filter(|output| own(path).is_some_and(|path| path != *output));
    let is_output =
        |file: &PathBuf| own(file).zip(outputs.as_ref()).is_some_and(|(file, own)| file.starts_with(own));
    for file in files.into_iter().filter(|file| !is_output(file)) {
        let name = output_name(file.strip_prefix(path).unwrap_or(&file), &file);
        clips.push(Clip { input: file, name });
    }
    Ok(())
}

/// The name of an input for its output: with the same ending, or as BVH where that ending is not written.
fn output_name(name: &Path, input: &Path) -> PathBuf {
    match Format::of_output(name, Some(input)) {
        Ok(_) => name.to_path_buf(),
        Err(_) => name.with_extension("bvh"),
    }
}

/// Translates clips into a folder, each by `one`, which takes input and output and returns the figures. A clip that is
/// refused is reported and counted.
///
/// # Errors
/// An output folder that can't be used, and clips that were refused.
pub fn run(
    clips: Vec<Clip>,
    folder: &Path,
    json: bool,
    one: impl Fn(&Path, &Path) -> Result<Value>,
) -> Result<()> {
    let inputs: Vec<PathBuf> = clips.iter().map(|clip| clip.input.clone()).collect();
    let mut open: VecDeque<Clip> = clips.into();
    let (mut done, mut refused) = (Vec::new(), 0);
    // The animations of a file are known when it is read.
    let mut written = BTreeMap::new();
    while let Some(clip) = open.pop_front() {
        let output = folder.join(&clip.name);
        let own = output.parent().unwrap_or(folder);
        let existing = own.ancestors().find(|folder| folder.exists()).map(Path::to_path_buf);
        let translated = ready(&inputs, &output)
            .and_then(|()| check_unwritten(&mut written, &clip))
            .and_then(|()| one(&clip.input, &output));
        match translated {
            Ok(figures) => {
                done.push(json!({ "input": super::shown(&clip.input), "output": super::shown(&output), "figures": figures }));
            }
            Err(error) => match animations(&error) {
                // Every animation of a file is a clip, and nothing was written.
                Some(names) => {
                    written.remove(&clip.name);
                    names.iter().rev().for_each(|name| open.push_front(clip.animation(name)));
                }
                None => {
                    refused += 1;
                    remove_empty(own, existing.as_deref());
                    super::note(format_args!("refused: {error:#}"));
                    done.push(json!({ "input": super::shown(&clip.input), "refused": format!("{error:#}") }));
                }
            },
        }
    }
    let (all, translated) = (done.len(), done.len() - refused);
    let unlike = done.iter().filter(|clip| clip["figures"]["verdict"]["like"] == "unlike").count();
    if json {
        super::say(json!({ "translated": translated, "unlike": unlike, "refused": refused, "clips": done }))?;
    } else {
        let unlike = if unlike > 0 { format!("; {unlike} unlike the database") } else { String::new() };
        super::say(format_args!(
            "{}: {translated} clips translated, {refused} refused{unlike}",
            folder.display()
        ))?;
    }
    if refused > 0 {
        bail!("{refused} of {all} clips were refused; the lines above say why");
    }
    Ok(())
}

/// Makes the folder of an output, and refuses one that is any of the inputs.
fn ready(inputs: &[PathBuf], output: &PathBuf) -> Result<()> {
    open::make_folder(output.parent().unwrap_or(Path::new(".")))?;
    Ok(super::check_outputs(inputs.iter().map(Some), [("-o", Some(output))])?)
}

/// Removes a folder and those above it as far as they are empty, below one that existed before.
fn remove_empty(folder: &Path, existing: Option<&Path>) {
    let made = folder.ancestors().take_while(|folder| Some(*folder) != existing);
    // A folder that holds something can't be removed, nor those above it.
    let _ = made.map(fs::remove_dir).find(Result::is_err);
}

/// The animations of a file, if that is the error.
fn animations(error: &anyhow::Error) -> Option<&[String]> {
    match error.downcast_ref::<CaptureError>()? {
        CaptureError::Gltf(error) => match &error.kind {
            GltfErrorKind::Several { names, .. } => Some(names),
            _ => None,
        },
        _ => None,
    }
}

impl Clip {
    /// One animation of the file.
    fn animation(&self, name: &str) -> Self {
        let mut input = self.input.clone().into_os_string();
        input.push(format!("#{name}"));
        let ending = self.name.extension().unwrap_or_default().display();
        let file = format!("{}.{ending}", name.replace(['/', '\\'], "_"));
        Self { input: input.into(), name: self.name.with_extension("").join(file) }
    }
}

/// Refuses options that are for one clip.
///
/// # Errors
/// The options that were given.
pub fn refuse(given: &[(&str, bool)]) -> Result<()> {
    let given: Vec<&str> = given.iter().filter(|(_, given)| *given).map(|(option, _)| *option).collect();
    if !given.is_empty() {
        bail!("{}: only for one clip, but --input names several: give one file", given.join(", "));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn folders_patterns_and_lists_name_clips() {
        let folder = std::env::temp_dir().join(format!("gestus-batch-{}", std::process::id()));
        fs::create_dir_all(folder.join("a")).unwrap();
        // `a/out` is the output folder.
        fs::create_dir_all(folder.join("a/out")).unwrap();
        for file in ["x.bvh", "a/y.glb", "a/x.bvh", "a/out/x.bvh", "notes.txt"] {
            fs::write(folder.join(file), "").unwrap();
        }
        let names = |inputs: &[PathBuf]| {
            let found = clips(&inputs.iter().collect::<Vec<_>>(), &folder.join("a/out"))
                .map_err(|e| e.to_string())?;
            Ok::<_, String>(
                found.map(|all| all.into_iter().map(|c| c.name.display().to_string()).collect::<Vec<_>>()),
            )
        };
        let x = folder.join("x.bvh");
        assert_eq!(names(std::slice::from_ref(&x)).unwrap(), None);
        assert_eq!(names(std::slice::from_ref(&folder)).unwrap().unwrap(), ["a/x.bvh", "a/y.glb", "x.bvh"]);
        assert_eq!(names(&[folder.join("a/*.glb")]).unwrap().unwrap(), ["y.glb"]);
        assert_eq!(names(&[x.clone(), folder.join("a/y.glb")]).unwrap().unwrap(), ["x.bvh", "y.glb"]);
        // Animations of one file.
        let named = ["a/y.glb#walk", "a/y.glb#run"].map(|name| folder.join(name));
        assert_eq!(names(&named).unwrap().unwrap(), ["y/walk.glb", "y/run.glb"]);
        // What the words have to name: the clip, and the option.
        assert!(names(&[x, folder.join("a/x.bvh")]).unwrap_err().contains("x.bvh"));
        assert!(names(&[folder.join("*.fbx")]).is_err());
        assert!(
            refuse(&[("--page", true), ("--trace", false)]).unwrap_err().to_string().starts_with("--page:")
        );
        assert!(refuse(&[("--page", false)]).is_ok());
        let error = anyhow::Error::new(CaptureError::from(gestus_motion::formats::gltf::GltfError {
            file: "y.glb".into(),
            kind: GltfErrorKind::Several { file: "y.glb".into(), names: vec!["a/b".into()] },
        }))
        .context("y.glb");
        let clip = Clip { input: "y.glb".into(), name: "y.glb".into() };
        let one = clip.animation(&animations(&error).unwrap()[0]);
        assert_eq!(one, Clip { input: "y.glb#a/b".into(), name: "y/a_b.glb".into() });
        assert!(Format::of(&one.name).is_some());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn animations_that_would_be_written_to_one_file_are_refused() {
        let folder = std::env::temp_dir().join(format!("gestus-animations-{}", std::process::id()));
        fs::create_dir_all(&folder).unwrap();
        for file in ["y.glb", "notes.txt"] {
            fs::write(folder.join(file), "").unwrap();
        }
        let animations = |input: &Path, output: &Path| {
            if input.ends_with("y.glb") {
                return Err(anyhow::Error::new(CaptureError::from(
                    gestus_motion::formats::gltf::GltfError {
                        file: "y.glb".into(),
                        kind: GltfErrorKind::Several {
                            file: "y.glb".into(),
                            names: vec!["a/b".into(), "a_b".into(), "c".into()],
                        },
                    },
                )));
            }
            fs::write(output, input.to_string_lossy().as_bytes())?;
            Ok(Value::Null)
        };
        // A pattern leaves out what is no motion.
        let found = clips(&[&folder.join("*")], Path::new("out")).unwrap().unwrap();
        let out = folder.join("out");
        let error = run(found, &out, true, animations).unwrap_err().to_string();
        assert!(error.starts_with("1 of 3"), "{error}");
        assert!(fs::read_to_string(out.join("y/a_b.glb")).unwrap().ends_with("#a/b"));
        assert!(out.join("y/c.glb").is_file());
        fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn a_batch_leaves_no_empty_folders_for_clips_that_were_refused() {
        let folder = std::env::temp_dir().join(format!("gestus-refused-{}", std::process::id()));
        let input = folder.join("in");
        fs::create_dir_all(input.join("bad/deep")).unwrap();
        fs::create_dir_all(folder.join("own")).unwrap();
        for file in ["good.bvh", "bad/deep/x.bvh"] {
            fs::write(input.join(file), "").unwrap();
        }
        let only_good = |input: &Path, output: &Path| {
            if input.ends_with("good.bvh") {
                fs::write(output, "")?;
                return Ok(Value::Null);
            }
            bail!("bad")
        };
        let translate = |output: &str| {
            let found = clips(&[&input], Path::new(output)).unwrap().unwrap();
            run(found, &folder.join(output), true, only_good).unwrap_err()
        };
        let _ = translate("out/of/it");
        assert!(folder.join("out/of/it/good.bvh").is_file() && !folder.join("out/of/it/bad").exists());
        fs::remove_file(input.join("good.bvh")).unwrap();
        let _ = (translate("none/of/it"), translate("own"));
        assert!(!folder.join("none").exists());
        // It was there before.
        assert!(folder.join("own").is_dir());
        fs::remove_dir_all(&folder).unwrap();
    }
}
