//! Generated motion: a body of 21 joints that walks, by sines, in three styles, with cycles and contacts known exactly.
//!
//! It is no portrait of a walk. It has what the tests need: legs that swing, arms that swing against them, styles that
//! differ in posture, amplitude, phase and tempo, and a slow change of stride, so that no two cycles are the same.

use std::{
    f64::consts::TAU,
    sync::{Arc, OnceLock},
};

use gestus_database::{
    build::{BuildOptions, build},
    synth,
};
use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    corpus::{Corpus, Cycle, Example},
};
use nalgebra::{UnitQuaternion, Vector3};

/// Frames a second of everything here.
pub const RATE_HZ: f64 = 30.0;

/// Name, parent and offset (centimetres) of each joint: faces +Z, left is +X.
const JOINTS: [(&str, usize, [i32; 3]); 21] = [
    ("Hips", 0, [0, 0, 0]),
    ("Spine", 0, [0, 10, 0]),
    ("Chest", 1, [0, 18, 0]),
    ("Neck", 2, [0, 22, 0]),
    ("Head", 3, [0, 10, 2]),
    ("Shoulder_L", 2, [4, 18, 0]),
    ("UpperArm_L", 5, [12, 0, 0]),
    ("LowerArm_L", 6, [26, 0, 0]),
    ("Hand_L", 7, [24, 0, 0]),
    ("Shoulder_R", 2, [-4, 18, 0]),
    ("UpperArm_R", 9, [-12, 0, 0]),
    ("LowerArm_R", 10, [-26, 0, 0]),
    ("Hand_R", 11, [-24, 0, 0]),
    ("UpperLeg_L", 0, [9, -4, 0]),
    ("LowerLeg_L", 13, [0, -40, 0]),
    ("Foot_L", 14, [0, -41, 0]),
    ("Toes_L", 15, [0, -5, 13]),
    ("UpperLeg_R", 0, [-9, -4, 0]),
    ("LowerLeg_R", 17, [0, -40, 0]),
    ("Foot_R", 18, [0, -41, 0]),
    ("Toes_R", 19, [0, -5, 13]),
];

/// Names of the styles. `raised` holds its arms a radian higher than `normal`.
pub const STYLES: [&str; 3] = ["normal", "heavy", "raised"];
/// Names of the actions.
pub const ACTIONS: [&str; 2] = ["walk", "turn"];

/// How much of a corpus is generated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    /// The first of [`ACTIONS`].
    pub actions: usize,
    /// The first of [`STYLES`].
    pub styles: usize,
    /// Clips a class.
    pub takes: usize,
    /// Frames a clip.
    pub frames: usize,
}

/// Classes that are searched whole.
pub const SMALL: Size = Size { actions: 2, styles: 3, takes: 3, frames: 96 };
/// Classes large enough for the search by graph.
pub const LARGE: Size = Size { actions: 2, styles: 3, takes: 3, frames: 260 };
/// The least that has more than one class: for tests that open a blob very often.
pub const TINY: Size = Size { actions: 1, styles: 2, takes: 1, frames: 120 };

/// The skeleton, joints named as in the databases.
pub fn skeleton() -> Arc<Skeleton> {
    Arc::new(Skeleton {
        names: JOINTS.iter().map(|j| j.0.to_owned()).collect(),
        parents: JOINTS.iter().enumerate().map(|(i, j)| (i > 0).then_some(j.1)).collect(),
        offsets: JOINTS.iter().map(|j| Vector3::from(j.2.map(|v| f64::from(v) / 100.0))).collect(),
    })
}

/// A clip of an action in a style. Takes differ in stride, tempo and phase; take numbers from `takes` of the corpus on
/// are clips that it does not hold.
pub fn example(action: usize, style: usize, take: usize, frames: usize) -> Example {
    let take_s = take as f64;
    // Frames of a cycle, never whole, so that cycles are sampled at different phases.
    let period = [31.3, 37.7, 29.1][style] + 0.83 * (take_s * 2.1).sin() + 1.3 * action as f64;
    let shift = 0.37 * take_s + 0.11;
    let yaw_rate = if action == 1 { 0.7 + 0.05 * take_s } else { 0.03 * take_s };
    let mut heading = 0.4 * take_s;
    let mut root = Vector3::new(0.2 * take_s, 0.0, -0.1 * take_s);
    let clip = (0..frames)
        .map(|t| {
            let phase = t as f64 / period + shift;
            // Stride changes slowly, by a tenth.
            let stride = 1.0 + 0.1 * (TAU * (t as f64 / 171.0 + 0.29 * take_s)).sin();
            let speed = [1.2, 0.8, 1.35][style] * stride;
            heading += yaw_rate * (1.0 + 0.2 * (TAU * phase).cos()) / RATE_HZ;
            root += Vector3::new(heading.sin(), 0.0, heading.cos()) * (speed / RATE_HZ);
            pose(phase, stride, style, heading, root)
        })
        .collect();
    // Left strikes are whole phases, right strikes lie between them.
    let first = shift.ceil();
    let strike = |n: f64| (first + n - shift) * period;
    let cycles = (0..)
        .map(|n| Cycle { knots: [0.0, 0.5, 1.0].map(|p| strike(f64::from(n) + p)).to_vec() })
        .take_while(|c| c.span().1 <= (frames - 1) as f64)
        .collect();
    let stands = |phase: f64| phase.rem_euclid(1.0) < 0.6;
    let contacts = (0..frames)
        .map(|t| t as f64 / period + shift)
        .map(|phase| [stands(phase), stands(phase + 0.5)])
        .collect();
    let name = format!("{}-{}-{take}", ACTIONS[action], STYLES[style]);
    Example {
        clip: Clip { name, skeleton: skeleton(), rate_hz: RATE_HZ, frames: clip },
        action,
        style,
        contacts,
        cycles,
        take: String::new(),
        licence: "generated".to_owned(),
    }
}

fn pose(phase: f64, stride: f64, style: usize, heading: f64, root: Vector3<f64>) -> Frame {
    let turn = |x: f64, y: f64, z: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z));
    let wave = |lead: f64| (TAU * (phase + lead)).sin();
    let double = |lead: f64| (2.0 * TAU * (phase + lead)).sin();
    let swing = [0.5, 0.35, 0.6][style] * stride;
    let stoop = [0.05, 0.35, -0.1][style];
    let lift = [0.0, 0.15, 1.0][style];
    let lag = [0.0, 0.05, -0.03][style];
    let mut rotations = vec![UnitQuaternion::identity(); JOINTS.len()];
    let y = turn(0.0, heading, 0.0);
    rotations[0] = y * turn(0.3 * stoop, 0.08 * swing * wave(0.0), 0.04 * wave(0.25));
    rotations[1] = turn(stoop + 0.03 * double(lag), -0.1 * swing * wave(0.1), 0.0);
    rotations[2] = turn(0.5 * stoop, -0.2 * swing * wave(0.05), 0.03 * wave(0.4));
    rotations[3] = turn(-0.4 * stoop, 0.05 * wave(0.3), 0.0);
    rotations[4] = turn(-0.2 * stoop + 0.02 * double(0.2), 0.04 * wave(0.6), 0.0);
    for (side, sign) in [(0, 1.0), (1, -1.0)] {
        let half = 0.5 * side as f64;
        let (arm, leg) = (5 + 4 * side, 13 + 4 * side);
        rotations[arm] = turn(0.0, 0.05 * sign * wave(half + lag), 0.02);
        // From the T pose down, less what the style lifts; then the swing, against the leg of the same side.
        let down = turn(0.0, 0.0, sign * (lift - 1.2));
        rotations[arm + 1] = turn(-0.8 * swing * wave(half + 0.75 + lag), 0.0, 0.0) * down;
        rotations[arm + 2] = turn(0.0, -sign * (0.4 + 0.25 * swing * wave(half + 0.8 + lag)), 0.0);
        rotations[arm + 3] = turn(0.05 * wave(half + 0.1), 0.0, 0.04 * double(half));
        let bend = 0.5 + 0.45 * wave(half + 0.6 + lag) + 0.1 * double(half + 0.1);
        rotations[leg] = turn(-swing * wave(half + 0.25) - 0.1, 0.03 * sign, 0.02 * wave(half));
        rotations[leg + 1] = turn(swing * bend, 0.0, 0.0);
        rotations[leg + 2] = turn(0.2 * swing * wave(half + 0.4), 0.0, 0.02 * sign);
        rotations[leg + 3] = turn(0.15 * wave(half + 0.1), 0.0, 0.0);
    }
    let height = 0.88 - 0.03 * style as f64 + 0.02 * stride * double(0.1);
    Frame { root: Vector3::new(root.x, height, root.z), rotations }
}

/// A corpus of that size.
pub fn corpus(size: Size) -> Corpus {
    let names = |names: &[&str], count: usize| names.iter().take(count).map(|n| (*n).to_owned()).collect();
    let classes = (0..size.actions).flat_map(|a| (0..size.styles).map(move |s| (a, s)));
    Corpus {
        skeleton: skeleton(),
        rate_hz: RATE_HZ,
        actions: names(&ACTIONS, size.actions),
        styles: names(&STYLES, size.styles),
        examples: classes
            .flat_map(|(a, s)| (0..size.takes).map(move |take| example(a, s, take, size.frames)))
            .collect(),
    }
}

/// The blob of a corpus of that size.
///
/// # Panics
/// Where the corpus can't be built: a fault of this module or of the builder.
pub fn blob(size: Size) -> Vec<u8> {
    built(size, &BuildOptions::default())
}

/// The same without a search graph.
///
/// # Panics
/// As [`blob`].
pub fn without_graph(size: Size) -> Vec<u8> {
    built(size, &BuildOptions { graph: false, ..BuildOptions::default() })
}

fn built(size: Size, options: &BuildOptions) -> Vec<u8> {
    build(&corpus(size), options).expect("the generated corpus is complete").bytes
}

/// The blob of [`SMALL`], built once.
pub fn small() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| blob(SMALL))
}

/// The blob of [`LARGE`], built once.
pub fn large() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| blob(LARGE))
}

/// The blob of [`TINY`], built once.
pub fn tiny() -> &'static [u8] {
    static BLOB: OnceLock<Vec<u8>> = OnceLock::new();
    BLOB.get_or_init(|| blob(TINY))
}

/// A walker of [`synth`], whose feet do not slide: a database of three clips of each style less one, and that one, in
/// the first style.
///
/// # Panics
/// As [`blob`].
pub fn walker(styles: &[&str], seconds: f64) -> (Vec<u8>, Clip) {
    let corpus = synth::corpus(&synth::Options::of(&["walk"], styles, 3, seconds)).expect("it has legs");
    let test = corpus.examples.iter().position(|e| corpus.styles[e.style] == styles[0]).expect("a style");
    let built = build(&corpus.without(&[test]), &BuildOptions::default()).expect("the corpus is complete");
    (built.bytes, corpus.examples[test].clip.clone())
}

/// A clip that is in no database here.
pub fn unseen(action: usize, style: usize, frames: usize) -> Clip {
    example(action, style, 7, frames).clip
}

/// Two clips as one: the second goes on where the first ends, with a jump of pose.
pub fn joined(first: &Clip, second: &Clip) -> Clip {
    let mut clip = first.clone();
    clip.frames.extend(second.frames.iter().cloned());
    clip
}
