//! `cargo xtask real-data`: the tests that need captured motion: those in files `tests/*real*.rs` of any crate. The
//! motion is not part of the repository; where it is missing there is nothing to run.

use std::{env, path::PathBuf};

use anyhow::Result;

use crate::shell::{Outcome, cargo, root, run as run_command};

/// Crates whose integration tests named `*real*` want real clips.
const CRATES: [&str; 4] = ["builder/motion", "builder/database", "firmware-sim", "tests"];

/// What to do where there are no real clips.
pub const MISSING: &str =
    "no real clips: put them into shared/data beside the repository, or name their folder in GESTUS_DATA";

/// Runs them.
///
/// # Errors
/// Where a test fails.
pub fn run() -> Result<Outcome> {
    let Some(data) = folder() else {
        return Ok(Outcome::Skipped(MISSING.into()));
    };
    // Of the whole workspace, whose features `cargo test --workspace` has built it with.
    let mut command = cargo();
    command.args(["test", "--workspace"]).env("GESTUS_DATA", &data);
    for test in CRATES.into_iter().flat_map(real_tests) {
        command.args(["--test", &test]);
    }
    run_command(&mut command)?;
    Ok(Outcome::Passed)
}

/// The folder of real clips, where there is one.
pub fn folder() -> Option<PathBuf> {
    let folder =
        env::var_os("GESTUS_DATA").map_or_else(|| root().join("../shared/data"), |dir| root().join(dir));
    folder.is_dir().then_some(folder)
}

/// Integration tests of a crate with `real` in their names.
fn real_tests(path: &str) -> Vec<String> {
    let Ok(entries) = root().join(path).join("tests").read_dir() else { return Vec::new() };
    let mut tests: Vec<String> = entries
        .flatten()
        .filter_map(|e| Some(e.file_name().to_str()?.strip_suffix(".rs")?.to_owned()))
        .filter(|name| name.contains("real"))
        .collect();
    tests.sort();
    tests
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_builders_tests() {
        assert!(real_tests("builder/motion").contains(&"bvh_real".to_owned()));
        assert!(real_tests("no-such-crate").is_empty());
    }
}
