//! `cargo xtask checking`: the programs of docs/CHECKING.md, which recompute a stream in Python with NumPy.
//!
//! NumPy is in a virtual environment under `target/python`, which `--setup` makes; one of the system is not looked at.

use std::{env, path::PathBuf};

use anyhow::Result;

use crate::{
    shell::{Outcome, cargo, command, run as run_command, stdout_of, target_dir},
    tools,
};

/// The programs of the virtual environment.
fn programs() -> PathBuf {
    target_dir().join("python/bin")
}

fn has_numpy() -> bool {
    let python = programs().join("python3");
    stdout_of(command(&python.to_string_lossy()).args(["-c", "import numpy"])).is_some()
}

/// What is missing, after trying to install it where that is wanted.
pub fn missing(setup: bool) -> Option<String> {
    if setup && !has_numpy() && tools::missing(&["python3"], setup).is_none() {
        let (mut venv, mut pip) = (command("python3"), command(&programs().join("pip").to_string_lossy()));
        venv.args(["-m", "venv"]).arg(target_dir().join("python"));
        pip.args(["install", "--quiet", "--disable-pip-version-check", "numpy"]);
        tools::try_all(&mut [venv, pip]);
    }
    (!has_numpy()).then(|| "no NumPy in target/python (`--setup` installs it)".into())
}

/// Runs the programs.
///
/// # Errors
/// Where one prints something else than the page says.
pub fn run(setup: bool) -> Result<Outcome> {
    if let Some(missing) = missing(setup) {
        return Ok(Outcome::Skipped(missing));
    }
    let path = env::var_os("PATH").unwrap_or_default();
    let path = env::join_paths([programs()].into_iter().chain(env::split_paths(&path)))?;
    // Of the whole workspace, as `cargo test --workspace` has compiled it.
    let test = ["test", "--workspace", "--test", "checking", "--", "--ignored"];
    run_command(cargo().args(test).env("PATH", path))?;
    Ok(Outcome::Passed)
}
