//! `cargo xtask core`: gestus-core alone, for a Cortex-M4F, with each of its features, and with each method alone. That
//! it builds there shows that neither it nor what it depends on wants `std` or a heap.

use std::process::Command;

use crate::{
    shell::{Outcome, run as run_command, target_dir},
    target::{self, Source},
};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Sets of features that are built.
const FEATURES: [&str; 7] =
    ["methods", "methods,defmt", "methods,micromath", "mar", "lti", "statistic", "phase"];

/// Builds the core for the target.
pub fn run(setup: bool) -> Outcome {
    let source = match target::find(TARGET, setup) {
        Ok(source) => source,
        Err(missing) => return Outcome::Skipped(missing),
    };
    let mut failed = Vec::new();
    for features in FEATURES {
        if let Err(e) = run_command(&mut build(source, features)) {
            println!("{e:#}");
            failed.push(features);
        }
    }
    if failed.is_empty() { Outcome::Passed } else { Outcome::Failed(format!("with {}", failed.join("; "))) }
}

fn build(source: Source, features: &str) -> Command {
    let mut build = source.cargo("build", TARGET);
    build.args(["--package", "gestus-core", "--no-default-features"]);
    // The profile's optimised dependencies are for tests; here they would only be waited for.
    build.args(["--config", "profile.dev.package.\"*\".opt-level=0"]);
    build.args(["--features", features]);
    build.arg("--target-dir").arg(target_dir().join("bare-metal"));
    build
}
