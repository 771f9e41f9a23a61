//! Programs of the image that run without a host: they count the instructions of the work around a step and of
//! elementary functions, or replay a recording.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::Arc,
};

use anyhow::{Context, Result, bail};
use gestus_core::blob::layout::section;
use gestus_database::{
    blob::assemble::with_section,
    command_line::{blob, outputs::note},
    effort::{Source, dial::Dial},
    retarget::{MapFile, Retarget},
    robot::{Machine, RobotMap},
};
use gestus_float::trial;
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

/// Joints of the input's skeleton, and its size relative to the database's.
const JOINTS: usize = 31;
const LARGER: f64 = 1.1;

/// Median and maximum of the instructions of the work around a step, by name: `retarget_in` (from a skeleton of 31
/// joints), `retarget_back`, `retiming` (one frame of 30 a second, with ticks at 50 a second), `servo` (a toy robot of
/// 16 servos: limits and pulses), `row_decode` (one row of the database), and `effort` (the effort dial). The database,
/// its retargeting map and its robot are generated.
///
/// # Errors
/// An unsupported board, an image that can't be built, and an emulator that fails.
pub fn around(board: &Board) -> Result<Value> {
    if board.name != "m4f" {
        bail!("--around works on m4f only, not on {}", board.name);
    }
    let path = REFERENCE.database()?;
    let bytes = blob::read(&path)?;
    let database = blob::open(&path, &bytes)?;
    let map = Retarget::new(&database, &foreign(&REFERENCE.clip(4.0)?), &MapFile::default())?;
    let robot = Machine::new(&database, Robot::parse(TOY, "toy.urdf")?, &RobotMap::default())?;
    let [map, robot] = [("around.map", map.bytes()), ("around.robot", robot.bytes())].map(|(name, bytes)| {
        let path = image::target_folder().join(name);
        fs::write(&path, bytes).map(|()| path)
    });
    let (map, robot) = (map?, robot?);
    // The builder does not add an effort dial to generated motion. Its values do not matter here.
    let styles = database.counts().styles;
    let efforts = (0..styles).map(|s| Some([s as f64 / 3.0 - 1.0, (s % 3) as f64 - 1.0, (s % 2) as f64]));
    let dial = Dial::new(Source::Estimated, efforts.collect(), 0);
    let path = image::target_folder().join("around.gestus");
    fs::write(&path, with_section(&bytes, section::EFFORT, &dial.section())?)?;
    let files: [(&str, &Path); 2] = [("GESTUS_MAP", &map), ("GESTUS_ROBOT", &robot)];
    let lines = run(board, Options { program: Some("body"), files: &files, ..Options::default() }, &path)?;
    Ok(lines.into_iter().map(|(name, n)| (name, json!({ "median": n[0], "max": n[1] }))).collect())
}

/// Instructions and errors of elementary functions, by name.
///
/// # Errors
/// As [`around`], and a board whose sums and products have other bits than the host's.
pub fn functions(board: &Board) -> Result<Value> {
    if !["m4f", "m0"].contains(&board.name) {
        bail!("--functions works on m4f and m0 only, not on {}", board.name);
    }
    let path = if board.blob_address.is_some() { REFERENCE.database()? } else { SMALL.database()? };
    let options = Options { program: Some("functions"), blob: Some(&path), ..Options::default() };
    let mut lines = run(board, options, &path)?;
    let bits =
        lines.remove("bits").with_context(|| format!("{}: the program printed no digest", board.name))?;
    if bits[0] != u64::from(trial::digest(trial::PAIRS)) {
        bail!("{}: sums and products of floats have other bits than on this machine", board.name);
    }
    let figures = |n: Vec<u64>| {
        let [instructions, error, relative] = [n[0], n[1], n[2]].map(|n| n as f64);
        json!({ "instructions": instructions / 100.0, "error": error / 1e9, "relative_error": relative / 1e9 })
    };
    Ok(lines.into_iter().map(|(name, numbers)| (name, figures(numbers))).collect())
}

/// Replays on a board, without counting, the recording that follows the database in a file. Returns its digest and
/// number of frames.
///
/// # Errors
/// As [`around`].
pub fn replay(board: &Board, image: &Path, file: &Path) -> Result<(u32, usize)> {
    let text = emulator::output(board, image, file)?;
    let result = match text.split_whitespace().collect::<Vec<_>>()[..] {
        ["digest", digest, frames] => digest.parse().ok().zip(frames.parse().ok()),
        _ => None,
    };
    result.with_context(|| format!("{}: the board printed `{}`", board.name, text.trim()))
}

/// The image of [`replay`].
///
/// # Errors
/// An image that can't be built.
pub fn replay_image(board: &Board) -> Result<PathBuf> {
    image::build(board, Options { program: Some("replay"), ..Options::default() })
}

/// Runs a program and parses its lines, each a name and numbers; fewer than three are filled up with zeros.
fn run(board: &Board, options: Options<'_>, blob: &Path) -> Result<BTreeMap<String, Vec<u64>>> {
    let program = options.program.unwrap_or_default();
    note(format_args!("building {program} for {} ({})", board.name, board.title));
    let image: PathBuf = image::build(board, options)?;
    let text = emulator::counted_output(board, &image, blob)?;
    let mut lines = BTreeMap::new();
    for line in text.lines().filter(|l| !l.trim().is_empty()) {
        let mut words = line.split_whitespace();
        let name = words.next().unwrap_or_default().to_owned();
        let mut numbers = words
            .map(|word| word.parse().with_context(|| format!("{}: the board printed `{line}`", board.name)))
            .collect::<Result<Vec<u64>>>()?;
        numbers.resize(numbers.len().max(3), 0);
        lines.insert(name, numbers);
    }
    if lines.is_empty() {
        bail!("{}: the program printed nothing", board.name);
    }
    Ok(lines)
}

/// A clip on another skeleton: a tenth larger, with additional joints at its ends.
fn foreign(clip: &Clip) -> Clip {
    let mut skeleton = Skeleton::clone(&clip.skeleton);
    for offset in &mut skeleton.offsets {
        *offset *= LARGER;
    }
    let own = skeleton.joints();
    for extra in 0..JOINTS.saturating_sub(own) {
        // Like fingers, children of the last joints.
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
