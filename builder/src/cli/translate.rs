//! `gestus translate`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_builder::{
    trace::Trace,
    translate::{Input, Wish, figures, timing, translate},
    view,
};
use gestus_core::{Config, regress::Ridge};
use serde_json::json;

/// Translate a clip into another style.
#[derive(clap::Args)]
pub struct Args {
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

/// Style, labels and parameters, in words.
#[derive(clap::Args, Clone)]
pub struct WishArgs {
    /// Output style: a name, or weights a=1,b=2, which are brought to sum 1
    #[arg(long)]
    style: String,
    /// The input's action, where it is known
    #[arg(long)]
    action: Option<String>,
    /// The input's style, where it is known
    #[arg(long)]
    input_style: Option<String>,
    /// The method: mar, the mixture of autoregressive models
    #[arg(long, default_value = "mar")]
    method: String,
    /// Output time: free (poses keep their predicted times) or sync (one pose a tick)
    #[arg(long, default_value = "free")]
    timing: String,
    /// Leave feet as they come out (they are not locked yet in any case)
    #[arg(long)]
    no_contact: bool,
    /// Joint groups that the search leaves out: body, left-arm, right-arm
    #[arg(long, value_delimiter = ',')]
    mask: Vec<String>,
    /// Strength of the style in a joint group, left-arm=0.5
    #[arg(long, value_delimiter = ',')]
    strength: Vec<String>,
    /// Named parameters to start from: default, paper
    #[arg(long, default_value = "default")]
    preset: String,
    /// Neighbors a class
    #[arg(long)]
    k: Option<u16>,
    /// Weight of the ridge
    #[arg(long)]
    lambda: Option<f32>,
    /// Variables of the ridge: raw or norm
    #[arg(long)]
    ridge: Option<String>,
    /// Width of the mixing kernel
    #[arg(long)]
    delta: Option<f32>,
    /// Weight of classes that may be dropped
    #[arg(long)]
    prune: Option<f32>,
    /// Half width of the interval of trust, in standard deviations
    #[arg(long)]
    kappa: Option<f32>,
    /// How much of what lies outside is kept
    #[arg(long)]
    rho: Option<f32>,
}

impl WishArgs {
    /// The wish, with its parameters checked for their names.
    pub fn wish(&self) -> Result<Wish> {
        if self.method != "mar" {
            bail!("--method {}: this version has mar", self.method);
        }
        let policy =
            timing(&self.timing).with_context(|| format!("--timing {}: free or sync", self.timing))?;
        let mut config = match self.preset.as_str() {
            "default" => Config::new(),
            "paper" => Config::paper(),
            other => bail!("--preset {other}: default or paper"),
        }
        .timing(policy);
        if let Some(ridge) = &self.ridge {
            config = match ridge.as_str() {
                "raw" => config.ridge(Ridge::Raw),
                "norm" => config.ridge(Ridge::Normalised).lambda(1.0),
                other => bail!("--ridge {other}: raw or norm"),
            };
        }
        config = self.k.map_or(config, |v| config.k(v));
        config = self.lambda.map_or(config, |v| config.lambda(v));
        config = self.delta.map_or(config, |v| config.delta(v));
        config = self.prune.map_or(config, |v| config.prune(v));
        config = self.kappa.map_or(config, |v| config.kappa(v));
        config = self.rho.map_or(config, |v| config.rho(v));
        Ok(Wish {
            style: self.style.clone(),
            action: self.action.clone(),
            input_style: self.input_style.clone(),
            mask: self.mask.clone(),
            strength: self.strength.clone(),
            config,
        })
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let bytes = super::read_blob(&args.db)?;
    let database = super::open(&args.db, &bytes)?;
    let input = Input::read(&args.input, &database)?;
    for note in input.binding.notes() {
        eprintln!("{}: {note}", args.input.display());
    }
    let request = args.wish.wish()?.request(&database)?;
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
        let title = format!("{} in the style {}", input.clip.name, args.wish.wish()?.style);
        let scene = view::Scene { title, input: &input.mapped, streamed: &streamed };
        std::fs::write(path, view::page(&database, "Gestus", &[scene])?)
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    let mut figures = figures(&streamed);
    figures["output_frames"] = json!(output.frames.len());
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
