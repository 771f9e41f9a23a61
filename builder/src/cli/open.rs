//! Files that commands read and write.

use std::{fs, path::Path};

use anyhow::{Context, Result, bail};
pub use gestus_database::command_line::blob::{open, read as read_blob, write};

/// Makes a folder, with those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    if path.is_file() {
        bail!("{}: this is a file: give a folder", path.display());
    }
    fs::create_dir_all(path).with_context(|| format!("{} can't be made", path.display()))
}
