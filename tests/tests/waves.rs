//! Gestures that repeat themselves: a quick wave with many repetitions becomes a slow one with few.

use std::f64::consts::TAU;

use gestus_core::{Config, Database, Method, Pose, Stylizer};
use gestus_database::{
    build::{BuildOptions, build},
    stream::{from_pose, to_pose},
};
use gestus_motion::{
    clip::{Clip, Frame},
    corpus::{Corpus, Cycle, Example},
};
use gestus_tests::motion::{RATE_HZ, skeleton};
use nalgebra::{UnitQuaternion, Vector3};

/// The forearm that waves, and the upper arm that is raised for it.
const FOREARM: usize = 7;
const STYLES: [&str; 2] = ["quick", "slow"];
/// How often the hand goes to and fro in a clip of each style, and the frames that it takes.
const REPETITIONS: [f64; 2] = [8.0, 3.0];
const FRAMES: [f64; 2] = [150.0, 190.0];
/// How far the forearm turns to either side, radians.
const SWING: [f64; 2] = [0.4, 0.6];
const PLAIN: Config = Config::new().contacts(false).speed_limit(0.0);

/// By what part of a repetition the waves of a take come later than those of the take before.
const LATER: f64 = 0.1;

/// A take: an arm that is raised, waves, and is lowered. Takes differ in tempo, and their waves come `later` by part of a
/// repetition.
fn example(style: usize, take: usize, later: f64) -> Example {
    let take_s = take as f64;
    let frames = (FRAMES[style] * (1.0 + 0.06 * (2.3 * take_s).sin())) as usize;
    let pose = |t: usize| {
        let part = t as f64 / (frames - 1) as f64;
        let raised = (5.0 * part.min(1.0 - part)).min(1.0);
        let raised = raised * raised * (3.0 - 2.0 * raised);
        let phase = REPETITIONS[style] * part + later * take_s;
        let turn = |x: f64, y: f64, z: f64| UnitQuaternion::from_scaled_axis(Vector3::new(x, y, z));
        let mut rotations = vec![UnitQuaternion::identity(); skeleton().names.len()];
        rotations[FOREARM - 1] = turn(0.0, 0.0, 1.7 * raised - 1.2);
        rotations[FOREARM] = turn(0.0, 0.0, raised * (0.5 + SWING[style] * (TAU * phase).sin()));
        rotations[10] = turn(0.0, 0.0, 1.2);
        Frame { root: Vector3::new(0.0, 0.88, 0.0), rotations }
    };
    let last = (frames - 1) as f64;
    let name = format!("wave-{}-{take}", STYLES[style]);
    let clip = Clip { name, skeleton: skeleton(), rate_hz: RATE_HZ, frames: (0..frames).map(pose).collect() };
    Example {
        clip,
        action: 0,
        style,
        contacts: vec![[true; 2]; frames],
        // The clip whole, at equal steps.
        cycles: vec![Cycle { knots: (0..=8).map(|i| last * f64::from(i) / 8.0).collect() }],
        take: String::new(),
        licence: "generated".to_owned(),
    }
}

/// How far the forearm turns about its mean direction in the waving part of a motion: root mean square, radians.
fn swing(frames: &[Frame]) -> f64 {
    let waving = &frames[frames.len() / 4..frames.len() * 3 / 4];
    let angles: Vec<f64> = waving.iter().map(|f| f.rotations[FOREARM].scaled_axis().z).collect();
    let mean = angles.iter().sum::<f64>() / angles.len() as f64;
    (angles.iter().map(|a| (a - mean).powi(2)).sum::<f64>() / angles.len() as f64).sqrt()
}

/// Streams quick waves to the slow style, learnt from takes whose waves come `later`.
fn delivered(config: Config, later: f64, input: &[Frame]) -> Vec<Frame> {
    let names = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
    let corpus = Corpus {
        skeleton: skeleton(),
        rate_hz: RATE_HZ,
        actions: names(&["wave"]),
        styles: names(&STYLES),
        examples: (0..2).flat_map(|style| (0..3).map(move |take| example(style, take, later))).collect(),
    };
    let blob = build(&corpus, &BuildOptions::default()).expect("the corpus is complete").bytes;
    let mut stylizer = Stylizer::<21, 40, 2>::new(Database::open(&blob).unwrap(), config).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    let step = |frame: &Frame| {
        let _ = stylizer.step(&to_pose(frame), &mut output);
        from_pose(&output, 21)
    };
    input.iter().map(step).collect()
}

/// The swing of a quick wave in the slow style, over that of real slow ones.
fn kept(config: Config, later: f64) -> f64 {
    let real = (0..3).map(|take| swing(&example(1, take, later).clip.frames)).sum::<f64>() / 3.0;
    swing(&delivered(config, later, &example(0, 7, later).clip.frames)) / real
}

/// Largest change of the turn that a joint of the arm makes in a frame, radians.
fn jerk(frames: &[Frame]) -> f64 {
    let turns = |joint: usize| {
        let turn = move |pair: &[Frame]| {
            (pair[0].rotations[joint].inverse() * pair[1].rotations[joint]).scaled_axis()
        };
        frames.windows(2).map(turn).collect::<Vec<_>>()
    };
    let changes = [FOREARM - 1, FOREARM].map(turns);
    changes
        .iter()
        .flat_map(|turns| turns.windows(2).map(|pair| (pair[1] - pair[0]).norm()))
        .fold(0.0, f64::max)
}

#[test]
fn a_wave_still_waves_in_a_style_that_repeats_it_less_often() {
    let (followed, nearest) = (kept(Config::new(), LATER), kept(Config::new().follow(0.0), LATER));
    assert!(
        followed > 0.7 && nearest < 0.8 * followed,
        "{followed} followed, {nearest} by the nearest frames"
    );
}

#[test]
fn waves_of_takes_at_other_moments_do_not_cancel() {
    // The mean of two waves a quarter of a wave apart swings 0.7 times as far as either.
    for (later, least) in [(0.25, 0.68), (0.3, 0.8), (0.5, 0.8)] {
        let kept = kept(Config::new(), later);
        assert!(kept > least, "{later} of a wave later: {kept}");
    }
}

#[test]
fn an_arm_that_falls_early_sets_off_gently() {
    // Three of the eight waves are left out: the arm is lowered while the clips of the database still wave.
    let take = example(0, 7, LATER).clip.frames;
    let at = |part: f64| (part * (take.len() - 1) as f64) as usize;
    let input = [&take[..at(0.44)], &take[at(0.44 + 3.0 / REPETITIONS[0])..]].concat();
    // An output of the mixture that keeps 72% of its distance in a frame, and no velocity, has a third of the jerk. One of
    // the tables that keeps 43%, and no velocity, has 0.38 of it.
    for (method, most) in [(Method::Mar, 0.22), (Method::Phase, 0.35)] {
        let config = |settle_s| PLAIN.method(method).settle_s(settle_s);
        let [plain, gentle] = [0.0, 0.1].map(|settle_s| jerk(&delivered(config(settle_s), LATER, &input)));
        assert!(gentle < most * plain, "{method:?}: {gentle} of {plain} rad");
    }
}
