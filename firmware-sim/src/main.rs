//! The command `gestus-sim`: the core as firmware sees it.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use gestus_firmware_sim::run::{self, RunArgs};

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
}

fn main() -> ExitCode {
    let Command::Run(args) = Cli::parse().command;
    match run::run(&args) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
