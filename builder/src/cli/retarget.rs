//! `gestus retarget`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_database::{
    retarget::{MapFile, Retarget, check},
    stream::translate::read_clip,
};
use gestus_motion::formats::bvh::{Bvh, Unit};
use serde_json::json;

use super::open;

/// Map a clip's skeleton to a database's: show the mapping, write the mapped clip, write the map for a board.
#[derive(clap::Args)]
pub struct Args {
    /// The database
    #[arg(long)]
    db: PathBuf,
    /// The clip on any humanoid skeleton, BVH or glTF (`hero.glb#walk` is one of several animations)
    #[arg(long)]
    input: PathBuf,
    /// A file that says which joint is which body part, where names and shape don't
    #[arg(long)]
    map: Option<PathBuf>,
    /// Unit of the clip's lengths: m, cm, mm, inch, cmu, or metres a unit; where left out, the one in which the body is
    /// the database's, or else guessed by its height
    #[arg(long)]
    unit: Option<Unit>,
    /// Show the mapping and its doubts
    #[arg(long)]
    check: bool,
    /// Where the clip on the database's skeleton goes, a BVH file in centimetres
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// Where the map for the core goes: what a board needs to take poses of this skeleton
    #[arg(long)]
    section: Option<PathBuf>,
    /// One JSON object on standard output
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    if !args.check && args.output.is_none() && args.section.is_none() {
        bail!("nothing to do: give --check, -o OUT.bvh or --section OUT.gestus");
    }
    super::check_outputs(
        [Some(&args.db), Some(&args.input), args.map.as_ref()],
        [("-o", args.output.as_ref()), ("--section", args.section.as_ref())],
    )?;
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    let file = args.map.as_deref().map(MapFile::read).transpose()?.unwrap_or_default();
    let (_, binding, clip) = read_clip(&args.input, &database, args.unit)?;
    super::tell(&args.input, binding.notes());
    let place = || args.input.display().to_string();
    let retarget = Retarget::new(&database, &clip, &file).with_context(place)?;
    if let Some(path) = &args.output {
        let mapped = retarget.to_target(&clip);
        let document = Bvh::from_clip(&mapped, Unit::Centimetres)?;
        std::fs::write(path, document.to_text())
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    if let Some(path) = &args.section {
        std::fs::write(path, retarget.bytes())
            .with_context(|| format!("{} can't be written", path.display()))?;
    }
    if args.json {
        let mut object = check::json(&retarget);
        object["input"] = json!(place());
        object["frames"] = json!(clip.frames.len());
        super::say(&object)
    } else if args.check {
        super::say(check::text(&retarget).trim_end())
    } else {
        let doubts = retarget.doubts();
        for doubt in &doubts {
            eprintln!("doubt: {doubt}");
        }
        super::say(format_args!(
            "{}: {} frames, {} joints to {}, {} doubts",
            place(),
            clip.frames.len(),
            clip.skeleton.joints(),
            retarget.target.skeleton.joints(),
            doubts.len()
        ))
    }
}
