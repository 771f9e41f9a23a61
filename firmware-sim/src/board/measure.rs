//! Streams a clip through an emulated board, and measures what it costs there.

use std::{fs::File, path::Path, time::Duration};

use anyhow::{Context, Result};
use gestus_core::{Config, Database, Method, Stage, link::counter, robot::Robot};
use gestus_database::{
    parts::{calibration::Isa, worst},
    stream::Request,
};
use gestus_motion::clip::Clip;
use serde_json::{Value, json};

use super::{boards::Board, emulator::Emulator, image};
use crate::link::{
    Line,
    client::{Client, RetryPolicy},
    command::RobotArgs,
    serve::with_board,
    session::Session,
    stream::{Linked, stream},
};

/// Long timeouts: an emulated board is slow, and its line has no faults.
const RETRY: RetryPolicy =
    RetryPolicy { first_timeout: Duration::from_secs(5), max_timeout: Duration::from_secs(60), retries: 8 };

/// The result of streaming a clip through a board.
#[derive(Debug, Clone)]
pub struct Measured {
    /// The board.
    pub board: &'static Board,
    /// Its output, compared with this machine's.
    pub linked: Linked,
    /// The board's statistics, each as its number ([`counter`]) and its value.
    pub statistics: Vec<(u16, u64)>,
    /// Bytes of the stylizer.
    pub ram_bytes: u32,
    /// Bytes of flash of the image.
    pub flash_bytes: u64,
    /// Bytes read from the blob in each frame, ascending.
    pub bytes_read: Vec<u32>,
    /// Upper bound of the instructions of a frame under the request ([`worst::bound`]), if it is known.
    pub bound: Option<f64>,
    /// Bytes a style of the method's section in the database; 0 for the mixture, which has no section of its own.
    pub model_bytes_per_style: usize,
}

impl Measured {
    /// True if every bit of every frame is the same as on this machine.
    pub fn bit_exact(&self) -> bool {
        self.linked.bit_exact()
    }

    /// The board's statistic of that number.
    pub fn statistic(&self, number: u16) -> Option<u64> {
        self.statistics.iter().find(|(n, _)| *n == number).map(|(_, value)| *value)
    }

    /// Bytes of stylizer and server, which are in the stack frame of the firmware's main loop.
    pub fn state_bytes(&self) -> Option<u64> {
        Some(self.statistic(counter::STYLIZER_BYTES)? + self.statistic(counter::SERVER_BYTES)?)
    }

    /// Instructions of each frame in a stage, ascending.
    pub fn stage(&self, stage: Stage) -> Vec<u32> {
        let mut all: Vec<u32> =
            self.linked.stages.iter().filter_map(|s| s.get(stage as usize).copied()).collect();
        all.sort_unstable();
        all
    }

    /// The figures as JSON.
    pub fn json(&self) -> Value {
        let instructions = self.linked.instructions();
        let stages: serde_json::Map<String, Value> = Stage::ALL
            .iter()
            .map(|&stage| {
                let counts = self.stage(stage);
                let figures = json!({ "median": median(&counts), "max": counts.last() });
                (Stage::NAMES[stage as usize].to_owned(), figures)
            })
            .collect();
        json!({
            "board": self.board.name,
            "machine": self.board.machine,
            "target": self.board.target,
            "bit_exact": self.bit_exact(),
            "frames": self.linked.streamed.steps.len(),
            "frames_differing": self.linked.differing,
            "first_difference": self.linked.first_difference,
            "degrees_apart": self.linked.difference_rad.to_degrees(),
            "instructions_median": median(&instructions),
            "instructions_max": instructions.last(),
            "model_bytes_per_style": self.model_bytes_per_style,
            "robot": self.linked.robot_json(),
            "instructions_bound": self.bound.map(f64::round),
            "instructions_first": self.linked.stages.first().map(|s| s.iter().sum::<u32>()),
            "stages": stages,
            "instructions_open": self.statistic(counter::INSTRUCTIONS_OPEN),
            "ram_bytes": self.ram_bytes,
            "static_bytes": self.statistic(counter::STATIC_BYTES),
            "state_bytes": self.state_bytes(),
            "stack_bytes": self.statistic(counter::STACK_BYTES),
            "flash_bytes": self.flash_bytes,
            "bytes_read_median": median(&self.bytes_read),
            "bytes_read_max": self.bytes_read.last(),
            "degraded": self.linked.streamed.steps.iter().filter(|s| !s.report.degraded.is_empty()).count(),
            "digest": format!("{:08x}", self.linked.streamed.digest),
            "host_digest": format!("{:08x}", self.linked.host_digest),
        })
    }
}

/// Median of ascending values.
pub fn median<T: Copy>(ascending: &[T]) -> Option<T> {
    ascending.get(ascending.len() / 2).copied()
}

/// A clip to stream, with its database and settings.
#[derive(Debug, Clone, Copy)]
pub struct Job<'a> {
    /// The database's file.
    pub path: &'a Path,
    /// The database.
    pub database: Database<'a>,
    /// The clip, at the database's rate and on its joints.
    pub clip: &'a Clip,
    /// Style, labels, parameters.
    pub request: &'a Request,
    /// A robot on the board, whose tables follow the database in the file, and how it is driven.
    pub robot: Option<(Robot<'a>, &'a RobotArgs)>,
}

/// Starts an emulated board and its twin on this machine, and calls `run` with a session of both.
///
/// # Errors
/// An emulator that can't be started, a board that ends or does not reply, and the errors of `run`.
fn with_session<R>(
    board: &'static Board,
    image: &Path,
    job_path: &Path,
    database: Database<'_>,
    robot: Option<Robot<'_>>,
    run: impl FnOnce(&mut Session<'_, Box<dyn Line>>) -> Result<R>,
) -> Result<R> {
    let log = log_path(board);
    if let Some(folder) = log.parent() {
        std::fs::create_dir_all(folder)?;
    }
    let file = File::create(&log).with_context(|| format!("{} can't be written", log.display()))?;
    let (mut emulator, line) = Emulator::start(board, image, job_path, file)?;
    let line: Box<dyn Line> = Box::new(line);
    let outcome = with_board(database, first_config(&database), robot, |twin| {
        let client = Client::new(line, Client::<Box<dyn Line>>::new_session(), RETRY);
        let mut session = Session::begin(client, twin, &database)?;
        run(&mut session)
    })?;
    outcome.map_err(|error| match emulator.exit_reason() {
        Some(reason) => error.context(reason),
        None => error,
    })
}

/// The configuration with which an image begins: that of a database without frames is not the mixture.
fn first_config(database: &Database<'_>) -> Config {
    Config::new().method(Method::of(database))
}

/// File with the log lines of a board's last run.
fn log_path(board: &Board) -> std::path::PathBuf {
    image::target_folder().join(format!("{}.log", board.name))
}

/// The result of replaying a recording on a board.
#[derive(Debug, Clone, Copy)]
pub struct Replayed {
    /// The board.
    pub board: &'static Board,
    /// Frames of the recording.
    pub frames: usize,
    /// Digest of the board's output.
    pub digest: u32,
    /// Digest of this machine's.
    pub host_digest: u32,
    /// Time that it took, with the emulator's start, seconds.
    pub seconds: f64,
}

impl Replayed {
    /// The figures as JSON.
    pub fn json(&self) -> Value {
        json!({
            "board": self.board.name,
            "bit_exact": self.bit_exact(),
            "frames": self.frames,
            "seconds": self.seconds,
            "digest": format!("{:08x}", self.digest),
            "host_digest": format!("{:08x}", self.host_digest),
        })
    }

    /// True if every bit of every frame is the same as on this machine.
    pub fn bit_exact(&self) -> bool {
        self.digest == self.host_digest
    }
}

/// Upper bound of the instructions of a job's frames, on the only board whose costs were measured on worst-case
/// streams.
fn bound(board: &Board, job: &Job<'_>) -> Option<f64> {
    if board.name != "m4f" || job.request.config.method != Method::Mar {
        return None;
    }
    worst::bound(Isa::Armv7MFpu, &job.database, job.request)
}

/// Bytes of the section that the method reads.
fn model_bytes(job: &Job<'_>) -> usize {
    let section = job.request.config.method.section().and_then(|id| job.database.optional(id));
    section.map_or(0, <[u8]>::len)
}

/// Streams a clip through a board.
///
/// # Errors
/// As `with_session`, and settings that the board refuses.
pub fn measure(
    board: &'static Board,
    image: &Path,
    job: Job<'_>,
    progress: impl FnMut(),
) -> Result<Measured> {
    let flash_bytes = image::flash_bytes(image)?;
    with_session(board, image, job.path, job.database, job.robot.map(|(robot, _)| robot), |session| {
        session.apply(job.request)?;
        if let Some((robot, args)) = job.robot {
            args.begin(&robot, session)?;
        }
        let linked = stream(session, job.clip, None, progress)?;
        let statistics = session.board().statistics()?;
        let mut bytes_read: Vec<u32> = linked.streamed.steps.iter().map(|s| s.report.bytes_read).collect();
        bytes_read.sort_unstable();
        let ram_bytes = session.identity().ram_bytes;
        let bound = bound(board, &job);
        let model_bytes_per_style = model_bytes(&job) / job.database.counts().styles.max(1);
        Ok(Measured {
            board,
            linked,
            statistics,
            ram_bytes,
            flash_bytes,
            bytes_read,
            bound,
            model_bytes_per_style,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The twin began with the mixture, and every database without frames was refused.
    #[test]
    fn a_database_without_frames_has_a_twin() {
        let whole = Database::open(super::super::command::LONG_BLOB).unwrap();
        let blob = gestus_database::blob::cut::models_only(&whole).unwrap();
        for database in [whole, Database::open(&blob).unwrap()] {
            with_board(database, first_config(&database), None, |_| ()).unwrap();
        }
    }
}
