//! Reads the file of a database or of tables made for it.

use std::path::Path;

use anyhow::{Context, Result};
use gestus_motion::files;

/// Largest file that is read, bytes: offsets in it have 32 bits.
const MOST: u64 = 1 << 32;

/// Reads a file's bytes; a database is opened where they live.
///
/// # Errors
/// A file that can't be read, is no regular one, or is larger than any database.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    files::read(path, MOST).with_context(|| format!("{} can't be read", path.display()))
}
