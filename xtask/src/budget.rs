//! `cargo xtask budget`: what the core costs on boards, against `budgets.toml`.
//!
//! Everything is counted in the emulator, so that the figures are the same on every machine: instructions by stage,
//! bytes read, stack by painting and by a static bound, RAM, flash. The database is generated motion of 28 classes,
//! and the one that the micro:bit holds; where the captured one is beside the repository, it is measured too. A
//! figure more than 2% over its budget fails. The table `limits` holds what the figures should come to: a figure over
//! its limit is named, and does not fail as long as it gets no worse.

use std::{collections::BTreeMap, fs, path::Path};

use crate::{
    bare_metal,
    firmware::missing,
    real_data,
    shell::{Outcome, built, json, root, run as run_command, sim, target_dir},
    stack,
};
use anyhow::{Context, Result};

const FILE: &str = "budgets.toml";
const OVER: f64 = 1.02;
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
const HEAD: &str = "\
# What the core may cost on a board, counted in the emulator by `cargo xtask budget`. A figure that is more than 2% over
# its value here fails; one that is over its value below `limits` is named. `cargo xtask budget --record` replaces all
# values but the limits by those of today. They depend on the compiler: compare with an older commit in the same run.
";

type Figures = BTreeMap<String, f64>;

/// Prefix, most instructions that were measured, and the bound that they have to stay under.
type Bounds = Vec<(String, f64, f64)>;

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
/// A bound that is further than this from the worst of the hard streams is of no use.
const LOOSE: f64 = 1.6;
/// Boards without an FPU that hold the whole reference.
const NO_FPU: [&str; 2] = ["armv6m", "rv32imc"];
/// The other methods.
const MODELS: [&str; 3] = ["lti", "statistic", "phase"];
/// Stages of a step that belong to feet, and programs around a step, that have one limit together.
const TOGETHER: ([&str; 2], [&str; 3]) = (["contacts", "lock"], ["retarget_in", "retiming", "servo"]);

/// Measures, prints the table, and compares; or records.
///
/// # Errors
/// Where something can't be run or read.
pub fn run(setup: bool, record: bool) -> Result<Outcome> {
    if let Some(missing) = missing(setup)? {
        return Ok(Outcome::Skipped(missing));
    }
    let path = root().join(FILE);
    let text = fs::read_to_string(&path).with_context(|| FILE.to_owned())?;
    let budgets: toml::Table = text.parse().with_context(|| FILE.to_owned())?;
    let (mut figures, mut bounds) = (Figures::new(), Bounds::new());
    let generated = ["--generated"];
    let labels = ["--action", "walk", "--input-style", "neutral"];
    measure("generated", &generated, &labels, &mut figures, &mut bounds)?;
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
    board("m0", "m0", &generated, &KEYS, &mut figures, &mut bounds)?;
    without_fpu("generated", &["--generated", "--style", "angry"], &labels, &mut figures, &mut bounds)?;
    let approximate = ["--generated", "--micromath"];
    let keys = ["instructions_median", "instructions_max", "flash_bytes"];
    let found = board("m0.micromath", "m0", &approximate, &keys, &mut figures, &mut bounds)?;
    functions(&mut figures)?;
    println!("micromath turns a joint of the m0 profile by {} degrees at most", found["degrees_apart"]);
    let reference = reference()?;
    if let Some((database, clip)) = &reference {
        let stream = ["--db", database, "--input", clip];
        let labels = ["--action", "walk", "--input-style", "normal"];
        measure("reference", &stream, &labels, &mut figures, &mut bounds)?;
        together("reference", &mut figures)?;
        let by_phase = [&stream[..], &["--style", "youthful", "--method", "phase"]].concat();
        board("reference.phase", "m4f", &by_phase, &LABELLED, &mut figures, &mut bounds)?;
        let labelled = [&by_phase[..], &labels].concat();
        board("reference.phase.labelled", "m4f", &labelled, &LABELLED, &mut figures, &mut bounds)?;
        let stream = [&stream[..], &["--style", "youthful"]].concat();
        without_fpu("reference", &stream, &labels, &mut figures, &mut bounds)?;
    }
    if record {
        let limits = budgets.get("limits").cloned();
        fs::write(&path, recorded(limits, &flat(&budgets), &figures)?)?;
    }
    let text = fs::read_to_string(&path)?;
    let mut over = compare(&flat(&text.parse()?), &figures);
    over.extend(beyond(&bounds));
    if !over.is_empty() {
        return Ok(Outcome::Failed(over.join("; ")));
    }
    let no_clips = reference.is_none().then(|| format!("the budgets `reference`: {}", real_data::MISSING));
    Ok(Outcome::passed_but_for(no_clips))
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

/// Prints the bounds of a frame beside what was measured; those that are too low, or of no use.
fn beyond(bounds: &Bounds) -> Vec<String> {
    let mut wrong = Vec::new();
    println!("{:42} {:>12} {:>12} {:>7}", "the worst frame", "measured", "bound", "");
    for (name, measured, bound) in bounds {
        println!("{name:42} {measured:>12.0} {bound:>12.0} {:>6.2}x", bound / measured);
        if measured > bound {
            wrong.push(format!("{name}: a frame took {measured:.0}, over its bound of {bound:.0}"));
        } else if name.starts_with("hard.") && *bound > LOOSE * measured {
            wrong.push(format!(
                "{name}: the bound of {bound:.0} is loose, the worst frame took {measured:.0} (`--example calibrate -- generated`)"
            ));
        }
    }
    wrong
}

/// The database of the captured clips that the figures of the documentation are about, and a clip. Built where they
/// are, and where it is not built yet.
fn reference() -> Result<Option<(String, String)>> {
    let Some(folder) = real_data::folder().map(|f| f.join("bandai-namco-2")).filter(|f| f.is_dir()) else {
        return Ok(None);
    };
    let database = target_dir().join("firmware/reference.gestus");
    let mut build = built("gestus")?;
    build.args([
        "build",
        "--actions",
        "walk,run,walk-turn-left,walk-turn-right",
        "--effort",
        "--json",
        "--data",
    ]);
    build.arg(&folder).arg("-o").arg(&database).stdout(std::process::Stdio::null());
    fs::create_dir_all(target_dir().join("firmware"))?;
    run_command(&mut build)?;
    let clip = folder.join("dataset-2_walk-turn-left_normal_002.bvh");
    Ok(Some((database.display().to_string(), clip.display().to_string())))
}

/// Numbers of a table and its tables, by their names with dots between.
fn flat(table: &toml::Table) -> Figures {
    let mut figures = Figures::new();
    for (name, value) in table {
        match value {
            toml::Value::Table(inner) => {
                figures.extend(flat(inner).into_iter().map(|(key, v)| (format!("{name}.{key}"), v)));
            }
            toml::Value::Integer(number) => {
                figures.insert(name.clone(), *number as f64);
            }
            toml::Value::Float(number) => {
                figures.insert(name.clone(), *number);
            }
            _ => {}
        }
    }
    figures
}

/// Prints the figures beside their budgets; what is over, or has none.
fn compare(budgets: &Figures, figures: &Figures) -> Vec<String> {
    let (mut over, mut beyond) = (Vec::new(), Vec::new());
    println!("{:42} {:>12} {:>12} {:>7}", "figure", "now", "budget", "");
    for (name, &now) in figures {
        let budget = budgets.get(name).copied();
        let limit = budgets.get(&format!("limits.{name}")).copied();
        let part =
            budget.filter(|b| *b > 0.0).map_or_else(String::new, |b| format!("{:.1}%", 100.0 * now / b));
        let shown = budget.map_or_else(|| "none".to_owned(), |b| format!("{b:.0}"));
        println!("{name:42} {now:>12.0} {shown:>12} {part:>7}");
        match budget {
            None => over.push(format!("{name} has no budget (`cargo xtask budget --record`)")),
            Some(budget) if now > budget * OVER => {
                over.push(format!("{name} is {now:.0}, budget {budget:.0}"))
            }
            Some(_) => {}
        }
        if let Some(limit) = limit.filter(|l| now > *l) {
            beyond.push(format!("{name} is {now:.0}, and should be {limit:.0} at most"));
        }
    }
    for line in beyond {
        println!("over the limit: {line}");
    }
    over
}

/// The file with today's figures. Those that could not be measured here stay as they were.
fn recorded(limits: Option<toml::Value>, before: &Figures, figures: &Figures) -> Result<String> {
    let mut all: Figures =
        before.iter().filter(|(n, _)| !n.starts_with("limits.")).map(|(n, v)| (n.clone(), *v)).collect();
    all.extend(figures.iter().map(|(n, v)| (n.clone(), *v)));
    let mut table = toml::Table::new();
    for (name, value) in &all {
        let (place, key) = name.rsplit_once('.').context("a name of two parts")?;
        let mut at = &mut table;
        for part in place.split('.') {
            at = at
                .entry(part)
                .or_insert_with(|| toml::Table::new().into())
                .as_table_mut()
                .with_context(|| format!("{name} is a table and a number"))?;
        }
        // A function of ten instructions is held to hundredths: the nearest whole number would be 5% off.
        let value = (value * 100.0).round() / 100.0;
        let whole = toml::Value::Integer(value as i64);
        at.insert(key.to_owned(), if value.fract() == 0.0 { whole } else { toml::Value::Float(value) });
    }
    let mut text = HEAD.to_owned();
    if let Some(limits) = limits {
        let only = toml::Table::from_iter([("limits".to_owned(), limits)]);
        text += &format!("\n{}", toml::to_string(&only)?);
    }
    Ok(text + "\n" + &toml::to_string(&table)?)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(list: &[(&str, f64)]) -> Figures {
        list.iter().map(|(n, v)| ((*n).to_owned(), *v)).collect()
    }

    #[test]
    fn more_than_two_percent_over_a_budget_fails() {
        let budgets = figures(&[("a.x", 100.0), ("a.y", 100.0), ("limits.a.y", 101.0)]);
        assert!(compare(&budgets, &figures(&[("a.x", 101.9), ("a.y", 101.0)])).is_empty());
        assert_eq!(compare(&budgets, &figures(&[("a.x", 102.1)])), ["a.x is 102, budget 100"]);
        // Over the limit and within the budget: named, and no failure.
        assert!(compare(&budgets, &figures(&[("a.y", 101.8)])).is_empty());
        assert!(compare(&budgets, &figures(&[("b.z", 1.0)]))[0].contains("has no budget"));
    }

    #[test]
    fn a_bound_is_held_from_above_and_hard_streams_hold_it_from_below() {
        let bounds = |name: &str, measured, bound| vec![(name.to_owned(), measured, bound)];
        assert!(beyond(&bounds("hard.x", 100.0, 150.0)).is_empty());
        assert!(beyond(&bounds("hard.x", 100.0, 170.0))[0].contains("loose"));
        // A stream that is easy says nothing of how loose the bound is.
        assert!(beyond(&bounds("generated", 100.0, 900.0)).is_empty());
        assert!(beyond(&bounds("generated", 101.0, 100.0))[0].contains("over its bound"));
    }

    #[test]
    fn a_record_keeps_limits_and_what_was_not_measured() {
        let before = figures(&[("limits.a.x", 9.0), ("a.x", 1.0), ("reference.x", 5.0)]);
        let limits: toml::Table = "a = { x = 9 }".parse().unwrap();
        let text =
            recorded(Some(limits.into()), &before, &figures(&[("a.x", 2.0), ("a.b.y", 3.456)])).unwrap();
        let after = flat(&text.parse().unwrap());
        let expected = [("limits.a.x", 9.0), ("a.x", 2.0), ("a.b.y", 3.46), ("reference.x", 5.0)];
        assert_eq!(after, figures(&expected));
    }
}
