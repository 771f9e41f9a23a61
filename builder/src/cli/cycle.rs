//! `gestus loop`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_database::{command_line::options::ReportArgs, list, models::bilinear::Bilinear};
use gestus_motion::{body::Body, formats::bvh::Bvh, unit::Unit};
use serde_json::json;

use super::{
    open,
    selection::{ClassArgs, Selection},
};

/// An endless walk: one gait cycle with a dial for style and a dial for speed, from a folder of clips.
#[derive(clap::Args)]
pub struct Args {
    /// Folder of clips
    #[arg(long)]
    data: PathBuf,
    /// The gait
    #[arg(long, default_value = "walk")]
    action: String,
    /// Styles to learn from, s,t; default: all
    #[arg(long, value_delimiter = ',')]
    styles: Vec<String>,
    /// Style, or weights a=1,b=0.5, which are normalised to sum 1; a negative weight moves away from a style
    #[arg(long, allow_hyphen_values = true)]
    style: String,
    /// Speed, metres a second, which may be beyond the data's; default: the style's medium speed
    #[arg(long)]
    speed: Option<f64>,
    /// Style whose cycle the others are warped onto; default: `normal` or `neutral`, or else the first
    #[arg(long)]
    from: Option<String>,
    /// Length, seconds
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// The output, a BVH file
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
}

/// Greatest weight of a style, of a sum of 1: further from the data no body walks.
const MAX_WEIGHT: f64 = 5.0;

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    super::check_outputs([Some(&args.data)], [("-o", Some(&args.output))])?;
    super::check_clip("-o", Some(&args.output), None)?;
    let classes = ClassArgs { actions: vec![args.action.clone()], styles: args.styles.clone() };
    let (_, loaded) = Selection { classes, ..Selection::default() }.load(&args.data)?;
    let corpus = &loaded.corpus;
    let place = || args.data.display().to_string();
    let from = match &args.from {
        Some(name) => corpus.style(name).with_context(place)?,
        None => corpus.plain_style(),
    };
    let action = corpus.action(&args.action).with_context(place)?;
    let mut weights = vec![0.0; corpus.styles.len()];
    for item in list::items(&args.style) {
        let weight: f64 = item.weight().context("--style")?;
        weights[corpus.style(item.name).with_context(place)?] += weight;
    }
    let total: f64 = weights.iter().sum();
    if !(total.is_finite() && total.abs() > 1e-6) {
        bail!("--style {}: the weights sum to {total}", args.style);
    }
    weights.iter_mut().for_each(|w| *w /= total);
    if let Some(w) = weights.iter().find(|w| !(-MAX_WEIGHT..=MAX_WEIGHT).contains(*w)) {
        bail!("--style {}: a style has {w:.1} of the sum: from -{MAX_WEIGHT} to {MAX_WEIGHT}", args.style);
    }
    if !(0.1..=600.0).contains(&args.seconds) {
        bail!("--seconds {}: from 0.1 to 600", args.seconds);
    }
    let body = Body::of(corpus)?;
    let model = Bilinear::of(corpus, &body, action, from).with_context(place)?;
    let known = model.speeds_of(&weights);
    let speed = args.speed.unwrap_or(known[1]);
    let cycle = model.cycle(&weights, speed, 0.0).with_context(|| format!("--style {}", args.style))?;
    // Away from the data, the speed called slow may be the highest.
    let slow = known.iter().copied().fold(f64::INFINITY, f64::min);
    let fast = known.iter().copied().fold(0.0, f64::max);
    if !(slow..=fast).contains(&speed) {
        super::note(format_args!(
            "--speed {speed}: {} walks at {slow:.2} to {fast:.2} m/s in the data; its steps are {:.2} times as quick",
            args.style, cycle.cadence
        ));
    }
    let clip = cycle.walk(&body, args.seconds, corpus.rate_hz);
    let text = Bvh::from_clip(&clip, Unit::Centimetres)?.to_text();
    open::write(&args.output, text)?;
    let frames = clip.frames.len();
    args.report.print(
        || json!({
            "frames": frames, "seconds": clip.duration_s(), "speed_m_s": cycle.speed_m_s(), "speeds_m_s": known,
            "cadence": cycle.cadence,
            "styles": corpus.styles, "weights": weights, "style_explained": model.explained[0],
            "speed_explained": model.explained[1], "output": super::shown(&args.output),
        }),
        || {
        let known: Vec<String> = known.iter().map(|v| format!("{v:.2}")).collect();
        format!(
            "{}: {frames} frames at {speed:.2} m/s; {} walks at {} m/s in the data (slow, medium, fast)",
            args.output.display(),
            args.style,
            known.join(", ")
        )
    })
}
