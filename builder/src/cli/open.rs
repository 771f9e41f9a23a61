//! Files that commands read and write.

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
pub use gestus_database::command_line::blob::{open, read as read_blob, write};

/// Refuses files of the user's own that generated ones would replace. `mark`: a file that is among them, and how it begins
/// where the program has written all of them.
pub fn check_generated((mark, start): (&Path, &str), mut files: impl Iterator<Item = PathBuf>) -> Result<()> {
    if read_blob(mark).is_ok_and(|bytes| bytes.starts_with(start.as_bytes())) {
        return Ok(());
    }
    match files.find(|path| path.exists()) {
        Some(own) => bail!(
            "{} is there already, and was not generated: give another folder, or move it away",
            own.display()
        ),
        None => Ok(()),
    }
}

/// Makes a folder, with those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    if path.is_file() {
        bail!("{}: this is a file: give a folder", path.display());
    }
    fs::create_dir_all(path).with_context(|| format!("{} can't be made", path.display()))
}
