//! Builds a board's image, and reads its size.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, Result, bail};
use gestus_core::{Method, blob::layout::ALIGNMENT};
use gestus_database::command_line::outputs::note;
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf};

use super::boards::Board;

/// Capacity of the images for a robot's hinges (`image/src/lib.rs`).
pub const HINGES: usize = 32;

/// Options of an image's build.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options<'a> {
    /// The database for boards whose image contains it.
    pub blob: Option<&'a Path>,
    /// Include log lines.
    pub defmt: bool,
    /// Include the sizes of stack frames in the ELF file, for a static bound. Sets `RUSTC_BOOTSTRAP`.
    pub stack_sizes: bool,
    /// Use micromath's sine and cosine.
    pub micromath: bool,
    /// Drive a robot, whose tables follow the database.
    pub robot: bool,
    /// A binary target other than the board's own, which needs the feature of the same name.
    pub program: Option<&'a str>,
    /// The methods that the core is built with; empty for all.
    pub methods: &'a [Method],
    /// Environment variables of the build, with the files that they name.
    pub files: &'a [(&'a str, &'a Path)],
}

impl Options<'_> {
    /// Features of the image's crate.
    fn features(&self) -> String {
        let chosen = [(self.defmt, "defmt"), (self.micromath, "micromath"), (self.robot, "robot")];
        let all = chosen.map(|(wanted, name)| wanted.then_some(name)).into_iter().chain([self.program]);
        let methods = self.methods.iter().map(|method| method.name());
        all.flatten().chain(methods).collect::<Vec<_>>().join(",")
    }

    /// Suffix that distinguishes the images of one board.
    fn suffix(&self) -> String {
        let stack = self.stack_sizes.then_some("stack");
        let features = self.features();
        let all = [stack, Some(features.as_str()).filter(|f| !f.is_empty())];
        all.into_iter().flatten().map(|part| format!("-{}", part.replace(',', "-"))).collect()
    }
}

/// Compiler flags of every image. At opt-level 3 the compiler unrolls and inlines code whether it is hot or not, which
/// takes a fifth of the flash and makes a frame less than 2% faster. Hot loops are unrolled by hand where that pays,
/// and small hot functions are marked `#[inline]`.
const SIZE_FLAGS: [&str; 3] = [
    "-Cllvm-args=-unroll-runtime=false",
    "-Cllvm-args=-unroll-threshold=60",
    "-Cllvm-args=-inline-threshold=100",
];

/// Folder of the firmware's crate.
pub fn crate_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("image")
}

/// Folder in which images are built.
pub fn target_folder() -> PathBuf {
    let own = Path::new(env!("CARGO_MANIFEST_DIR"));
    let root = own.parent().unwrap_or(own);
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |dir| root.join(dir));
    target.join("firmware")
}

/// Builds the board's image and returns its path.
///
/// # Errors
/// A missing compiler target (the message says how to install it), and errors of the compiler.
pub fn build(board: &Board, options: Options<'_>) -> Result<PathBuf> {
    let kept_in = target_folder();
    // A target folder for each set of flags, since a build with other flags would rebuild everything.
    let target = kept_in.join(format!("{}{}", board.name, if options.stack_sizes { "-stack" } else { "" }));
    let program = options.program.unwrap_or(board.binary);
    let mut cargo = cargo(board, &options)?;
    cargo.args(["--bin", program]).arg("--target-dir").arg(&target);
    let output =
        cargo.stdin(Stdio::null()).stdout(Stdio::null()).output().context("cargo can't be started")?;
    let messages = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        bail!("the image of {} can't be built:\n{}", board.name, messages.trim_end());
    }
    if !messages.trim().is_empty() {
        note(messages.trim_end());
    }
    let built = target.join(board.target).join("release").join(program);
    let kept = kept_in.join(format!("{}{}.elf", board.name, options.suffix()));
    fs::copy(&built, &kept).with_context(|| format!("{} can't be written", kept.display()))?;
    Ok(kept)
}

/// The command that builds the board's image, but for its binary and folder.
fn cargo(board: &Board, options: &Options<'_>) -> Result<Command> {
    let folder = crate_folder();
    if !folder.join("Cargo.toml").is_file() {
        bail!(
            "the firmware's sources are not in {}: run from a checkout, or give an image with --image",
            folder.display()
        );
    }
    let Some(compiler) = Compiler::find(board.target) else {
        bail!(
            "the target {} of the {} board is not installed: run `cargo xtask firmware --setup` or `rustup target add {}`",
            board.target,
            board.name,
            board.target
        );
    };
    let mut cargo = compiler.cargo();
    cargo.current_dir(&folder).args(["build", "--release", "--quiet", "--target", board.target]);
    let mut flags: Vec<String> = compiler.linker().map(String::from).into_iter().collect();
    if let Some(cpu) = board.cpu {
        flags.push(format!("-Ctarget-cpu={cpu}"));
    }
    flags.extend(SIZE_FLAGS.map(String::from));
    if options.stack_sizes {
        flags.push("-Zemit-stack-sizes".to_owned());
        cargo.env("RUSTC_BOOTSTRAP", "1");
    }
    let arithmetic = if board.has_fpu() { "" } else { ",soft-float" };
    cargo.args(["--features", &format!("{}{arithmetic}", options.features())]);
    if !options.methods.is_empty() {
        cargo.arg("--no-default-features");
    }
    if options.defmt {
        // By default defmt logs errors only.
        cargo.env("DEFMT_LOG", env::var_os("DEFMT_LOG").unwrap_or_else(|| "info".into()));
    }
    // These replace flags that are meant for the host.
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}")).env_remove("RUSTFLAGS");
    cargo.env("GESTUS_BOARD", board.reported);
    if board.blob_address.is_none() {
        let blob = options
            .blob
            .with_context(|| format!("the {} board needs a database for its image", board.name))?;
        cargo.env("GESTUS_BLOB", fs::canonicalize(blob).with_context(|| blob.display().to_string())?);
    }
    for (variable, file) in options.files {
        cargo.env(variable, fs::canonicalize(file).with_context(|| file.display().to_string())?);
    }
    for (name, _) in env::vars_os() {
        let text = name.to_string_lossy();
        if ["CARGO_PKG_", "CARGO_MANIFEST_", "CARGO_BIN_"].iter().any(|p| text.starts_with(p)) {
            cargo.env_remove(&name);
        }
    }
    Ok(cargo)
}

/// Sources of a target's `core` library, in order of preference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Compiler {
    /// Installed with the compiler.
    Installed,
    /// Built from the compiler's sources.
    Sources,
    /// Built from the sources of Debian's compiler.
    Debian,
}

const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

impl Compiler {
    fn find(target: &str) -> Option<Self> {
        let rustc = env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
        let sources = |rustc: &str| {
            printed_path(rustc, &["--print", "sysroot"])
                .is_some_and(|s| s.join("lib/rustlib/src/rust/library/core").is_dir())
        };
        if printed_path(&rustc, &["--print", "target-libdir", "--target", target]).is_some_and(|f| f.is_dir())
        {
            Some(Self::Installed)
        } else if sources(&rustc) {
            Some(Self::Sources)
        } else if Path::new("/usr/bin/cargo").is_file() && sources(DEBIAN_RUSTC) {
            Some(Self::Debian)
        } else {
            None
        }
    }

    fn cargo(self) -> Command {
        let mut cargo = match self {
            Self::Debian => Command::new("/usr/bin/cargo"),
            _ => Command::new(env::var_os("CARGO").unwrap_or_else(|| "cargo".into())),
        };
        if self == Self::Debian {
            cargo.env("RUSTC", DEBIAN_RUSTC);
        }
        if self != Self::Installed {
            cargo.arg("-Zbuild-std=core").env("RUSTC_BOOTSTRAP", "1");
        }
        cargo
    }

    /// Linker flag: Debian's compiler comes without a linker for these targets.
    fn linker(self) -> Option<&'static str> {
        (self == Self::Debian).then_some("-Clinker=ld.lld")
    }
}

fn printed_path(rustc: &str, arguments: &[&str]) -> Option<PathBuf> {
    let mut command = Command::new(rustc);
    let output = command.current_dir(crate_folder()).args(arguments).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()))
}

/// Writes a file as a board has it in flash: a database and, from the next 16-byte boundary on, a robot's tables or a
/// recording. Returns its path.
///
/// # Errors
/// A file that can't be written.
pub fn write_flash(database: &[u8], appended: &[u8], name: &str) -> Result<PathBuf> {
    let mut bytes = database.to_vec();
    bytes.resize(bytes.len().next_multiple_of(ALIGNMENT), 0);
    bytes.extend(appended);
    let path = target_folder().join(name);
    fs::create_dir_all(target_folder())?;
    fs::write(&path, bytes).with_context(|| format!("{} can't be written", path.display()))?;
    Ok(path)
}

/// Bytes of flash of an image: code, constants, and initial values of variables.
///
/// # Errors
/// A file that can't be read, or is not an ELF file.
pub fn flash_bytes(image: &Path) -> Result<u64> {
    let bytes = fs::read(image).with_context(|| format!("{} can't be read", image.display()))?;
    let file = object::File::parse(&*bytes)
        .with_context(|| format!("{} is no image: give an ELF file for the board", image.display()))?;
    let loaded = |flags: SectionFlags| matches!(flags, SectionFlags::Elf { sh_flags } if sh_flags & u64::from(elf::SHF_ALLOC) != 0);
    Ok(file
        .sections()
        .filter(|s| s.kind() != SectionKind::UninitializedData && loaded(s.flags()))
        .map(|s| s.size())
        .sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_no_image_is_refused_by_its_name() {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("Cargo.toml");
        let error = flash_bytes(&path).expect_err("it is a text").to_string();
        assert!(error.contains("Cargo.toml is no image"), "{error}");
    }

    /// Paths of images are printed, for a debugger.
    #[test]
    fn images_are_in_a_plain_path() {
        assert!(!target_folder().components().any(|part| part.as_os_str() == ".."), "{:?}", target_folder());
    }
}
