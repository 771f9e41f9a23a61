//! `gestus-sim link`.

use std::{path::PathBuf, str::FromStr, time::Duration};

use anyhow::{Context, Result, bail};
use clap::value_parser;
use gestus_core::{
    BlobError, Database,
    robot::{Robot, layout::MAX_HINGES},
};
use gestus_database::{
    command_line::{
        blob,
        lenient::Trimmed,
        options::ReportArgs,
        outputs::{note, say},
        progress,
    },
    stream::{Request, input::Input},
};
use serde_json::{Value, json};

use super::{
    client::{Client, RetryPolicy},
    line::{self, Line},
    loopback::Loopback,
    noise::Noise,
    serve::with_board,
    session::{BoardIdentity, Session, named},
    stream::{Linked, stream},
};
use crate::clip_args::ClipArgs;

/// Stream a clip through a board at the other end of a line, and compare every bit.
#[derive(clap::Args, Debug)]
// A probe needs neither database nor clip.
#[command(
    mut_arg("db", |db| db.required(false).required_unless_present("probe")),
    mut_arg("input", |input| input.required(false).required_unless_present("probe"))
)]
pub struct LinkArgs {
    /// The line: DEVICE[@BAUD] (a serial port), tcp:HOST:PORT, unix:PATH, or loopback (a board in this process)
    port: String,
    /// Only print the board's identity and statistics; needs neither database, clip nor style
    #[arg(long)]
    probe: bool,
    #[command(flatten)]
    clip: Option<ClipArgs>,
    /// Send frames at the database's rate, instead of each as soon as the previous one is answered
    #[arg(long)]
    pace: bool,
    /// Milliseconds to wait for a reply before the request is sent again, 1 to 60000; doubled after each attempt, up to 8
    /// times this value
    #[arg(long, default_value_t = 250, value_name = "MS", value_parser = value_parser!(u64).range(1..=60_000))]
    timeout: u64,
    /// Retries before the command gives up, 0 to 255
    #[arg(long, default_value_t = 20, value_name = "N")]
    repeats: u8,
    #[command(flatten)]
    robot: RobotArgs,
    /// Faults of the loopback line, such as lose=0.0001,corrupt=0.0001,drop=0.01,cut=0.01,delay=0.05:300,seed=7: of a byte
    /// lose, double and corrupt, of a frame the others
    #[arg(long)]
    noise: Option<Noise>,
    #[command(flatten)]
    report: ReportArgs,
}

/// A robot on the board.
#[derive(clap::Args, Debug)]
pub struct RobotArgs {
    /// The tables of a robot that the board drives, as `gestus translate --robot-section` writes them. It is driven at
    /// its own rate, and every angle and pulse is compared
    #[arg(long, value_name = "ROBOT.gestus")]
    pub robot: Option<PathBuf>,
    /// The hinges' angles before the first tick, radians, in the order of the tables; those that are not given are 0
    #[arg(long, requires = "robot", value_delimiter = ',', allow_hyphen_values = true, value_parser = Trimmed(f32::from_str))]
    pub robot_at: Vec<f32>,
    /// One request a frame for style and servos: the board steps the pose and makes the robot's ticks that are due. This
    /// machine does it in separate requests, and has to come to the same bits
    #[arg(long, requires = "robot")]
    pub step_robot: bool,
    /// CSV file to write the robot's angles and pulses to
    #[arg(long, requires = "robot", value_name = "OUT.csv")]
    pub robot_csv: Option<PathBuf>,
}

impl RobotArgs {
    /// The file's bytes; empty without a robot.
    ///
    /// # Errors
    /// A file that can't be read.
    pub fn read(&self) -> Result<Vec<u8>> {
        self.robot.as_ref().map_or(Ok(Vec::new()), |path| blob::read(path))
    }

    /// Opens the robot's tables, which have to fit the database and a board with room for `hinges`.
    ///
    /// # Errors
    /// Bytes that are not a robot's tables, tables made for another database, and angles of hinges that it does not have.
    pub fn open<'r>(
        &self,
        bytes: &'r [u8],
        database: &Database<'_>,
        hinges: usize,
    ) -> Result<Option<Robot<'r>>> {
        let Some(path) = &self.robot else { return Ok(None) };
        let robot = Robot::open(bytes).map_err(|error| match error {
            BlobError::Magic => anyhow::anyhow!(
                "{}: these are no tables of a robot: `gestus translate --robot R.urdf --robot-section FILE` writes them",
                path.display()
            ),
            error => anyhow::anyhow!("{}: {error}", path.display()),
        })?;
        robot.fits(database, hinges).map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))?;
        let (most, given) = (robot.hinges(), self.robot_at.len());
        if given > most || !self.robot_at.iter().all(|angle| angle.is_finite()) {
            bail!(
                "--robot-at: give finite angles, at most one for each of the {most} hinges of {}; these are {given}",
                path.display()
            );
        }
        Ok(Some(robot))
    }

    /// Finds the robot on the board, and tells the session how to drive it.
    ///
    /// # Errors
    /// As [`Session::find_robot`].
    pub fn begin<L: Line>(&self, robot: &Robot<'_>, session: &mut Session<'_, L>) -> Result<()> {
        session.find_robot(robot, &self.robot_at)?;
        if self.step_robot {
            session.step_in_one_call();
        }
        Ok(())
    }

    /// Writes the robot's ticks, if `--robot-csv` is given.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn write(&self, linked: &Linked) -> Result<()> {
        let Some(path) = &self.robot_csv else { return Ok(()) };
        blob::write(path, linked.robot_csv())
    }
}

fn client<L: Line>(line: L, timeout_ms: u64, repeats: u8) -> Client<L> {
    let first_timeout = Duration::from_millis(timeout_ms);
    let retry = RetryPolicy { first_timeout, max_timeout: first_timeout * 8, retries: repeats };
    Client::new(line, Client::<L>::new_session(), retry)
}

/// Runs the command.
///
/// # Errors
/// Files that can't be read or written, a board that does not reply or refuses a request, and bits that differ.
pub fn run(args: &LinkArgs) -> Result<()> {
    let loopback = args.port == "loopback";
    let Some(clip) = &args.clip else {
        if loopback {
            bail!("--probe needs a real board: give a port instead of `loopback`");
        }
        return probe(args).with_context(|| args.port.clone());
    };
    if args.noise.is_some() && !loopback {
        bail!("--noise works with the line `loopback` only");
    }
    let csv = args.robot.robot_csv.as_ref().map(|path| ("--robot-csv", path));
    clip.check(args.robot.robot.as_ref(), csv)?;
    let bytes = clip.read()?;
    let (database, input, request) = clip.open(&bytes)?;
    let tables = args.robot.read()?;
    let robot = args.robot.open(&tables, &database, MAX_HINGES)?;
    let outcome = with_board(database, request.config, robot, |twin| {
        if loopback {
            let noise = args.noise.unwrap_or_default();
            with_board(database, request.config, robot, |board| {
                let mut line = Loopback::new(board, noise);
                let outcome = stream_clip(args, clip, &mut line, twin, (&database, robot), &input, &request);
                let [there, back] = line.fault_counts();
                note(format_args!("faults on the way to the board: {there}; on the way back: {back}"));
                outcome
            })?
        } else {
            stream_clip(args, clip, line::open(&args.port)?, twin, (&database, robot), &input, &request)
        }
    })?;
    outcome.with_context(|| args.port.clone())
}

/// Prints a board's identity and statistics.
fn probe(args: &LinkArgs) -> Result<()> {
    let mut client = client(line::open(&args.port)?, args.timeout, args.repeats);
    let identity = BoardIdentity::from(client.hello()?);
    let statistics = named(&client.statistics()?);
    if args.report.json {
        say(json!({ "board": identity, "statistics": object(&statistics) }))
    } else {
        say(&identity)?;
        statistics.iter().try_for_each(|(name, value)| say(format_args!("  {name} {value}")))
    }
}

fn stream_clip<'t, L: Line>(
    args: &LinkArgs,
    clip: &ClipArgs,
    line: L,
    twin: &'t mut super::serve::BoardFn<'t>,
    (database, robot): (&Database<'_>, Option<Robot<'_>>),
    input: &Input,
    request: &Request,
) -> Result<()> {
    let mut session = Session::begin(client(line, args.timeout, args.repeats), twin, database)?;
    note(session.identity());
    session.apply(request)?;
    if let Some(robot) = robot {
        args.robot.begin(&robot, &mut session)?;
    }
    let bar = progress::bar(input.mapped.frames.len(), "frames");
    let pace_hz = args.pace.then_some(input.mapped.rate_hz);
    let linked = stream(&mut session, &input.mapped, pace_hz, || bar.inc(1))?;
    bar.finish_and_clear();
    let statistics = named(&session.board().statistics()?);
    clip.write(input, &linked.streamed)?;
    args.robot.write(&linked)?;
    let figures = figures(&session, &linked, &statistics);
    if args.report.json {
        say(&figures)?;
    } else {
        print(&figures)?;
    }
    match linked.first_difference {
        None if linked.bit_exact() => Ok(()),
        None => bail!("the robot's ticks differ from this machine's"),
        Some(frame) => bail!(
            "{} of {} frames differ from this machine's, frame {frame} first",
            linked.differing,
            linked.streamed.steps.len()
        ),
    }
}

fn object(pairs: &[(String, u64)]) -> Value {
    pairs.iter().map(|(name, value)| (name.clone(), json!(value))).collect::<serde_json::Map<_, _>>().into()
}

fn figures<L: Line>(session: &Session<'_, L>, linked: &Linked, statistics: &[(String, u64)]) -> Value {
    let mut trips: Vec<f64> = linked.streamed.steps.iter().map(|s| s.micros / 1e3).collect();
    trips.sort_by(f64::total_cmp);
    let quantile = |q: f64| trips.get((trips.len() as f64 * q) as usize).or(trips.last()).copied();
    let instructions = linked.instructions();
    json!({
        "board": session.identity().board,
        "identity": session.identity(),
        "bit_exact": linked.bit_exact(),
        "robot": linked.robot_json(),
        "frames": linked.streamed.steps.len(),
        "frames_differing": linked.differing,
        "first_difference": linked.first_difference,
        "digest": format!("{:08x}", linked.streamed.digest),
        "host_digest": format!("{:08x}", linked.host_digest),
        "round_trip_median_ms": quantile(0.5),
        "round_trip_p99_ms": quantile(0.99),
        "round_trip_max_ms": trips.last(),
        "frames_late": linked.late,
        "degraded": linked.streamed.steps.iter().filter(|s| !s.report.degraded.is_empty()).count(),
        "instructions_median": instructions.get(instructions.len() / 2),
        "instructions_max": instructions.last(),
        "line": session.counts(),
        "statistics": object(statistics),
    })
}

fn print(figures: &Value) -> Result<()> {
    let number = |key: &str| figures[key].as_f64().unwrap_or(0.0);
    say(format_args!(
        "{} frames, {} bit-exact, digest {}; round trip {:.1} ms (median), {:.1} ms at most; {} requests sent again",
        figures["frames"],
        if figures["bit_exact"] == json!(true) { "all" } else { "not" },
        figures["digest"].as_str().unwrap_or(""),
        number("round_trip_median_ms"),
        number("round_trip_max_ms"),
        figures["line"]["repeats"]
    ))?;
    let damage: Vec<String> = ["repeated", "doubled", "lost", "stale", "cut", "corrupted", "overlong"]
        .iter()
        .filter_map(|name| {
            figures["statistics"][name].as_u64().filter(|n| *n > 0).map(|n| format!("{n} {name}"))
        })
        .collect();
    if !damage.is_empty() {
        say(format_args!("since it started, the board counted {}", damage.join(", ")))?;
    }
    if let Some(ticks) = figures["robot"]["ticks"].as_u64() {
        say(format_args!(
            "{} hinges, {ticks} ticks, {} of them not bit-exact; at most {:.1} degrees behind",
            figures["robot"]["hinges"],
            figures["robot"]["ticks_differing"],
            figures["robot"]["lag_max_deg"].as_f64().unwrap_or(0.0)
        ))?;
    }
    Ok(())
}
