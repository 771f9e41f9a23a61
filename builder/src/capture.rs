//! Files of captured motion: one, or a folder of them read in a fixed order, where a bad file is reported and left out.

use std::fs;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use crate::bvh::{Bvh, BvhError, BvhErrorKind};

/// Deepest nesting of folders that is followed.
const MAX_FOLDERS: usize = 32;

/// What [`read_folder`] found.
#[derive(Debug, Clone, Default)]
pub struct Folder {
    /// The documents that could be read, with their paths, sorted by path.
    pub documents: Vec<(PathBuf, Bvh)>,
    /// Why the others could not, in the same order.
    pub skipped: Vec<BvhError>,
}

impl Folder {
    /// One line for the end of a command: how many were read, and how many were not.
    pub fn summary(&self) -> String {
        let read = format!("read {} BVH files", self.documents.len());
        match self.skipped.len() {
            0 => read,
            n => format!("{read}, skipped {n} that could not be read (--strict stops at the first)"),
        }
    }
}

/// Reads every `.bvh` file below a folder (or the one file that `path` is), sorted by path.
///
/// A file that cannot be read is put in [`Folder::skipped`]; with `strict`, the first in order is the error.
/// Links to folders are not followed. Documents are named by their path.
pub fn read_folder(path: &Path, strict: bool) -> Result<Folder, BvhError> {
    let mut paths = Vec::new();
    let mut errors = Vec::new();
    if path.is_file() {
        paths.push(path.to_path_buf());
    } else {
        let mut open = vec![(path.to_path_buf(), 0)];
        while let Some((folder, depth)) = open.pop() {
            let entries = fs::read_dir(&folder).and_then(|entries| entries.collect::<Result<Vec<_>, _>>());
            let entries = match entries {
                Ok(entries) => entries,
                // The folder itself must be there; one below it may be closed to us.
                Err(e) if depth == 0 || strict => return Err(io_error(&folder, &e)),
                Err(e) => {
                    errors.push(io_error(&folder, &e));
                    continue;
                }
            };
            for entry in entries {
                let is_folder = entry.file_type().is_ok_and(|t| t.is_dir());
                let path = entry.path();
                if is_folder && depth < MAX_FOLDERS {
                    open.push((path, depth + 1));
                } else if !is_folder && path.extension().is_some_and(|e| e.eq_ignore_ascii_case("bvh")) {
                    paths.push(path);
                }
            }
        }
    }
    paths.sort();
    let read: Vec<Result<Bvh, BvhError>> = paths.par_iter().map(|path| read(path)).collect();
    let mut folder = Folder { documents: Vec::new(), skipped: errors };
    for (path, document) in paths.into_iter().zip(read) {
        match document {
            Ok(document) => folder.documents.push((path, document)),
            Err(error) if strict => return Err(error),
            Err(error) => folder.skipped.push(error),
        }
    }
    folder.skipped.sort_by(|a, b| a.file.cmp(&b.file));
    Ok(folder)
}

/// Reads one file, named in messages by its path.
pub fn read(path: &Path) -> Result<Bvh, BvhError> {
    let bytes = fs::read(path).map_err(|e| io_error(path, &e))?;
    Bvh::parse(&bytes, &path.to_string_lossy())
}

fn io_error(path: &Path, error: &std::io::Error) -> BvhError {
    let kind = BvhErrorKind::Io(error.to_string());
    BvhError { file: path.to_string_lossy().into_owned(), line: 0, column: 0, kind }
}
