//! A clip through the core, the way firmware feeds it: one pose a tick, nothing known ahead. The digest is the one of
//! `gestus translate` on the same input.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_builder::{
    translate::{Input, figures, translate},
    wish::WishArgs,
};
use gestus_core::Database;

/// Stream a clip through the core on this machine.
#[derive(clap::Args, Debug)]
pub struct RunArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, a BVH file on the database's skeleton
    #[arg(long)]
    input: PathBuf,
    #[command(flatten)]
    wish: WishArgs,
    /// Where the output goes, a BVH file at the database's rate
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read or written, and requests that don't suit the database.
pub fn run(args: &RunArgs) -> Result<()> {
    let bytes = std::fs::read(&args.db).with_context(|| format!("{} can't be read", args.db.display()))?;
    let database = match Database::open(&bytes) {
        Ok(database) => database,
        Err(error) => bail!("{}: {error}", args.db.display()),
    };
    let input = Input::read(&args.input, &database)?;
    let request = args.wish.request(&database)?;
    let streamed =
        translate(&database, &input, &request, &mut ()).with_context(|| args.db.display().to_string())?;
    if let Some(path) = &args.output {
        let document = input.document(&input.output(&streamed))?;
        std::fs::write(path, document.to_text())
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    let figures = figures(&streamed);
    if args.json {
        println!("{figures}");
    } else {
        println!(
            "{} frames, {:.0} us each (median), {} bytes read each (mean), {} degraded, digest {}",
            figures["frames"],
            figures["median_us"].as_f64().unwrap_or(0.0),
            figures["bytes_read_mean"].as_f64().unwrap_or(0.0).round(),
            figures["degraded"],
            figures["digest"].as_str().unwrap_or("")
        );
    }
    Ok(())
}
