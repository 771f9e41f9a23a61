//! `cargo xtask same --base REV`: proof that a change of structure changes nothing else.
//!
//! `gestus` and `gestus-sim` of the base revision and of the working tree run the same commands, and whatever they
//! write is compared: JSON on standard output as text, all other files byte for byte. Only the values in
//! `compare::VOLATILE` are left out.
//!
//! The base's programs and their output stay in `target/same/REVISION` for the next run.

mod cases;
mod compare;

use std::{
    fs,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, ensure};

use crate::{
    real_data,
    shell::{Outcome, cargo, command, root, run as run_command, run_for_stdout, target_dir},
};
use cases::Case;

/// The programs that are compared.
const PROGRAMS: [&str; 2] = ["gestus", "gestus-sim"];
/// What a case writes to standard output.
const STDOUT: &str = "stdout.json";
/// The commands that a folder of outputs was made by. It is written last, so an interrupted run is not reused.
const COMMANDS: &str = "commands.txt";

/// Compares the working tree with a revision.
///
/// # Errors
/// Where a revision does not build, or a command fails.
pub fn run(base: &str, quick: bool) -> Result<Outcome> {
    let revision =
        run_for_stdout(command("git").args(["rev-parse", "--verify", &format!("{base}^{{commit}}")]))?;
    let kept = target_dir().join("same").join(revision.trim());
    let tree = target_dir().join("same/working-tree");
    let data = real_data::folder().map(|f| f.join("bandai-namco-2")).filter(|f| f.is_dir());
    let cases: Vec<Case> = cases::all(quick, data.as_deref());
    let commands: String = cases.iter().map(|c| format!("{}\n", c.line())).collect();

    build_base(&kept, revision.trim())?;
    build(root(), &tree)?;
    let outputs = if quick { "quick" } else { "full" };
    let old = kept.join(outputs);
    if fs::read_to_string(old.join(COMMANDS)).ok().as_ref() != Some(&commands) {
        remove(&old)?;
        for case in &cases {
            run_case(case, &kept, &old)?;
        }
        fs::write(old.join(COMMANDS), &commands)?;
    }
    let new = tree.join(outputs);
    remove(&new)?;
    let mut changed = Vec::new();
    for case in &cases {
        run_case(case, &tree, &new)?;
        let differences = compare::folders(case.name, &old.join(case.name), &new.join(case.name))?;
        println!("{}: {}", case.name, if differences.is_empty() { "the same" } else { "DIFFERENT" });
        differences.iter().for_each(|difference| println!("  {difference}"));
        if !differences.is_empty() {
            changed.push(case.name);
        }
    }
    Ok(if !changed.is_empty() {
        Outcome::Failed(format!("different from {base}: {}", changed.join(", ")))
    } else if data.is_none() {
        Outcome::Skipped(format!("the measures on real clips: {}", real_data::MISSING))
    } else {
        Outcome::Passed
    })
}

/// Builds the base's programs from a temporary checkout, unless they are there.
fn build_base(folder: &Path, revision: &str) -> Result<()> {
    if PROGRAMS.iter().all(|p| program(folder, p).is_file()) {
        return Ok(());
    }
    let checkout = folder.join("checkout");
    remove(&checkout)?;
    run_command(command("git").args(["worktree", "prune"]))?;
    run_command(command("git").args(["worktree", "add", "--detach"]).arg(&checkout).arg(revision))?;
    let built = build(&checkout, folder);
    run_command(command("git").args(["worktree", "remove", "--force"]).arg(&checkout))?;
    built
}

/// Builds the programs of a checkout and copies them into a folder. Both checkouts share one target folder, and with
/// it the packages that they depend on.
fn build(checkout: &Path, folder: &Path) -> Result<()> {
    let mut build = cargo();
    build.current_dir(checkout).args(["build", "--release", "--quiet"]).args(["--target-dir"]);
    build.arg(target_dir());
    run_command(build.args(PROGRAMS.iter().flat_map(|p| ["--bin", p])))?;
    fs::create_dir_all(folder)?;
    for name in PROGRAMS {
        fs::copy(program(&target_dir().join("release"), name), program(folder, name))
            .with_context(|| format!("{name} can't be copied to {}", folder.display()))?;
    }
    Ok(())
}

fn program(folder: &Path, name: &str) -> PathBuf {
    folder.join(name).with_extension(std::env::consts::EXE_EXTENSION)
}

/// Runs a case in a folder of its own, so that the paths in its arguments and output are the same for both revisions.
fn run_case(case: &Case, programs: &Path, outputs: &Path) -> Result<()> {
    let folder = outputs.join(case.name);
    fs::create_dir_all(&folder)?;
    let stdout = fs::File::create(folder.join(STDOUT))?;
    let mut run = command(&program(programs, case.program).to_string_lossy());
    run.current_dir(&folder).args(&case.arguments).stdout(stdout);
    // What a command tells people may change; it is kept to be read when the command fails.
    let messages = folder.with_extension("stderr");
    run.stderr(fs::File::create(&messages)?);
    let status = run
        .status()
        .with_context(|| format!("{} can't be started", program(programs, case.program).display()))?;
    ensure!(
        status.success(),
        "{}: `{}` failed ({status}):\n{}",
        outputs.display(),
        case.line(),
        fs::read_to_string(&messages)?
    );
    Ok(())
}

fn remove(folder: &Path) -> Result<()> {
    if folder.exists() {
        fs::remove_dir_all(folder).with_context(|| format!("{} can't be removed", folder.display()))?;
    }
    Ok(())
}
