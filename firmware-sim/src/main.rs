//! The command `gestus-sim`: streams poses through the core as firmware does, here or on a board.

use std::process::ExitCode;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use gestus_database::command_line::{
    lenient::lenient,
    outputs::{exit_code, matches},
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

/// What a board's images are built with.
const BUILT_WITH: &[&str] =
    &["name", "all", "build", "defmt", "robot", "micromath", "stack_sizes", "least", "methods", "json"];

/// Options, by their commands, that make the command do something else, with the options that still have an effect then.
/// All others are refused beside them. Clap's `requires` does not do it: Clap drops it if the required option conflicts
/// with one that is given.
const APART: [(&str, &str, &[&str]); 7] = [
    ("link", "probe", &["port", "timeout", "repeats", "json"]),
    ("board", "build", BUILT_WITH),
    ("board", "least", BUILT_WITH),
    ("board", "stack_sizes", BUILT_WITH),
    ("board", "long_stream", &["name", "all", "frames", "json"]),
    ("board", "around", &["name", "json"]),
    ("board", "functions", &["name", "json"]),
];

fn command() -> clap::Command {
    let command = Cli::command().mut_subcommands(|command| command.mut_args(lenient));
    APART.iter().fold(command, |command, &(name, option, beside)| {
        command.mut_subcommand(name, |command| {
            let ids = command.get_arguments().map(|argument| argument.get_id().to_string());
            let others: Vec<String> = ids.filter(|id| id != option && !beside.contains(&&**id)).collect();
            command.mut_arg(option, |argument| argument.conflicts_with_all(others))
        })
    })
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
    use clap::error::ErrorKind;
    use gestus_core::Method;
    use gestus_database::command_line::parameters::undocumented;

    use super::*;

    /// Why a line is refused before anything is read or built.
    fn refusal(line: &str) -> Option<ErrorKind> {
        command()
            .try_get_matches_from(format!("gestus-sim {line}").split_whitespace())
            .err()
            .map(|e| e.kind())
    }

    #[test]
    fn items_of_lists_are_trimmed() {
        let clip = ["--db", "a.gestus", "--input", "a.bvh", "--style", "proud"];
        let line = ["gestus-sim", "link", "tcp:localhost:1", "--robot", "r", "--robot-at", "0.5, -0.1"];
        let matches = command().try_get_matches_from(line.into_iter().chain(clip)).unwrap();
        let link = matches.subcommand().unwrap().1;
        assert_eq!(link.get_many("robot_at").unwrap().copied().collect::<Vec<f32>>(), [0.5, -0.1]);
        let line = ["gestus-sim", "board", "m4f", "--build", "--methods", "mar, phase"];
        let matches = command().try_get_matches_from(line).unwrap();
        let methods = matches.subcommand().unwrap().1.get_many("methods").unwrap();
        assert_eq!(methods.copied().collect::<Vec<Method>>(), [Method::Mar, Method::Phase]);
    }

    #[test]
    fn options_without_an_effect_are_refused() {
        let clip = "--db a.gestus --input a.bvh --style proud";
        for line in [
            "link tcp:localhost:1 --probe --style proud",
            "link tcp:localhost:1 --probe --k 8",
            "link tcp:localhost:1 --probe --floor 0",
            "board m4f --leaps",
            &format!("board m4f --leaps {clip}"),
            "board m4f --least",
            &format!("board m4f --least {clip}"),
            &format!("board m4f --stack-sizes {clip}"),
            "board m4f --least --generated",
            "board m4f --build --frames 3",
            "board m4f --build --generated",
            "board m4f --build --style proud",
            "board m4f --generated --floor 0",
            "board m4f --generated --up y",
            "view --db a.gestus -o a.html --up z",
            "link loopback --noise seed=7",
            "board m4f --long-stream --style proud",
            "board m4f --long-stream --defmt",
            "board m4f --around --style proud",
            "board m4f --functions --frames 3",
            &format!("link loopback --timeout 0 {clip}"),
        ] {
            assert!(refusal(line).is_some(), "{line}");
        }
        for line in [
            "link tcp:localhost:1 --probe --timeout 10 --repeats 0 --json",
            "board m4f --leaps --generated --frames 9 --style proud --k 3",
            "board --all --build --least --methods mar,phase --stack-sizes",
            "board m4f --build --robot r.gestus --defmt",
            "board --all --long-stream --frames 500 --json",
            "board m4f --around --json",
            &format!("board m4f --floor 0 --up y --root motion {clip}"),
        ] {
            assert_eq!(refusal(line), None, "{line}");
        }
    }

    #[test]
    fn the_page_of_commands_names_every_option() {
        let page = include_str!("../../docs/COMMANDS.md");
        assert_eq!(undocumented(&command().name("gestus-sim"), page), Vec::<String>::new());
    }
}
