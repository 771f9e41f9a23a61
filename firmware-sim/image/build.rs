//! Puts the board's memory map where the runtime's linker script looks for it, and names that script.

use std::{env, error::Error, fs, path::PathBuf};

/// The memory map of each board, by target and reported name. Without `GESTUS_BOARD` the first of the target counts.
const MAPS: [(&str, &str, &str); 8] = [
    ("thumbv7em-none-eabihf", "mps2-an386", "an386.x"),
    ("thumbv7em-none-eabihf", "mps2-an500", "an500.x"),
    ("thumbv8m.main-none-eabihf", "mps2-an505", "an505.x"),
    ("thumbv6m-none-eabi", "microbit", "microbit.x"),
    ("thumbv6m-none-eabi", "mps2-an386-armv6m", "an386.x"),
    ("riscv32imafc-unknown-none-elf", "virt-rv32imafc", "virt.x"),
    ("riscv32imac-unknown-none-elf", "virt-rv32imac", "virt.x"),
    ("riscv32imc-unknown-none-elf", "virt-rv32imc", "virt.x"),
];

fn main() -> Result<(), Box<dyn Error>> {
    let target = env::var("TARGET")?;
    println!("cargo:rerun-if-env-changed=GESTUS_BOARD");
    let wanted = env::var("GESTUS_BOARD").ok();
    let named = |board: &str| wanted.as_deref().is_none_or(|wanted| wanted == board);
    let of_target = MAPS.iter().find(|(of, board, _)| *of == target && named(board));
    let Some((_, board, map)) = of_target else {
        let wanted = wanted.as_deref().unwrap_or("any name");
        return Err(
            format!("no board of {target} reports {wanted}: add a row to MAPS in image/build.rs").into()
        );
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(PathBuf::from("memory").join(map), out.join("memory.x"))?;
    // The runtime asks for names of the device's interrupts: `src/vectors.rs` names none.
    fs::write(out.join("device.x"), "")?;
    println!("cargo:rerun-if-changed=memory/{map}");
    if *map == "microbit.x" {
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
    println!("cargo:rustc-env=GESTUS_BOARD={board}");
    println!("cargo:rustc-env=GESTUS_BUILD={} {target}", env::var("CARGO_PKG_VERSION")?);
    if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
