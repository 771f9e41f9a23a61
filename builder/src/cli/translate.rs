//! `gestus translate`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use clap::{ArgMatches, Args as _, Command, parser::ValueSource};
use gestus_core::Database;
use gestus_database::{
    command_line::{
        options::{ClipArgs, ReportArgs},
        outputs::counted,
        stylizer_args::{MethodArgs, StylizerArgs},
    },
    effort::{self, sheet::caveat, synthesize},
    stream::{
        Request, Streamed, Watcher,
        input::{Input, InputOptions},
        trace::Trace,
        translate::{degraded_words, figures, translate, translate_clean},
        verdict::Verdict,
    },
};
use gestus_evaluate::pages::{self, Track, view};
use gestus_motion::{clip::Clip, statistics::mean_or_zero};
use serde_json::{Value, json};

use super::{batch, effort::model, figures::add, open, robot::RobotArgs};

/// Output time over the clip's that is not worth a word.
const OWN_PACE: std::ops::RangeInclusive<f64> = 0.67..=1.5;

/// Translate a clip into another style, or each of several.
#[derive(clap::Args, Clone)]
pub struct Args {
    // First: arguments that are parsed after it are no longer in the matches.
    #[command(flatten)]
    given: Given,
    #[command(flatten)]
    common: CommonArgs,
    #[command(flatten)]
    stylizer_args: StylizerArgs,
    /// Remove foot skate from the whole clip afterwards, with later frames known, instead of locking feet while streaming
    #[arg(long, conflicts_with = "no_contact")]
    clean_up: bool,
    /// The clip is a loop: so is the output. Where its ends do not meet, the longest part of it whose ends do is taken
    #[arg(long = "loop")]
    looped: bool,
    /// File for everything that the steps computed, .npz; of a loop, in all the rounds in which it settles
    #[arg(long)]
    trace: Option<PathBuf>,
    #[command(flatten)]
    robot: RobotArgs,
    /// More clips, as a shell puts them after `--input *.bvh`
    #[arg(value_name = "CLIP")]
    more: Vec<PathBuf>,
}

/// The options that apply with every method. With [`MethodArgs`] they are all that `--method effort` takes.
#[derive(clap::Args, Clone)]
struct CommonArgs {
    /// The database
    #[arg(long)]
    db: PathBuf,
    #[command(flatten)]
    clip: ClipArgs,
    /// The output at the database's rate: BVH, or glTF where the input is, with its meshes and with the ending of its name;
    /// a folder for several clips
    #[arg(short, long)]
    output: PathBuf,
    /// Name of the animation in a glTF output: another one than the input's is added, or replaced if it is there.
    /// Default: the input's is replaced
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    /// Efforts that people gave, for `--method effort`: a filled-in table of `gestus effort sheet` whose clips are in
    /// the database; default: estimates
    #[arg(long)]
    labels: Option<PathBuf>,
    /// A page that shows input and output side by side
    #[arg(long)]
    page: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
}

impl CommonArgs {
    /// Refuses an output that can't be written, and a name without use.
    fn check(&self) -> Result<()> {
        super::check_clip("-o", Some(&self.output), Some(&self.clip.input))?;
        super::check_animation(self.animation.as_deref(), &self.output)
    }

    /// The output in the form of the input.
    fn written(&self, input: &Input, output: &Clip) -> Result<Vec<u8>> {
        input.written(output, &self.output, self.animation.as_deref())
    }
}

/// The options for streams alone that were given with another value than their default, with their dashes.
#[derive(Clone)]
struct Given(Vec<String>);

impl clap::Args for Given {
    fn augment_args(command: Command) -> Command {
        command
    }
    fn augment_args_for_update(command: Command) -> Command {
        command
    }
}

impl clap::FromArgMatches for Given {
    fn from_arg_matches(matches: &ArgMatches) -> Result<Self, clap::Error> {
        let command = <Args as clap::Args>::augment_args(Command::new("translate"));
        let whole = CommonArgs::augment_args(MethodArgs::augment_args(Command::new("whole")));
        let for_streams = |a: &&clap::Arg| whole.get_arguments().all(|other| other.get_id() != a.get_id());
        let given = |a: &&clap::Arg| {
            let id = a.get_id().as_str();
            let plain = a.get_default_values().iter().map(|v| v.as_os_str());
            matches.value_source(id) == Some(ValueSource::CommandLine)
                && !matches.get_raw(id).into_iter().flatten().eq(plain)
        };
        let options = command.get_arguments().filter(for_streams).filter(given);
        Ok(Self(options.filter_map(|a| Some(format!("--{}", a.get_long()?))).collect()))
    }
    fn update_from_arg_matches(&mut self, matches: &ArgMatches) -> Result<(), clap::Error> {
        *self = Self::from_arg_matches(matches)?;
        Ok(())
    }
}

impl Args {
    /// What the stream is asked for. Says on standard error what is doubtful in it.
    fn request(&self, database: &Database<'_>) -> Result<Request> {
        let mut request =
            self.stylizer_args.request(database).with_context(|| self.common.db.display().to_string())?;
        if self.clean_up {
            if request.bounds.is_some() {
                bail!("--clean-up knows later frames, --timing bounded is for streams: give one of them");
            }
            request.config = request.config.contacts(false);
        }
        Ok(request)
    }

    /// Streams the input, and writes the trace if `--trace` is given.
    fn streamed(&self, database: &Database<'_>, input: &Input, request: &Request) -> Result<Streamed> {
        let name = || self.common.db.display().to_string();
        let Some(path) = &self.trace else {
            return self.stream(database, input, request, &mut ()).with_context(name);
        };
        let mut trace = Trace::of(database, request);
        let streamed = self.stream(database, input, request, &mut trace).with_context(name)?;
        trace
            .write(path, database, request)
            .with_context(|| format!("{} can't be written", path.display()))?;
        Ok(streamed)
    }

    /// Streams the input and, if asked to, cleans it up.
    fn stream(
        &self,
        database: &Database<'_>,
        input: &Input,
        request: &Request,
        watcher: &mut impl Watcher,
    ) -> Result<Streamed> {
        if self.clean_up {
            translate_clean(database, input, request, watcher)
        } else {
            translate(database, input, request, watcher)
        }
    }

    /// The page of what was delivered.
    fn page(
        &self,
        database: &Database<'_>,
        input: &Input,
        output: &Clip,
        streamed: &Streamed,
        (request, verdict): (&Request, &Verdict),
    ) -> Result<String> {
        let args = &self.stylizer_args;
        let in_style = || format!("in the style {}", args.style);
        let wanted = args.method.effort.as_ref().map_or_else(in_style, |e| format!("with effort {e}"));
        let scene = view::Scene {
            title: format!("{} {wanted}", input.clip.name),
            words: verdict.sentences().join(" "),
            given: input.shown(&input.clip),
            output: input.shown(output),
            body: &input.mapped.skeleton,
            streamed,
        };
        let known = view::Known::of(request);
        view::page_of(database, "Gestus", &[scene], known)
    }
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let (common, json) = (&args.common, args.common.report.json);
    let inputs: Vec<&PathBuf> = [&common.clip.input].into_iter().chain(&args.more).collect();
    let Some(clips) = batch::clips(&inputs, &common.output)? else {
        let figures = one(args)?;
        return if json { super::say(&figures) } else { Ok(()) };
    };
    batch::refuse(&[
        ("--page", common.page.is_some()),
        ("--trace", args.trace.is_some()),
        ("--robot", args.robot.robot.is_some()),
    ])?;
    batch::run(clips, &common.output, json, |input, output| {
        let mut args = Args { more: Vec::new(), ..args.clone() };
        (args.common.clip.input, args.common.output) = (input.to_owned(), output.to_owned());
        one(&args)
    })
}

/// Refuses options that do nothing, and outputs that would overwrite an input or each other.
fn check(args: &Args) -> Result<()> {
    let (common, robot) = (&args.common, &args.robot);
    robot.check(common.report.json)?;
    let whole_clip = args.stylizer_args.method.is_effort();
    if whole_clip && args.stylizer_args.method.effort.is_none() {
        bail!("--method effort needs a target: give --effort flow=..,weight=..,time=..");
    }
    if whole_clip && !args.given.0.is_empty() {
        bail!(
            "{} would do nothing with --method effort, which rebuilds the whole clip of fragments: leave out these options, \
             or --method",
            args.given.0.join(", ")
        );
    }
    if !whole_clip && common.labels.is_some() {
        bail!("--labels does nothing without --method effort: give both, or neither");
    }
    common.check()?;
    super::check_outputs(
        [Some(&common.db), Some(&common.clip.input), common.clip.map.as_ref(), common.labels.as_ref()]
            .into_iter()
            .chain([robot.robot.as_ref(), robot.robot_map.as_ref()]),
        [("-o", Some(&common.output)), ("--page", common.page.as_ref()), ("--trace", args.trace.as_ref())]
            .into_iter()
            .chain(robot.outputs()),
    )?;
    Ok(())
}

/// Translates one clip, and returns the figures, which are also printed for people without `--json`.
fn one(args: &Args) -> Result<Value> {
    check(args)?;
    let common = &args.common;
    let bytes = open::read_blob(&common.db)?;
    let database = open::open(&common.db, &bytes)?;
    let machine = args.robot.machine(&database)?;
    let reading = InputOptions { looped: args.looped, ..common.clip.reading()? };
    let input = Input::read_with(&common.clip.input, &database, &reading)?;
    super::tell(&common.clip.input, input.notes());
    let method = &args.stylizer_args.method;
    if let Some(wanted) = method.effort.as_ref().filter(|_| method.is_effort()) {
        return whole(common, wanted, &database, &input);
    }
    let request = args.request(&database)?;
    let streamed = args.streamed(&database, &input, &request)?;
    let mut verdict = Verdict::of(&database, &input, &request, &streamed);
    verdict.note_same_style(&database, &request);
    let output = input.output(&streamed);
    open::write(&common.output, common.written(&input, &output)?)?;
    if let Some(path) = &common.page {
        open::write(path, args.page(&database, &input, &output, &streamed, (&request, &verdict))?)?;
    }
    let mut figures = figures(&streamed);
    figures["output_frames"] = json!(output.frames.len());
    if let Some(machine) = &machine {
        figures["robot"] = args.robot.run(machine, &input, &streamed)?;
    }
    figures["retargeted"] = json!(input.retarget().is_some());
    figures["verdict"] = verdict.json();
    add(&mut figures, input.json());
    let (before, after) = (input.clip.duration_s(), figures["seconds"].as_f64().unwrap_or(0.0));
    if before > 0.0 && !OWN_PACE.contains(&(after / before)) {
        super::note(format_args!(
            "{}: {before:.1} s became {after:.1} s, since poses come at the times of their style; `--timing bounded` stays \
             near the clip's time, `--timing sync` in it",
            common.clip.input.display()
        ));
    }
    if !common.report.json {
        super::say(format_args!(
            "{}: {} in, {} out; {:.0} us a frame (median), {:.1} classes, {}, digest {}",
            common.output.display(),
            counted(streamed.steps.len(), "frame"),
            output.frames.len(),
            figures["median_us"].as_f64().unwrap_or(0.0),
            figures["classes_mean"].as_f64().unwrap_or(0.0),
            degraded_words(&figures),
            figures["digest"].as_str().unwrap_or("")
        ))?;
        if let Some(round) = input.round() {
            super::say(round)?;
        }
        super::say(verdict.sentences().join("\n"))?;
    }
    Ok(figures)
}

/// The whole clip, rebuilt of blended fragments of the database (Torresani 2006).
fn whole(args: &CommonArgs, wanted: &str, database: &Database<'_>, input: &Input) -> Result<Value> {
    let factors = effort::parse(wanted).map_err(|e| anyhow::anyhow!("--effort: {e}"))?;
    let start = std::time::Instant::now();
    let model = model(database, &args.db, args.labels.as_deref())?;
    let output = synthesize::translate(&model, &input.mapped, &factors);
    let clip = input.carried(&output.frames, &output.sources);
    open::write(&args.output, args.written(input, &clip)?)?;
    let library = &model.library;
    if let Some(path) = &args.page {
        let (given, delivered) = (input.shown(&input.clip), input.shown(&clip));
        let scene = pages::Scene {
            title: format!("{} with effort {wanted}", input.clip.name),
            subtitle: caveat(model.source).into(),
            tracks: vec![Track::of("input", &given, &[]), Track::of("output", &delivered, &[])],
            ..pages::Scene::default()
        };
        open::write(path, pages::render(&scene.into()))?;
    }
    let name = |i: usize| {
        let f = &library.fragments[i];
        json!({ "clip": f.span.clip, "from": f.span.from, "to": f.span.to, "style": library.styles[f.style] })
    };
    let mean: [f64; 3] = std::array::from_fn(|k| mean_or_zero(output.choices.iter().map(|c| c.effort[k])));
    let mut figures = json!({
        "method": "effort",
        "frames": input.mapped.frames.len(),
        "output_frames": clip.frames.len(),
        "labels": model.source.name(),
        "wanted": factors,
        "predicted": mean,
        "seconds": start.elapsed().as_secs_f64(),
        "fragments": library.fragments.len(),
        "snippets": output.choices.iter().map(|c| json!({
            "from": c.snippet.from, "to": c.snippet.to, "recognised": name(c.snippet.fragment),
            "first": name(c.first), "second": name(c.second), "alpha": c.alpha, "predicted": c.effort,
        })).collect::<Vec<_>>(),
    });
    add(&mut figures, input.json());
    if !args.report.json {
        super::say(format_args!(
            "{}: {} in, {} out, {}; predicted flow {:.2}, weight {:.2}, time {:.2} ({})",
            args.output.display(),
            counted(input.mapped.frames.len(), "frame"),
            clip.frames.len(),
            counted(output.choices.len(), "snippet"),
            mean[0],
            mean[1],
            mean[2],
            caveat(model.source)
        ))?;
    }
    Ok(figures)
}
