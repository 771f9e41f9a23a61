//! `cargo xtask capi`: the C interface, from its tests to an example in C on an emulated board.
//!
//! 1. format, lints and tests of `firmware-sim/capi`, which is outside the workspace;
//! 2. the header is what cbindgen makes of the source; made anew where it is not, which is a failure;
//! 3. the example, compiled by the host's C compiler: the host's digest, and no complaint of valgrind;
//! 4. the same file on a Cortex-M4F, in QEMU, with the blob where external flash would be: the same digest.
//!
//! What is missing is said, and the rest is done.

use std::{fs, path::PathBuf, process::Command, time::Duration};

use anyhow::{Context, Result, bail};

use crate::{
    recording::{Recorded, record},
    shell::{Outcome, cargo, command, root, run as run_command, run_within, stdout_of, target_dir},
    target, tools,
};

const CRATE: &str = "firmware-sim/capi";
const HEADER: &str = "firmware-sim/capi/include/gestus.h";
const M4F: &str = "thumbv7em-none-eabihf";
/// Frames of the example's stream.
const FRAMES: u32 = 2000;
/// Far longer than the board takes for them.
const PATIENCE: Duration = Duration::from_secs(300);
const WARNINGS: [&str; 6] = ["-std=c11", "-O2", "-Wall", "-Wextra", "-Wpedantic", "-Werror"];

/// Does all of it.
///
/// # Errors
/// Where something of it fails.
pub fn run(setup: bool) -> Result<Outcome> {
    let manifest = root().join(CRATE).join("Cargo.toml");
    let own = |subcommand: &str| {
        let mut cargo = cargo();
        cargo.arg(subcommand).arg("--manifest-path").arg(&manifest);
        cargo
    };
    let shared = |mut cargo: Command| {
        cargo.args(["--quiet", "--target-dir"]).arg(target_dir().join("capi"));
        cargo
    };
    run_command(own("fmt").arg("--check"))?;
    run_command(shared(own("clippy")).args(["--all-targets", "--", "-D", "warnings"]))?;
    run_command(&mut shared(own("test")))?;

    let mut missing = Vec::new();
    missing.extend(header(setup)?);
    let recorded = record(FRAMES)?;
    missing.extend(on_host(&recorded, setup)?);
    missing.extend(on_board(&recorded, setup)?);
    Ok(Outcome::passed_but_for(missing))
}

/// Makes the header, and compares it with the one that is there. Returns what is missing for that.
fn header(setup: bool) -> Result<Option<String>> {
    if let Some(missing) = tools::missing(&["cbindgen"], setup) {
        return Ok(Some(missing));
    }
    let made = target_dir().join("capi/gestus.h");
    let mut cbindgen = command("cbindgen");
    cbindgen.args(["--quiet", "--config"]).arg(root().join(CRATE).join("cbindgen.toml"));
    run_command(cbindgen.args(["--crate", "gestus-capi", "--output"]).arg(&made).arg(root().join(CRATE)))?;
    let (new, kept) = (fs::read(&made)?, root().join(HEADER));
    if fs::read(&kept).ok().as_deref() != Some(&new) {
        fs::write(&kept, new).with_context(|| format!("{HEADER} can't be written"))?;
        bail!(
            "{HEADER} was not what cbindgen makes of the source: it was made anew, look at it and commit it"
        );
    }
    Ok(None)
}

/// A static library for the host, or for a target.
fn library(mut cargo: Command, folder: &str) -> Result<PathBuf> {
    let folder = target_dir().join(folder);
    cargo.args(["--release", "--quiet", "--crate-type", "staticlib", "--manifest-path"]);
    cargo.arg(root().join(CRATE).join("Cargo.toml")).arg("--target-dir").arg(&folder);
    run_command(&mut cargo)?;
    Ok(folder)
}

fn sources(names: &[&str]) -> Vec<PathBuf> {
    names.iter().map(|name| root().join(CRATE).join("example").join(name)).collect()
}

/// The example on the host, and under valgrind. Returns what is missing.
fn on_host(recorded: &Recorded, setup: bool) -> Result<Option<String>> {
    if let Some(missing) = tools::missing(&["cc"], setup) {
        return Ok(Some(missing));
    }
    let mut cargo = cargo();
    cargo.arg("rustc");
    let folder = library(cargo, "capi")?;
    let example = folder.join("example");
    let mut cc = command("cc");
    cc.args(WARNINGS)
        .arg("-g")
        .args(sources(&["example.c", "host.c"]))
        .arg(folder.join("release/libgestus.a"));
    // What the standard library wants where it is no part of the C library.
    run_command(cc.args(["-lpthread", "-ldl", "-lm", "-o"]).arg(&example))?;
    run_command(command(&example.to_string_lossy()).arg(&recorded.blob).arg(&recorded.stream))?;
    if let Some(missing) = tools::missing(&["valgrind"], setup) {
        return Ok(Some(missing));
    }
    let mut valgrind = command("valgrind");
    valgrind.args(["--quiet", "--error-exitcode=9", "--leak-check=full", "--errors-for-leak-kinds=all"]);
    run_command(valgrind.arg(&example).arg(&recorded.blob).arg(&recorded.stream))?;
    Ok(None)
}

/// The example on an emulated Cortex-M4F. Returns what is missing.
fn on_board(recorded: &Recorded, setup: bool) -> Result<Option<String>> {
    if let Some(missing) = tools::missing(&["arm-none-eabi-gcc", "qemu-system-arm"], setup) {
        return Ok(Some(missing));
    }
    let source = match target::find(M4F, setup) {
        Ok(source) => source,
        Err(missing) => return Ok(Some(missing)),
    };
    let folder = library(source.cargo("rustc", M4F), "bare-metal")?;
    let (example, lengths) = (folder.join("example.elf"), folder.join("lengths"));
    let mut gcc = command("arm-none-eabi-gcc");
    gcc.args(WARNINGS).args(["-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"]);
    gcc.args(["-ffreestanding", "-nostdlib", "-Wl,--gc-sections", "-Wl,-z,noexecstack", "-T"]);
    gcc.args(sources(&["mps2.ld", "example.c", "mps2.c"])).arg(folder.join(M4F).join("release/libgestus.a"));
    run_command(gcc.arg("-o").arg(&example))?;
    if let Some(size) = stdout_of(command("arm-none-eabi-size").arg(&example)) {
        println!("{size}");
    }
    let bytes =
        |file: &PathBuf| Ok::<_, anyhow::Error>(u32::try_from(fs::metadata(file)?.len())?.to_le_bytes());
    fs::write(&lengths, [bytes(&recorded.blob)?, bytes(&recorded.stream)?].concat())?;
    let mut qemu = command("qemu-system-arm");
    qemu.args(["-M", "mps2-an386", "-display", "none", "-monitor", "none", "-serial", "none"]);
    qemu.args(["-chardev", "stdio,id=text", "-semihosting-config", "enable=on,target=native,chardev=text"]);
    qemu.arg("-kernel").arg(&example);
    let loaded = [(&recorded.blob, 0x2100_0000), (&recorded.stream, 0x2180_0000), (&lengths, 0x217f_fff0)];
    for (file, address) in loaded {
        qemu.args(["-device", &format!("loader,file={},addr={address:#x},force-raw=on", file.display())]);
    }
    let (done, output) = run_within(&mut qemu, PATIENCE)?;
    print!("{output}");
    if !done || !output.contains(", the host's") {
        bail!("the example does not give the host's digest on the board");
    }
    Ok(None)
}
