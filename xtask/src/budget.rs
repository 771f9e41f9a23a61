//! `cargo xtask budget`: what the core costs on boards, against `budgets.toml`.
//!
//! Everything is counted in the emulator, so that the figures are the same on every machine: instructions by stage,
//! bytes read, stack by painting and by a static bound, RAM, flash. The database is generated motion of 28 classes,
//! and the one that the micro:bit holds; where the captured one is beside the repository, it is measured too. A
//! figure more than 2% over its budget fails. The table `limits` holds what the figures ought to come to: what is still
//! over it is said, and does not fail as long as it gets no worse.

use std::{collections::BTreeMap, fs, path::Path};

use crate::{
    firmware::{missing, sim},
    real_data,
    shell::{Outcome, cargo, json, root, run as run_command, target_dir},
    stack,
};
use anyhow::{Context, Result};

const FILE: &str = "budgets.toml";
const OVER: f64 = 1.02;
/// Numbers of a board's JSON that have a budget.
const KEYS: [&str; 9] = [
    "flash_bytes",
    "ram_bytes",
    "stack_bytes",
    "instructions_median",
    "instructions_max",
    "instructions_open",
    "row_decode_instructions",
    "bytes_read_median",
    "bytes_read_max",
];
/// What a host asks for when it wants another method in a running board: for that moment the method's new state is on
/// the stack, which is no part of the bound. A board whose host does not do so needs no room for it.
const SWITCH: [&str; 1] = ["::switch"];
const HEAD: &str = "\
# What the core may cost on a board: counted in the emulator by `cargo xtask budget`, which fails where a figure is
# more than 2% over. `cargo xtask budget --record` writes the figures of today in place of those below `limits`, which
# are what the figures ought to come to: the chore names those that do not yet.
";

type Figures = BTreeMap<String, f64>;

/// Measures, prints the table, and compares; or records.
///
/// # Errors
/// Where something can't be run or read.
pub fn run(setup: bool, record: bool) -> Result<Outcome> {
    if let Some(missing) = missing(setup) {
        return Ok(Outcome::Skipped(missing));
    }
    let path = root().join(FILE);
    let text = fs::read_to_string(&path).with_context(|| FILE.to_owned())?;
    let budgets: toml::Table = text.parse().with_context(|| FILE.to_owned())?;
    let mut figures = Figures::new();
    measure("generated", &["--generated"], &["--action", "walk", "--input-style", "neutral"], &mut figures)?;
    board("m0", "m0", &["--generated"], &mut figures)?;
    if let Some((database, clip)) = reference()? {
        let wish = ["--db", &database, "--input", &clip];
        measure("reference", &wish, &["--action", "walk", "--input-style", "normal"], &mut figures)?;
    } else {
        println!("no captured motion here: its budgets are not looked at");
    }
    if record {
        let limits = budgets.get("limits").cloned();
        fs::write(&path, recorded(limits, &flat(&budgets), &figures)?)?;
    }
    let text = fs::read_to_string(&path)?;
    let over = compare(&flat(&text.parse()?), &figures);
    Ok(if over.is_empty() { Outcome::Passed } else { Outcome::Failed(over.join("; ")) })
}

/// The reference board, unlabelled and labelled, and the bound of its stack.
fn measure(name: &str, with: &[&str], labels: &[&str], figures: &mut Figures) -> Result<()> {
    let style: &[&str] = if name == "reference" { &["--style", "youthful"] } else { &["--style", "angry"] };
    let state = board(name, "m4f", &[with, style].concat(), figures)?;
    board(&format!("{name}.labelled"), "m4f", &[with, style, labels].concat(), figures)?;
    let built = json(sim().args(["board", "m4f", "--build", "--stack-sizes", "--json"]))?;
    let image = built["image"].as_str().context("the path of the image")?;
    let bound = stack::bound(Path::new(image), "main", &SWITCH)?;
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

/// A name of a function without its mangling's hashes, as far as it matters.
fn short(name: &str) -> String {
    format!("{:#}", rustc_demangle::demangle(name)).chars().take(100).collect()
}

/// Runs a board and takes the figures of its JSON. Gives the bytes of its state, which lie on its stack.
fn board(prefix: &str, board: &str, arguments: &[&str], figures: &mut Figures) -> Result<f64> {
    let found = json(sim().args(["board", board, "--json"]).args(arguments))?;
    let labelled = prefix.ends_with("labelled");
    let wanted = |key: &str| !labelled || key.contains("instructions_m") || key.contains("bytes_read");
    for key in KEYS.iter().filter(|key| wanted(key)) {
        let value = found[*key].as_f64().with_context(|| format!("{board} says nothing of {key}"))?;
        figures.insert(format!("{prefix}.{key}"), value);
    }
    for (stage, counts) in found["stages"].as_object().into_iter().flatten() {
        for which in ["median", "max"] {
            let value = counts[which].as_f64().unwrap_or(0.0);
            figures.insert(format!("{prefix}.{stage}_{which}"), value);
        }
    }
    found["state_bytes"].as_f64().context("the bytes of the state")
}

/// The database of the captured clips that the figures of the documentation are about, and a clip. Built where they
/// are, and where it is not built yet.
fn reference() -> Result<Option<(String, String)>> {
    let Some(folder) = real_data::folder().map(|f| f.join("bandai-namco-2")).filter(|f| f.is_dir()) else {
        return Ok(None);
    };
    let database = target_dir().join("firmware/reference.gestus");
    let mut build = cargo();
    build.args(["run", "--release", "--quiet", "-p", "gestus-builder", "--bin", "gestus", "--", "build"]);
    build.args(["--actions", "walk,run,walk-turn-left,walk-turn-right", "--json", "--data"]);
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
            beyond.push(format!("{name} is {now:.0}, and ought to be {limit:.0} at most"));
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
        at.insert(key.to_owned(), toml::Value::Integer(value.round() as i64));
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
        // Over the limit and within the budget: said, and no failure.
        assert!(compare(&budgets, &figures(&[("a.y", 101.4)])).is_empty());
        assert!(compare(&budgets, &figures(&[("b.z", 1.0)]))[0].contains("has no budget"));
    }

    #[test]
    fn a_record_keeps_limits_and_what_was_not_measured() {
        let before = figures(&[("limits.a.x", 9.0), ("a.x", 1.0), ("reference.x", 5.0)]);
        let limits: toml::Table = "a = { x = 9 }".parse().unwrap();
        let text = recorded(Some(limits.into()), &before, &figures(&[("a.x", 2.0), ("a.b.y", 3.0)])).unwrap();
        let after = flat(&text.parse().unwrap());
        let expected = [("limits.a.x", 9.0), ("a.x", 2.0), ("a.b.y", 3.0), ("reference.x", 5.0)];
        assert_eq!(after, figures(&expected));
    }
}
