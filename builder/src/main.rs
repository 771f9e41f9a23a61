//! The command `gestus`: builds databases, translates clips, measures.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    gestus_database::command_line::outputs::exit_code(cli::run())
}
