//! The command `gestus-sim`: the core as firmware sees it.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use gestus_firmware_sim::{
    run::{self, RunArgs},
    view::{self, ViewArgs},
};

/// Gestus off the board: the very same core on this machine.
#[derive(Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Stream a clip through the core on this machine
    Run(RunArgs),
    /// Write a page in which the core runs, to look at a database and to try it
    View(ViewArgs),
}

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::View(args) => view::run(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
