//! What a budget is about, counted in the emulator: the boards' runs, and the numbers that are taken from them.

use std::{collections::BTreeMap, path::Path, thread};

use anyhow::{Context, Result};

use crate::{
    bare_metal,
    shell::{json, sim},
    stack,
};

/// Figures by their names with dots between.
pub type Figures = BTreeMap<String, f64>;

/// Prefix, most instructions that were measured, and the bound that they have to stay under.
pub type Bounds = Vec<(String, f64, f64)>;

/// Numbers of a board's JSON that have a budget.
const KEYS: [&str; 8] = [
    "flash_bytes",
    "ram_bytes",
    "stack_bytes",
    "instructions_median",
    "instructions_max",
    "instructions_open",
    "bytes_read_median",
    "bytes_read_max",
];
/// Those that change with labels.
const LABELLED: [&str; 4] =
    ["instructions_median", "instructions_max", "bytes_read_median", "bytes_read_max"];
/// Those of a stream that is hard.
const INSTRUCTIONS: [&str; 2] = ["instructions_median", "instructions_max"];
/// Streams that cost most: they leap, and under a mask every class is searched to the end in every frame. In
/// configurations of their own: K, visits, classes searched and mixes of styles. What is measured on them is what the
/// bound of a frame is held against from below as well.
const HARD: [(&str, &[&str]); 5] = [
    ("hard.shipped", &[]),
    ("hard.k40", &["--k", "40"]),
    ("hard.visits160", &["--visits", "160"]),
    ("hard.action", &["--action", "walk"]),
    ("hard.groups", &["--group-style", "left-arm=old", "--group-style", "right-arm=proud"]),
];
/// Frames of a stream that leaps.
const LEAPING: &str = "120";
/// Boards without an FPU that hold the whole reference.
const NO_FPU: [&str; 2] = ["armv6m", "rv32imc"];
/// The other methods.
const MODELS: [&str; 3] = ["lti", "statistic", "phase"];
/// Stages of a step that belong to feet, and programs around a step, that have one limit together.
const TOGETHER: ([&str; 2], [&str; 3]) = (["contacts", "lock"], ["retarget_in", "retiming", "servo"]);

/// Measures everything; `reference` is a captured database and a clip.
///
/// # Errors
/// Where something can't be run or read.
pub fn measured(reference: Option<&(String, String)>) -> Result<(Figures, Bounds)> {
    // Emulators keep one processor busy. Two runs of one board would share its images.
    let (with, without) = thread::scope(|scope| {
        let without = scope.spawn(|| boards_without_fpu(reference));
        let with = board_with_fpu(reference);
        (with, without.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    let ((mut figures, mut bounds), (others, their_bounds)) = (with?, without?);
    figures.extend(others);
    bounds.extend(their_bounds);
    functions(&mut figures)?;
    Ok((figures, bounds))
}

/// Labels of the generated clip, and of the captured one.
const LABELS: [[&str; 4]; 2] =
    [["--action", "walk", "--input-style", "neutral"], ["--action", "walk", "--input-style", "normal"]];

/// Everything that is measured on `m4f`.
fn board_with_fpu(reference: Option<&(String, String)>) -> Result<(Figures, Bounds)> {
    let (mut figures, mut bounds) = (Figures::new(), Bounds::new());
    measure("generated", &["--generated"], &LABELS[0], &mut figures, &mut bounds)?;
    for (prefix, more) in HARD {
        let stream =
            ["--generated", "--leaps", "--frames", LEAPING, "--style", "angry", "--mask", "left-arm"];
        let arguments = [&stream[..], more].concat();
        board(prefix, "m4f", &arguments, &INSTRUCTIONS, &mut figures, &mut bounds)?;
    }
    for method in MODELS {
        let prefix = format!("generated.{method}");
        let arguments = ["--generated", "--style", "angry", "--method", method];
        let keys = ["instructions_median", "instructions_max", "model_bytes_per_style"];
        board(&prefix, "m4f", &arguments, &keys, &mut figures, &mut bounds)?;
    }
    around(&mut figures)?;
    together("generated", &mut figures)?;
    least(&mut figures)?;
    if let Some((database, clip)) = reference {
        let stream = ["--db", database, "--input", clip];
        measure("reference", &stream, &LABELS[1], &mut figures, &mut bounds)?;
        together("reference", &mut figures)?;
        let by_phase = [&stream[..], &["--style", "youthful", "--method", "phase"]].concat();
        board("reference.phase", "m4f", &by_phase, &LABELLED, &mut figures, &mut bounds)?;
        let labelled = [&by_phase[..], &LABELS[1]].concat();
        board("reference.phase.labelled", "m4f", &labelled, &LABELLED, &mut figures, &mut bounds)?;
    }
    Ok((figures, bounds))
}

/// Everything that is measured on boards without an FPU.
fn boards_without_fpu(reference: Option<&(String, String)>) -> Result<(Figures, Bounds)> {
    let (mut figures, mut bounds) = (Figures::new(), Bounds::new());
    board("m0", "m0", &["--generated"], &KEYS, &mut figures, &mut bounds)?;
    let keys = ["instructions_median", "instructions_max", "flash_bytes"];
    let found =
        board("m0.micromath", "m0", &["--generated", "--micromath"], &keys, &mut figures, &mut bounds)?;
    println!("micromath turns a joint of the m0 profile by {} degrees at most", found["degrees_apart"]);
    without_fpu("generated", &["--generated", "--style", "angry"], &LABELS[0], &mut figures, &mut bounds)?;
    if let Some((database, clip)) = reference {
        let stream = ["--db", database, "--input", clip, "--style", "youthful"];
        without_fpu("reference", &stream, &LABELS[1], &mut figures, &mut bounds)?;
    }
    Ok((figures, bounds))
}

/// The reference board, unlabelled and labelled, and the bound of its stack.
fn measure(
    name: &str,
    with: &[&str],
    labels: &[&str],
    figures: &mut Figures,
    bounds: &mut Bounds,
) -> Result<()> {
    let style: &[&str] = if name == "reference" { &["--style", "youthful"] } else { &["--style", "angry"] };
    let found = board(name, "m4f", &[with, style].concat(), &KEYS, figures, bounds)?;
    let state = found["state_bytes"].as_f64().context("the bytes of the state")?;
    let labelled = format!("{name}.labelled");
    board(&labelled, "m4f", &[with, style, labels].concat(), &LABELLED, figures, bounds)?;
    let built = json(sim()?.args(["board", "m4f", "--build", "--stack-sizes", "--json"]))?;
    let image = built["image"].as_str().context("the path of the image")?;
    let bound = stack::bound(Path::new(image), "main")?;
    println!(
        "the deepest path of calls, {} bytes without the stylizer and the server:",
        bound.bytes as f64 - state
    );
    for (function, frame) in &bound.path {
        println!("  {frame:6} {}", short(function));
    }
    for function in &bound.indirect {
        println!("  calls through a register, which are not followed: {}", short(function));
    }
    figures.insert(format!("{name}.stack_bound"), bound.bytes as f64 - state);
    Ok(())
}

/// The boards without an FPU: the mixture and the phase tables, each unlabelled and labelled.
fn without_fpu(
    stream: &str,
    with: &[&str],
    labels: &[&str],
    figures: &mut Figures,
    bounds: &mut Bounds,
) -> Result<()> {
    let phase = ["--method", "phase"];
    let labelled_phase = [&phase[..], labels].concat();
    let runs: [(&str, &[&str], &[&str]); 4] = [
        ("", &[], &KEYS),
        (".labelled", labels, &INSTRUCTIONS),
        (".phase", &phase, &INSTRUCTIONS),
        (".phase.labelled", &labelled_phase, &INSTRUCTIONS),
    ];
    for name in NO_FPU {
        for (suffix, more, keys) in runs {
            let arguments = [with, more].concat();
            board(&format!("{name}.{stream}{suffix}"), name, &arguments, keys, figures, bounds)?;
        }
    }
    Ok(())
}

/// The flash of the least firmware: with all methods, and with each alone.
fn least(figures: &mut Figures) -> Result<()> {
    for method in std::iter::once(String::new()).chain(bare_metal::methods()?) {
        let mut sim = sim()?;
        sim.args(["board", "m4f", "--build", "--least", "--json"]);
        if !method.is_empty() {
            sim.args(["--methods", &method]);
        }
        let bytes = json(&mut sim)?["flash_bytes"].as_f64().context("the bytes of flash")?;
        let name = ["least", &method, "flash_bytes"].into_iter().filter(|part| !part.is_empty());
        figures.insert(name.collect::<Vec<_>>().join("."), bytes);
    }
    Ok(())
}

/// What stands around a step, each by itself.
fn around(figures: &mut Figures) -> Result<()> {
    let found = json(sim()?.args(["board", "m4f", "--around", "--json"]))?;
    for (name, counts) in found.as_object().context("figures by name")? {
        for which in ["median", "max"] {
            let value = counts[which].as_f64().with_context(|| format!("{name} has no {which}"))?;
            figures.insert(format!("around.{name}_{which}"), value);
        }
    }
    Ok(())
}

/// The sum of what stands around a step and of that stream's stages of feet.
fn together(stream: &str, figures: &mut Figures) -> Result<()> {
    for which in ["median", "max"] {
        let (stages, programs) = TOGETHER;
        let stages = stages.map(|s| format!("{stream}.{s}_{which}"));
        let programs = programs.map(|p| format!("around.{p}_{which}"));
        let parts = stages.iter().chain(&programs);
        let sum = parts.map(|p| figures.get(p).with_context(|| format!("no {p}"))).sum::<Result<f64>>()?;
        figures.insert(format!("{stream}.together_{which}"), sum);
    }
    Ok(())
}

/// Elementary functions of libm and micromath, with an FPU and without.
fn functions(figures: &mut Figures) -> Result<()> {
    println!("{:18} {:>12} {:>12} {:>14} {:>14}", "function", "m4f", "m0", "error", "relative");
    let of = |board| json(sim()?.args(["board", board, "--functions", "--json"]));
    let [m4f, m0] = ["m4f", "m0"].map(of);
    let (m4f, m0) = (m4f?, m0?);
    for (name, counts) in m4f.as_object().context("figures by name")? {
        let cost =
            |of: &serde_json::Value| of["instructions"].as_f64().context("the instructions of a function");
        let (with, without) = (cost(counts)?, cost(&m0[name])?);
        println!(
            "{name:18} {with:>12} {without:>12} {:>14} {:>14}",
            counts["error"], counts["relative_error"]
        );
        let key = name.replace('.', "_");
        figures.insert(format!("functions.m4f.{key}"), with);
        figures.insert(format!("functions.m0.{key}"), without);
    }
    Ok(())
}

/// A name of a function without its mangling's hashes, as far as it matters.
fn short(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name)).chars().take(100).collect()
}

/// Runs a board and takes those figures of its JSON, which it gives back; and the bound of a frame, where there is one.
/// Where every figure is wanted, each stage's too.
fn board(
    prefix: &str,
    board: &str,
    arguments: &[&str],
    keys: &[&str],
    figures: &mut Figures,
    bounds: &mut Bounds,
) -> Result<serde_json::Value> {
    let found = json(sim()?.args(["board", board, "--json"]).args(arguments))?;
    let number = |key: &str| found[key].as_f64().with_context(|| format!("{board} says nothing of {key}"));
    for key in keys {
        figures.insert(format!("{prefix}.{key}"), number(key)?);
    }
    if let Some(bound) = found["instructions_bound"].as_f64() {
        bounds.push((prefix.to_owned(), number("instructions_max")?, bound));
    }
    let stages = found["stages"].as_object().filter(|_| keys.contains(&"bytes_read_max"));
    for (stage, counts) in stages.into_iter().flatten() {
        for which in ["median", "max"] {
            let value = counts[which].as_f64().unwrap_or(0.0);
            figures.insert(format!("{prefix}.{stage}_{which}"), value);
        }
    }
    Ok(found)
}
