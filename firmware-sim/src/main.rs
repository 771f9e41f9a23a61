//! The command `gestus-sim`: the core as firmware sees it.

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use gestus_database::command_line::stylizer_args::lenient;
use gestus_firmware_sim::{
    board::command::{self as board, BoardArgs},
    link::command::{self as link, LinkArgs, ProbeArgs},
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
    // Neither the table of parts nor a probe needs a database or a clip, which the parser would ask for.
    let words: Vec<String> = std::env::args().skip(1).collect();
    if let ["run", rest @ ..] = &words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        && (rest.windows(2).any(|w| w == ["--board", "list"]) || rest.contains(&"--board=list"))
    {
        return ended(run::list(rest.contains(&"--json")));
    }
    ended(match ProbeArgs::asked(&words) {
        Some(args) => link::probe(&args),
        None => run_command(),
    })
}

fn ended(outcome: anyhow::Result<()>) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}

fn command() -> clap::Command {
    Cli::command().mut_subcommands(|command| command.mut_args(lenient))
}

fn run_command() -> anyhow::Result<()> {
    let cli =
        Cli::from_arg_matches(&command().get_matches()).unwrap_or_else(|e| e.format(&mut command()).exit());
    match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Link(args) => link::run(&args),
        Command::Board(args) => board::run(&args),
        Command::View(args) => view::run(&args),
    }
}
