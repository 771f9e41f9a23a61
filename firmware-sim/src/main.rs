//! The command `gestus-sim`: the core as firmware sees it.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use gestus_firmware_sim::{
    board::command::{self as board, BoardArgs},
    link::command::{self as link, LinkArgs},
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
    /// Stream a clip through a board at the other end of a line, and compare every bit
    Link(LinkArgs),
    /// Run the firmware in an emulator, stream a clip through it, and compare every bit with this machine
    Board(BoardArgs),
    /// Write a page in which the core runs, to look at a database and to try it
    View(ViewArgs),
}

fn main() -> ExitCode {
    let outcome = match Cli::parse().command {
        Command::Run(args) => run::run(&args),
        Command::Link(args) => link::run(&args),
        Command::Board(args) => board::run(&args),
        Command::View(args) => view::run(&args),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
