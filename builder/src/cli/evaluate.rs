//! `gestus evaluate`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use gestus_core::{Database, output::retime::Bounds};
use gestus_database::{
    build::BuildOptions,
    data_folder::load::load,
    effort::{fragment::Library, labels, model::Model},
};
use gestus_evaluate::{
    evaluation::Evaluation,
    fold::{LooOptions, test_clips},
    measures::{
        ablation, comparison, compression, contacts, correspondence, effort, growth, knn, loo, retarget,
        servo, skate, timing,
    },
};
use gestus_motion::corpus::Corpus;
use serde_json::json;

use super::build::Selection;
use super::open;

/// Most lead and lag, seconds.
const MOST_BOUND_S: f32 = 10.0;

/// What can be measured.
#[derive(clap::ValueEnum, Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    /// Leave one clip out: pose and timing errors of every method
    Loo,
    /// Pairs made by rule, whose answer is known
    Exact,
    /// Each parameter by itself
    Ablation,
    /// Recall and visits of the search
    Knn,
    /// Bytes a frame against joint error
    Compression,
    /// All methods side by side, in words too
    Methods,
    /// What warping makes of pairs of clips
    Correspondence,
    /// Efforts learned, segmented and dialled
    Effort,
    /// Gaussian processes: accuracy, time and memory as the data grows
    GaussianProcess,
    /// Which foot stands
    Contacts,
    /// How far standing feet slide
    Skate,
    /// The output's time
    Timing,
    /// Other skeletons through --db and back
    Retarget,
    /// A robot that does what comes out of --db
    Servo,
}

impl What {
    /// The word for it.
    fn name(self) -> String {
        self.to_possible_value().map(|v| v.get_name().to_owned()).unwrap_or_default()
    }

    /// Whether it judges a database that is there, with clips of any skeleton; others build theirs of the folder.
    fn on_database(self) -> bool {
        matches!(self, What::Retarget | What::Servo)
    }

    /// Whether it holds out clips of one style and looks at what they become in others.
    fn translates(self) -> bool {
        use What::{Ablation, Contacts, GaussianProcess, Loo, Methods, Skate, Timing};
        matches!(self, Loo | Ablation | Methods | GaussianProcess | Contacts | Skate | Timing)
    }

    /// Whether an option, by the name of its argument, does anything in this measure.
    fn takes(self, option: &str) -> bool {
        match option {
            "actions" | "styles" | "joints" | "rate" | "limit" | "strict" => !self.on_database(),
            "groups" => !self.on_database() && self != What::Correspondence,
            "from" => !self.on_database() && self != What::Compression,
            "to" => self.translates(),
            "folds" => self.translates() || matches!(self, What::Exact | What::Knn | What::Effort),
            "db" => self.on_database(),
            "labels" | "splits" => self == What::Effort,
            "gaussian_process" => matches!(self, What::Loo | What::Exact | What::Methods),
            "lead" | "lag" => self == What::Timing,
            "robot" | "robot_map" => self == What::Servo,
            _ => true,
        }
    }
}

/// Options that every measure can be called with, so that one line does for several: where one of them does nothing, that
/// is said and no more.
const COMMON: [&str; 6] = ["actions", "styles", "from", "to", "folds", "db"];

/// Says which of the options that were given do nothing in this measure, and refuses those that nobody gives by habit.
fn check_use(what: What, given: &[String]) -> Result<()> {
    let name = what.name();
    for option in given.iter().map(String::as_str).filter(|option| !what.takes(option)) {
        let words = option.replace('_', "-");
        if !COMMON.contains(&option) {
            let takers = What::value_variants().iter().filter(|w| w.takes(option));
            let takers = takers.map(|w| w.name()).collect::<Vec<_>>().join(", ");
            bail!("--{words} does nothing in {name}: leave it out (it is for {takers})");
        }
        let why = match option {
            "db" => ": it builds its own",
            "actions" | "styles" => ": it takes every clip of the folder",
            _ => "",
        };
        eprintln!("--{words} is not used by {name}{why}");
    }
    Ok(())
}

/// Measure: errors, ablations, search, compression.
#[derive(clap::Args)]
pub struct Args {
    /// What to measure
    what: What,
    /// Folder of BVH and glTF files
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

/// Runs the command. `given` are the arguments that were said, by name.
pub fn run(args: &Args, given: &[String]) -> Result<()> {
    check_use(args.what, given)?;
    for (option, seconds) in [("--lead", args.lead), ("--lag", args.lag)] {
        if !(0.0..=MOST_BOUND_S).contains(&seconds) {
            bail!("{option} {seconds}: seconds from 0 to {MOST_BOUND_S}");
        }
    }
    // Hours of looking go into such a table; the measure of that name writes one beside its report.
    let table = args.output.join("effort.csv");
    let there = Some(&table).filter(|_| args.output.is_dir());
    super::check_outputs([args.labels.as_ref()], [("-o", there)])?;
    let evaluation = match args.what {
        What::Loo => on_corpus(args, |c, o| Ok(loo::evaluate(c, o)?)),
        What::Exact => on_corpus(args, |c, o| Ok(loo::exact(c, o)?)),
        What::Ablation => on_corpus(args, |c, o| Ok(ablation::evaluate(c, o)?)),
        What::Knn => on_corpus(args, knn::evaluate),
        What::Compression => on_corpus(args, |c, o| Ok(compression::evaluate(c, o)?)),
        What::Methods => on_corpus(args, |c, o| Ok(comparison::evaluate(c, o)?)),
        What::Contacts => on_corpus(args, |c, o| Ok(contacts::evaluate(c, o)?)),
        What::Skate => on_corpus(args, |c, o| Ok(skate::evaluate(c, o)?)),
        What::Timing => {
            let bounds = Bounds { lead_s: args.lead, lag_s: args.lag };
            on_corpus(args, |c, o| timing::evaluate(c, o, bounds))
        }
        What::Correspondence => on_corpus(args, |c, o| Ok(correspondence::evaluate(c, o.from)?)),
        What::Effort => on_corpus(args, |c, o| efforts(args, c, o)),
        What::GaussianProcess => on_corpus(args, |c, o| Ok(growth::growth(c, o)?)),
        What::Retarget => on_database(args, |db| retarget::evaluate(db, &args.data)),
        What::Servo => on_database(args, |db| {
            servo::evaluate(db, &args.data, args.robot.as_deref(), args.robot_map.as_deref())
        }),
    }?;
    say(args, &evaluation)
}

/// What judges databases that it builds of the folder.
fn on_corpus(
    args: &Args,
    measure: impl FnOnce(&Corpus, &LooOptions) -> Result<Evaluation>,
) -> Result<Evaluation> {
    let config = args.selection.config(Some(&args.data), None)?;
    let loaded = load(&config)?;
    for note in &loaded.notes {
        eprintln!("{note}");
    }
    let corpus = &loaded.corpus;
    let style = |name: &str| corpus.style(name).with_context(|| args.data.display().to_string());
    let from = match args.from.as_ref().filter(|_| args.what.takes("from")) {
        Some(name) => style(name.trim())?,
        None => corpus.plain_style(),
    };
    let to = if args.to.is_empty() || !args.what.takes("to") {
        (0..corpus.styles.len()).filter(|&s| s != from).collect()
    } else {
        args.to.iter().map(|n| style(n)).collect::<Result<Vec<_>>>()?
    };
    if args.what.takes("folds") {
        if args.folds == 0 {
            bail!("--folds 0: at least one test clip an action");
        }
        say_few(corpus, from, args.folds);
    }
    make_output(args)?;
    let options = LooOptions {
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
    let evaluation = measure(corpus, &options)?;
    if evaluation.rows.is_empty() {
        bail!("{}: nothing was measured: {}", args.data.display(), why_nothing(corpus, &options));
    }
    Ok(evaluation)
}

/// Names the actions that have fewer test clips than were asked for.
fn say_few(corpus: &Corpus, from: usize, folds: usize) {
    let tests = test_clips(corpus, from, folds);
    for (action, name) in corpus.actions.iter().enumerate() {
        let have = tests.iter().filter(|&&i| corpus.examples[i].action == action).count();
        if have < folds {
            eprintln!("--folds {folds}: {name} has {have} clips in the style {}", corpus.styles[from]);
        }
    }
}

/// Why no fold is left.
fn why_nothing(corpus: &Corpus, options: &LooOptions) -> String {
    let from = &corpus.styles[options.from];
    if options.to.is_empty() {
        return format!("{from} is the only style, and there is none to translate to (--styles, --to)");
    }
    if test_clips(corpus, options.from, options.folds).is_empty() {
        return format!("no clip is in the style {from} (--from)");
    }
    "every test clip and its truth have to leave a clip of the action in each style: use more clips, or fewer styles"
        .into()
}

/// What judges a database with clips of any skeleton.
fn on_database(args: &Args, measure: impl FnOnce(&Database<'_>) -> Result<Evaluation>) -> Result<Evaluation> {
    let path = args.db.as_ref().context("this judges a database: give --db DB.gestus")?;
    let bytes = open::read_blob(path)?;
    let database = open::open(path, &bytes)?;
    make_output(args)?;
    measure(&database)
}

/// Efforts, by the labels that were given.
fn efforts(args: &Args, corpus: &Corpus, options: &LooOptions) -> Result<Evaluation> {
    let given = match &args.labels {
        Some(path) => {
            let rows = labels::read(path, corpus.rate_hz)?;
            let annotated = |spans: &_| Library::annotated(corpus, spans);
            Some(Model::given(&rows, &path.display().to_string(), annotated)?)
        }
        None => None,
    };
    let options = effort::EffortOptions { loo: options, given, splits: args.splits.max(1) };
    Ok(effort::evaluate(corpus, &options)?)
}

/// Made before what takes long.
fn make_output(args: &Args) -> Result<()> {
    std::fs::create_dir_all(&args.output).with_context(|| format!("{} can't be made", args.output.display()))
}

fn say(args: &Args, evaluation: &Evaluation) -> Result<()> {
    evaluation.write(&args.output)?;
    if args.json {
        super::say(json!({ "what": evaluation.what, "rows": evaluation.rows }))?;
    } else {
        super::say(format_args!("{}", evaluation.summary()))?;
        super::say(format_args!("tables, plots and the report are in {}", args.output.display()))?;
    }
    Ok(())
}
