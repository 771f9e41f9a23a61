//! `gestus-sim board`.

use std::{
    num::NonZero,
    path::{Path, PathBuf},
    time::Instant,
};

use anyhow::{Context, Result, bail};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use gestus_core::{Database, Method};
use gestus_database::{
    command_line::{
        blob,
        lenient::Trimmed,
        options::ReportArgs,
        outputs::{check_outputs, note, say},
        progress,
    },
    stream::Request,
    synth::STYLES,
};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::{
    boards::{self, BOARDS, Board},
    generated::{Profile, REFERENCE, SMALL, SMALL_NEIGHBORS},
    image,
    measure::{Job, Measured, Replayed, measure, median},
    programs,
};
use crate::{clip_args::StreamArgs, link::command::RobotArgs, recording::Recording};

/// Frames of the long stream.
pub const LONG_FRAMES: usize = 10_000;
/// Frames of the long stream between two changes of its settings.
pub const LONG_CHANGE: usize = 250;
/// Length of a generated clip, seconds.
const SECONDS: f64 = 12.0;
/// The database of the long stream: a small golden file, which is kept as long as its format version.
pub const LONG_BLOB: &[u8] = include_bytes!("../../../tests/golden/blob-v2-legs.gestus");

/// Run the firmware in an emulator, stream a clip through it, and compare every bit with this machine.
#[derive(clap::Args, Debug)]
#[command(
    mut_arg("unit", |unit| unit.requires("input").conflicts_with("generated")),
    mut_arg("floor", |floor| floor.requires("input").conflicts_with("generated")),
    mut_arg("up", |up| up.requires("input").conflicts_with("generated")),
    mut_arg("root", |root| root.requires("input").conflicts_with("generated"))
)]
pub struct BoardArgs {
    #[arg(required_unless_present = "all", conflicts_with = "all", help = format!("The board: {}, or the name of QEMU's machine", boards::names()))]
    name: Option<String>,
    /// Run every board and print a table; m0 gets a small database of its own. With --long-stream, boards that
    /// are too small or too slow for it are left out
    #[arg(long)]
    all: bool,
    /// The database
    #[arg(long, required_unless_present_any = ["generated", "long_stream", "build", "around", "functions"], requires = "input")]
    db: Option<PathBuf>,
    /// The clip, BVH or glTF (`hero.glb#walk` names one of several animations). It is retargeted if its skeleton is not
    /// the database's
    #[arg(long)]
    input: Option<PathBuf>,
    #[command(flatten)]
    stream: StreamArgs,
    /// Use generated motion in place of a database and a clip: 28 classes, or 6 on m0
    #[arg(long, conflicts_with_all = ["db", "input"])]
    generated: bool,
    /// With --generated: stream a clip that leaps to another motion every few frames, the worst case for the search
    #[arg(long, requires = "generated", conflicts_with_all = ["db", "input"])]
    leaps: bool,
    /// In place of a clip, stream 10,000 frames of a small database's own motion with changing settings; the digest is
    /// the same on every machine
    #[arg(long)]
    long_stream: bool,
    /// Stream at most this many frames of the clip
    #[arg(long)]
    frames: Option<NonZero<usize>>,
    /// Use this image, an ELF file for the board, instead of building one
    #[arg(long, conflicts_with = "all")]
    image: Option<PathBuf>,
    /// Build the image with log lines, and write them to BOARD.log next to the images
    #[arg(long, conflicts_with = "image")]
    defmt: bool,
    #[command(flatten)]
    robot: RobotArgs,
    /// Count on m4f the instructions of the work around a step: retargeting both ways, retiming, a robot's servos, the
    /// effort dial
    #[arg(long)]
    around: bool,
    /// Count on m4f or m0 the instructions of elementary functions of libm and micromath, and measure their errors
    #[arg(long)]
    functions: bool,
    /// Build the image with micromath's sine and cosine, and report the joints' difference from this machine, which
    /// uses libm, instead of requiring the same bits
    #[arg(long, conflicts_with = "image")]
    micromath: bool,
    /// Only build the images, and print their paths
    #[arg(long)]
    build: bool,
    /// With --build: include the sizes of stack frames in the ELF file, for a static bound
    #[arg(long, requires = "build")]
    stack_sizes: bool,
    /// With --build: build the smallest firmware, which opens a database and steps, without link and counters
    #[arg(long, requires = "build")]
    least: bool,
    /// Build the image with these methods alone, as the core's features choose them: the others take no flash
    #[arg(long, conflicts_with = "image", value_delimiter = ',', value_name = "METHOD,…", value_parser = Trimmed(PossibleValuesParser::new(Method::NAMES)).try_map(method))]
    methods: Vec<Method>,
    #[command(flatten)]
    report: ReportArgs,
}

impl BoardArgs {
    /// How the images are built; `blob` is the database of an image that contains it.
    fn options<'a>(&'a self, blob: Option<&'a Path>) -> image::Options<'a> {
        image::Options {
            blob,
            defmt: self.defmt,
            stack_sizes: self.stack_sizes,
            micromath: self.micromath,
            robot: self.robot.robot.is_some(),
            program: self.least.then_some("minimal"),
            methods: &self.methods,
            files: &[],
        }
    }
}

/// The method of a name.
fn method(name: String) -> Result<Method> {
    Method::named(&name).with_context(|| format!("there is no method `{name}`"))
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read, a missing emulator or compiler target, a board that ends or refuses a request, and bits
/// that differ.
pub fn run(args: &BoardArgs) -> Result<()> {
    check_outputs(
        [args.db.as_ref(), args.input.as_ref(), args.robot.robot.as_ref()],
        [("--robot-csv", args.robot.robot_csv.as_ref())],
    )?;
    let boards: Vec<&'static Board> = match &args.name {
        Some(name) => vec![boards::find(name)?],
        None => BOARDS.iter().filter(|b| !args.long_stream || b.long_stream).collect(),
    };
    if args.build {
        return build(args, &boards);
    }
    if let [board] = boards[..]
        && (args.around || args.functions)
    {
        let figures = if args.around { programs::around(board)? } else { programs::functions(board)? };
        if args.report.json {
            return say(&figures);
        }
        let mut numbers = figures.as_object().into_iter().flatten();
        return numbers.try_for_each(|(name, numbers)| say(format_args!("{name:16} {numbers}")));
    }
    let (figures, lines, differing) = if args.long_stream {
        let replayed = long_streams(args, &boards)?;
        let differing = replayed.iter().filter(|r| !r.bit_exact()).map(|r| r.board.name).collect();
        let lines = replayed.iter().map(|r| {
            let word = if r.bit_exact() { "bit-exact" } else { "NOT bit-exact" };
            let Replayed { board, frames, digest, seconds, .. } = r;
            format!("{:10} {frames} frames, {word}, digest {digest:08x}, {seconds:.0} s\n", board.name)
        });
        (replayed.iter().map(Replayed::json).collect::<Vec<Value>>(), lines.collect::<String>(), differing)
    } else {
        if args.db.is_none() {
            // Before several boards need them at once.
            boards.iter().try_for_each(|board| profile(board).database().map(drop))?;
        }
        let measured = boards.par_iter().map(|b| clip(args, b)).collect::<Result<Vec<_>>>()?;
        let differing = measured.iter().filter(|m| !m.bit_exact() && !args.micromath);
        let differing: Vec<&str> = differing.map(|m| m.board.name).collect();
        (measured.iter().map(Measured::json).collect(), table(&measured), differing)
    };
    match (&figures[..], args.report.json) {
        ([one], true) if !args.all => say(one)?,
        (_, true) => say(json!({ "boards": figures }))?,
        (_, false) => say(lines.trim_end())?,
    }
    if !differing.is_empty() {
        bail!("not bit-exact with this machine: {}", differing.join(", "));
    }
    Ok(())
}

/// Builds the images and prints their paths.
fn build(args: &BoardArgs, boards: &[&'static Board]) -> Result<()> {
    // A compiler of one image does not keep all processors busy.
    let image_of = |board: &&'static Board| {
        let blob = if board.blob_address.is_none() { Some(SMALL.database()?) } else { None };
        note(format_args!("building the image of {} ({})", board.name, board.title));
        let image = image::build(board, args.options(blob.as_deref()))?;
        Ok((board.name, image::flash_bytes(&image)?, image))
    };
    let images: Vec<(&str, u64, PathBuf)> = boards.par_iter().map(image_of).collect::<Result<_>>()?;
    let mut built = Vec::new();
    for (board, flash_bytes, image) in images {
        if !args.report.json {
            say(format_args!("{board:10} {flash_bytes:>7} bytes of flash  {}", image.display()))?;
        }
        built.push(json!({ "board": board, "image": image, "flash_bytes": flash_bytes }));
    }
    match &built[..] {
        [one] if args.report.json && !args.all => say(one),
        _ if args.report.json => say(json!({ "boards": built })),
        _ => Ok(()),
    }
}

/// What is generated for a board.
const fn profile(board: &Board) -> Profile {
    if board.blob_address.is_some() { REFERENCE } else { SMALL }
}

/// Streams a clip through a board: the given one, or a generated one.
fn clip(args: &BoardArgs, board: &'static Board) -> Result<Measured> {
    let profile = profile(board);
    // Few databases fit a micro:bit.
    let own = args.generated || (args.all && board.blob_address.is_none());
    match (&args.db, &args.input) {
        (Some(path), Some(input)) if !own => {
            let bytes = blob::read(path)?;
            let (database, input, request) = args.stream.open(path, &bytes, input)?;
            let clip = input.mapped;
            let tables = args.robot.read()?;
            let robot = args.robot.open(&tables, &database, image::HINGES)?;
            let flash =
                robot.map(|_| image::write_flash(&bytes, &tables, "with-robot.gestus")).transpose()?;
            let path = flash.as_deref().unwrap_or(path);
            let robot = robot.map(|robot| (robot, &args.robot));
            one(args, board, Job { path, database, clip: &clip, request: &request, robot })
        }
        _ if args.robot.robot.is_some() => {
            bail!("--robot needs the database that the robot's tables were made for: give --db and --input")
        }
        _ => {
            let path = profile.database()?;
            let bytes = blob::read(&path)?;
            let database = blob::open(&path, &bytes)?;
            let clip = if args.leaps { profile.leaping(SECONDS)? } else { profile.clip(SECONDS)? };
            // With --all the settings are those of the --db database, so here they count with --generated only.
            let request = if args.generated { generated(args, board, &database)? } else { Request::style(1) };
            one(args, board, Job { path: &path, database, clip: &clip, request: &request, robot: None })
        }
    }
}

/// The settings of a generated stream: in the second style, unless another is given.
fn generated(args: &BoardArgs, board: &Board, database: &Database<'_>) -> Result<Request> {
    let mut given = args.stream.stylizer_args.clone();
    if given.style.is_empty() {
        STYLES[1].clone_into(&mut given.style);
    }
    let mut request = given.request(database).context("the generated database")?;
    if board.blob_address.is_none() {
        // The micro:bit's image has room for no more.
        request.config.k = request.config.k.min(SMALL_NEIGHBORS);
    }
    Ok(request)
}

fn one(args: &BoardArgs, board: &'static Board, job: Job<'_>) -> Result<Measured> {
    let mut clip = job.clip.clone();
    clip.frames.truncate(args.frames.map_or(usize::MAX, NonZero::get));
    let image = image_of(args, board, job.path)?;
    let bar = progress::bar(clip.frames.len(), "frames");
    let measured = measure(board, &image, Job { clip: &clip, ..job }, || bar.inc(1)).context(board.name)?;
    bar.finish_and_clear();
    args.robot.write(&measured.linked)?;
    Ok(measured)
}

fn image_of(args: &BoardArgs, board: &Board, blob: &Path) -> Result<PathBuf> {
    if let Some(image) = &args.image {
        return Ok(image.clone());
    }
    note(format_args!("building the image of {} ({})", board.name, board.title));
    image::build(board, args.options(Some(blob)))
}

/// Replays the long stream on every board. The recording follows the database in flash and the board reads it there, so
/// that only the core is emulated and no link. Runs as many boards at once as there are processors.
fn long_streams(args: &BoardArgs, boards: &[&'static Board]) -> Result<Vec<Replayed>> {
    let path = image::target_folder().join("long-stream.gestus");
    let database = blob::open(&path, LONG_BLOB)?;
    let frames = args.frames.map_or(LONG_FRAMES, NonZero::get);
    let recording = Recording::long(&database, frames, LONG_CHANGE);
    let host_digest = recording.digest(&database)?;
    let file = image::write_flash(LONG_BLOB, &recording.to_bytes(host_digest), "long-stream.gestus")?;
    let images = boards.par_iter().map(|b| programs::replay_image(b)).collect::<Result<Vec<_>>>()?;
    let bar = progress::bar(boards.len(), "boards");
    let replay = |(&board, image): (&&'static Board, &PathBuf)| {
        let start = Instant::now();
        let (digest, frames) = programs::replay(board, image, &file)?;
        bar.inc(1);
        Ok(Replayed { board, frames, digest, host_digest, seconds: start.elapsed().as_secs_f64() })
    };
    // The last board of the list is the slowest, so it starts first.
    let replayed: Result<Vec<Replayed>> = boards.par_iter().zip(&images).rev().map(replay).collect();
    bar.finish_and_clear();
    let mut replayed = replayed?;
    replayed.reverse();
    Ok(replayed)
}

/// The table, one line a board.
fn table(measured: &[Measured]) -> String {
    let mut text = format!(
        "{:10} {:>9} {:>6}  {:>12} {:>12}  {:>6} {:>6} {:>7}  {:>10}  digest\n",
        "board", "bit-exact", "frames", "instructions", "worst", "RAM", "stack", "flash", "bytes read"
    );
    for one in measured {
        let instructions = one.linked.instructions();
        let number = |value: Option<u64>| value.map_or_else(|| "-".to_owned(), |v| v.to_string());
        text += &format!(
            "{:10} {:>9} {:>6}  {:>12} {:>12}  {:>6} {:>6} {:>7}  {:>10}  {:08x}\n",
            one.board.name,
            if one.bit_exact() { "yes" } else { "NO" },
            one.linked.streamed.steps.len(),
            number(median(&instructions)),
            number(instructions.last().copied()),
            one.ram_bytes,
            number(one.statistic(gestus_core::link::counter::STACK_BYTES)),
            one.flash_bytes,
            number(median(&one.bytes_read).map(u64::from)),
            one.linked.streamed.digest,
        );
    }
    text
}
