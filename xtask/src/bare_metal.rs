//! `cargo xtask core`: gestus-core alone, for a Cortex-M4F: built with all methods; checked with these and `defmt` or
//! `micromath`, and with each method alone. That it compiles there shows that neither it nor what it depends on wants
//! `std` or a heap.

use std::{fs, process::Command};

use anyhow::{Context, Result};

use crate::{
    shell::{Outcome, root, run as run_command, target_dir},
    target::{self, Source},
};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Features with which the core is built.
const BUILT: &str = "methods";
/// Sets of features with which it is checked, besides each method alone. Their machine code is left to `cargo xtask
/// no-panic` and `budget`, which link it.
const CHECKED: [&str; 2] = ["methods,defmt", "methods,micromath"];

/// The methods of the core, by the names of their features: those under `methods` in its manifest.
///
/// # Errors
/// A manifest that does not list them.
pub fn methods() -> Result<Vec<String>> {
    let manifest: toml::Table = fs::read_to_string(root().join("core/Cargo.toml"))?.parse()?;
    let listed = manifest["features"]["methods"].as_array().into_iter().flatten();
    listed.map(|name| Ok(name.as_str().context("core/Cargo.toml: a method is no text")?.to_owned())).collect()
}

/// Compiles the core for the target.
///
/// # Errors
/// As [`methods`].
pub fn run(setup: bool) -> Result<Outcome> {
    let source = match target::find(TARGET, setup) {
        Ok(source) => source,
        Err(missing) => return Ok(Outcome::Skipped(missing)),
    };
    let mut failed = Vec::new();
    let checked = CHECKED.map(str::to_owned).into_iter().chain(methods()?);
    for (subcommand, features) in
        [("build", BUILT.to_owned())].into_iter().chain(checked.map(|f| ("check", f)))
    {
        if let Err(e) = run_command(&mut compile(source, subcommand, &features)) {
            println!("{e:#}");
            failed.push(features);
        }
    }
    Ok(match failed.is_empty() {
        true => Outcome::Passed,
        false => Outcome::Failed(format!("with {}", failed.join("; "))),
    })
}

fn compile(source: Source, subcommand: &str, features: &str) -> Command {
    let mut compile = source.cargo(subcommand, TARGET);
    compile.args(["--package", "gestus-core", "--no-default-features"]);
    // The profile's optimised dependencies are for tests; here they would only be waited for.
    compile.args(["--config", "profile.dev.package.libm.opt-level=0"]);
    compile.args(["--features", features]);
    compile.arg("--target-dir").arg(target_dir().join("bare-metal"));
    compile
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_manifest_lists_the_methods() {
        assert!(methods().unwrap().iter().any(|method| method == "mar"));
    }
}
