//! Puts the board's memory map where the runtime's linker script looks for it, and names that script.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    let target = env::var("TARGET")?;
    let (map, script) = match target.as_str() {
        "thumbv7em-none-eabihf" => ("an386.x", "link.x"),
        "thumbv8m.main-none-eabihf" => ("an505.x", "link.x"),
        "thumbv6m-none-eabi" => ("microbit.x", "link.x"),
        t if t.starts_with("riscv32") => ("virt.x", "link.x"),
        other => return Err(format!("no board has the target {other}: see the README").into()),
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::copy(PathBuf::from("memory").join(map), out.join("memory.x"))?;
    println!("cargo:rerun-if-changed=memory/{map}");
    println!("cargo:rustc-link-search={}", out.display());
    println!("cargo:rustc-link-arg-bins=-T{script}");
    // Sections lie as close as they can: no page of a system to align to.
    println!("cargo:rustc-link-arg-bins=--nmagic");
    if env::var_os("CARGO_FEATURE_DEFMT").is_some() {
        println!("cargo:rustc-link-arg-bins=-Tdefmt.x");
    }
    Ok(())
}
