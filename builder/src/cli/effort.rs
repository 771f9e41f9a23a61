//! `gestus effort`: a table in which people label motion with its Effort.

use std::path::PathBuf;

use anyhow::{Result, bail};
use gestus_database::{
    command_line::options::ReportArgs,
    effort::{
        fragment::Library,
        model::BLENDS,
        sheet::{SEEDS, selected, sheet},
    },
};
use gestus_evaluate::pages::effort_sheet;
use serde_json::json;

use super::{open, selection::Selection};

/// Laban Effort: tables for people to label.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Write a table of fragments and blends for a person to fill in, and a page that shows each of them
    Sheet(SheetArgs),
}

/// Write a table to fill in, and the page that goes with it.
#[derive(clap::Args)]
struct SheetArgs {
    /// Folder of BVH and glTF files
    #[arg(long)]
    data: PathBuf,
    #[command(flatten)]
    selection: Selection,
    /// Number of fragments, spread evenly over actions and styles
    #[arg(long, default_value_t = SEEDS)]
    fragments: usize,
    /// Number of blends of two fragments
    #[arg(long, default_value_t = BLENDS)]
    blends: usize,
    /// Seed of the blends: the same seed gives the same blends
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Folder for `effort.csv` and `effort.html`
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let Command::Sheet(args) = &args.command;
    if args.fragments < 2 {
        bail!("--fragments {}: at least 2", args.fragments);
    }
    let table = args.output.join("effort.csv");
    // Hours of labelling go into a table: it must not be overwritten.
    if table.exists() {
        bail!("{} is there already: move it away, or choose another folder", table.display());
    }
    let (_, loaded) = args.selection.load(&args.data)?;
    let library = selected(&Library::found(&loaded.corpus)?, args.fragments);
    if library.fragments.is_empty() {
        bail!("{}: no fragment found", args.data.display());
    }
    let sheet = sheet(&library, args.blends, args.seed);
    open::make_folder(&args.output)?;
    let save = |name: &str, content: &str| -> Result<PathBuf> {
        let path = args.output.join(name);
        open::write(&path, content)?;
        Ok(path)
    };
    let (csv, html) =
        (save("effort.csv", &sheet.csv)?, save("effort.html", &effort_sheet::page(&library, &sheet))?);
    if sheet.blends < args.blends {
        super::note(format_args!(
            "only {} of {} blends: few fragments show one content",
            sheet.blends, args.blends
        ));
    }
    args.report.print(
        || json!({ "csv": csv, "html": html, "fragments": sheet.fragments, "blends": sheet.blends }),
        || format!(
            "{} fragments and {} blends: look at them in {}, fill in flow, weight and time in {}, then\n  \
             gestus build --data {} --labels {} -o DB.gestus",
            sheet.fragments,
            sheet.blends,
            html.display(),
            csv.display(),
            args.data.display(),
            csv.display()
        ),
    )
}
