//! Options that several commands have.

use std::path::{Path, PathBuf};

use anyhow::Result;
use gestus_motion::unit::Unit;
use serde_json::Value;

use super::outputs::say;
use crate::{
    retarget::{MapFile, axis},
    stream::{course::Root, input::InputOptions},
};

/// How a command reports its result.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct ReportArgs {
    /// One JSON object on standard output
    #[arg(long)]
    pub json: bool,
}

impl ReportArgs {
    /// Prints the result to standard output: with `--json` as one object, else as text for people.
    ///
    /// # Errors
    /// A standard output that takes nothing: a full disk.
    pub fn print(self, json: impl FnOnce() -> Value, text: impl FnOnce() -> String) -> Result<()> {
        if self.json { say(json()) } else { say(text()) }
    }
}

/// The clip that a command reads, where its body is compared with a database's.
#[derive(clap::Args, Clone, Debug)]
pub struct ClipArgs {
    /// The clip on any humanoid skeleton, BVH or glTF (`hero.glb#walk` is one of several animations)
    #[arg(long)]
    pub input: PathBuf,
    /// A file that says which joint is which body part, where names and shape don't
    #[arg(long)]
    pub map: Option<PathBuf>,
    /// The unit of the clip.
    #[command(flatten)]
    pub unit: UnitArgs,
    /// Its floor, and how its hips move.
    #[command(flatten)]
    pub ground: GroundArgs,
}

impl ClipArgs {
    /// What the user states about the clip.
    ///
    /// # Errors
    /// A map file that can't be read, and a floor that is too far away.
    pub fn reading(&self) -> Result<InputOptions> {
        self.ground.reading(self.map.as_deref(), self.unit.unit)
    }
}

/// Where the floor of a clip is, and whether its hips move as its body does.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct GroundArgs {
    /// Height of the floor in the clip, metres along its up. Default: the height at which its feet stand
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    pub floor: Option<f64>,
    /// Up in the clip: x, y, z, -x, -y or -z. Default: in glTF y, unless the body's walk shows another axis; in BVH
    /// found from the body
    #[arg(long, value_name = "AXIS", value_parser = axis::of_name, allow_hyphen_values = true)]
    pub up: Option<(usize, f64)>,
    /// Whether the body walks or runs in place, or its hips move over the ground with it. Default: found from its feet
    #[arg(long, value_name = "in-place|motion")]
    pub root: Option<Root>,
}

impl GroundArgs {
    /// What the user states about a clip, with a file that says which joint is which body part. Options win over the file.
    ///
    /// # Errors
    /// A map file that can't be read, and a floor that is too far away.
    pub fn reading(&self, map: Option<&Path>, unit: Option<Unit>) -> Result<InputOptions> {
        let mut map = map.map(MapFile::read).transpose()?.unwrap_or_default();
        map.up = self.up.or(map.up);
        let reading = InputOptions { map, unit, root: self.root, looped: false };
        reading.on_floor(self.floor).map_err(|e| anyhow::anyhow!("--{e}"))
    }
}

/// The unit of a clip's lengths.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct UnitArgs {
    /// Unit of the clip's lengths: m, cm, mm, inch, cmu, or metres a unit. Default: in glTF metres, in BVH a guess by
    /// the body's height; with a database, the unit in which the body has the size of the database's, if there is one
    #[arg(long)]
    pub unit: Option<Unit>,
}
