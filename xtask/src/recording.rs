//! What other languages are tried with: the kept database, and a recording of a long stream over it with the digest of
//! the host's core.

use std::{fs, path::PathBuf};

use anyhow::{Context, Result};

use crate::shell::{built, root, run as run_command, target_dir};

/// A database and a recording over it.
pub struct Recorded {
    /// The database.
    pub blob: PathBuf,
    /// The recording.
    pub stream: PathBuf,
}

/// Records a stream of that many frames.
///
/// # Errors
/// Where the host's core can't be built or run.
pub fn record(frames: u32) -> Result<Recorded> {
    let blob = root().join("tests/golden/blob-v2-legs.gestus");
    let folder = target_dir().join("recorded");
    fs::create_dir_all(&folder).with_context(|| format!("{} can't be made", folder.display()))?;
    let stream = folder.join(format!("{frames}.stream"));
    let mut example = built("examples/recording")?;
    run_command(example.arg(&blob).arg(frames.to_string()).arg(&stream))?;
    Ok(Recorded { blob, stream })
}
