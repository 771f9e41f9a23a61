//! A robot that follows the motion: limit violations, tracking errors, and errors of hands and feet.
//!
//! Two rows a clip: `drive` follows the clip; `stress` jumps from one end of the clip to the other every third of a
//! second. No robot can follow that, but every limit has to hold. `docs/METRICS.md` defines
//! the figures.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use gestus_core::Database;
use serde_json::{Value, json};

use crate::{
    evaluation::{self, Evaluation},
    measures::OnDatabase,
    plots::{self, Labels},
    report::{html::Figure, table},
};
use gestus_database::{
    command_line::{outputs::note, progress},
    data_folder::config::Config,
    robot::{
        Machine, Played, RobotMap,
        play::{end_effectors, play, play_frames},
    },
    stream::input::onto,
};
use gestus_motion::{
    binding::{Binding, Options},
    capture::read_folder,
    clip::Frame,
    formats::urdf::{Robot, TOY},
};

/// Clips at most: evenly out of the folder.
const CLIPS: usize = 24;

/// Options of `gestus evaluate servo`.
#[derive(clap::Args, Debug, Default)]
pub struct Args {
    /// The robot, a URDF file; default: the toy robot that comes with Gestus
    #[arg(long)]
    robot: Option<PathBuf>,
    /// What the robot's joint names don't say, as TOML
    #[arg(long, requires = "robot")]
    robot_map: Option<PathBuf>,
}

impl OnDatabase for Args {
    fn evaluate(&self, database: &Database<'_>, folder: &Path) -> Result<Evaluation> {
        let robot = match &self.robot {
            Some(path) => Robot::read(path)?,
            None => Robot::parse(TOY, "toy.urdf")?,
        };
        let map = self.robot_map.as_deref().map(RobotMap::read).transpose()?.unwrap_or_default();
        evaluate(database, folder, robot, &map)
    }
}

/// Drives a robot with clips of a folder.
fn evaluate(database: &Database<'_>, folder: &Path, robot: Robot, map: &RobotMap) -> Result<Evaluation> {
    let name = robot.name.clone();
    let machine = Machine::new(database, robot, map).with_context(|| format!("robot {name}"))?;
    for doubt in &machine.doubts {
        note(format_args!("robot {name}: doubt: {doubt}"));
    }
    let config = Config::of_folder(folder)?;
    let options = Options { unit: config.unit(), ..Options::default() };
    let files = read_folder(folder)?;
    for error in &files.skipped {
        note(format_args!("left out: {error}"));
    }
    if files.documents.is_empty() {
        bail!("{}: there is no clip in it that can be read", folder.display());
    }
    let step = files.documents.len().div_ceil(CLIPS).max(1);
    let mut rows: Vec<table::Row> = Vec::new();
    let mut figures = Vec::new();
    let tried = files.documents.len().div_ceil(step);
    let bar = progress::bar(tried, "servo");
    for (path, document) in files.documents.iter().step_by(step) {
        bar.inc(1);
        let clip = Binding::new(document, &options).and_then(|b| b.to_clip(document));
        let clip = match clip.map_err(anyhow::Error::from).and_then(|c| onto(database, &c)) {
            Ok(clip) => clip,
            Err(e) => {
                note(format_args!("left out: {}: {e:#}", path.display()));
                continue;
            }
        };
        let played = play(&machine, &clip);
        let (reached, wanted) = end_effectors(&machine, &played, &clip);
        let (action, style) = config.class(folder, path).unzip();
        let row = |method: &str, figures: Value| {
            let mut row = evaluation::row(
                json!({ "method": method, "action": action, "style": style, "clip": clip.name, "robot": name }),
            );
            row.extend(evaluation::row(figures));
            row
        };
        let mut drive = row("drive", played.figures(&machine));
        drive.insert("end_effector_deg".into(), json!(reached));
        drive.insert("end_effector_target_deg".into(), json!(wanted));
        rows.push(drive);
        if figures.is_empty() {
            figures = plots(&machine, &played, &clip.name);
        }
        let jumps = jumping(&clip.resampled(machine.tick_hz).frames, machine.tick_hz);
        let stressed = play_frames(&machine, &jumps);
        rows.push(row("stress", stressed.figures(&machine)));
    }
    bar.finish_and_clear();
    if rows.is_empty() {
        bail!(
            "{}: none of the {tried} clips that were tried can drive the robot; the lines above say why",
            folder.display()
        );
    }
    Ok(Evaluation {
        what: "servo",
        about: format!(
            "The robot `{name}` ({} hinges, {} ticks a second) driven by clips. Violations are ticks of a hinge \
             outside its limits of position, velocity, acceleration or jerk; ratios are peaks over limits; the first \
             half second, in which the robot leaves its zero pose, counts for limits and not for tracking.",
            machine.robot.hinges.len(),
            machine.tick_hz
        ),
        keys: vec!["method"],
        rows,
        figures,
    })
}

/// Frames that jump between the two ends of a clip.
fn jumping(frames: &[Frame], rate_hz: f64) -> Vec<Frame> {
    let hold = (rate_hz / 3.0) as usize;
    let last = frames.len() - 1;
    (0..frames.len())
        .map(|i| {
            let turn = i / hold.max(1);
            frames[if turn.is_multiple_of(2) { i % (last + 1) } else { last - i }].clone()
        })
        .collect()
}

/// Hinges over time, each in its range: 0 is its lower end, 1 its upper end.
fn plots(machine: &Machine, played: &Played, clip: &str) -> Vec<Figure> {
    let tables = machine.tables();
    let seconds = |i: usize| (i + 1) as f64 / played.tick_hz;
    let of = |h: usize, value: &dyn Fn(usize, &gestus_core::robot::limits::Limits) -> f64| {
        let limits = tables.limits(h);
        let points = (0..played.ticks.len()).map(|i| (seconds(i), value(i, &limits))).collect::<Vec<_>>();
        (played.names[h].clone(), points)
    };
    // More than eight lines can't be told apart.
    let shown: Vec<usize> = (0..played.names.len()).take(8).collect();
    let range = |i: usize, h: usize, l: &gestus_core::robot::limits::Limits| {
        f64::from((played.ticks[i].motions[h].position - l.low) / (l.high - l.low))
    };
    let positions: Vec<_> = shown.iter().map(|&h| of(h, &|i, l| range(i, h, l))).collect();
    let jerks: Vec<_> = shown
        .iter()
        .map(|&h| {
            of(h, &|i, l| {
                let before = if i > 0 { played.ticks[i - 1].motions[h].acceleration } else { 0.0 };
                let jerk = f64::from(played.ticks[i].motions[h].acceleration - before) * played.tick_hz;
                jerk / f64::from(l.jerk)
            })
        })
        .collect();
    vec![
        Figure {
            name: "positions".into(),
            caption: format!("{clip}: hinges in their ranges; 0 and 1 are the ends."),
            svg: plots::lines(
                Labels { title: "Position within limits", x: "seconds", y: "share of the range" },
                &positions,
            ),
        },
        Figure {
            name: "jerk".into(),
            caption: format!("{clip}: jerk over its limit; within -1 and 1."),
            svg: plots::lines(
                Labels { title: "Jerk within limits", x: "seconds", y: "share of the limit" },
                &jerks,
            ),
        },
    ]
}
