//! Arrays as files of a folder.

use std::path::Path;

use anyhow::{Context, Result};
use gestus_motion::formats::npy::write_npy;

/// Writes arrays to a folder.
pub(super) struct Saver<'a> {
    pub folder: &'a Path,
}

impl Saver<'_> {
    /// Writes `NAME.npy`.
    pub fn array<T: npyz::AutoSerialize + Clone>(
        &self,
        name: &str,
        shape: &[usize],
        values: &[T],
    ) -> Result<()> {
        let path = self.folder.join(format!("{name}.npy"));
        write_npy(&path, shape, values).with_context(|| format!("{} can't be written", path.display()))
    }
}
