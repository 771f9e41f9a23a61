//! `cargo xtask budget`: what the core costs on boards, against `budgets.toml`.
//!
//! Everything is counted in the emulator, so that the figures are the same on every machine: instructions by stage,
//! bytes read, stack by painting and by a static bound, RAM, flash. The database is generated motion of 28 classes,
//! and the one that the micro:bit holds; where the captured one is beside the repository, it is measured too. A
//! figure more than 2% over its budget fails. The table `limits` holds what the figures should come to: a figure over
//! its limit is named, and does not fail as long as it gets no worse.

use std::fs;

use crate::{
    firmware::missing,
    measured::{Bounds, Figures, measured},
    real_data,
    shell::{Outcome, built, root, run as run_command, target_dir},
};
use anyhow::{Context, Result};

const FILE: &str = "budgets.toml";
const OVER: f64 = 1.02;
const HEAD: &str = "\
# What the core may cost on a board, counted in the emulator by `cargo xtask budget`. A figure that is more than 2% over
# its value here fails; one that is over its value below `limits` is named. `cargo xtask budget --record` replaces all
# values but the limits by those of today. They depend on the compiler: compare with an older commit in the same run.
";

/// A bound that is further than this from the worst of the hard streams is of no use.
const LOOSE: f64 = 1.6;

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
    let reference = reference()?;
    let (figures, bounds) = measured(reference.as_ref())?;
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
