//! Other targets: how to get a target's `core` library, and a cargo that builds for it.
//!
//! The library comes from the first of these that is there, and [`install`] tries to get them in the same order:
//!
//! 1. the compiler's own copy (`rustup target add`);
//! 2. built from the sources of a rustup toolchain (`rustup component add rust-src`);
//! 3. built from the sources of Debian's compiler (packages rustc-web, cargo-web, rust-web-src, lld).

use std::{path::Path, process::Command};

use crate::{
    shell::{cargo, command, stdout_of},
    tools::{install_packages, try_all},
};

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
        let folder = stdout_of(rustc.args(["--print", "target-libdir", "--target", target]));
        folder.is_some_and(|f| Path::new(&f).is_dir())
    };
    let has_sources = |mut rustc: Command| {
        let sysroot = stdout_of(rustc.args(["--print", "sysroot"]));
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
    let rustup = |arguments: &[&str]| {
        let mut rustup = command("rustup");
        rustup.args(arguments);
        try_all(&mut [rustup])
    };
    let ways: [&dyn Fn() -> bool; 3] =
        [&|| rustup(&["target", "add", target]), &|| rustup(&["component", "add", "rust-src"]), &|| {
            install_packages(&DEBIAN_PACKAGES)
        }];
    ways.iter().find_map(|way| if way() { present(target) } else { None })
}
