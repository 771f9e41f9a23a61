//! `cargo xtask ci`: what has to pass beyond `cargo test --workspace`.
//!
//! A failed step does not end the run: the summary names every one, so that one run shows all there is to mend.

use std::time::{Duration, Instant};

use anyhow::Result;

use crate::{
    bare_metal, budget, capi, firmware, fuzz, no_panic, real_data,
    shell::{Outcome, cargo, run as run_command},
    wasm,
};

/// Seconds for each fuzz target: enough to notice a target that is broken, or a bug that is near.
const FUZZ_SECONDS: u32 = 30;

struct Step {
    name: &'static str,
    outcome: Outcome,
    time: Duration,
}

/// Runs every step. What fails is in the summary and the outcome.
pub fn run(setup: bool) -> Outcome {
    let mut steps = Vec::new();
    let mut step = |name, chore: &dyn Fn() -> Result<Outcome>| {
        println!("\n== {name}");
        let start = Instant::now();
        let outcome = chore().unwrap_or_else(|e| Outcome::Failed(format!("{e:#}")));
        let time = start.elapsed();
        println!("== {name}: {} ({:.0} s)", word(&outcome), time.as_secs_f64());
        steps.push(Step { name, outcome, time });
    };
    step("format", &|| passed(cargo().args(["fmt", "--all", "--check"])));
    let clippy = ["clippy", "--workspace", "--all-targets", "--keep-going", "--", "-D", "warnings"];
    step("clippy", &|| passed(cargo().args(clippy)));
    let docs = ["doc", "--workspace", "--no-deps", "--keep-going"];
    step("docs", &|| passed(cargo().args(docs).env("RUSTDOCFLAGS", "-D warnings")));
    step("core", &|| Ok(bare_metal::run(setup)));
    let micromath = ["test", "--workspace", "--features", "gestus-core/micromath", "--test", "micromath"];
    step("micromath", &|| passed(cargo().args(micromath)));
    step("firmware", &|| firmware::run(setup));
    step("budget", &|| budget::run(setup, false));
    step("no panic", &|| no_panic::run(setup));
    step("C interface", &|| capi::run(setup));
    step("wasm", &|| wasm::run(setup));
    step("real data", &real_data::run);
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
    let failed: Vec<&str> =
        steps.iter().filter(|s| matches!(s.outcome, Outcome::Failed(_))).map(|s| s.name).collect();
    if failed.is_empty() { Outcome::Passed } else { Outcome::Failed(failed.join(", ")) }
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
        assert_eq!(summary(&[failed, skipped()]), Outcome::Failed("docs".into()));
    }
}
