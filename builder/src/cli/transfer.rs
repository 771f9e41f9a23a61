//! `gestus transfer`.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, anyhow, bail};
use clap::value_parser;
use gestus_database::{
    command_line::options::{ReportArgs, UnitArgs},
    models::statistic::transfer::{self, mean_offset},
    retarget::{MapFile, Retarget, axis, file::check_floor, up},
    stream::{cleanup::Limbs, far::Place, is_same_body},
};
use gestus_evaluate::metrics::{feet::skate_cm_s, performance::Performance};
use gestus_motion::{
    binding::{Binding, Options, to_clip},
    body::Body,
    capture::{self, Document},
    clip::Clip,
    corpus::Corpus,
    unit::Unit,
};
use serde_json::json;

use super::open;

/// Shortest clip that shows a style, seconds: less than half a step.
const MIN_REFERENCE_S: f64 = 1.0 / 3.0;

/// Give a clip the style of another clip, without a database: any clip is a style.
#[derive(clap::Args)]
pub struct Args {
    /// The clip, BVH or glTF (`hero.glb#walk` is one of several animations)
    #[arg(long)]
    input: PathBuf,
    /// The clip that has the style. It is retargeted if its skeleton is another
    #[arg(long)]
    reference: PathBuf,
    #[command(flatten)]
    unit: UnitArgs,
    /// Height of the floor in the clip, metres. Default: the height at which its feet stand
    #[arg(long, value_name = "M", allow_hyphen_values = true)]
    floor: Option<f64>,
    /// Up in the clip: x, y, z, -x, -y or -z. Default: in glTF y, unless the body's walk shows another axis; in BVH
    /// found from the body
    #[arg(long, value_name = "AXIS", value_parser = axis::of_name, allow_hyphen_values = true)]
    up: Option<(usize, f64)>,
    /// Up in the reference, as --up
    #[arg(long, value_name = "AXIS", value_parser = axis::of_name, allow_hyphen_values = true)]
    reference_up: Option<(usize, f64)>,
    /// Rounds from the recursive mean of rotations towards the geodesic one; 0 is the paper's own, 1000
    /// at most
    #[arg(long, default_value_t = 0, value_parser = value_parser!(u64).range(..=1000))]
    rounds: u64,
    /// Euler angles instead of quaternions, to compare
    #[arg(long)]
    euler: bool,
    /// Map every frame through the time warp and back, as the paper does, instead of weighing it by the warp
    #[arg(long)]
    literal: bool,
    /// Leave foot skate in the output: feet that stand in the clip may slide
    #[arg(long)]
    no_clean_up: bool,
    /// The output: BVH, or glTF where the input is, with its meshes and with the ending of its name
    #[arg(short, long)]
    output: PathBuf,
    /// Name of the animation in a glTF output: another one than the input's is added, or replaced if it is there.
    /// Default: the input's is replaced
    #[arg(long, value_name = "NAME")]
    animation: Option<String>,
    #[command(flatten)]
    report: ReportArgs,
}

/// A clip that was read.
struct Read {
    document: Document,
    binding: Binding,
    /// Near the origin, with Y up.
    clip: Clip,
    place: Place,
    doubt: Option<String>,
}

/// Reads a clip; `option` states its up.
fn read(path: &Path, unit: Option<Unit>, option: &str, up: Option<(usize, f64)>) -> Result<Read> {
    let document = capture::read(path)?;
    let name = path.display();
    let options = Options { unit, ..Options::default() };
    let (clip, binding) = to_clip(&document, &options).with_context(|| name.to_string())?;
    for note in binding.notes() {
        super::note(format_args!("{name}: {note}"));
    }
    let file = MapFile { up, ..MapFile::default() }.of_document(&document);
    let doubt = up::doubt(&clip, &file).map(|doubt| doubt.replace("--up", option));
    super::tell(path, doubt.iter().map(|doubt| format!("doubt: {doubt}")));
    let place = Place::of(&clip, &file);
    Ok(Read { document, binding, clip: place.near(&clip), place, doubt })
}

/// Mean speed on the ground of feet that stand in the output, cm/s; none where none stands.
fn skate(body: &Body, source: &Clip, out: &transfer::Transferred) -> Option<f64> {
    let (limbs, _) = Limbs::of_clip(body, source)?;
    let performance = Performance {
        frames: out.clip.frames.clone(),
        steps_s: vec![1.0 / source.rate_hz; out.clip.frames.len()],
        stands: out.contacts.clone(),
    };
    Some(skate_cm_s(&body.skeleton, limbs.legs(), &performance))
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    super::check_clip("-o", Some(&args.output), Some(&args.input))?;
    super::check_animation(args.animation.as_deref(), &args.output)?;
    super::check_outputs([Some(&args.input), Some(&args.reference)], [("-o", Some(&args.output))])?;
    args.floor.map(check_floor).transpose().map_err(|e| anyhow!("--{e}"))?;
    let Read { document, binding, clip: source, place, doubt } =
        read(&args.input, args.unit.unit, "--up", args.up)?;
    let reference = read(&args.reference, args.unit.unit, "--reference-up", args.reference_up)?;
    let mut doubts: Vec<String> = doubt.into_iter().chain(reference.doubt).collect();
    let reference = reference.clip;
    let retargeted = !is_same_body(&reference.skeleton, &source.skeleton);
    let reference = match retargeted {
        false => reference,
        true => {
            let place = || args.reference.display().to_string();
            let (mapped, more) = Retarget::between(&reference, &source).with_context(place)?;
            super::tell(&args.reference, [format!("retargeted to the skeleton of {}", args.input.display())]);
            super::tell(&args.reference, more.iter().map(|doubt| format!("doubt: {doubt}")));
            doubts.extend(more);
            mapped
        }
    };
    let reference = reference.fitted(source.rate_hz).with_context(|| args.reference.display().to_string())?;
    let least = (MIN_REFERENCE_S * source.rate_hz).ceil() as usize;
    if reference.frames.len() < least {
        bail!(
            "{}: {} frames, which show no style: give a clip of {least} frames or more",
            args.reference.display(),
            reference.frames.len()
        );
    }
    let body = Body::of(&Corpus::of_clip(&source)).with_context(|| args.input.display().to_string())?;
    let clean_up = !args.no_clean_up;
    let options = transfer::Options {
        rounds: args.rounds as usize,
        euler: args.euler,
        literal: args.literal,
        clean_up,
        floor_m: args.floor.map(|metres| metres - place.height_m()),
        ..Default::default()
    };
    let out = transfer::transfer(&body, &source, &reference, &options)
        .with_context(|| args.input.display().to_string())?;
    let bytes = document
        .write(&binding, &place.back(&out.clip), &args.output, args.animation.as_deref())
        .with_context(|| args.output.display().to_string())?;
    open::write(&args.output, bytes)?;
    let plants = out.footplants;
    super::tell(&args.input, plants.doubt().map(|doubt| format!("doubt: {doubt}")));
    doubts.extend(plants.doubt());
    let skate = skate(&body, &source, &out);
    let offset = mean_offset(&body, &reference);
    args.report.print(
        || json!({
            "frames": out.clip.frames.len(), "reference_frames": reference.frames.len(), "warp_ms": out.warp_ms,
            "transfer_ms": out.transfer_ms, "clean_up_ms": out.clean_up_ms, "recursive_mean_off_deg": offset.to_degrees(),
            "clean_up": clean_up, "retargeted": retargeted, "floor_m": out.floor_m + place.height_m(), "skate_cm_s": skate,
            "footplants": plants.all, "footplants_dropped": plants.dropped, "footplants_shortened": plants.shortened,
            "doubts": doubts, "output": super::shown(&args.output),
        }),
        || format!(
            "{}: {} frames in the style of {}; warp {:.1} ms, transfer {:.2} ms, clean-up {:.1} ms; the recursive mean is {:.2} degrees off the geodesic one at most",
            args.output.display(),
            out.clip.frames.len(),
            args.reference.display(),
            out.warp_ms,
            out.transfer_ms,
            out.clean_up_ms,
            offset.to_degrees()
        ),
    )
}
