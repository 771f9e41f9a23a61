//! Options that several commands have.

use std::path::PathBuf;

use anyhow::Result;
use gestus_motion::unit::Unit;
use serde_json::Value;

use super::outputs::say;

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
}

/// The unit of a clip's lengths.
#[derive(clap::Args, Clone, Copy, Debug)]
pub struct UnitArgs {
    /// Unit of the clip's lengths: m, cm, mm, inch, cmu, or metres a unit. Where left out: the unit in which the body has
    /// the size of the database's, or else a guess by its height
    #[arg(long)]
    pub unit: Option<Unit>,
}
