//! Chores of the workspace, as `cargo xtask …`.
//!
//! Whatever needs more than stable Rust lives here and not in `cargo test`. A chore uses what is installed and skips
//! the rest with a line that says what is missing; with `--setup` it installs it first. With `CI=true` in the
//! environment, to skip is to fail.

mod bare_metal;
mod browser;
mod budget;
mod capi;
mod checking;
mod ci;
mod firmware;
mod foreign;
mod fuzz;
mod log_lines;
mod measured;
mod no_panic;
mod page;
mod real_data;
mod recording;
mod same;
mod shell;
mod stack;
mod structure;
mod target;
mod tools;
mod wasm;

use std::process::ExitCode;

use anyhow::Result;
use clap::{Parser, Subcommand};
use shell::Outcome;

#[derive(Parser)]
#[command(name = "cargo xtask", about = "Chores of the Gestus workspace", disable_help_subcommand = true)]
struct Arguments {
    #[command(subcommand)]
    chore: Chore,
}

#[derive(clap::Args)]
struct Setup {
    /// Install what is missing: programs, targets or their sources, the nightly toolchain
    #[arg(long)]
    setup: bool,
}

#[derive(Subcommand)]
enum Chore {
    /// All that CI runs beyond `cargo test --workspace`: each step, its time, and a summary
    Ci(Setup),
    /// Install every program and target that any chore needs
    Setup,
    /// Fuzz every target, or one, for a while
    Fuzz {
        #[command(flatten)]
        setup: Setup,
        /// Seconds for each target
        #[arg(long, default_value_t = 60)]
        seconds: u32,
        /// One target; all of them unless given
        target: Option<String>,
    },
    /// Compile gestus-core alone for a Cortex-M4F, with all methods and with each alone
    Core(Setup),
    /// Prove, by linking, that neither the core nor the C interface can reach a panic
    NoPanic(Setup),
    /// The C interface: its tests, its header, and its example on this machine and on an emulated Cortex-M4F
    Capi(Setup),
    /// The firmware for every emulated board, and a long stream that has to give the same bits on those with room and speed for it
    Firmware(Setup),
    /// What the core costs on boards, against budgets.toml
    Budget {
        #[command(flatten)]
        setup: Setup,
        /// Write today's figures into budgets.toml
        #[arg(long)]
        record: bool,
    },
    /// The core as a wasm module, for node and for the pages of `gestus-sim view`
    Wasm(Setup),
    /// The programs of docs/CHECKING.md, which recompute a stream in Python
    Checking(Setup),
    /// Tests on real clips: GESTUS_DATA, or shared/data beside the repository
    RealData,
    /// Clips that nobody prepared, of public packages: each translates well, or is refused for a true reason
    Foreign(Setup),
    /// Prove that `gestus` and `gestus-sim` write the same as those of another revision
    Same {
        /// The revision to compare with, such as `main`
        #[arg(long)]
        base: String,
        /// Fewer measures and fewer classes of real clips
        #[arg(long)]
        quick: bool,
    },
    /// Check that no files depend on each other in a circle, and that no file or function is too long
    Structure,
    /// Record the golden digests anew, and show what changed
    Golden {
        /// The golden blob with legs too: where the format or the builder was meant to change
        #[arg(long)]
        blob: bool,
    },
}

fn main() -> ExitCode {
    let outcome = run(Arguments::parse().chore).unwrap_or_else(|e| Outcome::Failed(format!("{e:#}")));
    match outcome.strict(shell::in_ci()) {
        Outcome::Passed => ExitCode::SUCCESS,
        Outcome::Skipped(why) => {
            println!("skipped: {why}");
            ExitCode::SUCCESS
        }
        Outcome::Failed(what) => {
            eprintln!("failed: {what}");
            ExitCode::FAILURE
        }
    }
}

fn run(chore: Chore) -> Result<Outcome> {
    match chore {
        Chore::Ci(Setup { setup }) => Ok(ci::run(setup)),
        Chore::Setup => ci::setup(),
        Chore::Fuzz { setup, seconds, target } => fuzz::run(setup.setup, seconds, target.as_deref()),
        Chore::Core(Setup { setup }) => bare_metal::run(setup),
        Chore::NoPanic(Setup { setup }) => no_panic::run(setup),
        Chore::Capi(Setup { setup }) => capi::run(setup),
        Chore::Firmware(Setup { setup }) => firmware::run(setup),
        Chore::Budget { setup, record } => budget::run(setup.setup, record),
        Chore::Wasm(Setup { setup }) => wasm::run(setup),
        Chore::Checking(Setup { setup }) => checking::run(setup),
        Chore::RealData => real_data::run(),
        Chore::Foreign(Setup { setup }) => foreign::run(setup),
        Chore::Same { base, quick } => same::run(&base, quick),
        Chore::Structure => structure::run(),
        Chore::Golden { blob } => golden(blob),
    }
}

/// Runs the golden tests so that they write what they would compare.
fn golden(blob: bool) -> Result<Outcome> {
    let record = if blob { "blob" } else { "1" };
    let tests: [&[&str]; 2] =
        [&["test", "-p", "gestus-tests", "--test", "golden", "--test", "long_stream"], &ci::MICROMATH];
    for test in tests {
        shell::run(shell::cargo().args(test).env("GESTUS_RECORD", record))?;
    }
    shell::run(shell::command("git").args(["status", "--short", "tests"]))?;
    Ok(Outcome::Passed)
}
