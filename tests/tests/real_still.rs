//! Poses of real runs, walks and gestures that are held: every method's output comes to rest. Skipped where the clips are
//! missing, which fails with `CI=true`.

use gestus_core::{Config, Database, Method, Pose, Stylizer};
use gestus_database::{
    build::{BuildOptions, build},
    stream::to_pose,
};
use gestus_tests::real_clips;

const JOINTS: usize = 22;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 16>;

/// How fast the root moves after five seconds of a held pose, m/s.
fn speed_at_rest(database: Database<'_>, config: Config, lead: &[Pose<JOINTS>], style: u16) -> f32 {
    let mut stylizer = Gestus::new(database, config).unwrap();
    stylizer.set_style(&[(style, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    let held = lead.iter().chain(std::iter::repeat_n(&lead[lead.len() - 1], 150));
    let mut last = output;
    for pose in held {
        last = output;
        let _ = stylizer.step(pose, &mut output);
    }
    let way: f32 = last.position.iter().zip(output.position).map(|(a, b)| (a - b) * (a - b)).sum();
    30.0 * way.sqrt()
}

#[test]
fn no_held_pose_glides() {
    let Some(corpus) =
        real_clips::corpus(&["walk", "run", "raise-up-both-hands"], &["normal", "active", "elderly"])
    else {
        return;
    };
    let is_held_out = |name: &str| name.ends_with("_normal_001");
    let held_out: Vec<usize> =
        (0..corpus.examples.len()).filter(|&e| is_held_out(&corpus.examples[e].clip.name)).collect();
    let built = build(&corpus.without(&held_out), &BuildOptions::default()).unwrap();
    let database = Database::open(&built.bytes).unwrap();
    for method in Method::ALL {
        let (mut poses, mut glided) = (0, 0);
        for &e in &held_out {
            let input: Vec<Pose<JOINTS>> = corpus.examples[e].clip.frames.iter().map(to_pose).collect();
            for at in (20..input.len()).step_by(5) {
                let config = Config::new().method(method);
                let lead = &input[at - 20..=at];
                let speed = |config| speed_at_rest(database, config, lead, 1 + (at % 2) as u16);
                let (rest, without) = (speed(config), speed(config.still_speed(0.0)));
                poses += 1;
                glided += usize::from(without > 0.1);
                assert!(rest < 1e-3, "{method:?}, clip {e}, frame {at}: {rest} m/s; {without} without");
            }
        }
        println!("{method:?}: of {poses} poses {glided} glide without it");
    }
}
