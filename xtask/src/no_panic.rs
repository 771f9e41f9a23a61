//! `cargo xtask no-panic`: a proof by linking that no panic can be reached.
//!
//! `firmware-sim/no-panic` links only where its panic handler, which calls a function that exists nowhere, is dropped
//! as unreachable. Three links a target:
//!
//! 1. the proof: has to succeed;
//! 2. the control, with a reachable panic put in on purpose: has to fail, and for that reason. A proof that can't fail
//!    proves nothing;
//! 3. where the proof fails: with a handler that is there, to read from the program which places call it. Every
//!    panic of Rust takes the address of its file, line and column along, and the linker keeps those that are used.

use std::{collections::BTreeSet, fs, path::Path};

use anyhow::{Context, Result, bail};
use rayon::prelude::*;
use walkdir::WalkDir;

use crate::{
    shell::{Outcome, root, run_captured, target_dir},
    target::{self, Source},
};

/// What is proved for: with and without an FPU, micromath and the core's own arithmetic of floats.
const TARGETS: [(&str, &str); 5] = [
    ("thumbv7em-none-eabihf", ""),
    ("riscv32imac-unknown-none-elf", ""),
    ("thumbv6m-none-eabi", ""),
    ("thumbv6m-none-eabi", "micromath"),
    ("thumbv6m-none-eabi", "soft-float"),
];
/// The function that exists nowhere.
const MISSING: &str = "gestus_a_panic_can_be_reached";
const CRATE: &str = "firmware-sim/no-panic";

/// Proves it for every target, or says where a panic is reached from.
///
/// # Errors
/// Where the proof does not build, for another reason than a panic, or is not one.
pub fn run(setup: bool) -> Result<Outcome> {
    every_c_function_is_called()?;
    every_method_is_called()?;
    let sources = TARGETS.map(|(target, features)| (target, features, target::find(target, setup)));
    // A linker that optimises the whole program keeps one processor busy.
    let proofs = sources.into_par_iter().map(|(target, features, source)| prove(source, target, features));
    let proofs = proofs.collect::<Result<Vec<Outcome>>>()?;
    let (mut failed, mut skipped) = (Vec::new(), Vec::new());
    for proof in proofs {
        match proof {
            Outcome::Passed => {}
            Outcome::Skipped(missing) => skipped.push(missing),
            Outcome::Failed(name) => failed.push(name),
        }
    }
    if !failed.is_empty() {
        return Ok(Outcome::Failed(format!("a panic can be reached: {}", failed.join(", "))));
    }
    Ok(Outcome::passed_but_for(skipped))
}

/// Proves it for one target, and prints what came out. What failed is called by its target and features.
fn prove(source: Result<Source, String>, target: &str, features: &str) -> Result<Outcome> {
    let name = [target, features].join(" ");
    let name = name.trim();
    let source = match source {
        Ok(source) => source,
        Err(missing) => {
            println!("{name}: skipped: {missing}");
            return Ok(Outcome::Skipped(missing));
        }
    };
    if link(source, target, features, "")?.is_ok() {
        if link(source, target, features, "control")?.is_ok() {
            bail!("{name}: the control links too, although it panics: the proof proves nothing");
        }
        println!("{name}: no panic can be reached; the control does not link, as it should not");
        return Ok(Outcome::Passed);
    }
    let program = link(source, target, features, "places")?
        .map_err(|e| anyhow::anyhow!("{name}: the places can't be found: {e}"))?;
    let places: String = places(&program)?.iter().map(|place| format!("\n  {}", describe(place))).collect();
    println!("{name}: a panic can be reached, from:{places}");
    Ok(Outcome::Failed(name.to_owned()))
}

/// Links the program. The inner error is that of a reachable panic; every other failure is the outer one.
fn link(
    source: Source,
    target: &str,
    features: &str,
    mode: &str,
) -> Result<std::result::Result<std::path::PathBuf, String>> {
    let mut build = source.cargo("build", target);
    // A folder for each, since a build locks its folder.
    let folder = target_dir().join("no-panic").join(format!("{target}{features}"));
    build
        .args(["--release", "--quiet", "--manifest-path"])
        .arg(root().join(CRATE).join("Cargo.toml"))
        .args(["--features", &[features, mode].join(" ")])
        .arg("--target-dir")
        .arg(&folder)
        .env(
            "RUSTFLAGS",
            format!("-Clink-arg=--gc-sections -Clink-arg=--entry=_start {}", source.linker(target))
                .trim_end(),
        );
    let (done, output) = run_captured(&mut build)?;
    if done {
        return Ok(Ok(folder.join(target).join("release/gestus-no-panic")));
    }
    if output.contains("undefined symbol") && output.contains(MISSING) {
        return Ok(Err(output));
    }
    bail!("{target}: the proof does not build:\n{output}")
}

/// A function of the C interface that the proof does not call would not be covered.
fn every_c_function_is_called() -> Result<()> {
    let read =
        |path: &str| fs::read_to_string(root().join(path)).with_context(|| format!("{path} can't be read"));
    let roots = read("firmware-sim/no-panic/src/capi_roots.rs")?;
    let missing: Vec<String> = functions(&read("firmware-sim/capi/include/gestus.h")?)
        .into_iter()
        .filter(|f| !roots.contains(&format!("{f}(")))
        .collect();
    if missing.is_empty() {
        Ok(())
    } else {
        bail!("{CRATE}/src/capi_roots.rs does not call {}", missing.join(", "))
    }
}

/// Names of the functions that a header declares.
fn functions(header: &str) -> BTreeSet<String> {
    let code = header.lines().filter(|l| !l.trim_start().starts_with("//"));
    code.filter_map(|line| {
        let at = line.find("gestus_")?;
        let (name, rest) = line.get(at..)?.split_at_checked(line.get(at..)?.find('(')?)?;
        rest.starts_with('(').then(|| name.to_owned())
    })
    .collect()
}

/// Types whose public functions are all proved, what the proof calls them on, and the folder of the sources that they
/// have them in.
const PROVED: [(&str, &str, &str); 5] = [
    ("Database", "database", "core/src/blob"),
    ("Database", "database", "core/src/stylizer"),
    ("Stylizer", "stylizer", "core/src/stylizer"),
    ("Retimer", "retimer", "core/src/output"),
    ("VisitCap", "cap", "core/src/output"),
];

/// So would be a function of the core's types.
fn every_method_is_called() -> Result<()> {
    let read =
        |path: &str| fs::read_to_string(root().join(path)).with_context(|| format!("{path} can't be read"));
    let roots: String = ["core_roots", "link_roots", "loop_roots", "robot_roots"]
        .iter()
        .map(|name| read(&format!("{CRATE}/src/{name}.rs")))
        .collect::<Result<_>>()?;
    let mut calls: Vec<String> = vec![];
    for (name, variable, folder) in PROVED {
        for entry in WalkDir::new(root().join(folder)) {
            let entry = entry.with_context(|| folder.to_owned())?;
            let path = entry.path();
            if path.extension().is_some_and(|ending| ending == "rs") {
                let source = fs::read_to_string(path).with_context(|| path.display().to_string())?;
                calls.extend(methods(&source, name).iter().map(|f| match f.as_str() {
                    "new" => format!("= {name}::"),
                    "open" | "open_marked" => format!("{name}::{f}("),
                    f => format!("{variable}.{f}("),
                }));
            }
        }
    }
    let missing: Vec<&str> = calls
        .iter()
        .filter(|call| !roots.contains(*call))
        .map(|call| call.trim().trim_end_matches('('))
        .collect();
    if missing.is_empty() { Ok(()) } else { bail!("{CRATE}/src does not call {}", missing.join(", ")) }
}

/// Names of the public functions that a source gives to a type.
fn methods(source: &str, of: &str) -> BTreeSet<String> {
    let mut is_its_own = false;
    source
        .lines()
        .filter_map(|line| {
            if line.starts_with("impl") {
                // `impl<const J: usize> Retimer<J>`, and no trait of it.
                let of = format!(" {of}");
                is_its_own = line.contains(&of) && !line.contains(" for ");
            }
            let rest = line.strip_prefix("    pub ")?;
            let rest = rest.strip_prefix("const ").unwrap_or(rest).strip_prefix("fn ")?;
            is_its_own.then(|| rest.split(['(', '<']).next().unwrap_or(rest).to_owned())
        })
        .collect()
}

/// Where in a source something panics.
#[derive(Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Place {
    file: String,
    line: u32,
    column: u32,
}

/// The places of panics in a program: `core::panic::Location`, which is the address and the length of the file's name,
/// line and column, wherever four words of the program are that.
fn places(program: &Path) -> Result<BTreeSet<Place>> {
    let bytes = fs::read(program).with_context(|| format!("{} can't be read", program.display()))?;
    let segments =
        segments(&bytes).with_context(|| format!("{} is no 32-bit ELF file", program.display()))?;
    let text = |address: u32, length: u32| {
        let (start, content) = segments.iter().find(|(start, content)| {
            address >= *start
                && u64::from(address) + u64::from(length) <= u64::from(*start) + content.len() as u64
        })?;
        let at = (address - start) as usize;
        std::str::from_utf8(content.get(at..at + length as usize)?).ok()
    };
    let mut places = BTreeSet::new();
    for (_, content) in &segments {
        for words in content.windows(16).step_by(4) {
            let word = |i: usize| {
                u32::from_le_bytes([words[4 * i], words[4 * i + 1], words[4 * i + 2], words[4 * i + 3]])
            };
            let (length, line, column) = (word(1), word(2), word(3));
            let plausible = (4..4096).contains(&length)
                && (1..1_000_000).contains(&line)
                && (1..10_000).contains(&column);
            if let Some(file) =
                plausible.then(|| text(word(0), length)).flatten().filter(|f| f.ends_with(".rs"))
            {
                places.insert(Place { file: file.to_owned(), line, column });
            }
        }
    }
    Ok(places)
}

/// The loaded segments of a little-endian 32-bit ELF file: addresses and bytes.
fn segments(elf: &[u8]) -> Option<Vec<(u32, &[u8])>> {
    let u16_at = |at: usize| Some(u16::from_le_bytes(*elf.get(at..)?.first_chunk()?));
    let u32_at = |at: usize| Some(u32::from_le_bytes(*elf.get(at..)?.first_chunk()?));
    if !elf.starts_with(b"\x7fELF\x01\x01") {
        return None;
    }
    let (table, entry, count) = (u32_at(28)? as usize, u16_at(42)? as usize, u16_at(44)? as usize);
    let mut segments = Vec::new();
    for i in 0..count {
        let at = table + i * entry;
        let (kind, offset, address, bytes) =
            (u32_at(at)?, u32_at(at + 4)?, u32_at(at + 8)?, u32_at(at + 16)?);
        if kind == 1 {
            segments.push((address, elf.get(offset as usize..)?.get(..bytes as usize)?));
        }
    }
    Some(segments)
}

/// A place with the function that it is in and the line itself, where the source is there.
fn describe(place: &Place) -> String {
    let shown = Path::new(&place.file);
    let shown = shown.strip_prefix(root()).unwrap_or(shown).display();
    let at = format!("{shown}:{}:{}", place.line, place.column);
    let Ok(source) = fs::read_to_string(root().join(&place.file)) else { return at };
    let lines: Vec<&str> = source.lines().take(place.line as usize).collect();
    let Some(line) = lines.last() else { return at };
    let function = lines.iter().rev().find_map(|l| function_name(l)).unwrap_or("?");
    format!("{at}, in `{function}`: {}", line.trim())
}

/// The name of the function that a line begins.
fn function_name(line: &str) -> Option<&str> {
    let rest =
        line.trim_start().strip_prefix("fn ").or_else(|| line.split_once(" fn ").map(|(_, rest)| rest))?;
    let end = rest.find(|c: char| !c.is_alphanumeric() && c != '_')?;
    rest.get(..end).filter(|name| !name.is_empty() && !line.trim_start().starts_with("//"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An ELF file with one segment, at an address, that holds the bytes.
    fn elf(address: u32, content: &[u8]) -> Vec<u8> {
        let mut file = vec![0; 52 + 32];
        file[..6].copy_from_slice(b"\x7fELF\x01\x01");
        file[28..32].copy_from_slice(&52u32.to_le_bytes());
        file[42..44].copy_from_slice(&32u16.to_le_bytes());
        file[44..46].copy_from_slice(&1u16.to_le_bytes());
        let header = [1, 84, address, address, content.len() as u32, content.len() as u32, 4, 4];
        for (slot, word) in file[52..].chunks_exact_mut(4).zip(header) {
            slot.copy_from_slice(&word.to_le_bytes());
        }
        file.extend_from_slice(content);
        file
    }

    #[test]
    fn places_are_read_from_a_program() {
        let mut content = b"core/x.rs\0\0\0".to_vec();
        for word in [0x1000u32, 9, 72, 41, 0x1000, 9, 0, 1, 0x1001, 2, 5, 5] {
            content.extend(word.to_le_bytes());
        }
        let path = std::env::temp_dir().join(format!("gestus-places-{}", std::process::id()));
        fs::write(&path, elf(0x1000, &content)).unwrap();
        let found = places(&path);
        fs::remove_file(&path).unwrap();
        let expected = Place { file: "core/x.rs".into(), line: 72, column: 41 };
        assert_eq!(found.unwrap().into_iter().collect::<Vec<_>>(), [expected]);
    }

    #[test]
    fn a_place_is_described_by_its_function_and_line() {
        let line =
            include_str!("no_panic.rs").lines().position(|l| l.contains("pub fn run(")).unwrap() as u32 + 2;
        let place = Place { file: "xtask/src/no_panic.rs".into(), line, column: 5 };
        assert!(
            describe(&place).ends_with("in `run`: every_c_function_is_called()?;"),
            "{}",
            describe(&place)
        );
        let elsewhere = Place { file: "/rustc/0/library/core/src/x.rs".into(), line: 3, column: 1 };
        assert_eq!(describe(&elsewhere), "/rustc/0/library/core/src/x.rs:3:1");
    }

    #[test]
    fn the_proof_calls_the_whole_interface() {
        every_c_function_is_called().unwrap();
        every_method_is_called().unwrap();
        let source = "impl A {\n    pub const fn no() {}\n}\nimpl<T> B<T> {\n    pub fn yes<U>() {}\n    fn own() {}\n}\nimpl C for B {\n    pub fn no() {}\n}\n";
        assert_eq!(methods(source, "B").into_iter().collect::<Vec<_>>(), ["yes"]);
        assert_eq!(
            functions("// gestus_no(1);\nint gestus_yes(void);\n").into_iter().collect::<Vec<_>>(),
            ["gestus_yes"]
        );
    }
}
