//! `gestus retarget`.

use std::path::PathBuf;

use anyhow::{Context, Result, bail};
use gestus_core::retarget::layout::MAX_SOURCES;
use gestus_database::{
    command_line::options::{ClipArgs, ReportArgs},
    retarget::{Retarget, check},
    stream::{input::Input, reading::read_clip, verdict},
};
use gestus_motion::{formats::bvh::Bvh, unit::Unit};
use serde_json::json;

use super::open;

/// Map a clip's skeleton to a database's: show the mapping, write the mapped clip, write the map for a board.
#[derive(clap::Args)]
pub struct Args {
    /// The database
    #[arg(long)]
    db: PathBuf,
    #[command(flatten)]
    clip: ClipArgs,
    /// Show the mapping and its doubts
    #[arg(long)]
    check: bool,
    /// File for the clip on the database's skeleton, BVH in centimetres
    #[arg(short, long)]
    output: Option<PathBuf>,
    /// File for the map that a board needs to take poses of this skeleton
    #[arg(long)]
    section: Option<PathBuf>,
    #[command(flatten)]
    report: ReportArgs,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    if !args.check && args.output.is_none() && args.section.is_none() {
        bail!("nothing to do: give --check, -o OUT.bvh or --section OUT.gestus");
    }
    super::check_outputs(
        [Some(&args.db), Some(&args.clip.input), args.clip.map.as_ref()],
        [("-o", args.output.as_ref()), ("--section", args.section.as_ref())],
    )?;
    super::check_clip("-o", args.output.as_ref(), None)?;
    let bytes = open::read_blob(&args.db)?;
    let database = open::open(&args.db, &bytes)?;
    let reading = args.clip.reading()?;
    let (document, binding, clip) =
        read_clip(&args.clip.input, &database, args.clip.unit.unit, reading.map.hips())?;
    super::tell(&args.clip.input, binding.notes());
    let place = || args.clip.input.display().to_string();
    let retarget =
        Retarget::new(&database, &clip, &reading.map.of_document(&document)).with_context(place)?;
    if let Some(path) = &args.output {
        let mapped = retarget.to_target(&clip);
        open::write(path, Bvh::from_clip(&mapped, Unit::Centimetres)?.to_text())?;
    }
    if let Some(path) = &args.section {
        if retarget.kept.is_part() {
            bail!(
                "{}: a board takes poses of at most {MAX_SOURCES} joints, and this skeleton has {}: export the clip without \
                 the joints of face, hair and clothes",
                place(),
                clip.skeleton.joints()
            );
        }
        open::write(path, retarget.bytes())?;
    }
    if args.report.json {
        let mut object = check::json(&retarget);
        object["input"] = json!(place());
        object["frames"] = json!(clip.frames.len());
        if args.check {
            let input = Input::read_with(&args.clip.input, &database, &reading)?;
            object["same_body"] = json!(input.retarget().is_none());
            object["verdict"] = verdict::before(&database, &input).with_context(place)?.json();
            object["root"] = input.json()["root"].clone();
            object["speed_m_s"] = input.json()["speed_m_s"].clone();
        }
        super::say(&object)
    } else if args.check {
        super::say(check::text(&retarget).trim_end())?;
        let input = Input::read_with(&args.clip.input, &database, &reading)?;
        if input.retarget().is_none() {
            super::say(
                "this is the database's own body: `translate` takes it joint by joint, without this map",
            )?;
        }
        if let Some(course) = input.course() {
            super::say(format_args!("walks in place, at {:.2} m/s by its feet", course.speed_m_s))?;
        }
        super::say(verdict::before(&database, &input).with_context(place)?.sentences().join("\n"))
    } else {
        let doubts = retarget.doubts();
        for doubt in &doubts {
            super::note(format_args!("doubt: {doubt}"));
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
