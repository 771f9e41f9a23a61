//! A glTF file with its animations, and the files beside it.

use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

use super::{
    error::{GltfError, GltfErrorKind},
    joined::joined,
    motion::animations,
};
use crate::{
    animation::Animation as Motion,
    files::{self, FileError, MAX_MOTION_BYTES},
};

/// An animation, with the file that it is in.
#[derive(Debug, Clone, PartialEq)]
pub struct Gltf {
    /// Its motion.
    pub animation: Motion,
    /// Its name.
    pub(super) name: String,
    /// The whole file.
    pub(super) bytes: Arc<[u8]>,
    /// The folder that the file is in.
    pub(super) folder: PathBuf,
}

/// Reads the animations of a file that move a body, in the file's order.
///
/// They are named `FILE#ANIMATION`, or `FILE` if there is only one. Several that move one joint each are one.
///
/// # Errors
/// [`GltfError`] if the file, or one of its animations, can't be used.
pub fn read(path: &Path) -> Result<Vec<Gltf>, GltfError> {
    Gltf::of_file(path, None)
}

/// Reads the animation of that name, or the only one.
///
/// # Errors
/// [`GltfError`] if the file or the animation can't be used, and if there are several and none is named.
pub fn read_one(path: &Path, wanted: Option<&str>) -> Result<Gltf, GltfError> {
    let none = || GltfError { file: path.to_string_lossy().into_owned(), kind: GltfErrorKind::NoMotion };
    Gltf::of_file(path, Some(wanted))?.pop().ok_or_else(none)
}

impl Gltf {
    fn of_file(path: &Path, only: Option<Option<&str>>) -> Result<Vec<Self>, GltfError> {
        let file = path.to_string_lossy();
        let bytes = files::read(path, MAX_MOTION_BYTES)
            .map_err(|e| GltfError { file: file.clone().into_owned(), kind: GltfErrorKind::File(e) })?;
        Self::some_of(bytes.into(), &file, path.parent().unwrap_or(Path::new("")), only)
    }

    /// The animations in the bytes of a file, with the folder that its other files are in.
    ///
    /// # Errors
    /// As [`read`].
    pub fn of(bytes: Arc<[u8]>, file: &str, folder: &Path) -> Result<Vec<Self>, GltfError> {
        Self::some_of(bytes, file, folder, None)
    }

    fn some_of(
        bytes: Arc<[u8]>,
        file: &str,
        folder: &Path,
        only: Option<Option<&str>>,
    ) -> Result<Vec<Self>, GltfError> {
        let failed = |kind| GltfError { file: file.to_owned(), kind };
        let open = |name: &Path| beside(folder, name);
        let (bytes, found) = match animations(&bytes, file, &open, only) {
            Err(GltfErrorKind::OneByOne { animations: count }) => {
                let bytes: Arc<[u8]> = joined(&bytes).map_err(failed)?.into();
                let mut found = animations(&bytes, file, &open, None).map_err(failed)?;
                let note = format!(
                    "each of its {count} animations moves one joint, and no joint is moved by two: they are taken for one \
                     motion, and written as one"
                );
                found.iter_mut().for_each(|(_, motion)| motion.notes.push(note.clone()));
                (bytes, found)
            }
            found => (bytes, found.map_err(failed)?),
        };
        let with_file =
            |(name, animation)| Self { animation, name, bytes: bytes.clone(), folder: folder.to_owned() };
        Ok(found.into_iter().map(with_file).collect())
    }

    /// The folder that the file is in.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The animation's name in the file.
    pub fn name(&self) -> &str {
        &self.name
    }
}

/// Reads a file in the folder of a glTF file.
pub(super) fn beside(folder: &Path, name: &Path) -> Result<Vec<u8>, FileError> {
    files::read_in(folder, name, MAX_MOTION_BYTES)
}
