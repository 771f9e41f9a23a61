//! `gestus cut`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_database::{blob::cut, command_line::options::ReportArgs, effort::dial::doubts};
use serde_json::json;

use super::open;

/// Cut a database to what a smaller board needs.
#[derive(clap::Args)]
pub struct Args {
    /// The database
    db: PathBuf,
    /// Keep the phase tables, the linear models and the statistics, and no frames
    #[arg(long)]
    models_only: bool,
    /// The smaller database
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    if !args.models_only {
        bail!("give --models-only, the only kind of cut");
    }
    super::check_outputs([Some(&args.db)], [("-o", Some(&args.output))])?;
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    let cut = cut::models_only(&database).with_context(|| args.db.display().to_string())?;
    open::write(&args.output, &cut)?;
    doubts(&database).iter().for_each(super::note);
    args.report.print(
        || json!({ "output": super::shown(&args.output), "bytes": cut.len(), "from_bytes": bytes.len() }),
        || format!("{}: {} bytes, of {}", args.output.display(), cut.len(), bytes.len()),
    )
}
