//! `gestus evaluate`.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use anyhow::{Context, Result, bail};
use clap::ValueEnum;
use gestus_database::{
    build::BuildOptions,
    command_line::options::ReportArgs,
    data_folder::split::{Set, Split},
    list,
};
use gestus_evaluate::{
    evaluation::Evaluation,
    experiment::Experiment,
    measures::{
        OnClips, OnDatabase, Uses, ablation, bilinear, comparison, compression, contacts, correspondence,
        cost, cross, deviations, effort, field, growth, knn, literal, loo, papers, retarget, servo, sheets,
        skate, starts, timing, transfer, transitions,
    },
};

use super::{
    open,
    selection::{ClassArgs, FrameArgs, GroupArgs, Selection},
};

/// Measure accuracy, timing, contacts, search, size and more.
#[derive(clap::Args)]
pub struct Args {
    #[command(subcommand)]
    measure: Measure,
}

macro_rules! measures {
    ($($(#[doc = $doc:literal])* $Measure:ident($Args:ty),)*) => {
        /// What is measured.
        // Parsed once: the size of a variant does not matter.
        #[allow(clippy::large_enum_variant)]
        #[derive(clap::Subcommand)]
        enum Measure {
            $($(#[doc = $doc])* $Measure($Args),)*
        }

        /// Runs the command.
        pub fn run(args: &Args) -> Result<()> {
            match &args.measure {
                $(Measure::$Measure(measure) => measure.run(),)*
            }
        }
    };
}

measures! {
    /// Leave one clip out: pose and timing errors of every method
    Loo(Clips<loo::Args>),
    /// Pairs made by rule, whose true answer is known
    Exact(Clips<loo::ExactArgs>),
    /// One parameter changed at a time
    Ablation(Clips<ablation::Args>),
    /// Recall, visits and time of the search
    Knn(Clips<knn::Args>),
    /// Where the core differs from Xia 2015, compared with the paper's own way: eq. 1, neighbors for timing and contacts
    Literal(Clips<literal::Args>),
    /// Bytes a frame against joint error
    Compression(Clips<compression::Args>),
    /// All methods side by side, with a verdict in words
    Methods(Clips<comparison::Args>),
    /// How well clips of different styles are aligned in time
    Correspondence(Clips<correspondence::Args>),
    /// Cycles of the bilinear model at speeds that it has not seen
    Bilinear(Clips<bilinear::Args>),
    /// Time of a frame by stage on this machine, and size of the database
    Cost(Clips<cost::Args>),
    /// How well Effort is learned, segmented and dialled
    Effort(Clips<effort::Args>),
    /// Gaussian processes: accuracy, time and memory as the data grows
    GaussianProcess(Clips<growth::Args>),
    /// How well standing feet are recognised
    Contacts(Clips<contacts::Args>),
    /// How fast standing feet slide
    Skate(Clips<skate::Args>),
    /// Joint speeds in the first second of a stream and after a change
    Starts(Clips<starts::Args>),
    /// Motion of actions that the database lacks: is the output worse than the input, and does the report say so
    Cross(Clips<cross::Args>),
    /// Walks that step over something, duck or lean back: how much is kept, and how fast the output recovers
    Deviations(Clips<deviations::Args>),
    /// Measures of other papers: recognition by classifiers, Fréchet distance, skating ratio, jerk
    Field(Clips<field::Args>),
    /// Sheets of drawn poses: styles over a polygon, inputs with their neighbors
    Sheets(Clips<sheets::Args>),
    /// The output's time under each timing policy
    Timing(Clips<timing::Args>),
    /// Statistics of joints: the paper's reverse time warp, its times, and where Euler angles fail
    Transfer(Clips<transfer::Args>),
    /// Streams of many actions by a motion graph: error after transitions, recognition
    Transitions(Clips<transitions::Args>),
    /// The tables and figures of the papers, with their own numbers beside ours
    Papers(Clips<papers::Args>),
    /// Clips of other skeletons to the database of --db and back
    Retarget(OfDatabase<retarget::Args>),
    /// A robot that follows the clips of --data, on the body of --db: limits, tracking, hands and feet
    Servo(OfDatabase<servo::Args>),
}

/// Options of every measure.
#[derive(clap::Args)]
struct Common {
    /// Folder of clips
    #[arg(long)]
    data: PathBuf,
    /// Folder for tables, plots and the report
    #[arg(short, long)]
    output: PathBuf,
    #[command(flatten)]
    report: ReportArgs,
    #[command(flatten)]
    classes: ClassArgs,
    /// Style of the test clips; default: `normal` or `neutral`, or else the first
    #[arg(long)]
    from: Option<String>,
    /// Output styles, u,v; default: all others
    #[arg(long, value_delimiter = ',')]
    to: Vec<String>,
    /// Test clips of each action; default: 2
    #[arg(long)]
    folds: Option<usize>,
    /// File that assigns clips to the sets `development` and `test`. Test and truth clips come from --set; --folds limits
    /// their number
    #[arg(long, requires = "set")]
    split: Option<PathBuf>,
    /// The set of --split to measure. `development` leaves the clips of the test set out of everything
    #[arg(long, requires = "split")]
    set: Option<Set>,
    /// The database
    #[arg(long)]
    db: Option<PathBuf>,
}

impl Common {
    /// Writes the report and prints the result.
    fn report(&self, evaluation: &Evaluation, of: &serde_json::Value) -> Result<()> {
        evaluation.write(&self.output, of)?;
        self.report.print(
            || evaluation.to_json(of),
            || {
                format!(
                    "{}\ntables, plots and the report are in {}",
                    evaluation.summary(),
                    self.output.display()
                )
            },
        )
    }
}

/// Says which of the options were given and have no effect, where each comes with whether it is given and whether it is
/// used: one command line can serve several measures.
fn note_unused<'a>(options: impl IntoIterator<Item = (&'a str, bool, bool)>) {
    for (option, given, used) in options {
        if given && !used {
            super::note(format_args!("{option} has no effect on this measure"));
        }
    }
}

/// A measure of clips.
// Accepted, since one command line can serve several measures.
#[derive(clap::Args)]
#[command(mut_arg("db", |a| a.hide(true)))]
struct Clips<M: OnClips> {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    groups: GroupArgs,
    #[command(flatten)]
    measure: M,
}

impl<M: OnClips> Clips<M> {
    fn run(&self) -> Result<()> {
        let Self { common, groups, measure, .. } = self;
        let uses = measure.uses();
        note_unused([
            ("--from", common.from.is_some(), uses.from),
            ("--to", !common.to.is_empty(), uses.to),
            ("--folds", common.folds.is_some(), uses.folds),
            ("--split", common.split.is_some(), uses.folds),
            ("--groups", groups.is_given(), uses.groups),
            ("--db", common.db.is_some(), false),
        ]);
        measure.check(&common.output)?;
        let experiment = self.experiment()?;
        open::make_folder(&common.output)?;
        let evaluation = measure.evaluate(&experiment)?;
        if evaluation.rows.is_empty() {
            bail!("{}: nothing was measured: {}", common.data.display(), why_nothing(&experiment, uses));
        }
        let mut of = experiment.described();
        of["set"] = common
            .set
            .and_then(|set| set.to_possible_value())
            .map(|value| value.get_name().to_owned())
            .into();
        common.report(&evaluation, &of)
    }

    /// The clips that were selected, and which of them are held out.
    fn experiment(&self) -> Result<Experiment> {
        let common = &self.common;
        let selection = Selection { classes: common.classes.clone(), frames: self.frames.clone() };
        let (config, loaded) = selection.load(&common.data)?;
        let corpus = &loaded.corpus;
        let style =
            |name: &String| corpus.style(name.trim()).with_context(|| common.data.display().to_string());
        let Uses { from, to, folds, .. } = self.measure.uses();
        let from = common.from.as_ref().filter(|_| from).map(style).transpose()?;
        let from = from.unwrap_or_else(|| corpus.plain_style());
        let to = if common.to.is_empty() || !to {
            (0..corpus.styles.len()).filter(|&s| s != from).collect()
        } else {
            list::check_once(common.to.iter().map(String::as_str)).context("--to")?;
            common.to.iter().map(style).collect::<Result<Vec<_>>>()?
        };
        if to.contains(&from) {
            let from = &corpus.styles[from];
            bail!("--to {from}: that is the style of the test clips (--from): leave it out");
        }
        // Measures that need models build them.
        let mut build = BuildOptions { models: false, ..config.build };
        self.groups.apply(&mut build)?;
        let experiment = Experiment { from, to, folds: 2, ..Experiment::new(loaded.corpus, build) };
        let split = common.split.as_ref().zip(common.set).filter(|_| folds);
        let mut experiment = match split {
            Some((file, set)) => on_set(experiment, file, set)?,
            None => experiment,
        };
        if let Some(folds) = common.folds {
            experiment.folds = folds;
        }
        if folds {
            if experiment.folds == 0 {
                bail!("--folds 0: at least one test clip of each action");
            }
            note_few(&experiment);
        }
        Ok(experiment)
    }
}

/// An experiment on one set of a split.
fn on_set(experiment: Experiment, file: &Path, set: Set) -> Result<Experiment> {
    let experiment = experiment.on(&Split::read(file)?, set)?;
    if experiment.among.as_ref().is_some_and(BTreeSet::is_empty) {
        bail!(
            "{}: no clip of the folder is in this set: do its patterns fit the files' names?",
            file.display()
        );
    }
    Ok(Experiment { folds: experiment.max_tests(), ..experiment })
}

/// A measure of an existing database.
// What chooses clips for a database is accepted, since one command line can serve several measures.
#[derive(clap::Args)]
#[command(
    mut_arg("actions", |a| a.hide(true)),
    mut_arg("styles", |a| a.hide(true)),
    mut_arg("from", |a| a.hide(true)),
    mut_arg("to", |a| a.hide(true)),
    mut_arg("folds", |a| a.hide(true)),
    mut_arg("split", |a| a.hide(true)),
    mut_arg("set", |a| a.hide(true)),
    mut_arg("joints", |a| a.hide(true)),
    mut_arg("rate", |a| a.hide(true)),
    mut_arg("limit", |a| a.hide(true)),
    mut_arg("strict", |a| a.hide(true)),
    mut_arg("groups", |a| a.hide(true))
)]
struct OfDatabase<M: OnDatabase> {
    #[command(flatten)]
    common: Common,
    #[command(flatten)]
    frames: FrameArgs,
    #[command(flatten)]
    groups: GroupArgs,
    #[command(flatten)]
    measure: M,
}

impl<M: OnDatabase> OfDatabase<M> {
    fn run(&self) -> Result<()> {
        let Self { common, frames, groups, .. } = self;
        let given = [
            ("--actions", !common.classes.actions.is_empty()),
            ("--styles", !common.classes.styles.is_empty()),
            ("--from", common.from.is_some()),
            ("--to", !common.to.is_empty()),
            ("--folds", common.folds.is_some()),
            ("--split", common.split.is_some()),
            ("--groups", groups.is_given()),
        ];
        let given = given.into_iter().chain(frames.given());
        note_unused(given.map(|(option, given)| (option, given, false)));
        let path = common.db.as_ref().context("this measures a database: give --db DB.gestus")?;
        let bytes = open::read_blob(path)?;
        let database = open::open(path, &bytes)?;
        open::make_folder(&common.output)?;
        let of = serde_json::json!({ "database": format!("{:08x}", database.identity()) });
        common.report(&self.measure.evaluate(&database, &common.data)?, &of)
    }
}

/// Names the actions that have fewer test clips than were asked for.
fn note_few(experiment: &Experiment) {
    let Experiment { corpus, from, folds, .. } = experiment;
    let tests = experiment.test_clips();
    for (action, name) in corpus.actions.iter().enumerate() {
        let have = tests.iter().filter(|&&i| corpus.examples[i].action == action).count();
        if have < *folds {
            super::note(format_args!(
                "--folds {folds}: {name} has {have} clips in the style {}",
                corpus.styles[*from]
            ));
        }
    }
}

/// Why no fold is left.
fn why_nothing(experiment: &Experiment, uses: Uses) -> String {
    let from = &experiment.corpus.styles[experiment.from];
    if uses.to && experiment.to.is_empty() {
        return format!("{from} is the only style, and there is none to translate to (--styles, --to)");
    }
    if experiment.test_clips().is_empty() {
        return format!("no clip is in the style {from} (--from)");
    }
    "without a test clip and its truth, a clip of the action has to be left in each style: use more clips, or fewer styles"
        .into()
}
