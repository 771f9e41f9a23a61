//! `gestus evaluate`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_builder::{
    build::BuildOptions,
    effort::{fragment::Library, labels, model::Model},
    evaluate::{
        Evaluation, ablation, comparison, compression, contacts, correspondence, effort, knn, loo, retarget,
        servo, skate, timing,
    },
    load::load,
};
use gestus_core::retime::Bounds;
use serde_json::json;

use super::build::Selection;

/// Measure: errors, ablations, search, compression.
#[derive(clap::Args)]
pub struct Args {
    /// What to measure: loo, exact (pairs made by rule, whose answer is known), ablation, knn, compression,
    /// methods (all of them side by side), correspondence, effort, gaussian-process (its accuracy, time and memory as
    /// the data grows), retarget (other skeletons through --db and back), contacts (which foot stands), skate (how far
    /// standing feet slide), timing (the output's time), servo (a robot that does the motion)
    what: String,
    /// Folder of BVH files
    #[arg(long)]
    data: PathBuf,
    #[command(flatten)]
    selection: Selection,
    /// Style of the test clips; `normal` or `neutral` where left out
    #[arg(long)]
    from: Option<String>,
    /// Output styles, u,v; all others where left out
    #[arg(long, value_delimiter = ',')]
    to: Vec<String>,
    /// Test clips an action
    #[arg(long, default_value_t = 2)]
    folds: usize,
    /// Efforts that people gave, for `effort`: a filled-in table of `gestus effort sheet`; estimates where left out
    #[arg(long)]
    labels: Option<PathBuf>,
    /// Random splits, for `effort`
    #[arg(long, default_value_t = 500)]
    splits: usize,
    /// Gaussian process regression among the methods of `loo`: it takes seconds a fold
    #[arg(long)]
    gaussian_process: bool,
    /// A database to judge, where one is judged rather than built
    #[arg(long)]
    db: Option<PathBuf>,
    /// timing: most seconds by which a pose may come early
    #[arg(long, default_value_t = 0.2)]
    lead: f32,
    /// timing: most seconds by which a pose may come late
    #[arg(long, default_value_t = 0.2)]
    lag: f32,
    /// The robot of `servo`, a URDF file; the toy that comes with the project where left out
    #[arg(long)]
    robot: Option<PathBuf>,
    /// What the robot's joint names don't say, as TOML
    #[arg(long, requires = "robot")]
    robot_map: Option<PathBuf>,
    /// Folder for tables, plots and the report
    #[arg(short, long)]
    output: PathBuf,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    if ["retarget", "servo"].contains(&args.what.as_str()) {
        return on_database(args);
    }
    let config = args.selection.config(Some(&args.data), None)?;
    let loaded = load(&config)?;
    for note in &loaded.notes {
        eprintln!("{note}");
    }
    let corpus = &loaded.corpus;
    let style = |name: &str| {
        corpus.styles.iter().position(|s| s == name).with_context(|| {
            format!("{} has no style `{name}`: it has {}", args.data.display(), corpus.styles.join(", "))
        })
    };
    let from = match &args.from {
        Some(name) => style(name)?,
        None => ["normal", "neutral"].iter().find_map(|n| style(n).ok()).unwrap_or(0),
    };
    let to = if args.to.is_empty() {
        (0..corpus.styles.len()).filter(|&s| s != from).collect()
    } else {
        args.to.iter().map(|n| style(n)).collect::<Result<Vec<_>>>()?
    };
    if args.folds == 0 {
        bail!("--folds 0: at least one test clip an action");
    }
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("{} can't be made", args.output.display()))?;
    let options = loo::LooOptions {
        from,
        to,
        folds: args.folds,
        // Models are built by those measures that look at them.
        build: BuildOptions { models: false, ..config.build.clone() },
        configs: loo::default_configs(),
        mixtures_only: false,
        exact: false,
        gaussian_process: args.gaussian_process,
    };
    let evaluation: Evaluation = match args.what.as_str() {
        "loo" => loo::evaluate(corpus, &options)?,
        "exact" => loo::exact(corpus, &options)?,
        "ablation" => ablation::evaluate(corpus, &options)?,
        "knn" => knn::evaluate(corpus, &options)?,
        "compression" => compression::evaluate(corpus, &options)?,
        "methods" => comparison::evaluate(corpus, &options)?,
        "contacts" => contacts::evaluate(corpus, &options)?,
        "skate" => skate::evaluate(corpus, &options)?,
        "timing" => timing::evaluate(corpus, &options, Bounds { lead_s: args.lead, lag_s: args.lag })?,
        "correspondence" => correspondence::evaluate(corpus, from)?,
        "effort" => {
            let given = match &args.labels {
                Some(path) => {
                    let rows = labels::read(path, corpus.rate_hz)?;
                    Some(Model::given(&rows, &path.display().to_string(), |spans| {
                        Library::annotated(corpus, spans)
                    })?)
                }
                None => None,
            };
            effort::evaluate(
                corpus,
                &effort::EffortOptions { loo: &options, given, splits: args.splits.max(1) },
            )?
        }
        "gaussian-process" => loo::growth(corpus, &options)?,
        other => bail!(
            "`{other}` is not measured by this version: loo, exact, ablation, knn, compression, methods, \
             correspondence, effort, gaussian-process, retarget, contacts, skate, timing, servo"
        ),
    };
    say(args, &evaluation)
}

/// What judges a database with clips of any skeleton.
fn on_database(args: &Args) -> Result<()> {
    let Some(path) = &args.db else { bail!("evaluate {} judges a database: give --db DB.gestus", args.what) };
    let bytes = super::read_blob(path)?;
    let database = super::open(path, &bytes)?;
    std::fs::create_dir_all(&args.output)
        .with_context(|| format!("{} can't be made", args.output.display()))?;
    let evaluation = match args.what.as_str() {
        "servo" => servo::evaluate(&database, &args.data, args.robot.as_deref(), args.robot_map.as_deref())?,
        _ => retarget::evaluate(&database, &args.data)?,
    };
    say(args, &evaluation)
}

fn say(args: &Args, evaluation: &Evaluation) -> Result<()> {
    evaluation.write(&args.output)?;
    if args.json {
        super::say(json!({ "what": args.what, "rows": evaluation.rows }))?;
    } else {
        super::say(format_args!("{}", evaluation.summary()))?;
        super::say(format_args!("tables, plots and the report are in {}", args.output.display()))?;
    }
    Ok(())
}
