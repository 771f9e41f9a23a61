//! The command line. With `--json`, standard output is one JSON object and nothing else; everything for people goes
//! to standard error.

mod batch;
mod build;
mod cut;
mod cycle;
mod demo;
mod effort;
mod evaluate;
mod figures;
mod fit;
mod graph;
mod inspect;
mod open;
mod page;
mod retarget;
mod rig;
mod robot;
mod selection;
mod transfer;
mod translate;

use anyhow::Result;
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use gestus_database::command_line::{
    lenient::lenient,
    outputs::{check_animation, check_clip, check_outputs, matches, note, say, shown, tell},
};

/// Motion style transfer that runs on a microcontroller: builds databases, translates clips, measures.
#[derive(Parser)]
#[command(version, max_term_width = 110)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

// Parsed once: the size of a variant does not matter.
#[allow(clippy::large_enum_variant)]
#[derive(Subcommand)]
enum Command {
    /// Generate motion, build a database, stylize clips and write a page that shows them: start here
    Demo(demo::DemoArgs),
    /// Write generated motion as BVH files
    Synth(demo::SynthArgs),
    /// Build a database from a folder of BVH and glTF files
    Build(build::Args),
    /// Cut a database to its models, for boards without room for frames
    Cut(cut::Args),
    /// Show what is in a database, and verify it
    Inspect(inspect::InspectArgs),
    /// Write the arrays of a database that a stream is recomputed from as .npy, and the manifest as JSON
    Export(inspect::ExportArgs),
    /// Translate a clip into another style
    Translate(translate::Args),
    /// Write a page that translates clips in the browser
    Page(page::Args),
    /// Give a clip the style of another clip, without a database
    Transfer(transfer::Args),
    /// Make an endless walk with a given style and speed
    Loop(cycle::Args),
    /// Make a long stream of many actions from short clips, with true labels
    Graph(graph::Args),
    /// Map a clip's skeleton to a database's: show the mapping, write the clip, write the map
    Retarget(retarget::Args),
    /// Tables in which people label the Laban Effort of fragments, and rate outputs
    Effort(effort::Args),
    /// Measure accuracy, timing, contacts, search, size and more
    Evaluate(evaluate::Args),
}

/// The command line, with what all options have in common.
fn command() -> clap::Command {
    fn with_subcommands(command: clap::Command) -> clap::Command {
        command.mut_args(lenient).mut_subcommands(with_subcommands)
    }
    with_subcommands(Cli::command())
}

/// Parses the command line and runs the command.
pub fn run() -> Result<()> {
    let matches = matches(command(), std::env::args_os());
    let cli = Cli::from_arg_matches(&matches).unwrap_or_else(|e| e.format(&mut command()).exit());
    match cli.command {
        Command::Demo(args) => demo::demo(&args),
        Command::Synth(args) => demo::synth(&args),
        Command::Build(args) => build::run(&args),
        Command::Cut(args) => cut::run(&args),
        Command::Inspect(args) => inspect::inspect(&args),
        Command::Export(args) => inspect::export(&args),
        Command::Translate(args) => translate::run(&args),
        Command::Page(args) => page::run(&args),
        Command::Transfer(args) => transfer::run(&args),
        Command::Loop(args) => cycle::run(&args),
        Command::Graph(args) => graph::run(&args),
        Command::Retarget(args) => retarget::run(&args),
        Command::Effort(args) => effort::run(&args),
        Command::Evaluate(args) => evaluate::run(&args),
    }
}

#[cfg(test)]
mod tests {
    use gestus_database::command_line::parameters::undocumented;

    use super::*;

    #[test]
    fn the_command_line_is_in_order() {
        command().debug_assert();
    }

    #[test]
    fn the_page_of_commands_names_every_option() {
        let page = include_str!("../../../docs/COMMANDS.md");
        assert_eq!(undocumented(&command().name("gestus"), page), Vec::<String>::new());
    }

    #[test]
    fn items_of_lists_are_trimmed() {
        let words = ["gestus", "build", "--data", "d", "-o", "k", "--actions", "walk, run ", "--rate", "-5"];
        let matches = command().try_get_matches_from(words).unwrap();
        let (_, build) = matches.subcommand().unwrap();
        let actions: Vec<&String> = build.get_many("actions").unwrap().collect();
        assert_eq!(actions, ["walk", "run"]);
        assert_eq!(build.get_one::<f64>("rate"), Some(&-5.0));
        assert!(Cli::from_arg_matches(&matches).is_ok());
    }

    #[test]
    fn lists_of_given_words_are_checked() {
        let given = |parameters| {
            let words =
                ["gestus", "evaluate", "ablation", "--data", "d", "-o", "o", "--parameters", parameters];
            command().try_get_matches_from(words)
        };
        let matches = given(" k, prune ").unwrap();
        let ablation = matches.subcommand().and_then(|(_, evaluate)| evaluate.subcommand()).unwrap().1;
        assert_eq!(ablation.get_many::<String>("parameters").unwrap().collect::<Vec<_>>(), ["k", "prune"]);
        assert!(Cli::from_arg_matches(&matches).is_ok());
        let error = given("k,kk").unwrap_err().to_string();
        assert!(error.contains("kk") && error.contains("kappa-rho"), "{error}");
    }
}
