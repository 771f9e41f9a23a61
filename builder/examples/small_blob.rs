//! Writes a blob that is as small as a whole one gets: nine joints that walk, in two styles. It is what the fuzzer
//! of `gestus_core::Database::open` starts from (`cargo xtask fuzz open`). A second file gets the blob cut to its
//! models: one without frames.
//!
//! `cargo run -p gestus-builder --example small_blob -- FILE [MODELS]`

use std::{f64::consts::TAU, sync::Arc};

use gestus_builder::{
    build::{BuildOptions, build},
    corpus::{Corpus, Cycle, Example},
    cut::models_only,
    effort::{Source, dial::Dial},
    motion::{Clip, Frame, Skeleton},
    write::with_section,
};
use gestus_core::blob::layout::section;
use nalgebra::{UnitQuaternion, Vector3};

const RATE_HZ: f64 = 30.0;
const FRAMES: usize = 40;
/// Frames of a gait cycle, by style.
const PERIOD: [f64; 2] = [12.0, 16.0];

fn main() -> anyhow::Result<()> {
    let Some(file) = std::env::args().nth(1) else { anyhow::bail!("name the file to write") };
    let skeleton = Arc::new(skeleton());
    let corpus = Corpus {
        skeleton: skeleton.clone(),
        rate_hz: RATE_HZ,
        actions: vec!["walk".into()],
        styles: vec!["neutral".into(), "proud".into()],
        examples: (0..PERIOD.len()).map(|style| example(&skeleton, style)).collect(),
    };
    // A small window and small blocks: less to mutate.
    let options = BuildOptions { window: 2, block_rows: 8, ..BuildOptions::default() };
    let built = build(&corpus, &options)?;
    let efforts = vec![Some([0.0, 0.0, 0.0]), Some([-0.5, 1.0, 0.8])];
    let dial = Dial::new(Source::Estimated, efforts, 0);
    let bytes = with_section(&built.bytes, section::EFFORT, &dial.section())?;
    std::fs::write(&file, &bytes)?;
    eprintln!("{file}: {} bytes", bytes.len());
    if let Some(models) = std::env::args().nth(2) {
        let cut = models_only(&gestus_core::Database::open(&bytes)?)?;
        std::fs::write(&models, &cut)?;
        eprintln!("{models}: {} bytes", cut.len());
    }
    Ok(())
}

/// Hips, two legs, a chest and two arms.
fn skeleton() -> Skeleton {
    let joints = [
        ("Hips", None, [0.0, 0.0, 0.0]),
        ("UpperLeg_L", Some(0), [0.1, -0.05, 0.0]),
        ("LowerLeg_L", Some(1), [0.0, -0.4, 0.0]),
        ("Foot_L", Some(2), [0.0, -0.4, 0.0]),
        ("UpperLeg_R", Some(0), [-0.1, -0.05, 0.0]),
        ("LowerLeg_R", Some(4), [0.0, -0.4, 0.0]),
        ("Foot_R", Some(5), [0.0, -0.4, 0.0]),
        ("Arm_L", Some(0), [0.2, 0.5, 0.0]),
        ("Arm_R", Some(0), [-0.2, 0.5, 0.0]),
    ];
    Skeleton {
        names: joints.iter().map(|j| j.0.to_owned()).collect(),
        parents: joints.iter().map(|j| j.1).collect(),
        offsets: joints.iter().map(|j| Vector3::from(j.2)).collect(),
    }
}

/// A walk: thighs and arms swing, knees bend, the hips go forward and sway.
fn example(skeleton: &Arc<Skeleton>, style: usize) -> Example {
    let period = PERIOD[style];
    let amplitude = 0.4 + 0.2 * style as f64;
    let about_x = |angle: f64| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), angle);
    let phase = |frame: usize| TAU * frame as f64 / period;
    let frames = (0..FRAMES).map(|i| {
        let swing = amplitude * phase(i).cos();
        let bend = |offset: f64| 0.5 * (1.0 - (phase(i) + offset).sin());
        let hips = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), 0.05 * phase(i).sin());
        Frame {
            root: Vector3::new(0.02 * phase(i).sin(), 0.9 + 0.02 * (2.0 * phase(i)).cos(), 0.04 * i as f64),
            rotations: [
                hips,
                about_x(-swing),
                about_x(bend(0.0)),
                about_x(-0.3 * bend(0.0)),
                about_x(swing),
                about_x(bend(TAU / 2.0)),
                about_x(-0.3 * bend(TAU / 2.0)),
                about_x(swing),
                about_x(-swing),
            ]
            .to_vec(),
        }
    });
    let clip = Clip {
        name: format!("walk-{style}"),
        skeleton: skeleton.clone(),
        rate_hz: RATE_HZ,
        frames: frames.collect(),
    };
    let cycles = (0..)
        .map(|i| Cycle { knots: [0.0, 0.5, 1.0].map(|p| (f64::from(i) + p) * period).to_vec() })
        .take_while(|c| c.span().1 < FRAMES as f64)
        .collect();
    let contacts = (0..FRAMES).map(|i| [phase(i).sin() > -0.1, phase(i).sin() < 0.1]).collect();
    Example { clip, action: 0, style, contacts, cycles, take: String::new(), licence: "generated".into() }
}
