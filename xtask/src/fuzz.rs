//! `cargo xtask fuzz`: every target of `core/fuzz` and `builder/fuzz`, for a while each.
//!
//! cargo-fuzz needs a nightly compiler for its coverage flags. The sanitizers stay off: there is no `unsafe` to
//! watch, and without them a target runs several times as many inputs. A target starts from the files in
//! `fuzz/seeds/TARGET` and puts the words of `fuzz/TARGET.dict` into its inputs, where there are such.

use std::{path::Path, process::Command};

use anyhow::{Context, Result, bail, ensure};
use rayon::prelude::*;

use crate::{
    shell::{
        Outcome, built, command, nightly_cargo, root, run as run_command, run_captured, show, stdout_of,
        target_dir,
    },
    tools,
};

/// Crates with a `fuzz` folder.
const CRATES: [&str; 2] = ["core", "builder"];

/// Runs one target, or all.
///
/// # Errors
/// Where a target finds a crash (cargo-fuzz says how to run it again), does not build, or is not there.
pub fn run(setup: bool, seconds: u32, only: Option<&str>) -> Result<Outcome> {
    let mut targets = Vec::new();
    for krate in CRATES {
        targets.extend(self::targets(krate)?.into_iter().map(|target| (krate, target)));
    }
    targets.retain(|(_, target)| only.is_none_or(|wanted| wanted == target));
    if let (Some(only), true) = (only, targets.is_empty()) {
        bail!("there is no fuzz target `{only}`: they are the files in */fuzz/fuzz_targets");
    }
    if let Some(missing) = missing(setup) {
        return Ok(Outcome::Skipped(missing));
    }
    if only.is_none() {
        CRATES.into_iter().try_for_each(build)?;
    }
    let runs =
        targets.iter().map(|(krate, target)| prepare(krate, target, seconds)).collect::<Result<Vec<_>>>()?;
    // A target keeps one processor busy.
    let runs = targets.into_par_iter().zip(runs).with_max_len(1);
    let failed: Vec<String> = runs
        .filter_map(|((krate, target), mut run)| {
            let error = fuzz(&mut run).err()?;
            println!("{error:#}");
            Some(format!("{krate}/fuzz {target}"))
        })
        .collect();
    if failed.is_empty() { Ok(Outcome::Passed) } else { Ok(Outcome::Failed(failed.join(", "))) }
}

/// Builds all targets of a crate at once.
fn build(krate: &str) -> Result<()> {
    run_command(&mut cargo_fuzz("build", krate))
}

/// `cargo fuzz` for a crate.
fn cargo_fuzz(subcommand: &str, krate: &str) -> Command {
    let mut command = nightly_cargo();
    command
        .args(["fuzz", subcommand, "--sanitizer", "none", "--fuzz-dir"])
        .arg(root().join(krate).join("fuzz"))
        .arg("--target-dir")
        .arg(target_dir().join("fuzz"))
        .current_dir(root().join(krate));
    command
}

/// Runs a target. Shows the end of what it wrote, or all of it where it failed.
fn fuzz(run: &mut Command) -> Result<()> {
    let (passed, output) = run_captured(run)?;
    let lines: Vec<&str> = output.lines().collect();
    let shown = if passed { lines.len().saturating_sub(3) } else { 0 };
    println!("{}", lines[shown..].join("\n"));
    ensure!(passed, "`{}` failed", show(run));
    Ok(())
}

/// The command that runs a target, with a corpus to start from.
fn prepare(krate: &str, target: &str, seconds: u32) -> Result<Command> {
    let folder = root().join(krate).join("fuzz");
    let corpus = folder.join("corpus").join(target);
    std::fs::create_dir_all(&corpus)?;
    if ["open", "work"].contains(&target) {
        seed_with_blobs(&corpus)?;
    }
    let mut command = cargo_fuzz("run", krate);
    if target == "link" {
        let blob = target_dir().join("fuzz-link.gestus");
        let robot = target_dir().join("fuzz-robot.gestus");
        write_blobs(&[&blob, &target_dir().join("fuzz-models.gestus"), &robot])?;
        command.env("GESTUS_BLOB", blob).env("GESTUS_ROBOT", robot);
    }
    if target == "recovery" {
        let [blob, poses] =
            ["fuzz-recovery.gestus", "fuzz-recovery.poses"].map(|name| target_dir().join(name));
        run_command(built("examples/recovery_stream")?.args([&blob, &poses]))?;
        command.env("GESTUS_BLOB", blob).env("GESTUS_POSES", poses);
    }
    command.arg(target).arg(corpus);
    let seeds = folder.join("seeds").join(target);
    if seeds.is_dir() {
        command.arg(seeds);
    }
    command.args(["--", &format!("-max_total_time={seconds}"), "-timeout=10", "-rss_limit_mb=2048"]);
    let dictionary = folder.join(target).with_extension("dict");
    if dictionary.is_file() {
        command.arg(format!("-dict={}", dictionary.display()));
    }
    Ok(command)
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
fn targets(krate: &str) -> Result<Vec<String>> {
    let folder = root().join(krate).join("fuzz/fuzz_targets");
    let entries = folder.read_dir().with_context(|| folder.display().to_string())?;
    let mut names: Vec<String> = entries
        .flatten()
        .filter_map(|e| Some(e.file_name().to_str()?.strip_suffix(".rs")?.to_owned()))
        .collect();
    names.sort();
    ensure!(!names.is_empty(), "{}: no fuzz target", folder.display());
    Ok(names)
}

/// What is missing for fuzzing, after trying to install it where that is wanted.
fn missing(setup: bool) -> Option<String> {
    let nightly = || stdout_of(nightly_cargo().arg("--version")).is_some();
    if setup && !nightly() {
        let mut rustup = command("rustup");
        rustup.args(["toolchain", "install", "nightly", "--profile", "minimal"]);
        tools::try_all(&mut [rustup]);
    }
    if !nightly() {
        return Some("no nightly toolchain (`cargo xtask fuzz --setup` installs it)".into());
    }
    tools::missing(&["cargo-fuzz"], setup)
}

#[cfg(test)]
mod tests {
    #[test]
    fn finds_the_targets() {
        assert!(super::targets("builder").unwrap().contains(&"bvh".to_owned()));
        assert!(super::targets("no-such-crate").is_err());
    }
}
