//! `gestus translate`.

use std::path::PathBuf;

use anyhow::{Context, Result};
use gestus_builder::{
    retarget::{MapFile, Retarget},
    trace::Trace,
    translate::{Input, figures, translate},
    view,
    wish::WishArgs,
};
use serde_json::json;

/// Translate a clip into another style.
#[derive(clap::Args)]
pub struct Args {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, a BVH file; on another skeleton than the database's it is retargeted, and the output comes back
    #[arg(long)]
    input: PathBuf,
    /// A file that says which joint is which body part, where names and shape don't
    #[arg(long)]
    map: Option<PathBuf>,
    #[command(flatten)]
    wish: WishArgs,
    /// Where the output goes, a BVH file at the database's rate
    #[arg(short, long)]
    output: PathBuf,
    /// A page that shows input and output side by side
    #[arg(long)]
    page: Option<PathBuf>,
    /// Everything that the steps computed, as .npz
    #[arg(long)]
    trace: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let bytes = super::read_blob(&args.db)?;
    let database = super::open(&args.db, &bytes)?;
    let map = args.map.as_deref().map(MapFile::read).transpose()?.unwrap_or_default();
    let input = Input::read_with(&args.input, &database, &map)?;
    for note in input.binding.notes() {
        eprintln!("{}: {note}", args.input.display());
    }
    for doubt in input.retarget().map(Retarget::doubts).unwrap_or_default() {
        eprintln!("{}: retargeted; doubt: {doubt}", args.input.display());
    }
    let request = args.wish.request(&database)?;
    let streamed = match &args.trace {
        Some(path) => {
            let mut trace = Trace::of(&database, &request);
            let streamed = translate(&database, &input, &request, &mut trace)?;
            trace
                .write(path, &database, &request)
                .with_context(|| format!("{} can't be written", path.display()))?;
            streamed
        }
        None => translate(&database, &input, &request, &mut ())?,
    };
    let output = input.output(&streamed);
    let document = input.document(&output)?;
    std::fs::write(&args.output, document.to_text())
        .with_context(|| format!("{} can't be written", args.output.display()))?;
    if let Some(path) = &args.page {
        let title = format!("{} in the style {}", input.clip.name, args.wish.style);
        let scene = view::Scene { title, input: &input.mapped, streamed: &streamed };
        std::fs::write(path, view::page(&database, "Gestus", &[scene])?)
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    let mut figures = figures(&streamed);
    figures["output_frames"] = json!(output.frames.len());
    figures["retargeted"] = json!(input.retarget().is_some());
    if args.json {
        super::say(&figures)?;
    } else {
        super::say(format_args!(
            "{}: {} frames in, {} out; {:.0} us a frame (median), {:.1} classes, {} degraded, digest {}",
            args.output.display(),
            figures["frames"],
            output.frames.len(),
            figures["median_us"].as_f64().unwrap_or(0.0),
            figures["classes_mean"].as_f64().unwrap_or(0.0),
            figures["degraded"],
            figures["digest"].as_str().unwrap_or("")
        ))?;
    }
    Ok(())
}
