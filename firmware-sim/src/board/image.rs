//! Building a board's image, and reading sizes off it.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
};

use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf};

use super::boards::Board;

/// How an image is built.
#[derive(Debug, Clone, Copy, Default)]
pub struct Options<'a> {
    /// The database that is compiled into images that hold theirs.
    pub blob: Option<&'a Path>,
    /// With log lines.
    pub defmt: bool,
    /// With the sizes of stack frames in the ELF, for a static bound. Needs `RUSTC_BOOTSTRAP`.
    pub stack_sizes: bool,
    /// With micromath's sine and cosine.
    pub micromath: bool,
    /// With a robot, whose tables lie behind the database.
    pub robot: bool,
    /// Another program than the board's own, which is behind a feature of its name.
    pub program: Option<&'a str>,
    /// Files that the program is built with: the variables that name them.
    pub files: &'a [(&'a str, &'a Path)],
}

impl Options<'_> {
    /// Features of the image's crate.
    fn features(&self) -> String {
        let chosen = [(self.defmt, "defmt"), (self.micromath, "micromath"), (self.robot, "robot")];
        let all = chosen.map(|(wanted, name)| wanted.then_some(name)).into_iter().chain([self.program]);
        all.flatten().collect::<Vec<_>>().join(",")
    }

    /// What tells images of one board apart.
    fn suffix(&self) -> String {
        let stack = self.stack_sizes.then_some("stack");
        let features = self.features();
        let all = [stack, Some(features.as_str()).filter(|f| !f.is_empty())];
        all.into_iter().flatten().map(|part| format!("-{}", part.replace(',', "-"))).collect()
    }
}

/// Told to the compiler of every image: at opt-level 3 it lays loops out by several rounds and puts functions into
/// others, hot or not, which takes a fifth of the flash and makes a frame faster by less than 2%. Hot loops are written
/// out where that pays, and what is hot and small is marked.
const SMALL: [&str; 3] = [
    "-Cllvm-args=-unroll-runtime=false",
    "-Cllvm-args=-unroll-threshold=150",
    "-Cllvm-args=-inline-threshold=100",
];

/// Folder of the firmware's crate.
pub fn crate_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("image")
}

/// Folder that images are built in.
pub fn target_folder() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), |dir| root.join(dir));
    target.join("firmware")
}

/// Builds the board's image and gives its path.
///
/// # Errors
/// A missing compiler target, with how to install it, and whatever the compiler has to say.
pub fn build(board: &Board, options: Options<'_>) -> Result<PathBuf> {
    let folder = crate_folder();
    if !folder.join("Cargo.toml").is_file() {
        bail!(
            "the firmware's sources are not at {}: run from a checkout, or give an image with --image",
            folder.display()
        );
    }
    let Some(compiler) = Compiler::find(board.target) else {
        bail!(
            "this Rust can't build for {} (the {} board): `cargo xtask firmware --setup` installs the target, or `rustup target add {}`",
            board.target,
            board.name,
            board.target
        );
    };
    let kept_in = target_folder();
    // Flags are a board's own, and what is built with others would be built anew.
    let target = kept_in.join(format!("{}{}", board.name, if options.stack_sizes { "-stack" } else { "" }));
    let mut cargo = compiler.cargo();
    let program = options.program.unwrap_or(board.binary);
    cargo.current_dir(&folder).args(["build", "--release", "--quiet", "--bin", program]);
    cargo.args(["--target", board.target]).arg("--target-dir").arg(&target);
    let mut flags: Vec<String> = compiler.linker().map(String::from).into_iter().collect();
    if let Some(cpu) = board.cpu {
        flags.push(format!("-Ctarget-cpu={cpu}"));
    }
    flags.extend(SMALL.map(String::from));
    if options.stack_sizes {
        flags.push("-Zemit-stack-sizes".to_owned());
        cargo.env("RUSTC_BOOTSTRAP", "1");
    }
    cargo.args(["--features", &options.features()]);
    if options.defmt {
        // Without it defmt keeps to errors.
        cargo.env("DEFMT_LOG", env::var_os("DEFMT_LOG").unwrap_or_else(|| "info".into()));
    }
    // In place of flags that are meant for the host.
    cargo.env("CARGO_ENCODED_RUSTFLAGS", flags.join("\u{1f}")).env_remove("RUSTFLAGS");
    cargo.env("GESTUS_BOARD", board.reported);
    if board.blob_address.is_none() {
        let blob =
            options.blob.with_context(|| format!("the {} board needs a database to hold", board.name))?;
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
    let output =
        cargo.stdin(Stdio::null()).stdout(Stdio::null()).output().context("cargo can't be started")?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        bail!("the image of {} can't be built:\n{}", board.name, said.trim_end());
    }
    if !said.trim().is_empty() {
        eprintln!("{}", said.trim_end());
    }
    let built = target.join(board.target).join("release").join(program);
    let kept = kept_in.join(format!("{}{}.elf", board.name, options.suffix()));
    fs::copy(&built, &kept).with_context(|| format!("{} can't be written", kept.display()))?;
    Ok(kept)
}

/// Where a target's `core` comes from, in order of preference.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Compiler {
    /// The compiler has it.
    Installed,
    /// Sources beside the compiler.
    Sources,
    /// Sources of Debian's compiler.
    Debian,
}

const DEBIAN_RUSTC: &str = "/usr/bin/rustc";

impl Compiler {
    fn find(target: &str) -> Option<Self> {
        let rustc = env::var("RUSTC").unwrap_or_else(|_| "rustc".into());
        let sources = |rustc: &str| {
            answer(rustc, &["--print", "sysroot"])
                .is_some_and(|s| s.join("lib/rustlib/src/rust/library/core").is_dir())
        };
        if answer(&rustc, &["--print", "target-libdir", "--target", target]).is_some_and(|f| f.is_dir()) {
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

    /// Flags that the compiler needs to find a linker: Debian's has none of its own.
    fn linker(self) -> Option<&'static str> {
        (self == Self::Debian).then_some("-Clinker=ld.lld")
    }
}

fn answer(rustc: &str, arguments: &[&str]) -> Option<PathBuf> {
    let mut command = Command::new(rustc);
    let output = command.current_dir(crate_folder()).args(arguments).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| PathBuf::from(String::from_utf8_lossy(&output.stdout).trim()))
}

/// A file with a robot's tables, or a recording, behind a database, on the next 16-byte boundary: as a board has them in
/// its flash.
///
/// # Errors
/// A file that can't be written.
pub fn with_behind(database: &[u8], behind: &[u8], name: &str) -> Result<PathBuf> {
    let mut bytes = database.to_vec();
    bytes.resize(bytes.len().next_multiple_of(16), 0);
    bytes.extend(behind);
    let path = target_folder().join(name);
    fs::create_dir_all(target_folder())?;
    fs::write(&path, bytes).with_context(|| format!("{} can't be written", path.display()))?;
    Ok(path)
}

/// Bytes of flash that an image takes: code, constants, the first values of variables.
///
/// # Errors
/// A file that can't be read, or is no ELF.
pub fn flash_bytes(image: &Path) -> Result<u64> {
    let bytes = fs::read(image).with_context(|| format!("{} can't be read", image.display()))?;
    let file = object::File::parse(&*bytes).with_context(|| image.display().to_string())?;
    let loaded = |flags: SectionFlags| matches!(flags, SectionFlags::Elf { sh_flags } if sh_flags & u64::from(elf::SHF_ALLOC) != 0);
    Ok(file
        .sections()
        .filter(|s| s.kind() != SectionKind::UninitializedData && loaded(s.flags()))
        .map(|s| s.size())
        .sum())
}
