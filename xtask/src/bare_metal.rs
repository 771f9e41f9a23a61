//! `cargo xtask core`: gestus-core alone, for a Cortex-M4F, with each of its features. That it builds there shows
//! that neither it nor what it depends on wants `std` or a heap.
//!
//! The target's `core` library comes from the first of these that is there, and `--setup` tries to install them in
//! the same order:
//!
//! 1. the compiler's own copy (`rustup target add`);
//! 2. built from the sources of a rustup toolchain (`rustup component add rust-src`);
//! 3. built from the sources of Debian's compiler (packages rustc-web, cargo-web, rust-web-src).

use std::{path::Path, process::Command};

use crate::shell::{Outcome, answer, cargo, command, root, run as run_command, target_dir};

const TARGET: &str = "thumbv7em-none-eabihf";
/// Sets of features that are built.
const FEATURES: [&str; 3] = ["", "defmt", "micromath"];
const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_PACKAGES: [&str; 3] = ["rustc-web", "cargo-web", "rust-web-src"];

/// Where the target's `core` comes from.
#[derive(Clone, Copy)]
enum Source {
    Installed,
    RustupSources,
    DebianSources,
}

/// Builds the core for the target.
pub fn run(setup: bool) -> Outcome {
    let Some(source) = find().or_else(|| setup.then(install).flatten()) else {
        return Outcome::Skipped(format!(
            "no core library for {TARGET} and no sources to build it from (`cargo xtask core --setup`, or `rustup target add {TARGET}`)"
        ));
    };
    let mut failed = Vec::new();
    for features in FEATURES {
        if let Err(e) = run_command(&mut build(source, features)) {
            println!("{e:#}");
            failed.push(if features.is_empty() { "no features" } else { features });
        }
    }
    if failed.is_empty() { Outcome::Passed } else { Outcome::Failed(format!("with {}", failed.join(", "))) }
}

fn build(source: Source, features: &str) -> Command {
    let mut build = match source {
        Source::Installed | Source::RustupSources => cargo(),
        Source::DebianSources => {
            let mut build = command("/usr/bin/cargo");
            build.env("RUSTC", DEBIAN_RUSTC);
            build
        }
    };
    build.args(["build", "--package", "gestus-core", "--target", TARGET, "--no-default-features"]);
    // The profile's optimised dependencies are for tests; here they would only be waited for.
    build.args(["--config", "profile.dev.package.\"*\".opt-level=0"]);
    if !features.is_empty() {
        build.args(["--features", features]);
    }
    if !matches!(source, Source::Installed) {
        build.arg("-Zbuild-std=core").env("RUSTC_BOOTSTRAP", "1");
    }
    build.arg("--target-dir").arg(target_dir().join("bare-metal"));
    build
}

fn find() -> Option<Source> {
    let has_core = |mut rustc: Command| {
        let folder = answer(rustc.args(["--print", "target-libdir", "--target", TARGET]));
        folder.is_some_and(|f| Path::new(&f).is_dir())
    };
    let has_sources = |mut rustc: Command| {
        let sysroot = answer(rustc.args(["--print", "sysroot"]));
        sysroot.is_some_and(|s| Path::new(&s).join("lib/rustlib/src/rust/library/core").is_dir())
    };
    if has_core(rustc()) {
        Some(Source::Installed)
    } else if has_sources(rustc()) {
        Some(Source::RustupSources)
    } else if Path::new("/usr/bin/cargo").is_file() && has_sources(command(DEBIAN_RUSTC)) {
        Some(Source::DebianSources)
    } else {
        None
    }
}

fn rustc() -> Command {
    command("rustc")
}

/// Tries the ways to get the target, until one works.
fn install() -> Option<Source> {
    let mut packages = command("apt-get");
    packages.args(["install", "--yes", "--no-install-recommends"]).args(DEBIAN_PACKAGES);
    let ways: [&mut [Command]; 3] = [
        &mut [arguments("rustup", &["target", "add", TARGET])],
        &mut [arguments("rustup", &["component", "add", "rust-src"])],
        &mut [arguments("apt-get", &["update"]), packages],
    ];
    for way in ways {
        let done = way.iter_mut().all(|step| match run_command(step) {
            Ok(()) => true,
            Err(e) => {
                println!("{e:#}; going on with the next way");
                false
            }
        });
        if let (true, Some(source)) = (done, find()) {
            return Some(source);
        }
    }
    None
}

fn arguments(program: &str, arguments: &[&str]) -> Command {
    let mut command = command(program);
    command.args(arguments).current_dir(root());
    command
}
