//! Reads motion files, BVH and glTF: a single file, or a folder in a fixed order. A bad file in a folder is reported and
//! skipped.
//!
//! A glTF file may hold several animations. A single file is given with the animation's name, `hero.glb#walk`. In a
//! folder, such a file counts as a subfolder of clips, `hero/walk`. An animation that is alone in its file has the
//! file's name, as with BVH.

use std::{
    borrow::Cow,
    path::{Path, PathBuf},
    sync::Arc,
};

use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;
use thiserror::Error;
use walkdir::WalkDir;

use crate::animation::{Animation, Joint, Recording};
use crate::files::{self, FileError, MAX_MOTION_BYTES};
pub use crate::format::{EndingError, Format, file_and_animation, file_of};

use crate::format::is_gltf;
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
const MAX_FOLDER_DEPTH: usize = 32;

/// A file that could not be read.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum CaptureError {
    /// BVH, or a folder.
    #[error(transparent)]
    Bvh(#[from] BvhError),
    /// glTF.
    #[error(transparent)]
    Gltf(#[from] GltfError),
    /// FBX, which is not read.
    #[error(
        "{file}: this is FBX, which Gestus does not read; convert it to glTF: `FBX2glTF -b -i {file} -o clip`, or in Blender \
         `blender -b --python-expr \"import bpy; bpy.ops.wm.read_factory_settings(use_empty=True); \
         bpy.ops.import_scene.fbx(filepath='{file}'); bpy.ops.export_scene.gltf(filepath='clip.glb')\"`"
    )]
    Fbx {
        /// The file, as the caller named it.
        file: String,
    },
}

impl CaptureError {
    /// The file, as the caller named it.
    pub fn file(&self) -> &str {
        match self {
            Self::Bvh(error) => &error.file,
            Self::Gltf(error) => &error.file,
            Self::Fbx { file } => file,
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

impl Document {
    /// Whether the format says that Y is up. Otherwise the body has to show what is.
    pub fn has_y_up(&self) -> bool {
        !matches!(self, Self::Bvh(_))
    }

    fn recording(&self) -> &dyn Recording {
        match self {
            Self::Bvh(document) => document,
            Self::Gltf(document) => &document.animation,
            Self::Animation(animation) => animation,
        }
    }
}

impl Recording for Document {
    fn name(&self) -> &str {
        self.recording().name()
    }

    fn unit(&self) -> Option<Unit> {
        self.recording().unit()
    }

    fn rate_hz(&self) -> f64 {
        self.recording().rate_hz()
    }

    fn notes(&self) -> &[String] {
        self.recording().notes()
    }

    fn joints(&self) -> Cow<'_, [Joint]> {
        self.recording().joints()
    }

    fn frames(&self) -> usize {
        self.recording().frames()
    }

    fn frame(&self, frame: usize) -> Cow<'_, [Isometry3<f64>]> {
        self.recording().frame(frame)
    }

    fn place(&self, frame: usize, joint: usize) -> Vector3<f64> {
        self.recording().place(frame, joint)
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
}

impl Folder {
    /// One line for the end of a command: how many clips were read, and how many files were not.
    pub fn summary(&self) -> String {
        let read = format!("read {} clips", self.documents.len());
        match self.skipped.len() {
            0 => read,
            n => format!("{read}, skipped {n} files that could not be read"),
        }
    }
}

/// Reads every motion file below a folder (or the one file that `path` is), sorted by path.
///
/// A file that can't be read is listed in [`Folder::skipped`]. Links to folders are not followed; hidden files and folders
/// (`.name`) are skipped. A document's name is its path.
///
/// # Errors
/// The folder itself can't be read.
pub fn read_folder(path: &Path) -> Result<Folder, CaptureError> {
    let (paths, errors) = motion_files(path)?;
    let read: Vec<Result<Vec<(PathBuf, Document)>, CaptureError>> =
        paths.par_iter().map(|path| clips(path)).collect();
    let mut folder = Folder { skipped: errors, ..Folder::default() };
    for clips in read {
        match clips {
            Ok(clips) => folder.documents.extend(clips),
            Err(error) => folder.skipped.push(error),
        }
    }
    folder.documents.sort_by(|a, b| a.0.cmp(&b.0));
    folder.skipped.sort_by(|a, b| a.file().cmp(b.file()));
    Ok(folder)
}

/// The motion files below a folder, sorted by path, and the folders in it that can't be read. For a file, the file itself.
///
/// # Errors
/// The folder itself can't be read.
pub fn motion_files(path: &Path) -> Result<(Vec<PathBuf>, Vec<CaptureError>), CaptureError> {
    let (mut paths, mut errors) = (Vec::new(), Vec::new());
    if path.is_file() {
        return Ok((vec![path.to_path_buf()], errors));
    }
    let files = WalkDir::new(path).max_depth(MAX_FOLDER_DEPTH + 1).into_iter();
    for entry in files.filter_entry(|entry| entry.depth() == 0 || !is_hidden(entry.path())) {
        match entry {
            Ok(entry) if !entry.file_type().is_dir() && Format::of(entry.path()).is_some() => {
                paths.push(entry.into_path());
            }
            Ok(_) => {}
            // The folder itself has to be there; a folder in it may be closed to us.
            Err(error) => {
                let (at, folder) = (error.depth(), error.path().unwrap_or(path).to_path_buf());
                let error = file_error(&folder, std::io::Error::from(error).into()).into();
                if at == 0 {
                    return Err(error);
                }
                errors.push(error);
            }
        }
    }
    paths.sort();
    Ok((paths, errors))
}

/// The documents in the bytes of a file, each with the name of its animation, which BVH does not have.
///
/// # Errors
/// As [`read`]; a glTF file has to hold all its data itself.
pub fn documents(file: &Path, bytes: &Arc<[u8]>) -> Result<Vec<(String, Document)>, CaptureError> {
    let name = file.to_string_lossy();
    let animations = match Format::of_content(file, bytes) {
        Format::Gltf => Gltf::of(bytes.clone(), &name, Path::new(""))?,
        Format::Bvh => return Ok(vec![(String::new(), Document::Bvh(Bvh::parse(bytes, &name)?))]),
        Format::Fbx => return Err(CaptureError::Fbx { file: name.into_owned() }),
    };
    Ok(animations.into_iter().map(|one| (one.name().to_owned(), Document::Gltf(Box::new(one)))).collect())
}

/// The poses of rest of a character's file, the best first, each a document of one frame; of a BVH file, which has none,
/// the file itself.
///
/// # Errors
/// [`CaptureError`] if it can't be read.
pub fn read_rest(path: &Path) -> Result<Vec<Document>, CaptureError> {
    match format_of(path)? {
        Format::Gltf => Ok(gltf::rest(path)?.into_iter().map(Document::Animation).collect()),
        Format::Bvh => Ok(vec![Document::Bvh(read_bvh(path)?)]),
        Format::Fbx => Err(CaptureError::Fbx { file: path.to_string_lossy().into_owned() }),
    }
}

/// The documents of a file, with their paths in [`Folder::documents`].
///
/// # Errors
/// [`CaptureError`] if it can't be read.
pub fn clips(path: &Path) -> Result<Vec<(PathBuf, Document)>, CaptureError> {
    let animations = match format_of(path)? {
        Format::Gltf => gltf::read(path)?,
        Format::Bvh => return Ok(vec![(path.to_path_buf(), Document::Bvh(read_bvh(path)?))]),
        Format::Fbx => return Err(CaptureError::Fbx { file: path.to_string_lossy().into_owned() }),
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
    let (file, wanted) = file_and_animation(path);
    match format_of(file)? {
        Format::Gltf => Ok(Document::Gltf(Box::new(gltf::read_one(file, wanted)?))),
        Format::Bvh => Ok(Document::Bvh(read_bvh(path)?)),
        Format::Fbx => Err(CaptureError::Fbx { file: path.to_string_lossy().into_owned() }),
    }
}

/// The format of a file, by its content.
fn format_of(path: &Path) -> Result<Format, CaptureError> {
    Ok(Format::of_file(path).map_err(|e| file_error(path, e))?)
}

fn read_bvh(path: &Path) -> Result<Bvh, BvhError> {
    let bytes = files::read(path, MAX_MOTION_BYTES).map_err(|e| file_error(path, e))?;
    Bvh::parse(&bytes, &path.to_string_lossy())
}

fn file_error(path: &Path, error: FileError) -> BvhError {
    let kind = BvhErrorKind::File(error);
    BvhError { file: path.to_string_lossy().into_owned(), line: 0, column: 0, kind }
}
