//! Puts the board's memory map where the runtime's linker script looks for it, and names that script.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let target = env::var("TARGET")?;
    println!("cargo:rerun-if-env-changed=GESTUS_BOARD");
    let wanted = env::var("GESTUS_BOARD").unwrap_or_default();
    let (map, board) = match target.as_str() {
        "thumbv7em-none-eabihf" if wanted == "mps2-an500" => ("an500.x", "mps2-an500"),
        "thumbv7em-none-eabihf" => ("an386.x", "mps2-an386"),
        "thumbv8m.main-none-eabihf" => ("an505.x", "mps2-an505"),
        "thumbv6m-none-eabi" if wanted == "mps2-an386-armv6m" => ("an386.x", "mps2-an386-armv6m"),
        "thumbv6m-none-eabi" => ("microbit.x", "microbit"),
        t if t.starts_with("riscv32") => ("virt.x", "virt"),
        other => return Err(format!("no board has the target {other}: see the README").into()),
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(PathBuf::from("memory").join(map), out.join("memory.x"))?;
    // The runtime asks for names of the device's interrupts: `src/vectors.rs` names none.
    fs::write(out.join("device.x"), "")?;
    println!("cargo:rerun-if-changed=memory/{map}");
    if map == "microbit.x" {
        println!("cargo:rerun-if-env-changed=GESTUS_BLOB");
        let Ok(blob) = env::var("GESTUS_BLOB") else {
            return Err("name the database that the image is to hold in GESTUS_BLOB: see the README".into());
        };
        println!("cargo:rerun-if-changed={blob}");
        println!("cargo:rustc-env=GESTUS_BLOB={blob}");
    }
    println!("cargo:rustc-link-search={}", out.display());
    if target.starts_with("riscv32") {
        // riscv-rt's script does not ask for it.
        println!("cargo:rustc-link-arg-bins=-Tmemory.x");
    }
    println!("cargo:rustc-link-arg-bins=-Tlink.x");
    // Sections lie as close as they can: no page of a system to align to.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    for board in ["an505", "microbit"] {
        println!("cargo:rustc-check-cfg=cfg({board})");
        if map.strip_suffix(".x") == Some(board) {
            println!("cargo:rustc-cfg={board}");
        }
    }
    let board = if wanted.is_empty() { board } else { &wanted };
    println!("cargo:rustc-env=GESTUS_BOARD={board}");
    println!("cargo:rustc-env=GESTUS_BUILD={} {target}", env::var("CARGO_PKG_VERSION")?);
    if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
