//! Other targets: how to get a target's `core` library, and a cargo that builds for it.
//!
//! The library comes from the first of these that is there, and [`install`] tries to get them in the same order:
//!
//! 1. the compiler's own copy (`rustup target add`);
//! 2. built from the sources of a rustup toolchain (`rustup component add rust-src`);
//! 3. built from the sources of Debian's compiler (packages rustc-web, cargo-web, rust-web-src, lld).

use std::{path::Path, process::Command};

use crate::shell::{answer, cargo, command, run as run_command};

const DEBIAN_RUSTC: &str = "/usr/bin/rustc";
const DEBIAN_PACKAGES: [&str; 4] = ["rustc-web", "cargo-web", "rust-web-src", "lld"];

/// Where a target's `core` comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The compiler has it.
    Installed,
    /// Sources beside a rustup toolchain.
    RustupSources,
    /// Sources of Debian's compiler.
    DebianSources,
}

impl Source {
    /// A cargo that builds for the target, with the given subcommand.
    pub fn cargo(self, subcommand: &str, target: &str) -> Command {
        let mut build = match self {
            Self::Installed | Self::RustupSources => cargo(),
            Self::DebianSources => {
                let mut build = command("/usr/bin/cargo");
                build.env("RUSTC", DEBIAN_RUSTC);
                build
            }
        };
        build.args([subcommand, "--target", target]);
        if self != Self::Installed {
            build.arg("-Zbuild-std=core").env("RUSTC_BOOTSTRAP", "1");
        }
        build
    }

    /// Flags that the compiler needs to find a linker: Debian's has none of its own.
    pub fn linker(self, target: &str) -> &'static str {
        match self {
            Self::DebianSources if target.starts_with("wasm") => "-Clinker=wasm-ld",
            Self::DebianSources => "-Clinker=ld.lld",
            _ => "",
        }
    }
}

/// Where the target's `core` comes from, if from anywhere; installs it where that is wanted.
///
/// # Errors
/// What is missing, and how to get it.
pub fn find(target: &str, setup: bool) -> Result<Source, String> {
    present(target).or_else(|| setup.then(|| install(target)).flatten()).ok_or_else(|| {
        format!("no core library for {target} and no sources to build it from (`--setup`, or `rustup target add {target}`)")
    })
}

fn present(target: &str) -> Option<Source> {
    let has_core = |mut rustc: Command| {
        let folder = answer(rustc.args(["--print", "target-libdir", "--target", target]));
        folder.is_some_and(|f| Path::new(&f).is_dir())
    };
    let has_sources = |mut rustc: Command| {
        let sysroot = answer(rustc.args(["--print", "sysroot"]));
        sysroot.is_some_and(|s| Path::new(&s).join("lib/rustlib/src/rust/library/core").is_dir())
    };
    if has_core(command("rustc")) {
        Some(Source::Installed)
    } else if has_sources(command("rustc")) {
        Some(Source::RustupSources)
    } else if Path::new("/usr/bin/cargo").is_file() && has_sources(command(DEBIAN_RUSTC)) {
        Some(Source::DebianSources)
    } else {
        None
    }
}

/// Tries the ways to get the target, until one works.
fn install(target: &str) -> Option<Source> {
    let arguments = |program: &str, arguments: &[&str]| {
        let mut command = command(program);
        command.args(arguments);
        command
    };
    let mut ways = [
        vec![arguments("rustup", &["target", "add", target])],
        vec![arguments("rustup", &["component", "add", "rust-src"])],
        packages(&DEBIAN_PACKAGES),
    ];
    ways.iter_mut().find_map(|way| if try_all(way) { present(target) } else { None })
}

/// Installs packages of the system, where that works.
pub fn install_packages(names: &[&str]) -> bool {
    try_all(&mut packages(names))
}

fn packages(names: &[&str]) -> Vec<Command> {
    let mut update = command("apt-get");
    update.arg("update");
    let mut install = command("apt-get");
    install.args(["install", "--yes", "--no-install-recommends"]).args(names);
    vec![update, install]
}

fn try_all(steps: &mut [Command]) -> bool {
    steps.iter_mut().all(|step| match run_command(step) {
        Ok(()) => true,
        Err(e) => {
            println!("{e:#}; going on without");
            false
        }
    })
}

/// True where the program can be started.
pub fn has_program(program: &str) -> bool {
    answer(command(program).arg("--version")).is_some()
}
