//! Standing feet after a change that nobody walks through: a leap of the input, and another style.

use std::sync::OnceLock;

use gestus_core::{Config, Database, Pose, Report, Stylizer};
use gestus_database::{
    build::{BuildOptions, build},
    stream::{Request, Streamed, stream, to_pose},
    synth,
};
use gestus_motion::{body::database_skeleton, clip::Clip};
use gestus_tests::motion::joined;

const STYLES: [&str; 3] = ["neutral", "old", "strutting"];

/// A database of generated walks, punches and kicks, and one more neutral clip of each.
fn generated() -> &'static (Vec<u8>, [Clip; 3]) {
    static GENERATED: OnceLock<(Vec<u8>, [Clip; 3])> = OnceLock::new();
    GENERATED.get_or_init(|| {
        let actions = ["walk", "punch", "kick"];
        let corpus = synth::corpus(&synth::Options::of(&actions, &STYLES, 3, 6.0)).unwrap();
        let unseen =
            |action: &str| synth::performance(77, action, "neutral", corpus.rate_hz, 6.0).unwrap().clip;
        (build(&corpus, &BuildOptions::default()).unwrap().bytes, actions.map(unseen))
    })
}

fn median(values: &[f32]) -> f32 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f32::total_cmp);
    sorted[sorted.len() / 2]
}

/// Mean distance of the feet of `streamed`, `from` frames after frame `start` on, from those of `alone`, metres, seen from the
/// root.
fn feet_apart(
    database: &Database<'_>,
    streamed: &Streamed,
    start: usize,
    alone: &Streamed,
    from: usize,
) -> f64 {
    let skeleton = database_skeleton(database);
    let legs = database.legs().unwrap();
    let feet = |of: &Streamed, t: usize| {
        let places = of.steps[t].frame.positions(&skeleton);
        legs.map(|leg| places[leg.ankle] - places[0])
    };
    let frames = from..alone.steps.len();
    let count = 2.0 * frames.len() as f64;
    let apart = |t: usize| {
        let (here, there) = (feet(streamed, start + t), feet(alone, t));
        here.iter().zip(&there).map(|(a, b)| (a - b).norm()).sum::<f64>()
    };
    frames.map(apart).sum::<f64>() / count
}

#[test]
fn after_a_leap_feet_stand_where_they_do_without_it() {
    let (bytes, [walk, punch, kick]) = generated();
    let database = Database::open(bytes).unwrap();
    for (clip, style) in [(punch, 1), (kick, 1), (punch, 2), (kick, 2)] {
        let run = |clip: &Clip| stream(&database, clip, &Request::style(style), &mut ()).unwrap();
        let apart = feet_apart(&database, &run(&joined(walk, clip)), walk.frames.len(), &run(clip), 15);
        assert!(apart < 0.02, "{} to {style}: {apart} m", clip.name);
    }
}

#[test]
fn after_a_change_of_style_a_standing_body_takes_the_stance_of_the_style() {
    let (bytes, [_, punch, _]) = generated();
    let database = Database::open(bytes).unwrap();
    // Forwards and backwards, without a leap.
    let there: Vec<Pose<22>> = punch.frames.iter().map(to_pose).collect();
    let back = there.iter().rev().skip(1).take(there.len() - 2);
    let poses: Vec<&Pose<22>> = there.iter().chain(back).cycle().take(300).collect();
    let (mut steps, mut off) = (0, Vec::new());
    for [from, to] in [[0, 1], [1, 0], [0, 2], [2, 0], [1, 2], [2, 1]] {
        let mut stylizer = Stylizer::<22, 16, 28>::new(database, Config::new()).unwrap();
        stylizer.set_style(&[(from, 1.0)]).unwrap();
        let mut output = Pose::IDENTITY;
        let mut last = Report::default();
        for (t, pose) in poses.iter().enumerate() {
            if t == 120 {
                stylizer.set_style(&[(to, 1.0)]).unwrap();
            }
            let report = stylizer.step(pose, &mut output);
            let begins = |side: usize| last.held[side] && !report.held[side] && last.held_m[side] > 0.05;
            steps += usize::from(t > 120 && (begins(0) || begins(1)));
            assert!(!(begins(0) && begins(1)), "{from} to {to}: both feet step at {t}");
            if t > 120 {
                off.push(report.held_m[0].max(report.held_m[1]));
            }
            last = report;
        }
    }
    assert!(steps > 0, "no foot was off");
    // During the punch itself a foot may be off: it moves in the prediction.
    let median = median(&off);
    assert!(median < 0.06, "feet are {median} m off in the median");
}
