//! The programs that chores need, and where they come from.

use std::process::Command;

use crate::shell::{cargo, command, run as run_command, stdout_of};

/// Where a program comes from.
enum Source {
    /// Packages of Debian.
    Packages(&'static [&'static str]),
    /// A crate that `cargo install` builds.
    Crate,
}
use Source::{Crate, Packages};

/// Programs by name. The names of a browser are alternatives: see [`BROWSERS`].
const TOOLS: [(&str, Source); 11] = [
    ("cc", Packages(&["gcc", "libc6-dev"])),
    ("valgrind", Packages(&["valgrind"])),
    ("arm-none-eabi-gcc", Packages(&["gcc-arm-none-eabi"])),
    ("qemu-system-arm", Packages(&["qemu-system-arm"])),
    ("qemu-system-riscv32", Packages(&["qemu-system-misc"])),
    ("node", Packages(&["nodejs"])),
    ("chromium", Packages(&["chromium", "fonts-dejavu-core"])),
    ("python3", Packages(&["python3", "python3-venv"])),
    ("cbindgen", Crate),
    ("defmt-print", Crate),
    ("cargo-fuzz", Crate),
];
/// Programs that do for `chromium`.
const BROWSERS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "google-chrome-stable"];

/// The browser of this machine.
pub fn browser() -> Option<&'static str> {
    BROWSERS.into_iter().find(|b| can_start(b))
}

/// True where the program is installed.
pub fn has(program: &str) -> bool {
    match program {
        "chromium" => browser().is_some(),
        // Debian's own has no virtual environments.
        "python3" => stdout_of(command("python3").args(["-c", "import ensurepip, venv"])).is_some(),
        // Without a subcommand's arguments it takes `--version` for an error.
        "cargo-fuzz" => stdout_of(cargo().args(["fuzz", "--version"])).is_some(),
        program => can_start(program),
    }
}

fn can_start(program: &str) -> bool {
    stdout_of(command(program).arg("--version")).is_some()
}

/// Which of the programs are missing, and how to get them; `None` where all are there. With `setup`, installs them
/// first.
pub fn missing(programs: &[&str], setup: bool) -> Option<String> {
    if setup {
        install(programs);
    }
    let missing: Vec<&str> = programs.iter().copied().filter(|p| !has(p)).collect();
    (!missing.is_empty()).then(|| format!("no {} (`--setup` installs what is missing)", missing.join(", ")))
}

/// Installs every program that any chore needs.
pub fn install_all() {
    install(&TOOLS.map(|(program, _)| program));
}

/// Installs those of the programs that are missing: one call of each installer, whatever their number.
fn install(programs: &[&str]) {
    let (mut packages, mut crates) = (Vec::new(), Vec::new());
    for (program, source) in TOOLS.iter().filter(|(p, _)| programs.contains(p) && !has(p)) {
        match source {
            Packages(names) => packages.extend_from_slice(names),
            Crate => crates.push(*program),
        }
    }
    if !packages.is_empty() {
        install_packages(&packages);
    }
    if !crates.is_empty() {
        // Unoptimised, since building them takes longer than they ever run; apart from the workspace's products.
        let mut install = cargo();
        install.args(["install", "--locked", "--debug"]).args(crates).env_remove("CARGO_TARGET_DIR");
        try_all(&mut [install]);
    }
}

/// Installs packages of the system. True where that worked.
pub fn install_packages(names: &[&str]) -> bool {
    let mut update = command("apt-get");
    update.args(["update", "--quiet"]);
    let mut install = command("apt-get");
    install.args(["install", "--yes", "--quiet", "--no-install-recommends"]).args(names);
    try_all(&mut [update, install])
}

/// Runs the commands until one fails, which is said. True where all succeeded.
pub fn try_all(steps: &mut [Command]) -> bool {
    steps.iter_mut().all(|step| match run_command(step) {
        Ok(()) => true,
        Err(e) => {
            println!("{e:#}; going on without");
            false
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_missing_is_named() {
        assert_eq!(missing(&["cargo"], false), None);
        let missing = missing(&["cargo", "gestus-no-such-program"], false).unwrap();
        assert!(missing.starts_with("no gestus-no-such-program ("), "{missing}");
    }
}
