//! `cargo xtask firmware`: the images of all boards, and in the emulator a long stream that has to give the bits of
//! this machine on those with room and speed for it.

use std::collections::BTreeSet;

use anyhow::{Context, Result, ensure};
use serde_json::Value;

use crate::{
    log_lines,
    shell::{Outcome, cargo, json, root, run as run_command, sim},
    target, tools,
};

/// The table of boards.
const BOARDS: &str = "firmware-sim/src/board/boards.rs";
/// Frames that go over every board's link.
const LINKED: &str = "12";
/// The digest of the long stream, on every machine.
const GOLDEN: &str = "tests/golden/long-stream.txt";

/// What is missing for the boards, after trying to install it where that is wanted.
///
/// # Errors
/// A table of boards that can't be read.
pub fn missing(setup: bool) -> Result<Option<String>> {
    let target = of_boards("target")?.iter().find_map(|t| target::find(t, setup).err());
    let emulators = of_boards("emulator")?;
    let emulators: Vec<&str> = emulators.iter().map(String::as_str).collect();
    Ok(target.or_else(|| tools::missing(&emulators, setup)))
}

/// The values of a field in the table of boards, which is read as text, so that no chore waits for the simulator.
fn of_boards(field: &str) -> Result<BTreeSet<String>> {
    let table = std::fs::read_to_string(root().join(BOARDS)).with_context(|| BOARDS.to_owned())?;
    let prefix = format!("{field}: \"");
    let values = table.lines().filter_map(|line| line.trim().strip_prefix(&prefix)?.split('"').next());
    let values: BTreeSet<String> = values.map(str::to_owned).collect();
    ensure!(!values.is_empty(), "{BOARDS}: no board has a line `{field}: \"…\"`");
    Ok(values)
}

/// Builds and streams.
///
/// # Errors
/// Where a command can't be run or says something else than JSON.
pub fn run(setup: bool) -> Result<Outcome> {
    if let Some(missing) = missing(setup)? {
        return Ok(Outcome::Skipped(missing));
    }
    run_command(sim()?.args(["board", "--all", "--build"]))?;
    let no_log_lines = tools::missing(&["defmt-print"], setup);
    if no_log_lines.is_none() {
        log_lines::check()?;
    }
    let golden = std::fs::read_to_string(root().join(GOLDEN)).with_context(|| GOLDEN.to_owned())?;
    let golden = golden.split_whitespace().last().context("the digest of the long stream")?;
    // Of the whole workspace, as `cargo test --workspace` has compiled it.
    run_command(cargo().args(["test", "--workspace", "--test", "boards"]).env("GESTUS_BOARDS", "1"))?;
    // Every board's port, and its counter, over the link.
    run_command(sim()?.args(["board", "--all", "--generated", "--frames", LINKED]))?;
    let figures = json(sim()?.args(["board", "--all", "--long-stream", "--json"]))?;
    let mut wrong = Vec::new();
    let boards = figures["boards"].as_array().context("a list of boards")?;
    ensure!(!boards.is_empty(), "the long stream went over no board");
    for board in boards {
        let name = board["board"].as_str().unwrap_or("?");
        let right = board["bit_exact"] == Value::Bool(true) && board["digest"].as_str() == Some(golden);
        println!(
            "{name:10} {} frames, digest {}, {:.0} s",
            board["frames"],
            board["digest"].as_str().unwrap_or(""),
            board["seconds"].as_f64().unwrap_or(0.0)
        );
        if !right {
            wrong.push(name.to_owned());
        }
    }
    Ok(if wrong.is_empty() {
        Outcome::passed_but_for(no_log_lines)
    } else {
        Outcome::Failed(format!("other bits than {golden} on {}", wrong.join(", ")))
    })
}
