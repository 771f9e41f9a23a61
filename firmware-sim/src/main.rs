//! The command `gestus-sim`: streams poses through the core as firmware does, here or on a board.

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use gestus_database::command_line::{
    outputs::{exit_code, matches},
    stylizer_args::lenient,
};
use gestus_firmware_sim::{
    board::command::{self as board, BoardArgs},
    link::command::{self as link, LinkArgs},
    run::{self, RunArgs},
    view::{self, ViewArgs},
};

/// Run the firmware's core on this machine, on a board or in an emulator
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Stream a clip through the core on this machine
    Run(RunArgs),
    /// Stream a clip through a board on a serial port or socket, and compare every bit with this machine
    Link(LinkArgs),
    /// Run the firmware in an emulator, stream a clip through it, and compare every bit with this machine
    Board(BoardArgs),
    /// Write an HTML page that runs the core in a browser, to try out a database
    View(ViewArgs),
}

fn main() -> ExitCode {
    // The table of parts is asked for apart, because the parser requires a database and a clip.
    let words: Vec<String> =
        std::env::args_os().skip(1).map(|word| word.to_string_lossy().into_owned()).collect();
    if let ["run", rest @ ..] = &words.iter().map(String::as_str).collect::<Vec<_>>()[..]
        && (rest.windows(2).any(|w| w == ["--board", "list"]) || rest.contains(&"--board=list"))
    {
        return exit_code(run::list(rest.contains(&"--json")));
    }
    exit_code(run_command())
}

fn command() -> clap::Command {
    Cli::command().mut_subcommands(|command| command.mut_args(lenient))
}

fn run_command() -> anyhow::Result<()> {
    let cli = Cli::from_arg_matches(&matches(command(), std::env::args_os()))
        .unwrap_or_else(|e| e.format(&mut command()).exit());
    match cli.command {
        Command::Run(args) => run::run(&args),
        Command::Link(args) => link::run(&args),
        Command::Board(args) => board::run(&args),
        Command::View(args) => view::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use gestus_database::command_line::parameters::undocumented;

    use super::*;

    #[test]
    fn the_page_of_commands_names_every_option() {
        let page = include_str!("../../docs/COMMANDS.md");
        assert_eq!(undocumented(&command().name("gestus-sim"), page), Vec::<String>::new());
    }
}
