//! `gestus-sim run`: streams a clip through the core as firmware does, one pose a tick and without looking ahead. The
//! digest is that of `gestus translate` on the same input. With `--faults` the core gets only the frames that arrive.

use anyhow::{Context, Result, anyhow, bail};
use gestus_core::Database;
use gestus_database::{
    command_line::{options::ReportArgs, outputs::say},
    parts::{Estimate, PARTS, Part, Stream, names, table},
    stream::{
        Request, Streamed,
        input::Input,
        translate::{degraded_words, figures, translate},
    },
};
use gestus_motion::body::database_skeleton;
use serde_json::{Value, json};

use crate::{
    clip_args::ClipArgs,
    faults::{self, Disturbance, Faults},
};

/// Stream a clip through the core on this machine.
#[derive(clap::Args, Debug)]
pub struct RunArgs {
    #[command(flatten)]
    clip: ClipArgs,
    /// Estimate whether the database fits a microcontroller, and at how many frames a second: the name of a part, of an
    /// emulated board, which stands for a part, or `all`.
    /// `list` prints the table of parts, and needs no other option
    #[arg(long)]
    board: Option<String>,
    /// Faults of the stream, such as drop=0.01,repeat=0.02,delay=0.05:3,corrupt=0.01,seed=7: each with its probability
    /// a frame, `delay` with the longest delay in frames
    #[arg(long)]
    faults: Option<Faults>,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read or written, unknown parts, and settings that don't suit the database.
pub fn run(args: &RunArgs) -> Result<()> {
    let parts: Vec<&'static Part> = match args.board.as_deref() {
        Some("all") => PARTS.iter().collect(),
        Some(name) => vec![names::find(name).map_err(|error| anyhow!("--board {error}"))?],
        None => Vec::new(),
    };
    args.clip.check(None, None)?;
    let bytes = args.clip.read()?;
    let (database, mut input, request) = args.clip.open(&bytes)?;
    let (streamed, disturbed) = match &args.faults {
        Some(faults) => {
            let (streamed, figures) = disturb(&database, &mut input, &request, faults)?;
            (streamed, Some(figures))
        }
        None => {
            let streamed = translate(&database, &input, &request, &mut ());
            (streamed.with_context(|| args.clip.database_name())?, None)
        }
    };
    args.clip.write(&input, &streamed)?;
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
    if args.report.json { say(&figures) } else { print(&figures, &estimates) }
}

/// Prints the table of parts.
///
/// # Errors
/// A standard output that can't be written.
pub fn list(json: bool) -> Result<()> {
    if json {
        say(json!({ "parts": PARTS.iter().map(table::json).collect::<Vec<_>>() }))
    } else {
        say(table::summary().trim_end())
    }
}

/// Streams the frames of an input that arrive, and compares with the undisturbed stream. The input's frames are
/// replaced by those that arrived.
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
    input.clip = arrivals.uncorrupted(&input.clip);
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
        say(faults::summary(&figures["faults"]))?;
        let undisturbed = &figures["faults"]["degraded_undisturbed"];
        say(format_args!("{undisturbed} degraded without the faults"))?;
    }
    estimates.iter().try_for_each(|estimate| say(estimate.summary()))
}
