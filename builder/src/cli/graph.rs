//! `gestus graph`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_database::{
    command_line::{
        options::ReportArgs,
        outputs::{counted, counted_as},
    },
    motion_graph::{Label, MotionGraph, Walk, WalkOptions},
};
use gestus_evaluate::report::table;
use gestus_motion::{corpus::Corpus, formats::bvh::Bvh, statistics::mean_or_zero, unit::Unit};
use serde_json::json;

use super::{open, selection::Selection};

/// A long stream of many actions from short clips, by a motion graph; with the true labels of every frame.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of clips
    #[arg(long)]
    data: PathBuf,
    #[command(flatten)]
    selection: Selection,
    /// Length, seconds
    #[arg(long, default_value_t = 60.0)]
    seconds: f64,
    /// Seed: the same seed gives the same stream
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Least time in a clip between two transitions, seconds; at most twice as long
    #[arg(long, default_value_t = 2.0)]
    stay: f64,
    /// The output, a BVH file; the labels go beside it, with the ending .csv
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let labels = args.output.with_extension("csv");
    super::check_outputs([Some(&args.data)], [("-o", Some(&args.output)), ("labels", Some(&labels))])?;
    super::check_clip("-o", Some(&args.output), None)?;
    if !(1.0..=3600.0).contains(&args.seconds) {
        bail!("--seconds {}: from 1 to 3600", args.seconds);
    }
    if !(0.0..=60.0).contains(&args.stay) {
        bail!("--stay {}: seconds, from 0 to 60", args.stay);
    }
    let (_, loaded) = args.selection.load(&args.data)?;
    let corpus = &loaded.corpus;
    let graph = MotionGraph::of(corpus).with_context(|| args.data.display().to_string())?;
    let walk = graph.walk(&WalkOptions { seconds: args.seconds, seed: args.seed, stay_s: args.stay });
    open::write(&args.output, Bvh::from_clip(&walk.clip, Unit::Centimetres)?.to_text())?;
    open::write(&labels, csv(corpus, &walk)?)?;
    let classes = classes(corpus, &walk);
    let visited = classes.iter().filter(|c| c.2 > 0).count();
    let distances = || walk.transitions.iter().map(|t| 100.0 * t.distance2.sqrt());
    let (mean_cm, max_cm) = (mean_or_zero(distances()), distances().fold(0.0, f64::max));
    args.report.print(
        || {
            json!({
                "frames": walk.clip.frames.len(), "seconds": walk.clip.duration_s(), "output": super::shown(&args.output), "labels": super::shown(&labels),
                "transitions": walk.transitions.len(), "transition_cm_mean": mean_cm, "transition_cm_max": max_cm,
                "classes": classes.iter().map(|(action, style, frames)| json!({
                    "action": action, "style": style, "frames": frames,
                })).collect::<Vec<_>>(),
            })
        },
        || {
            format!(
                "{}: {} frames, {} between joints {mean_cm:.1} cm apart ({max_cm:.1} at most), {visited} of {}; labels in {}",
                args.output.display(),
                walk.clip.frames.len(),
                counted(walk.transitions.len(), "transition"),
                counted_as(classes.len(), ["class", "classes"]),
                labels.display()
            )
        },
    )
}

/// The labels of each frame.
fn csv(corpus: &Corpus, walk: &Walk) -> Result<String> {
    let row = |(t, label): (usize, &Label)| {
        let value = json!({
            "frame": t,
            "seconds": (1e4 * t as f64 / corpus.rate_hz).round() / 1e4,
            "action": corpus.actions[label.action],
            "style": corpus.styles[label.style],
            "clip": corpus.examples[label.clip].clip.name,
            "clip_frame": label.frame,
            "blend": u8::from(label.blend),
        });
        value.as_object().cloned().unwrap_or_default()
    };
    let rows: Vec<table::Row> = walk.labels.iter().enumerate().map(row).collect();
    table::csv(&rows)
}

/// Action, style and frames of every class of the clips.
fn classes<'a>(corpus: &'a Corpus, walk: &Walk) -> Vec<(&'a str, &'a str, usize)> {
    let mut classes: Vec<(usize, usize)> = corpus.examples.iter().map(|e| (e.action, e.style)).collect();
    classes.sort_unstable();
    classes.dedup();
    let frames = |class: (usize, usize)| walk.labels.iter().filter(|l| (l.action, l.style) == class).count();
    classes
        .into_iter()
        .map(|c| (corpus.actions[c.0].as_str(), corpus.styles[c.1].as_str(), frames(c)))
        .collect()
}
