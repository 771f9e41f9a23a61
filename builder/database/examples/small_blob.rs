//! Writes a blob that is as small as a whole one gets: nine joints that walk, in two styles. It is what the fuzzer
//! of `gestus_core::Database::open` starts from (`cargo xtask fuzz open`). A second file gets the blob cut to its
//! models: one without frames.
//!
//! With a third file, the tables of a robot of one hinge for it, for the fuzzer of the link.
//!
//! `cargo run -p gestus-database --example small_blob -- FILE [MODELS [ROBOT]]`

use std::{f64::consts::TAU, sync::Arc};

use gestus_core::{
    Database,
    blob::{crc::crc32c, layout::section},
    robot::{
        Robot,
        layout::{self, group, header, hinge, joint},
    },
};
use gestus_database::{
    blob::{assemble::with_section, cut::models_only},
    build::{BuildOptions, build},
    effort::{Source, dial::Dial},
};
use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    corpus::{Corpus, Cycle, Example},
};
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
    if let Some(file) = std::env::args().nth(3) {
        let database = Database::open(&bytes).map_err(|error| anyhow::anyhow!("{error}"))?;
        let tables = robot(&database, &corpus.skeleton);
        Robot::open(&tables)
            .map_err(|error| anyhow::anyhow!("{error}"))?
            .fits(&database, 1)
            .map_err(|error| anyhow::anyhow!("{error}"))?;
        std::fs::write(&file, &tables)?;
        eprintln!("{file}: {} bytes", tables.len());
    }
    Ok(())
}

/// The tables of a robot with one hinge, a left knee.
fn robot(database: &Database<'_>, skeleton: &Skeleton) -> Vec<u8> {
    const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
    const X: [f32; 3] = [1.0, 0.0, 0.0];
    let joints = skeleton.joints();
    let mut bytes = vec![0; layout::total(joints, 1, 1, 0)];
    let mut put = |at: usize, data: &[u8]| bytes[at..at + data.len()].copy_from_slice(data);
    let floats = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    put(header::MAGIC.start, &layout::MAGIC);
    put(header::VERSION.start, &layout::VERSION.to_le_bytes());
    put(header::HINGES.start, &1u16.to_le_bytes());
    put(header::TARGETS.start, &(joints as u16).to_le_bytes());
    put(header::GROUPS.start, &1u16.to_le_bytes());
    put(header::TOTAL.start, &(layout::total(joints, 1, 1, 0) as u32).to_le_bytes());
    put(header::SKELETON.start, &database.skeleton_fingerprint().to_le_bytes());
    put(header::TICK.start, &0.02f32.to_le_bytes());
    put(header::BASE.start, &floats(&IDENTITY));
    let mut at = header::LENGTH;
    for (parent, offset) in skeleton.parents.iter().zip(&skeleton.offsets) {
        put(at + joint::PARENT, &[parent.map_or(u8::MAX, |p| p as u8)]);
        put(at + joint::OFFSET.start, &floats(&offset.map(|v| v as f32).as_slice()[..3]));
        at += joint::LENGTH;
    }
    put(at + hinge::PARENT, &[layout::BASE]);
    put(at + hinge::TURN.start, &floats(&IDENTITY));
    put(at + hinge::AXIS.start, &floats(&X));
    put(at + hinge::LIMITS.start, &floats(&[-0.2, 2.0, 6.0, 120.0, 5000.0]));
    put(at + hinge::SERVO.start, &floats(&[1500.0, 400.0, 0.9, 600.0, 2400.0]));
    at += hinge::LENGTH;
    put(at + group::COUNT, &[1]);
    put(at + group::JOINT, &[2]);
    put(at + group::TURN.start, &floats(&IDENTITY));
    put(at + group::ZERO.start, &floats(&IDENTITY));
    put(at + group::AXES.start, &floats(&X));
    put(at + group::POINTED.start, &floats(&[0.0, -1.0, 0.0]));
    let crc = crc32c(&[&bytes]);
    bytes[header::CRC].copy_from_slice(&crc.to_le_bytes());
    bytes
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
