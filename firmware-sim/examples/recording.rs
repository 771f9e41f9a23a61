//! Writes a recording of a long stream over a database, with the host's digest: what the C interface and the wasm
//! module are tried with (`cargo xtask capi`, `cargo xtask wasm`). 10,000 frames of it over the kept database are the
//! long stream that the boards are tried with too.
//!
//! `cargo run -p gestus-firmware-sim --example recording -- DB.gestus FRAMES FILE`

use anyhow::{Context, Result, bail};
use gestus_core::Database;
use gestus_firmware_sim::{board::command::LONG, recording::Recording};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [db, frames, file] = arguments.as_slice() else {
        bail!("name a database, a number of frames, and the file")
    };
    let blob = std::fs::read(db).with_context(|| format!("{db} can't be read"))?;
    let database = Database::open(&blob).map_err(|e| anyhow::anyhow!("{db}: {e}"))?;
    let recording = Recording::long(&database, frames.parse().context("frames are a number")?, LONG.1);
    let digest = recording.digest(&database)?;
    std::fs::write(file, recording.to_bytes(digest)).with_context(|| format!("{file} can't be written"))?;
    println!("{digest:08x}");
    Ok(())
}
