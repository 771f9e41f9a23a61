//! All BVH files of a folder.

use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::{Bvh, BvhError, Problem};

/// What a folder held.
#[derive(Debug, Default)]
pub struct Folder {
    /// The files that could be read, in order of their paths.
    pub files: Vec<(PathBuf, Bvh)>,
    /// Those that could not.
    pub errors: Vec<BvhError>,
}

/// Paths of the BVH files in a folder and below it, sorted; or the file itself.
///
/// # Errors
/// [`BvhError`] where the folder can't be read.
pub fn paths(folder: &Path) -> Result<Vec<PathBuf>, BvhError> {
    let mut found = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        let problem = |e: std::io::Error| BvhError {
            file: folder.clone(),
            place: None,
            problem: Problem::Io(e.to_string()),
        };
        for entry in std::fs::read_dir(&folder).map_err(problem)? {
            let path = entry.map_err(problem)?.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bvh")) {
                found.push(path);
            }
        }
    }
    found.sort();
    Ok(found)
}

/// Reads the files of a folder that `wanted` asks for. Bad files are reported and left out.
///
/// # Errors
/// [`BvhError`] where the folder itself can't be read.
pub fn read_folder(folder: &Path, wanted: impl Fn(&Path) -> bool) -> Result<Folder, BvhError> {
    let paths: Vec<PathBuf> = paths(folder)?.into_iter().filter(|p| wanted(p)).collect();
    let read: Vec<(PathBuf, Result<Bvh, BvhError>)> = paths
        .into_par_iter()
        .map(|path| {
            let bvh = Bvh::read(&path);
            (path, bvh)
        })
        .collect();
    let mut folder = Folder::default();
    for (path, bvh) in read {
        match bvh {
            Ok(bvh) => folder.files.push((path, bvh)),
            Err(error) => folder.errors.push(error),
        }
    }
    Ok(folder)
}
