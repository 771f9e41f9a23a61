//! `gestus effort`: tables in which people label motion with its Effort, and rate outputs by theirs.

use std::path::{Path, PathBuf};

use anyhow::{Result, bail};
use gestus_core::Database;
use gestus_database::{
    command_line::options::ReportArgs,
    effort::{
        POLE,
        fragment::{Library, MIN_FRAMES, Span},
        labels,
        model::{BLENDS, Model},
        outputs::{self, Row, Score},
        sheet::{SEEDS, selected, sheet},
    },
    stream::input::Input,
};
use gestus_evaluate::pages::{effort_outputs, effort_sheet};
use gestus_motion::{clip::Clip, landmarks::LandmarkError};
use serde_json::json;

use super::{open, selection::Selection};

/// Laban Effort: tables for people to label, and to rate outputs.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(clap::Subcommand)]
enum Command {
    /// Write a table of fragments and blends for a person to fill in, and a page that shows each of them
    Sheet(SheetArgs),
    /// Rebuild clips with each factor at either end, and write a table in which an expert rates them, and a page
    Outputs(OutputsArgs),
    /// How many of the rated outputs are consistent with their target
    Score(ScoreArgs),
}

/// Write the table of outputs and its page.
#[derive(clap::Args)]
struct OutputsArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clips, BVH or glTF
    #[arg(long, required = true, num_args = 1..)]
    input: Vec<PathBuf>,
    /// Efforts that people gave: a filled-in table of `gestus effort sheet`; default: estimates
    #[arg(long)]
    labels: Option<PathBuf>,
    /// How far each factor is turned, 0 to 3
    #[arg(long, default_value_t = 2.0)]
    reach: f64,
    /// Folder for `outputs.csv` and `outputs.html`
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Count what an expert found.
#[derive(clap::Args)]
struct ScoreArgs {
    /// The filled-in table
    table: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Write a table to fill in, and the page that goes with it.
#[derive(clap::Args)]
struct SheetArgs {
    /// Folder of clips
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
    match &args.command {
        Command::Sheet(args) => inputs(args),
        Command::Outputs(args) => rebuilt(args),
        Command::Score(args) => score(args),
    }
}

/// The model of a table of Efforts that people gave; says on standard error which rows are not used as they are. `library`
/// gives the fragments that are marked.
pub fn labelled(
    path: &Path,
    rate_hz: f64,
    library: impl FnOnce(&[Span]) -> Result<Library, LandmarkError>,
) -> Result<Model> {
    let (rows, file) = (labels::read(path, rate_hz)?, path.display().to_string());
    let model = Model::given(&rows, &file, library)?;
    labels::doubts(&rows, &file, &model.library).iter().for_each(super::note);
    Ok(model)
}

/// The model of a database, of Efforts that people gave or of estimates.
pub fn model(database: &Database<'_>, db: &Path, given: Option<&Path>) -> Result<Model> {
    if database.counts().frames == 0 {
        bail!("{}: it holds models only, and no captured cycles to blend", db.display());
    }
    let model = match given {
        Some(path) => {
            let marked = |spans: &[Span]| Library::marked(database, spans);
            labelled(path, f64::from(database.rate_hz()), marked)?
        }
        None => Model::of_database(database)?,
    };
    if model.library.fragments.is_empty() {
        bail!("{}: no cycle is as long as {MIN_FRAMES} frames: there is nothing to blend", db.display());
    }
    Ok(model)
}

/// Writes the sheet of outputs.
fn rebuilt(args: &OutputsArgs) -> Result<()> {
    if !(0.0..=POLE).contains(&args.reach) {
        bail!("--reach {}: from 0 to {POLE}", args.reach);
    }
    let table = fresh(&args.output, "outputs.csv")?;
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    let model = model(&database, &args.db, args.labels.as_deref())?;
    let clips: Vec<Clip> =
        args.input.iter().map(|path| Ok(Input::read(path, &database)?.mapped)).collect::<Result<_>>()?;
    let outputs = outputs::outputs(&model, &clips, args.reach);
    let rows: Vec<Row> = outputs.iter().map(|(row, _)| row.clone()).collect();
    open::make_folder(&args.output)?;
    let page = args.output.join("outputs.html");
    open::write(&table, outputs::write(&rows))?;
    open::write(&page, effort_outputs::page(&model, &clips, &outputs))?;
    args.report.print(
        || json!({ "csv": super::shown(&table), "html": super::shown(&page), "outputs": rows.len() }),
        || format!(
            "{} outputs: look at them in {}, fill in yes or no in the last column of {}, then\n  gestus effort score {}",
            rows.len(),
            page.display(),
            table.display(),
            table.display()
        ),
    )
}

/// Prints the score of each target and of all.
fn score(args: &ScoreArgs) -> Result<()> {
    let (targets, all) = outputs::scores(&outputs::read(&args.table)?);
    if all.rated == 0 {
        bail!("{}: nothing is rated: fill in yes or no in the column `consistent`", args.table.display());
    }
    args.report.print(
        || {
            let of = |(target, s): &(String, Score)| {
                json!({ "target": target, "rated": s.rated, "consistent": s.consistent })
            };
            let targets: Vec<_> = targets.iter().map(of).collect();
            json!({ "targets": targets, "rated": all.rated, "consistent": all.consistent })
        },
        || {
            let line = |name: &str, s: &Score| format!("{name}: {} of {} consistent", s.consistent, s.rated);
            let lines = targets.iter().map(|(target, s)| line(target, s)).chain([line("all", &all)]);
            lines.collect::<Vec<_>>().join("\n")
        },
    )
}

/// The table's place in a folder. Hours of labelling go into a table: it must not be overwritten.
fn fresh(folder: &Path, name: &str) -> Result<PathBuf> {
    let table = folder.join(name);
    if table.exists() {
        bail!("{} is there already: move it away, or choose another folder", table.display());
    }
    Ok(table)
}

/// Writes the sheet of fragments and blends.
fn inputs(args: &SheetArgs) -> Result<()> {
    if args.fragments < 2 {
        bail!("--fragments {}: at least 2", args.fragments);
    }
    fresh(&args.output, "effort.csv")?;
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
        || json!({ "csv": super::shown(&csv), "html": super::shown(&html), "fragments": sheet.fragments, "blends": sheet.blends }),
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
