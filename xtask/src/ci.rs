//! `cargo xtask ci`: what has to pass beyond `cargo test --workspace`.
//!
//! A failed step does not end the run: the summary names every one, so that one run shows all there is to repair.
//! The tests on real clips are part of `cargo test --workspace`; a step says whether there were clips to test on.

use std::time::{Duration, Instant};

use anyhow::Result;

use crate::{
    bare_metal, budget, capi, checking, firmware, foreign, fuzz, no_panic, real_data,
    shell::{Outcome, cargo, in_ci, run as run_command},
    structure, tools, wasm,
};

/// Seconds for each fuzz target: enough to notice a target that is broken, or a bug that is near.
const FUZZ_SECONDS: u32 = 30;

struct Step {
    name: &'static str,
    outcome: Outcome,
    time: Duration,
}

/// Installs what the steps need. What could not be installed is found missing by the step that needs it.
///
/// # Errors
/// As [`firmware::missing`].
pub fn setup() -> Result<Outcome> {
    tools::install_all();
    let missing =
        firmware::missing(true)?.into_iter().chain(wasm::missing(true)).chain(checking::missing(true));
    Ok(Outcome::passed_but_for(missing))
}

/// Cargo's arguments for the tests of the feature micromath.
pub const MICROMATH: [&str; 6] =
    ["test", "--workspace", "--features", "gestus-core/micromath", "--test", "micromath"];

/// Runs every step. What fails is in the summary and the outcome.
pub fn run(setup: bool) -> Outcome {
    if setup {
        match self::setup() {
            Ok(outcome) => println!("setup: {}", word(&outcome)),
            Err(e) => println!("setup: {e:#}"),
        }
    }
    let mut steps = Vec::new();
    let mut step = |name, chore: &dyn Fn() -> Result<Outcome>| {
        println!("\n== {name}");
        let start = Instant::now();
        let outcome = chore().unwrap_or_else(|e| Outcome::Failed(format!("{e:#}"))).strict(in_ci());
        let time = start.elapsed();
        println!("== {name}: {} ({:.0} s)", word(&outcome), time.as_secs_f64());
        steps.push(Step { name, outcome, time });
    };
    step("format", &|| passed(cargo().args(["fmt", "--all", "--check"])));
    let clippy = ["clippy", "--workspace", "--all-targets", "--keep-going", "--", "-D", "warnings"];
    step("clippy", &|| passed(cargo().args(clippy)));
    let docs = ["doc", "--workspace", "--no-deps", "--keep-going"];
    step("structure", &structure::run);
    step("docs", &|| passed(cargo().args(docs).env("RUSTDOCFLAGS", "-D warnings")));
    let clips =
        || real_data::folder().map_or(Outcome::Skipped(real_data::MISSING.into()), |_| Outcome::Passed);
    step("real clips", &|| Ok(clips()));
    step("core", &|| bare_metal::run(setup));
    step("micromath", &|| passed(cargo().args(MICROMATH)));
    step("firmware", &|| firmware::run(setup));
    step("budget", &|| budget::run(setup, false));
    step("no panic", &|| no_panic::run(setup));
    step("C interface", &|| capi::run(setup));
    step("wasm", &|| wasm::run(setup));
    step("checking", &|| checking::run(setup));
    step("foreign", &|| foreign::run(setup));
    step("fuzz", &|| fuzz::run(setup, FUZZ_SECONDS, None));
    summary(&steps)
}

fn passed(command: &mut std::process::Command) -> Result<Outcome> {
    run_command(command).map(|()| Outcome::Passed)
}

fn word(outcome: &Outcome) -> String {
    match outcome {
        Outcome::Passed => "passed".into(),
        Outcome::Skipped(why) => format!("skipped: {why}"),
        Outcome::Failed(what) => format!("FAILED: {what}"),
    }
}

fn summary(steps: &[Step]) -> Outcome {
    println!("\n== summary");
    for step in steps {
        println!("{:12} {:5.0} s  {}", step.name, step.time.as_secs_f64(), word(&step.outcome));
    }
    let total: f64 = steps.iter().map(|s| s.time.as_secs_f64()).sum();
    println!("{:12} {total:5.0} s", "all");
    let counts = counts(steps);
    if steps.iter().any(|s| matches!(s.outcome, Outcome::Failed(_))) {
        return Outcome::Failed(counts);
    }
    println!("{counts}");
    Outcome::Passed
}

/// How many steps passed, failed and were skipped, with the names of those that did not pass.
fn counts(steps: &[Step]) -> String {
    let named = |word: &str, has: &dyn Fn(&Outcome) -> bool| {
        let names: Vec<&str> = steps.iter().filter(|s| has(&s.outcome)).map(|s| s.name).collect();
        let list = if names.is_empty() { String::new() } else { format!(": {}", names.join(", ")) };
        format!("{} {word}{list}", names.len())
    };
    let passed = steps.iter().filter(|s| s.outcome == Outcome::Passed).count();
    let failed = named("failed", &|o| matches!(o, Outcome::Failed(_)));
    let skipped = named("skipped", &|o| matches!(o, Outcome::Skipped(_)));
    format!("{passed} passed, {failed}, {skipped}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(name: &'static str, outcome: Outcome) -> Step {
        Step { name, outcome, time: Duration::from_secs(1) }
    }

    #[test]
    fn a_skipped_step_is_no_failure_and_a_failed_one_is_named() {
        let skipped = || ended("fuzz", Outcome::Skipped("no cargo-fuzz".into()));
        assert_eq!(summary(&[ended("docs", Outcome::Passed), skipped()]), Outcome::Passed);
        let failed = ended("docs", Outcome::Failed("warnings".into()));
        let expected = "0 passed, 1 failed: docs, 1 skipped: fuzz";
        assert_eq!(summary(&[failed, skipped()]), Outcome::Failed(expected.into()));
    }

    #[test]
    fn in_ci_a_skipped_step_fails() {
        let skipped = || Outcome::Skipped("no cargo-fuzz".into());
        assert_eq!(skipped().strict(false), skipped());
        assert!(matches!(skipped().strict(true), Outcome::Failed(why) if why.contains("no cargo-fuzz")));
        assert_eq!(Outcome::Passed.strict(true), Outcome::Passed);
        assert!(matches!(Outcome::passed_but_for(["no node".into()]), Outcome::Skipped(_)));
    }
}
