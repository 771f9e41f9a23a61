//! `cargo xtask real-data`: the tests that need captured motion: those in files `tests/*real*.rs` of any crate. The
//! motion is not part of the repository; where it is missing there is nothing to run.

use std::{env, path::PathBuf};

use anyhow::{Result, ensure};
use walkdir::{DirEntry, WalkDir};

use crate::shell::{Outcome, cargo, root, run as run_command};

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
    let mut test = cargo();
    test.args(["test", "--workspace"]).env("GESTUS_DATA", &data);
    for name in real_tests()? {
        test.args(["--test", &name]);
    }
    run_command(&mut test)?;
    Ok(Outcome::Passed)
}

/// The folder of real clips, where there is one.
pub fn folder() -> Option<PathBuf> {
    let folder =
        env::var_os("GESTUS_DATA").map_or_else(|| root().join("../shared/data"), |dir| root().join(dir));
    folder.is_dir().then_some(folder)
}

/// The integration tests with `real` in their names, of every crate.
fn real_tests() -> Result<Vec<String>> {
    // Not by git: a source archive has no repository.
    let is_source = |entry: &DirEntry| entry.file_name() != "target" && entry.file_name() != ".git";
    let mut names = Vec::new();
    for entry in WalkDir::new(root()).sort_by_file_name().into_iter().filter_entry(is_source) {
        let entry = entry?;
        let name = entry.file_name().to_str().and_then(|name| name.strip_suffix(".rs"));
        let is_test = entry.path().parent().is_some_and(|folder| folder.ends_with("tests"));
        names.extend(name.filter(|name| is_test && name.contains("real")).map(str::to_owned));
    }
    ensure!(!names.is_empty(), "no tests are called `real`");
    Ok(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_the_tests_of_every_crate_and_no_helper_of_theirs() {
        let found = real_tests().unwrap();
        assert!(
            ["bvh_real", "register_real", "real_models"]
                .iter()
                .all(|name| found.contains(&(*name).to_owned()))
        );
        assert!(!found.contains(&"real_clips".to_owned()));
    }
}
