//! Reads and opens the file of a database or of tables made for it, and writes files.

use std::path::Path;

use anyhow::{Context, Result, anyhow};
use gestus_core::{Database, retarget, robot};
use gestus_motion::files;

/// Largest file that is read, bytes: offsets in it have 32 bits.
const MAX_BYTES: u64 = 1 << 32;

/// Reads a file's bytes; a database is opened where they live.
///
/// # Errors
/// A file that can't be read, is no regular one, or is larger than any database.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    files::read(path, MAX_BYTES).with_context(|| format!("{} can't be read", path.display()))
}

/// Writes a file, whole or not at all.
///
/// # Errors
/// Errors of the file system, after the name of the file.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    files::write(path, content).with_context(|| format!("{} can't be written", path.display()))
}

/// Opens a database.
///
/// # Errors
/// What is wrong with it, after the name of its file.
pub fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<Database<'a>> {
    let others =
        [(robot::layout::MAGIC, "the tables of a robot"), (retarget::layout::MAGIC, "the map of a skeleton")];
    Database::open(bytes).map_err(|error| match others.iter().find(|(magic, _)| bytes.starts_with(magic)) {
        Some((_, what)) => {
            anyhow!(
                "{}: it holds {what}, for firmware: give the database that it was made for",
                path.display()
            )
        }
        None => anyhow!("{}: {error}", path.display()),
    })
}
