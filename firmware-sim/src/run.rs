//! A clip through the core, the way firmware feeds it: one pose a tick, nothing known ahead. The digest is the one of
//! `gestus translate` on the same input; with faults, the stream is what the faults leave of it.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_core::Database;
use gestus_database::{
    command_line::{
        outputs::{check_outputs, say, tell},
        stylizer_args::StylizerArgs,
    },
    retarget::MapFile,
    stream::{
        Request, Streamed,
        translate::{Input, degraded_words, figures, translate},
    },
};
use gestus_motion::{body::database_skeleton, unit::Unit};
use serde_json::{Value, json};

use crate::{
    faults::{self, Disturbance, Faults},
    parts::{Estimate, PARTS, Part, Stream, table},
};

/// Stream a clip through the core on this machine.
#[derive(clap::Args, Debug)]
pub struct RunArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip, BVH or glTF (`hero.glb#walk` is one of several animations); on another skeleton than the database's it
    /// is retargeted
    #[arg(long)]
    input: PathBuf,
    /// Unit of the clip's lengths: m, cm, mm, inch, cmu, or metres a unit; where left out, the one in which the body is
    /// the database's, or else guessed by its height
    #[arg(long)]
    unit: Option<Unit>,
    #[command(flatten)]
    stylizer_args: StylizerArgs,
    /// A part to reckon with: whether the database fits, and how many frames a second it would give. `all` of them, or
    /// `list`, which prints the table and needs nothing else
    #[arg(long)]
    board: Option<String>,
    /// Faults of the stream, such as drop=0.01,repeat=0.02,delay=0.05:3,corrupt=0.01,seed=7: probabilities a frame,
    /// late by up to so many frames
    #[arg(long)]
    faults: Option<Faults>,
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
/// Files that can't be read or written, parts that are not in the table, and requests that don't suit the database.
pub fn run(args: &RunArgs) -> Result<()> {
    let parts: Vec<&'static Part> = match args.board.as_deref() {
        Some("all") => PARTS.iter().collect(),
        Some(name) => vec![table::find(name)?],
        None => Vec::new(),
    };
    check_outputs([Some(&args.db), Some(&args.input)], [("-o", args.output.as_ref())])?;
    let bytes = std::fs::read(&args.db).with_context(|| format!("{} can't be read", args.db.display()))?;
    let database = match Database::open(&bytes) {
        Ok(database) => database,
        Err(error) => bail!("{}: {error}", args.db.display()),
    };
    let mut input = Input::read_with(&args.input, &database, &MapFile::default(), args.unit)?;
    tell(&args.input, input.notes());
    let request = args.stylizer_args.request(&database).with_context(|| args.db.display().to_string())?;
    let (streamed, disturbed) = match &args.faults {
        Some(faults) => {
            let (streamed, figures) = disturb(&database, &mut input, &request, faults)?;
            (streamed, Some(figures))
        }
        None => (
            translate(&database, &input, &request, &mut ()).with_context(|| args.db.display().to_string())?,
            None,
        ),
    };
    if let Some(path) = &args.output {
        let document = input.document(&input.output(&streamed))?;
        std::fs::write(path, document.to_text())
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    let stream = Stream { database: &database, blob_bytes: bytes.len() as u64, request: &request };
    let reports = || streamed.steps.iter().map(|s| &s.report);
    let estimates: Vec<Estimate> = parts.iter().map(|part| Estimate::new(part, &stream, reports())).collect();
    let mut figures = figures(&streamed);
    if let Some(disturbed) = disturbed {
        figures["faults"] = disturbed;
    }
    match (&estimates[..], args.board.as_deref()) {
        (_, Some("all")) => figures["boards"] = estimates.iter().map(Estimate::json).collect(),
        ([one], _) => figures["board"] = one.json(),
        _ => {}
    }
    if args.json { say(&figures) } else { print(&figures, &estimates) }
}

/// Prints the table of parts.
///
/// # Errors
/// A standard output that takes nothing.
pub fn list(json: bool) -> Result<()> {
    if json {
        say(json!({ "parts": PARTS.iter().map(table::json).collect::<Vec<_>>() }))
    } else {
        say(table::words().trim_end())
    }
}

/// Streams what faults leave of an input, which becomes what arrived; and compares with the undisturbed stream.
fn disturb(
    database: &Database<'_>,
    input: &mut Input,
    request: &Request,
    faults: &Faults,
) -> Result<(Streamed, Value)> {
    let undisturbed = translate(database, input, request, &mut ())?;
    let arrivals = faults.arrivals(input.mapped.frames.len(), database.counts().joints);
    if arrivals.all.is_empty() {
        bail!("--faults: no frame arrives");
    }
    input.mapped = arrivals.clip(&input.mapped);
    input.clip = arrivals.order(&input.clip);
    let streamed = translate(database, input, request, &mut ())?;
    let disturbance = Disturbance::new(&database_skeleton(database), &undisturbed, &streamed, &arrivals);
    let mut figures = disturbance.json(&arrivals);
    let degraded = |s: &Streamed| s.steps.iter().filter(|s| !s.report.degraded.is_empty()).count();
    figures["degraded"] = json!(degraded(&streamed));
    figures["degraded_undisturbed"] = json!(degraded(&undisturbed));
    Ok((streamed, figures))
}

fn print(figures: &Value, estimates: &[Estimate]) -> Result<()> {
    say(format_args!(
        "{} frames, {:.0} us each (median), {} bytes read each (mean), {}, digest {}",
        figures["frames"],
        figures["median_us"].as_f64().unwrap_or(0.0),
        figures["bytes_read_mean"].as_f64().unwrap_or(0.0).round(),
        degraded_words(figures),
        figures["digest"].as_str().unwrap_or("")
    ))?;
    if figures["faults"].is_object() {
        say(faults::words(&figures["faults"]))?;
        let undisturbed = &figures["faults"]["degraded_undisturbed"];
        say(format_args!("{undisturbed} degraded without the faults"))?;
    }
    estimates.iter().try_for_each(|estimate| say(estimate.words()))
}
