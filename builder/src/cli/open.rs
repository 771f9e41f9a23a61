//! Databases in files.

use std::{fs, path::Path};

use anyhow::{Context, Result, anyhow};
use gestus_core::Database;

/// Reads a database's bytes; it is opened where they live.
pub fn read_blob(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("{} can't be read", path.display()))
}

/// Opens a database, naming its file where that fails.
pub fn open<'a>(path: &Path, bytes: &'a [u8]) -> Result<Database<'a>> {
    Database::open(bytes).map_err(|e| anyhow!("{}: {e}", path.display()))
}
