//! Crates of this repository that are built as wasm modules, for pages.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, Result, bail};

use super::outputs::note;

const TARGET: &str = "wasm32-unknown-unknown";

/// A crate that is built as a module.
pub struct WasmCrate {
    /// Its folder, in the repository in which this command was built.
    pub folder: &'static str,
    /// The module's name.
    pub file: &'static str,
    /// A function that it exports, and other modules do not.
    pub export: &'static str,
}

impl WasmCrate {
    /// The module: the given file, otherwise built now; an earlier build where what builds it is missing.
    ///
    /// # Errors
    /// A message that says what is missing, and how to get it.
    pub fn bytes(&self, named: Option<&Path>) -> Result<Vec<u8>> {
        let read = |path: &Path| {
            let bytes = fs::read(path).with_context(|| format!("{} can't be read", path.display()))?;
            let has = |word: &[u8]| bytes.windows(word.len()).any(|part| part == word);
            if !bytes.starts_with(b"\0asm") || !has(self.export.as_bytes()) {
                bail!(
                    "{}: this is not the module {}: `cargo xtask wasm` builds it",
                    path.display(),
                    self.file
                );
            }
            Ok(bytes)
        };
        if let Some(path) = named {
            return read(path);
        }
        let target =
            env::var_os("CARGO_TARGET_DIR").map_or_else(|| self.target(), PathBuf::from).join("wasm");
        let path = target.join(TARGET).join("release").join(self.file);
        if !path.is_file() {
            note("building the wasm module, which takes a few minutes, once");
        }
        if let Some(why) = self.missing() {
            if !path.is_file() {
                bail!(
                    "the wasm module can't be built ({why}): run `rustup target add {TARGET}` (or, without rustup, `cargo \
                     xtask wasm --setup`), or give a module with --wasm FILE"
                );
            }
            note(format_args!(
                "note: using the earlier build {}, because it can't be rebuilt ({why})",
                path.display()
            ));
        } else {
            self.build(&target)?;
        }
        read(&path)
    }

    /// Where build products go: the nearest `target` above the crate, or its own.
    fn target(&self) -> PathBuf {
        let own = Path::new(self.folder).join("target");
        let mut above = Path::new(self.folder).ancestors().skip(1).map(|folder| folder.join("target"));
        above.find(|target| target.is_dir()).unwrap_or(own)
    }

    fn manifest(&self) -> PathBuf {
        Path::new(self.folder).join("Cargo.toml")
    }

    /// What is missing to build the module, if anything is.
    fn missing(&self) -> Option<String> {
        if !self.manifest().is_file() {
            return Some(format!("{} does not exist", self.manifest().display()));
        }
        let libdir = Command::new("rustc").args(["--print", "target-libdir", "--target", TARGET]).output();
        let libdir = libdir
            .ok()
            .filter(|o| o.status.success())
            .map(|o| String::from_utf8_lossy(&o.stdout).into_owned());
        let is_installed = libdir.is_some_and(|folder| Path::new(folder.trim()).is_dir());
        (!is_installed).then(|| format!("the target {TARGET} is not installed"))
    }

    /// Builds the module, if its sources have changed.
    ///
    /// An earlier build does not stand in for sources that do not compile: a page would then run another core than the
    /// command that makes it.
    fn build(&self, target: &Path) -> Result<()> {
        let mut cargo = Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
        cargo
            .args(["build", "--release", "--quiet", "--target", TARGET, "--manifest-path"])
            .arg(self.manifest());
        // The same flags as in `cargo xtask wasm`, so that both share one build.
        cargo.arg("--target-dir").arg(target).env("RUSTFLAGS", "").stdout(Stdio::null());
        let status = cargo.status().context("the wasm module can't be built: cargo can't be started")?;
        if !status.success() {
            bail!(
                "the wasm module can't be built (cargo: {status}, as above): repair {}, or give a module with --wasm FILE",
                self.folder
            );
        }
        Ok(())
    }
}
