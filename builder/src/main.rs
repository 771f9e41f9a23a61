//! The command `gestus`: builds databases, translates clips, measures.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    match cli::run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            gestus_database::command_line::outputs::note(format_args!("error: {error:#}"));
            ExitCode::FAILURE
        }
    }
}
