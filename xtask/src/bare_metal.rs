//! `cargo xtask core`: gestus-core alone, for a Cortex-M4F: with all methods, these with `defmt` and with `micromath`,
//! and each method alone. That it builds there shows that neither it nor what it depends on wants `std` or a heap.

use std::{fs, process::Command};

use anyhow::{Context, Result};

use crate::{
    shell::{Outcome, root, run as run_command, target_dir},
    target::{self, Source},
};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Sets of features that are built, besides each method alone.
const FEATURES: [&str; 3] = ["methods", "methods,defmt", "methods,micromath"];

/// The methods of the core, by the names of their features: those under `methods` in its manifest.
///
/// # Errors
/// A manifest that does not list them.
pub fn methods() -> Result<Vec<String>> {
    let manifest: toml::Table = fs::read_to_string(root().join("core/Cargo.toml"))?.parse()?;
    let listed = manifest["features"]["methods"].as_array().into_iter().flatten();
    listed.map(|name| Ok(name.as_str().context("core/Cargo.toml: a method is no text")?.to_owned())).collect()
}

/// Builds the core for the target.
///
/// # Errors
/// As [`methods`].
pub fn run(setup: bool) -> Result<Outcome> {
    let source = match target::find(TARGET, setup) {
        Ok(source) => source,
        Err(missing) => return Ok(Outcome::Skipped(missing)),
    };
    let mut failed = Vec::new();
    for features in FEATURES.map(str::to_owned).into_iter().chain(methods()?) {
        if let Err(e) = run_command(&mut build(source, &features)) {
            println!("{e:#}");
            failed.push(features);
        }
    }
    Ok(match failed.is_empty() {
        true => Outcome::Passed,
        false => Outcome::Failed(format!("with {}", failed.join("; "))),
    })
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manifest_lists_the_methods() {
        assert!(methods().unwrap().iter().any(|method| method == "mar"));
    }
}
