//! Programs of the image that count by themselves, without a host: what stands around a step, and elementary functions.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use gestus_core::{Database, blob::layout::section};
use gestus_database::{
    blob::assemble::with_section,
    effort::{Source, dial::Dial},
    retarget::{MapFile, Retarget},
    robot::{Machine, RobotMap},
};
use gestus_motion::formats::urdf::TOY;
use gestus_motion::{
    clip::{Clip, Skeleton},
    formats::urdf::Robot,
};
use serde_json::{Value, json};

use super::{
    boards::Board,
    emulator,
    generated::{REFERENCE, SMALL},
    image::{self, Options},
};

/// Joints of the body that comes in, and how much larger it is than the database's.
const JOINTS: usize = 31;
const LARGER: f64 = 1.1;

/// Median and most instructions of what stands around a step, by name: `retarget_in` (a body of 31 joints),
/// `retarget_back`, `retiming` (one frame of 30 a second, its ticks at 50), `servo` (the toy of 16 servos, limits and
/// pulses), `row_decode` (one row of the database), `effort` (the dial). The database, its map and its robot are generated.
///
/// # Errors
/// A board that it is not made for, an image that can't be built, and an emulator that fails.
pub fn around(board: &Board) -> Result<Value> {
    if board.name != "m4f" {
        bail!("--around: it counts on m4f, not on {}", board.name);
    }
    let path = REFERENCE.database()?;
    let bytes = fs::read(&path).with_context(|| format!("{} can't be read", path.display()))?;
    let database = Database::open(&bytes).map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))?;
    let map = Retarget::new(&database, &foreign(&REFERENCE.clip(4.0)?), &MapFile::default())?;
    let robot = Machine::new(&database, Robot::parse(TOY, "toy.urdf")?, &RobotMap::default())?;
    let [map, robot] = [("around.map", map.bytes()), ("around.robot", robot.bytes())].map(|(name, bytes)| {
        let path = image::target_folder().join(name);
        fs::write(&path, bytes).map(|()| path)
    });
    let (map, robot) = (map?, robot?);
    // The dial is the database's, whose builder leaves it out of generated motion: what it holds does not matter here.
    let styles = database.counts().styles;
    let efforts = (0..styles).map(|s| Some([s as f64 / 3.0 - 1.0, (s % 3) as f64 - 1.0, (s % 2) as f64]));
    let dial = Dial::new(Source::Estimated, efforts.collect(), 0);
    let path = image::target_folder().join("around.gestus");
    fs::write(&path, with_section(&bytes, section::EFFORT, &dial.section())?)?;
    let files: [(&str, &Path); 2] = [("GESTUS_MAP", &map), ("GESTUS_ROBOT", &robot)];
    let lines = run(board, Options { program: Some("body"), files: &files, ..Options::default() }, &path)?;
    Ok(lines.into_iter().map(|(name, n)| (name, json!({ "median": n[0], "max": n[1] }))).collect())
}

/// Instructions of elementary functions and how far they are off, by name.
///
/// # Errors
/// As [`around`].
pub fn functions(board: &Board) -> Result<Value> {
    if !["m4f", "m0"].contains(&board.name) {
        bail!("--functions: it counts on m4f and m0, not on {}", board.name);
    }
    let path = if board.blob_address.is_some() { REFERENCE.database()? } else { SMALL.database()? };
    let options = Options { program: Some("functions"), blob: Some(&path), ..Options::default() };
    let lines = run(board, options, &path)?;
    let figures = |n: Vec<u64>| {
        let [instructions, error, relative] = [n[0], n[1], n[2]].map(|n| n as f64);
        json!({ "instructions": instructions / 100.0, "error": error / 1e9, "relative_error": relative / 1e9 })
    };
    Ok(lines.into_iter().map(|(name, numbers)| (name, figures(numbers))).collect())
}

/// Digest and frames of a recording that lies behind the database in a file, streamed by a board without counting.
///
/// # Errors
/// As [`around`].
pub fn replay(board: &Board, image: &Path, file: &Path) -> Result<(u32, usize)> {
    let text = emulator::output(board, image, file, false)?;
    let said = match text.split_whitespace().collect::<Vec<_>>()[..] {
        ["digest", digest, frames] => digest.parse().ok().zip(frames.parse().ok()),
        _ => None,
    };
    said.with_context(|| format!("{}: the board says `{}`", board.name, text.trim()))
}

/// The image of [`replay`].
///
/// # Errors
/// An image that can't be built.
pub fn replay_image(board: &Board) -> Result<PathBuf> {
    image::build(board, Options { program: Some("replay"), ..Options::default() })
}

/// The lines that a program prints: names and numbers, three at least (missing ones are 0).
fn run(board: &Board, options: Options<'_>, blob: &Path) -> Result<BTreeMap<String, Vec<u64>>> {
    eprintln!("building {} for {} ({})", options.program.unwrap_or_default(), board.name, board.title);
    let image: PathBuf = image::build(board, options)?;
    let text = emulator::output(board, &image, blob, true)?;
    let mut lines = BTreeMap::new();
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap_or_default().to_owned();
        let mut numbers = words
            .map(|word| word.parse().with_context(|| format!("{}: the board says `{line}`", board.name)))
            .collect::<Result<Vec<u64>>>()?;
        numbers.resize(numbers.len().max(3), 0);
        lines.insert(name, numbers);
    }
    if lines.is_empty() {
        bail!("{}: the program printed nothing", board.name);
    }
    Ok(lines)
}

/// A clip on another skeleton: a tenth larger, with joints at its ends that the database's does not have.
fn foreign(clip: &Clip) -> Clip {
    let mut skeleton = Skeleton::clone(&clip.skeleton);
    for offset in &mut skeleton.offsets {
        *offset *= LARGER;
    }
    let own = skeleton.joints();
    for extra in 0..JOINTS.saturating_sub(own) {
        // Fingers and the like hang on the last joints.
        let parent = own - 1 - extra % own;
        skeleton.names.push(format!("Extra{extra}"));
        skeleton.parents.push(Some(parent));
        skeleton.offsets.push(skeleton.offsets[parent] * 0.2);
    }
    let mut frames = clip.frames.clone();
    for frame in &mut frames {
        frame.root *= LARGER;
        frame.rotations.resize(skeleton.joints(), nalgebra::UnitQuaternion::identity());
    }
    Clip { skeleton: Arc::new(skeleton), frames, ..clip.clone() }
}
