//! Reads motion files, BVH and glTF: a single file, or a folder in a fixed order. A bad file in a folder is reported and
//! skipped.
//!
//! A glTF file may hold several animations. A single file is given with the animation's name, `hero.glb#walk`. In a
//! folder, such a file counts as a subfolder of clips, `hero/walk`. An animation that is alone in its file has the
//! file's name, as with BVH.

use std::{
    borrow::Cow,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use rayon::prelude::*;
use thiserror::Error;
use walkdir::WalkDir;

use crate::animation::{Animation, Recording};
use crate::formats::{
    bvh::{AsBvh, Bvh, BvhError, BvhErrorKind},
    gltf::{self, Gltf, GltfError, GltfErrorKind},
};
use crate::{
    binding::{Binding, ConvertError},
    clip::Clip,
    unit::Unit,
};

/// Deepest nesting of folders that is followed.
const MAX_FOLDERS: usize = 32;

/// A file that could not be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CaptureError {
    /// BVH, or a folder.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// glTF.
    #[error(transparent)]
    Gltf(#[from] GltfError),
}

impl CaptureError {
    /// The file, as the caller named it.
    pub fn file(&self) -> &str {
        match self {
            Self::Bvh(error) => &error.file,
            Self::Gltf(error) => &error.file,
        }
    }
}

/// The content of a file, in a form that a clip can be written like.
#[derive(Debug, Clone, PartialEq)]
pub enum Document {
    /// BVH, with its channels.
    Bvh(Bvh),
    /// glTF, with the whole file.
    Gltf(Box<Gltf>),
    /// An animation alone.
    Animation(Animation),
}

impl Document {
    /// The file's name.
    pub fn name(&self) -> &str {
        match self {
            Self::Bvh(document) => document.name(),
            Self::Gltf(document) => &document.animation.name,
            Self::Animation(animation) => &animation.name,
        }
    }

    /// The unit of length, where the format has one.
    pub fn unit(&self) -> Option<Unit> {
        match self {
            Self::Bvh(_) => None,
            Self::Gltf(document) => document.animation.unit,
            Self::Animation(animation) => animation.unit,
        }
    }

    /// A clip in the form of this document, for the file `to`: glTF or BVH, by its ending ([`Format::of_output`]). In glTF
    /// it replaces the animation that was read, or is added under `name`.
    ///
    /// # Errors
    /// [`WriteError`] if it is not on the document's skeleton, or can't be represented.
    pub fn write(
        &self,
        binding: &Binding,
        clip: &Clip,
        to: &Path,
        name: Option<&str>,
    ) -> Result<Vec<u8>, WriteError> {
        match self {
            Self::Gltf(document) if is_gltf(to) => {
                let real = |folder: &Path| Path::new(".").join(folder).canonicalize().ok();
                let elsewhere = real(document.folder()) != to.parent().and_then(real);
                Ok(document.write(binding, clip, name, elsewhere)?)
            }
            _ => Ok(binding.write(self, clip)?.to_text().into_bytes()),
        }
    }
}

/// A clip that could not be written.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum WriteError {
    /// As BVH.
    #[error(transparent)]
    Bvh(#[from] ConvertError),
    /// As glTF.
    #[error(transparent)]
    Gltf(#[from] GltfErrorKind),
}

/// An output whose ending can't be written.
#[derive(Debug, Clone, PartialEq, Error)]
#[error("{}: {reason}: choose a name that ends in {endings}", .file.display())]
pub struct EndingError {
    /// The output.
    pub file: PathBuf,
    /// Why it can't be written.
    pub reason: &'static str,
    /// The endings that can be written.
    pub endings: String,
}

impl Recording for Document {
    fn animation(&self) -> Cow<'_, Animation> {
        match self {
            Self::Bvh(document) => document.animation(),
            Self::Gltf(document) => Cow::Borrowed(&document.animation),
            Self::Animation(animation) => Cow::Borrowed(animation),
        }
    }
}

impl AsBvh for Document {
    fn as_bvh(&self) -> Result<Cow<'_, Bvh>, ConvertError> {
        match self {
            Self::Bvh(document) => document.as_bvh(),
            Self::Gltf(document) => document.animation.as_bvh(),
            Self::Animation(animation) => animation.as_bvh(),
        }
    }
}

/// A format of motion files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// BVH.
    Bvh,
    /// glTF.
    Gltf,
}

impl Format {
    const ALL: [Self; 2] = [Self::Bvh, Self::Gltf];

    /// The format of a file, by the ending of its name.
    pub fn of(path: &Path) -> Option<Self> {
        let ending = path.extension()?;
        Self::ALL.into_iter().find(|format| format.endings().iter().any(|e| ending.eq_ignore_ascii_case(e)))
    }

    /// Its name.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Bvh => "BVH",
            Self::Gltf => "glTF",
        }
    }

    /// The format in which a clip is written to a file, by the ending of its name: BVH, also where it has none, or glTF if
    /// the clip comes from a file with the same ending. `input`: that file; `None` for a clip on another skeleton.
    ///
    /// # Errors
    /// [`EndingError`] names the endings that can be written.
    pub fn of_output(output: &Path, input: Option<&Path>) -> Result<Self, EndingError> {
        let Some(ending) = output.extension() else { return Ok(Self::Bvh) };
        let format = Self::of(output);
        let input = input.map(file_of).filter(|path| is_gltf(path)).and_then(Path::extension);
        if format == Some(Self::Bvh) {
            return Ok(Self::Bvh);
        }
        if input.is_some_and(|input| input.eq_ignore_ascii_case(ending)) {
            return Ok(Self::Gltf);
        }
        let reason = match (format, input) {
            (Some(_), Some(_)) => "glTF is written with the ending of the input",
            (Some(_), None) => {
                "glTF is read and not written, except where the clip comes from glTF and stays on its nodes"
            }
            _ => "this ending can't be written",
        };
        let own = input.map(|e| format!(" or .{}", e.to_string_lossy().to_ascii_lowercase()));
        let endings = format!(".bvh{}", own.unwrap_or_default());
        Err(EndingError { file: output.to_owned(), reason, endings })
    }

    const fn endings(self) -> &'static [&'static str] {
        match self {
            Self::Bvh => &["bvh"],
            Self::Gltf => &["glb", "gltf"],
        }
    }
}

/// The file of a clip's path, without the name of an animation after a `#`.
pub fn file_of(path: &Path) -> &Path {
    let file = path.to_str().and_then(|text| text.split_once('#')).map(|(file, _)| Path::new(file));
    file.filter(|file| !path.exists() && is_gltf(file)).unwrap_or(path)
}

/// Whether a file is glTF, by its name.
fn is_gltf(path: &Path) -> bool {
    Format::of(path) == Some(Format::Gltf)
}

/// Whether a file or folder is hidden: macOS leaves a `._walk.bvh` beside a `walk.bvh`, which holds no motion.
fn is_hidden(path: &Path) -> bool {
    path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b"."))
}

/// What [`read_folder`] found.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    /// The documents that could be read, with their paths, sorted by path. One of several animations of a
    /// file has the file's path without its ending as its folder.
    pub documents: Vec<(PathBuf, Document)>,
    /// Errors of the others, in the same order.
    pub skipped: Vec<CaptureError>,
    /// How many of the documents came from glTF.
    animations: usize,
}

impl Folder {
    /// One line for the end of a command: how many were read, and how many were not.
    pub fn summary(&self) -> String {
        let files = self.documents.len() - self.animations;
        let read = match (files, self.animations) {
            (files, 0) => format!("read {files} BVH files"),
            (0, animations) => format!("read {animations} glTF animations"),
            (files, animations) => format!("read {files} BVH files and {animations} glTF animations"),
        };
        match self.skipped.len() {
            0 => read,
            n => format!("{read}, skipped {n} that could not be read (--strict stops at the first)"),
        }
    }
}

/// Reads every `.bvh`, `.glb` and `.gltf` file below a folder (or the one file that `path` is), sorted by path.
///
/// A file that can't be read is listed in [`Folder::skipped`]; with `strict`, the first such file in order is the error.
/// Links to folders are not followed; hidden files and folders (`.name`) are skipped. A document's name is its path.
pub fn read_folder(path: &Path, strict: bool) -> Result<Folder, CaptureError> {
    let mut paths = Vec::new();
    let mut errors = Vec::new();
    if path.is_file() {
        paths.push(path.to_path_buf());
    } else {
        let files = WalkDir::new(path).max_depth(MAX_FOLDERS + 1).into_iter();
        for entry in files.filter_entry(|entry| entry.depth() == 0 || !is_hidden(entry.path())) {
            match entry {
                Ok(entry) if !entry.file_type().is_dir() && Format::of(entry.path()).is_some() => {
                    paths.push(entry.into_path());
                }
                Ok(_) => {}
                // The folder itself has to be there; a folder in it may be closed to us.
                Err(error) => {
                    let (at, folder) = (error.depth(), error.path().unwrap_or(path).to_path_buf());
                    let error = io_error(&folder, &error.into());
                    if at == 0 || strict {
                        return Err(error.into());
                    }
                    errors.push(error.into());
                }
            }
        }
    }
    paths.sort();
    let read: Vec<Result<Vec<(PathBuf, Document)>, CaptureError>> =
        paths.par_iter().map(|path| clips(path)).collect();
    let mut folder = Folder { skipped: errors, ..Folder::default() };
    for (path, clips) in paths.iter().zip(read) {
        match clips {
            Ok(clips) => {
                folder.animations += if is_gltf(path) { clips.len() } else { 0 };
                folder.documents.extend(clips);
            }
            Err(error) if strict => return Err(error),
            Err(error) => folder.skipped.push(error),
        }
    }
    folder.documents.sort_by(|a, b| a.0.cmp(&b.0));
    folder.skipped.sort_by(|a, b| a.file().cmp(b.file()));
    Ok(folder)
}

/// The documents in the bytes of a file, each with the name of its animation, which BVH does not have. The file's name
/// says the format.
///
/// # Errors
/// As [`read`]; a glTF file has to hold all its data itself.
pub fn documents(file: &Path, bytes: &Arc<[u8]>) -> Result<Vec<(String, Document)>, CaptureError> {
    let name = file.to_string_lossy();
    if !is_gltf(file) {
        return Ok(vec![(String::new(), Document::Bvh(Bvh::parse(bytes, &name)?))]);
    }
    let animations = Gltf::of(bytes.clone(), &name, Path::new(""))?;
    Ok(animations.into_iter().map(|one| (one.name().to_owned(), Document::Gltf(Box::new(one)))).collect())
}

/// The documents of a file, with their paths in [`Folder::documents`].
fn clips(path: &Path) -> Result<Vec<(PathBuf, Document)>, CaptureError> {
    let animations = match Format::of(path) {
        Some(Format::Gltf) => gltf::read(path)?,
        Some(Format::Bvh) | None => return Ok(vec![(path.to_path_buf(), Document::Bvh(read_bvh(path)?))]),
    };
    let alone = animations.len() == 1;
    let place = |name: &str| match alone {
        true => path.to_path_buf(),
        // With an ending, so that a dot in the name does not start one.
        false => path.with_extension("").join(format!("{}.glb", name.replace(['/', '\\'], "_"))),
    };
    Ok(animations
        .into_iter()
        .map(|document| (place(document.name()), Document::Animation(document.animation)))
        .collect())
}

/// Reads a file, or the animation of it that is named after a `#`. Messages name it by its path.
///
/// # Errors
/// [`CaptureError`] if it can't be read, or holds several animations and none is named.
pub fn read(path: &Path) -> Result<Document, CaptureError> {
    let file = file_of(path);
    let text = path.to_string_lossy();
    let wanted = text.split_once('#').map(|(_, name)| name).filter(|_| file != path);
    let mut animations = match Format::of(file) {
        Some(Format::Gltf) => gltf::read(file)?,
        Some(Format::Bvh) | None => return Ok(Document::Bvh(read_bvh(path)?)),
    };
    let names: Vec<String> = animations.iter().map(|animation| animation.name().to_owned()).collect();
    let file = file.to_string_lossy().into_owned();
    let at = match wanted {
        Some(wanted) => names
            .iter()
            .position(|n| n == wanted)
            .ok_or_else(|| GltfErrorKind::NoSuch { wanted: wanted.to_owned(), names: names.clone() }),
        None if names.len() > 1 => Err(GltfErrorKind::Several { file: file.clone(), names }),
        None => Ok(0),
    };
    match at {
        Ok(at) => Ok(Document::Gltf(Box::new(animations.swap_remove(at)))),
        Err(kind) => Err(GltfError { file, kind }.into()),
    }
}

fn read_bvh(path: &Path) -> Result<Bvh, BvhError> {
    let bytes = fs::read(path).map_err(|e| io_error(path, &e))?;
    Bvh::parse(&bytes, &path.to_string_lossy())
}

fn io_error(path: &Path, error: &std::io::Error) -> BvhError {
    let kind = BvhErrorKind::Io(error.to_string());
    BvhError { file: path.to_string_lossy().into_owned(), line: 0, column: 0, kind }
}
