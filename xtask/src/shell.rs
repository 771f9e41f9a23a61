//! Other programs: started in the repository's root, shown before they run, judged by their exit code.
//!
//! The standard library's `Command` rather than `xshell`: fuzz targets run on several threads, comparisons in several
//! folders, and programs that hang are ended, none of which a shared `xshell::Shell` does.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    sync::{Mutex, PoisonError},
    time::Duration,
};

use anyhow::{Context, Result, bail};
use wait_timeout::ChildExt;

/// How a chore ended.
#[derive(Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It did what it says.
    Passed,
    /// Something is missing on this machine; what, and how to get it.
    Skipped(String),
    /// Some of it failed; what.
    Failed(String),
}

impl Outcome {
    /// Passed, unless something was missing for a part of it.
    pub fn passed_but_for(missing: impl IntoIterator<Item = String>) -> Self {
        let missing: Vec<String> = missing.into_iter().collect();
        if missing.is_empty() {
            Self::Passed
        } else {
            Self::Skipped(format!("in part: {}", missing.join(", ")))
        }
    }

    /// The outcome where everything has to be done: to skip is to fail.
    pub fn strict(self, strict: bool) -> Self {
        match self {
            Self::Skipped(why) if strict => Self::Failed(format!("skipped, although CI=true: {why}")),
            outcome => outcome,
        }
    }
}

/// True in continuous integration (`CI=true`), where nothing may be skipped.
pub fn in_ci() -> bool {
    env::var("CI").is_ok_and(|value| value == "true")
}

/// The repository's root.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new("."))
}

/// Where build products go: `CARGO_TARGET_DIR`, or `target` in the root.
pub fn target_dir() -> PathBuf {
    env::var_os("CARGO_TARGET_DIR").map_or_else(|| root().join("target"), |dir| root().join(dir))
}

/// A program, to be run in the root, without the variables that `cargo run` set for this one.
pub fn command(program: &str) -> Command {
    let mut command = Command::new(program);
    command.current_dir(root());
    for (name, _) in env::vars_os() {
        let name_text = name.to_string_lossy();
        if name_text.starts_with("CARGO_PKG_") || name_text.starts_with("CARGO_MANIFEST_") {
            command.env_remove(&name);
        }
    }
    command
}

/// The cargo that runs this program.
pub fn cargo() -> Command {
    command(&env::var("CARGO").unwrap_or_else(|_| "cargo".into()))
}

/// A program of the workspace, or an example (`examples/NAME`). It is built with the features of the whole workspace, as
/// `cargo test --workspace` builds it, so that nothing is compiled a second time.
///
/// # Errors
/// Where the workspace does not build.
pub fn built(program: &str) -> Result<Command> {
    // Once: even where nothing has changed, cargo takes a second to find that out.
    static BUILT: Mutex<bool> = Mutex::new(false);
    let mut is_built = BUILT.lock().unwrap_or_else(PoisonError::into_inner);
    if !*is_built {
        let mut build = cargo();
        build.args([
            "build",
            "--quiet",
            "--workspace",
            "--bin",
            "gestus",
            "--bin",
            "gestus-sim",
            "--examples",
        ]);
        let status = build.status().with_context(|| format!("`{}` can't be started", show(&build)))?;
        if !status.success() {
            bail!("`{}` failed ({status})", show(&build));
        }
        *is_built = true;
    }
    let path = target_dir().join("debug").join(program).with_extension(env::consts::EXE_EXTENSION);
    Ok(command(&path.to_string_lossy()))
}

/// The program `gestus-sim`.
///
/// # Errors
/// Where the workspace does not build.
pub fn sim() -> Result<Command> {
    built("gestus-sim")
}

/// The cargo of the nightly toolchain.
pub fn nightly_cargo() -> Command {
    let mut command = command("rustup");
    command.args(["run", "nightly", "cargo"]).env_remove("CARGO");
    command
}

/// Shows a command, runs it, and fails where it fails.
///
/// # Errors
/// Where the program can't be started or exits with something else than 0.
pub fn run(command: &mut Command) -> Result<()> {
    let shown = show(command);
    println!("$ {shown}");
    let status = command.status().with_context(|| format!("`{shown}` can't be started"))?;
    if !status.success() {
        bail!("`{shown}` failed ({status})");
    }
    Ok(())
}

/// Shows a command and runs it. Returns whether it succeeded, and all that it wrote, which is not shown.
///
/// # Errors
/// Where the program can't be started.
pub fn run_captured(command: &mut Command) -> Result<(bool, String)> {
    let shown = show(command);
    println!("$ {shown}");
    let output = command.stdin(Stdio::null()).output();
    let output = output.with_context(|| format!("`{shown}` can't be started"))?;
    let text = [&output.stdout, &output.stderr].map(|t| String::from_utf8_lossy(t).into_owned()).concat();
    Ok((output.status.success(), text))
}

/// Shows a command and runs it, for at most so long. Returns whether it succeeded in time, and its standard output,
/// which is not shown; standard error is dropped. For programs that can hang, and for browsers, which write a lot.
///
/// # Errors
/// Where the program can't be started.
pub fn run_within(command: &mut Command, patience: Duration) -> Result<(bool, String)> {
    let shown = show(command);
    println!("$ {shown}");
    // A file, since a pipe that nobody reads would stop the program.
    let path = env::temp_dir().join(format!("gestus-xtask-{}", std::process::id()));
    let output = fs::File::create(&path).with_context(|| format!("{} can't be written", path.display()))?;
    command.stdin(Stdio::null()).stdout(output).stderr(Stdio::null());
    let mut child = command.spawn().with_context(|| format!("`{shown}` can't be started"))?;
    let status = child.wait_timeout(patience)?;
    if status.is_none() {
        child.kill()?;
        child.wait()?;
    }
    let text = fs::read(&path).map(|t| String::from_utf8_lossy(&t).into_owned()).unwrap_or_default();
    fs::remove_file(&path).ok();
    Ok((status.is_some_and(|s| s.success()), text))
}

/// Standard output of a command that succeeds; `None` where it fails or can't be started.
pub fn stdout_of(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Standard output of a command that writes one JSON object to it. Its messages go to standard error.
///
/// # Errors
/// Where it fails, or writes something else.
pub fn json(command: &mut Command) -> Result<serde_json::Value> {
    let text = run_for_stdout(command.stdin(Stdio::null()))?;
    serde_json::from_str(text.trim()).with_context(|| format!("`{}` does not write JSON", show(command)))
}

/// Shows a command, runs it, and gives its standard output.
///
/// # Errors
/// Where the program can't be started or exits with something else than 0.
pub fn run_for_stdout(command: &mut Command) -> Result<String> {
    let shown = show(command);
    println!("$ {shown}");
    let output = command.stderr(Stdio::inherit()).output();
    let output = output.with_context(|| format!("`{shown}` can't be started"))?;
    if !output.status.success() {
        bail!("`{shown}` failed ({})", output.status);
    }
    Ok(String::from_utf8_lossy(&output.stdout).into_owned())
}

/// A command as a person would type it, with the variables that were set for it.
pub fn show(command: &Command) -> String {
    let set = command
        .get_envs()
        .filter_map(|(k, v)| Some(format!("{}={}", k.to_string_lossy(), quote(&v?.to_string_lossy()))));
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = [program].into_iter().chain(command.get_args()).map(|w| quote(&w.to_string_lossy()));
    set.chain(words).collect::<Vec<_>>().join(" ")
}

fn quote(word: &str) -> String {
    if word.contains([' ', '*', '"']) { format!("'{word}'") } else { word.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_shown_as_it_would_be_typed() {
        let mut command = Command::new("/somewhere/bin/cargo");
        command.args(["test", "-p", "two words"]).env("RUSTDOCFLAGS", "-D warnings").env_remove("CARGO");
        assert_eq!(show(&command), "RUSTDOCFLAGS='-D warnings' cargo test -p 'two words'");
    }

    #[test]
    fn a_program_that_is_not_there_has_no_output() {
        assert_eq!(stdout_of(&mut command("gestus-no-such-program")), None);
    }

    #[test]
    fn a_program_that_hangs_is_ended() {
        let (done, _) = run_within(command("sleep").arg("60"), Duration::from_millis(100)).unwrap();
        assert!(!done);
        let (done, said) = run_within(command("echo").arg("well"), Duration::from_secs(60)).unwrap();
        assert!(done && said == "well\n");
    }

    #[test]
    fn the_root_holds_the_workspace() {
        assert!(root().join("Cargo.toml").is_file() && root().join("core").is_dir());
    }
}
