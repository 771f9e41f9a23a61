//! `gestus build`.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, Result};
use gestus_core::blob::layout::section;
use gestus_database::{
    blob::assemble::with_section,
    build::build,
    command_line::options::ReportArgs,
    effort::{
        Source,
        fragment::{self, Library},
        labels,
        model::Model,
        response,
    },
    pairing::Scheme,
};
use gestus_motion::corpus::Corpus;
use serde_json::json;

use super::{
    open,
    selection::{Selection, load_with_notes},
};

/// Build a database from a folder of BVH and glTF files.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of BVH and glTF files; its gestus.toml, where it has one, says what they are
    #[arg(long, required_unless_present = "config")]
    data: Option<PathBuf>,
    /// Configuration, as gestus.toml, instead of the folder's own
    #[arg(long)]
    config: Option<PathBuf>,
    /// The database to write
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    selection: Selection,
    /// How output cycles are chosen: both (the default), spread, viterbi, nearest, kernel, mean or take
    #[arg(long)]
    pairing: Option<String>,
    /// Style that the linear models take; `normal` or `neutral`, or else the first, where left out
    #[arg(long)]
    from: Option<String>,
    /// Leave out the linear models and the statistics
    #[arg(long)]
    no_models: bool,
    /// Labels of Effort that people gave: a filled-in table of `gestus effort sheet`; estimates where left out
    #[arg(long, conflicts_with = "no_effort")]
    labels: Option<PathBuf>,
    /// Leave out the effort dial
    #[arg(long)]
    no_effort: bool,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let start = Instant::now();
    let mut config = args.selection.config(args.data.as_ref(), args.config.as_ref())?;
    super::check_outputs(
        [config.data.as_ref(), args.config.as_ref(), args.labels.as_ref()],
        [("-o", Some(&args.output))],
    )?;
    if let Some(name) = &args.pairing {
        config.build.pairing = Scheme::named(name).with_context(|| {
            format!("--pairing {name}: both, spread, viterbi, nearest, kernel, mean or take")
        })?;
    }
    config.build.models &= !args.no_models;
    config.build.from = args.from.clone().or(config.build.from);
    let loaded = load_with_notes(&config)?;
    let built = build(&loaded.corpus, &config.build)?;
    for note in &built.notes {
        eprintln!("{note}");
    }
    let mut built = built;
    if !args.no_effort {
        put_dial(&mut built.bytes, &loaded.corpus, args.labels.as_deref())?;
    }
    open::write(&args.output, &built.bytes)?;
    let database = open::open(&args.output, &built.bytes)?;
    let figures = super::inspect::figures(&database, built.bytes.len())?;
    if args.report.json {
        let mut figures = figures;
        figures["skipped"] = json!(loaded.skipped);
        figures["seconds"] = json!(start.elapsed().as_secs_f64());
        super::say(&figures)?;
    } else {
        super::say(format_args!(
            "{}: {} frames of {} clips, {} classes, {:.1} bytes a frame, in {:.1} s",
            args.output.display(),
            figures["frames"],
            loaded.corpus.examples.len(),
            figures["classes"].as_array().map_or(0, Vec::len),
            figures["bytes_per_frame"].as_f64().unwrap_or(0.0),
            start.elapsed().as_secs_f64()
        ))?;
        if loaded.skipped > 0 {
            super::say(format_args!(
                "{} files or clips were left out; the lines above say why (--strict stops at the first)",
                loaded.skipped
            ))?;
        }
    }
    Ok(())
}

/// Adds the effort dial to the blob, or says on standard error why there is none.
fn put_dial(bytes: &mut Vec<u8>, corpus: &Corpus, table: Option<&Path>) -> Result<()> {
    let database = gestus_core::Database::open(bytes)?;
    let model = match table {
        Some(path) => {
            let rows = labels::read(path, corpus.rate_hz)?;
            Model::given(&rows, &path.display().to_string(), |spans| Library::annotated(corpus, spans))?
        }
        None => Model::of_database(&database)?,
    };
    if model.library.fragments.is_empty() {
        eprintln!("no effort dial: no cycle is as long as {} frames", fragment::FEWEST);
        return Ok(());
    }
    let dial = match response::solve(&database, corpus, &model, corpus.plain_style())? {
        Ok(dial) => dial,
        Err(reason) => {
            eprintln!("no effort dial: {reason}");
            return Ok(());
        }
    };
    if let Some(path) = table.filter(|_| dial.source != Source::Given) {
        eprintln!(
            "{}: {} fragments have labels, the effort dial takes {} of {} frames or more: it is made of estimates; fill in \
             more rows",
            path.display(),
            model.library.fragments.len(),
            response::FEWEST_GIVEN,
            fragment::FEWEST
        );
    }
    *bytes = with_section(bytes, section::EFFORT, &dial.section())?;
    Ok(())
}
