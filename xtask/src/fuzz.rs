//! `cargo xtask fuzz`: every target of `core/fuzz` and `builder/fuzz`, for a while each.
//!
//! cargo-fuzz needs a nightly compiler for its coverage flags. The sanitizers stay off: there is no `unsafe` to
//! watch, and without them a target runs several times as many inputs. A target starts from the files in
//! `fuzz/seeds/TARGET` and puts the words of `fuzz/TARGET.dict` into its inputs, where there are such.

use std::{path::Path, process::Command};

use anyhow::{Result, bail};

use crate::shell::{
    Outcome, answer, built, cargo, command, nightly_cargo, root, run as run_command, target_dir,
};

/// Crates with a `fuzz` folder.
const CRATES: [&str; 2] = ["core", "builder"];

/// Runs one target, or all.
///
/// # Errors
/// Where a target finds a crash (cargo-fuzz says how to run it again), does not build, or is not there.
pub fn run(setup: bool, seconds: u32, only: Option<&str>) -> Result<Outcome> {
    let targets: Vec<(&str, String)> = CRATES
        .iter()
        .flat_map(|&c| targets(c).into_iter().map(move |t| (c, t)))
        .filter(|(_, t)| only.is_none_or(|o| o == t))
        .collect();
    if let (Some(only), true) = (only, targets.is_empty()) {
        bail!("there is no fuzz target `{only}`: they are the files in */fuzz/fuzz_targets");
    }
    if let Some(missing) = missing(setup) {
        return Ok(Outcome::Skipped(missing));
    }
    let mut failed = Vec::new();
    for (krate, target) in &targets {
        if let Err(e) = fuzz(krate, target, seconds) {
            println!("{e:#}");
            failed.push(format!("{krate}/fuzz {target}"));
        }
    }
    if failed.is_empty() { Ok(Outcome::Passed) } else { Ok(Outcome::Failed(failed.join(", "))) }
}

fn fuzz(krate: &str, target: &str, seconds: u32) -> Result<()> {
    let folder = root().join(krate).join("fuzz");
    let corpus = folder.join("corpus").join(target);
    std::fs::create_dir_all(&corpus)?;
    if target == "open" {
        seed_with_blobs(&corpus)?;
    }
    let mut command = nightly_cargo();
    if target == "link" {
        let blob = target_dir().join("fuzz-link.gestus");
        let robot = target_dir().join("fuzz-robot.gestus");
        write_blobs(&[&blob, &target_dir().join("fuzz-models.gestus"), &robot])?;
        command.env("GESTUS_BLOB", blob).env("GESTUS_ROBOT", robot);
    }
    command
        .args(["fuzz", "run", "--sanitizer", "none", "--fuzz-dir"])
        .arg(&folder)
        .arg("--target-dir")
        .arg(target_dir().join("fuzz"))
        .arg(target)
        .arg(corpus);
    let seeds = folder.join("seeds").join(target);
    if seeds.is_dir() {
        command.arg(seeds);
    }
    command.args(["--", &format!("-max_total_time={seconds}"), "-timeout=10", "-rss_limit_mb=2048"]);
    let dictionary = folder.join(target).with_extension("dict");
    if dictionary.is_file() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    run_command(command.current_dir(root().join(krate)))
}

/// Puts blobs that open into the corpus, for mutation alone would never get past the first checks: one with all that a
/// database may hold, and one of models alone; and each with bytes behind it, which the target makes settings and poses
/// of.
fn seed_with_blobs(corpus: &Path) -> Result<()> {
    let (seed, models) = (corpus.join("seed"), corpus.join("models"));
    write_blobs(&[&seed, &models])?;
    for (from, to) in [(seed, "seed-with-poses"), (models, "models-with-poses")] {
        let mut bytes = std::fs::read(from)?;
        bytes.extend((0..=255u8).map(|i| i.wrapping_mul(91)));
        std::fs::write(corpus.join(to), bytes)?;
    }
    Ok(())
}

/// Builds a small database, what it is when cut to its models, and the tables of a robot for it: as many of
/// them as there are files.
fn write_blobs(files: &[&Path]) -> Result<()> {
    run_command(built("examples/small_blob")?.args(files))
}

/// The targets of a crate: its files in `fuzz/fuzz_targets`.
fn targets(krate: &str) -> Vec<String> {
    let Ok(entries) = root().join(krate).join("fuzz/fuzz_targets").read_dir() else { return Vec::new() };
    let mut names: Vec<String> = entries
        .flatten()
        .filter_map(|e| Some(e.file_name().to_str()?.strip_suffix(".rs")?.to_owned()))
        .collect();
    names.sort();
    names
}

/// What is missing for cargo-fuzz, after trying to install it where that is wanted.
fn missing(setup: bool) -> Option<String> {
    let nightly = || answer(nightly_cargo().arg("--version")).is_some();
    let cargo_fuzz = || answer(cargo().args(["fuzz", "--version"])).is_some();
    let install = |mut command: Command| {
        if let Err(e) = run_command(&mut command) {
            println!("{e:#}");
        }
    };
    if setup && !nightly() {
        let mut rustup = command("rustup");
        rustup.args(["toolchain", "install", "nightly", "--profile", "minimal"]);
        install(rustup);
    }
    if setup && !cargo_fuzz() {
        let mut cargo = cargo();
        // Built apart from the workspace's products, and kept by nobody.
        cargo.args(["install", "--locked", "cargo-fuzz"]).env_remove("CARGO_TARGET_DIR");
        install(cargo);
    }
    match (nightly(), cargo_fuzz()) {
        (true, true) => None,
        (false, _) => Some("no nightly toolchain (`cargo xtask fuzz --setup` installs it)".into()),
        (true, false) => Some("no cargo-fuzz (`cargo xtask fuzz --setup` installs it)".into()),
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn finds_the_targets() {
        assert!(super::targets("builder").contains(&"bvh".to_owned()));
        assert!(super::targets("no-such-crate").is_empty());
    }
}
