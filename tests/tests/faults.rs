//! Streams with faults and foot locking: frames that are dropped, repeated, late or corrupted neither pull a foot off the
//! floor nor disturb the lock after the faults.

use std::sync::OnceLock;

use gestus_core::{Config, Database, Safety};
use gestus_database::stream::{Request, Streamed, stream, to_pose};
use gestus_evaluate::metrics::{feet::skate_cm_s, performance::Performance, speed::peak_speeds};
use gestus_firmware_sim::faults::{Arrival, Arrivals, Disturbance, Faults, RECOVERED_M};
use gestus_motion::{body::database_skeleton, clip::Clip};
use gestus_tests::motion;

/// Frames after the faults in which a stream recovers: 3 s.
const CALM: usize = 90;

/// Each kind of fault, and all of them at once.
const KINDS: [&str; 5] = [
    "drop=0.1,seed=5",
    "repeat=0.1,seed=5",
    "delay=0.1:3,seed=5",
    "corrupt=0.1,seed=5",
    "drop=0.05,repeat=0.05,delay=0.05:3,corrupt=0.05,seed=8",
];

/// A generated walker whose feet do not slide: a database, and a clip that is not in it.
fn walker() -> &'static (Vec<u8>, Clip) {
    static WALKER: OnceLock<(Vec<u8>, Clip)> = OnceLock::new();
    WALKER.get_or_init(|| motion::walker(&["neutral", "old", "childlike"], 9.0))
}

/// Faults in all but the last frames, which arrive undisturbed.
fn arrivals(faults: &str, clip: &Clip, joints: usize) -> Arrivals {
    let faults: Faults = faults.parse().unwrap();
    let calm = clip.frames.len() - CALM;
    let mut arrivals = faults.arrivals(calm, joints);
    arrivals.all.extend((calm..clip.frames.len()).map(|frame| Arrival { frame, flipped: None }));
    arrivals.sent += CALM;
    arrivals
}

fn run(database: &Database<'_>, clip: &Clip, config: Config) -> Streamed {
    stream(database, clip, &Request { config, ..Request::style(1) }, &mut ()).unwrap()
}

#[test]
fn feet_are_held_through_faults_and_the_stream_comes_back() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    let (legs, skeleton) = (database.legs().unwrap(), database_skeleton(&database));
    let undisturbed = run(&database, clip, Config::new());
    let held_frames = |s: &Streamed| s.steps.iter().filter(|s| s.report.held.contains(&true)).count();
    assert!(held_frames(&undisturbed) > clip.frames.len() / 2, "nothing to hold");
    for kind in KINDS {
        let arrivals = arrivals(kind, clip, database.counts().joints);
        let arrived = arrivals.clip(clip);
        let held = run(&database, &arrived, Config::new());
        let raw = run(&database, &arrived, Config::new().contacts(false));
        // Every output is a valid pose, and no foot is further from its prediction than the lock allows.
        for (t, step) in held.steps.iter().enumerate() {
            assert!(to_pose::<22>(&step.frame).is_valid(database.counts().joints), "{kind}: frame {t}");
            let far =
                step.report.held_m.into_iter().zip(step.report.held).find(|(m, held)| *held && *m > 0.201);
            assert!(far.is_none(), "{kind}: frame {t}: {far:?}");
        }
        let [held_feet, raw_feet] = [&held, &raw].map(Performance::of_stream);
        let skate = |p: &Performance| skate_cm_s(&skeleton, &legs, p);
        let peak = |p: &Performance| peak_speeds(p).into_iter().fold(0.0, f64::max);
        let apart = Disturbance::new(&skeleton, &undisturbed, &held, &arrivals);
        let last = apart.error_m.iter().rev().take(CALM / 3).copied().fold(0.0, f64::max);
        println!(
            "{kind}: skate {:.1} -> {:.2} cm/s, fastest joint {:.1} -> {:.1} rad/s, {:.2} cm apart at most in the last second",
            skate(&raw_feet),
            skate(&held_feet),
            peak(&raw_feet),
            peak(&held_feet),
            100.0 * last
        );
        assert!(held_frames(&held) > clip.frames.len() / 3, "{kind}: the lock gave up");
        assert!(skate(&held_feet) < 0.3 * skate(&raw_feet), "{kind}");
        assert!(peak(&held_feet) < 1.25 * peak(&raw_feet), "{kind}");
        assert!(last < RECOVERED_M, "{kind}: {:.1} cm apart in the last second", 100.0 * last);
    }
}

#[test]
fn a_held_foot_stays_where_it_is_while_the_input_is_none() {
    let (blob, clip) = walker();
    let database = Database::open(blob).unwrap();
    for safety in [Safety::Follow, Safety::Hold, Safety::Rest] {
        let mut stuck = clip.clone();
        // Half a second of invalid poses in the middle of a stride.
        for frame in &mut stuck.frames[100..115] {
            frame.root.x = f64::NAN;
        }
        let run = run(&database, &stuck, Config::new().safety(safety));
        let skeleton = database_skeleton(&database);
        let legs = database.legs().unwrap();
        for t in 100..115 {
            let [before, now] = [t - 1, t].map(|t| run.steps[t].frame.positions(&skeleton));
            for (leg, held) in legs.iter().zip(run.steps[99].report.held) {
                let moved = (now[leg.ankle] - before[leg.ankle]).norm();
                assert!(!held || safety == Safety::Rest || moved < 1e-6, "{safety:?}: frame {t}: {moved} m");
            }
            assert!(run.steps[t].frame.root.iter().all(|v| v.is_finite()), "{safety:?}: frame {t}");
        }
    }
}
