//! Files that commands read and write.

use std::{fs, path::Path};

use anyhow::{Context, Result, anyhow};
use gestus_core::Database;
use gestus_motion::files;

/// Largest database that is read, bytes: offsets in it have 32 bits.
const MOST_DATABASE: u64 = 1 << 32;

/// Reads a database's bytes; it is opened where they live.
pub fn read_blob(path: &Path) -> Result<Vec<u8>> {
    files::read(path, MOST_DATABASE).with_context(|| format!("{} can't be read", path.display()))
}

/// Writes a file.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> Result<()> {
    files::write(path, content).with_context(|| format!("{} can't be written", path.display()))
}

/// Makes a folder, with those above it.
pub fn make_folder(path: &Path) -> Result<()> {
    fs::create_dir_all(path).with_context(|| format!("{} can't be made", path.display()))
}

/// Opens a database, naming its file where that fails.
pub fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<Database<'a>> {
    Database::open(bytes).map_err(|e| anyhow!("{}: {e}", path.display()))
}
