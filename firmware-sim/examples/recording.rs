//! Writes a recording of a long stream through a database, with the host's digest, to test the C interface and the wasm
//! module (`cargo xtask capi`, `cargo xtask wasm`). The boards are tested with 10,000 frames of it.
//!
//! `cargo run -p gestus-firmware-sim --example recording -- DB.gestus FRAMES FILE`

use anyhow::{Context, Result, bail};
use gestus_core::Database;
use gestus_firmware_sim::{board::command::LONG_CHANGE, recording::Recording};

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [db, frames, file] = arguments.as_slice() else { bail!("usage: recording DB.gestus FRAMES FILE") };
    let blob = std::fs::read(db).with_context(|| format!("{db} can't be read"))?;
    let database = Database::open(&blob).map_err(|e| anyhow::anyhow!("{db}: {e}"))?;
    let frames = frames.parse().context("FRAMES is not a number")?;
    let recording = Recording::long(&database, frames, LONG_CHANGE);
    let digest = recording.digest(&database)?;
    std::fs::write(file, recording.to_bytes(digest)).with_context(|| format!("{file} can't be written"))?;
    println!("{digest:08x}");
    Ok(())
}
