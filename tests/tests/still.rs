//! A body that stands stands: of a pose that is held, every method's output comes to rest within three seconds, the
//! feet last.

use gestus_core::{Config, Database, Method, Pose, Stylizer, math::quaternion};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const JOINTS: usize = 21;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 6>;

const RATE: f32 = 30.0;
const REST: usize = 90;

fn input(action: usize, style: usize, frames: usize) -> Vec<Pose<JOINTS>> {
    motion::unseen(action, style, frames).frames.iter().map(to_pose).collect()
}

fn stylizer(config: Config) -> Gestus<'static> {
    let database = Database::open(motion::small()).unwrap();
    let mut stylizer = Gestus::new(database, config).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    stylizer
}

/// Between two poses: how fast the root moves, m/s, and the fastest joint turns, rad/s.
fn speeds(a: &Pose<JOINTS>, b: &Pose<JOINTS>) -> (f32, f32) {
    let root = a.position.iter().zip(b.position).map(|(a, b)| (a - b) * (a - b)).sum::<f32>().sqrt();
    let turn = a.rotations.iter().zip(b.rotations).map(|(a, b)| quaternion::angle(*a, b)).fold(0.0, f32::max);
    (RATE * root, RATE * turn)
}

/// The output of a pose that is held after `lead`, from `REST` frames on: how fast it is at most.
fn fastest_at_rest(stylizer: &mut Gestus<'_>, lead: &[Pose<JOINTS>], held: &Pose<JOINTS>) -> (f32, f32) {
    let mut output = Pose::IDENTITY;
    for pose in lead {
        let _ = stylizer.step(pose, &mut output);
    }
    let mut most = (0.0f32, 0.0f32);
    for t in 0..300 {
        let last = output;
        let _ = stylizer.step(held, &mut output);
        if t > REST {
            let (root, turn) = speeds(&last, &output);
            most = (most.0.max(root), most.1.max(turn));
        }
    }
    most
}

#[test]
fn a_held_pose_is_put_out_as_a_held_pose() {
    for method in Method::ALL {
        for (action, style) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let input = input(action, style, 120);
            for at in (5..120).step_by(19) {
                // From the first frame on, and in the middle of a stream.
                for lead in [&[][..], &input[..at]] {
                    let mut stylizer = stylizer(Config::new().method(method));
                    let (root, turn) = fastest_at_rest(&mut stylizer, lead, &input[at]);
                    assert!(
                        root < 1e-3 && turn < 1e-2,
                        "{method:?}, action {action}, style {style}, frame {at} after {}: {root} m/s, {turn} rad/s",
                        lead.len()
                    );
                }
            }
        }
    }
}

#[test]
fn without_it_some_pose_glides() {
    let mut most = 0.0f32;
    for method in Method::ALL {
        for action in 0..2 {
            let input = input(action, 0, 120);
            for at in (5..120).step_by(5) {
                let mut stylizer = stylizer(Config::new().method(method).still_speed(0.0));
                most = most.max(fastest_at_rest(&mut stylizer, &input[..at], &input[at]).0);
            }
        }
        println!("{method:?} {most}");
    }
    assert!(most > 0.1, "{most} m/s");
}

#[test]
fn a_change_of_style_reaches_a_body_that_stands() {
    let input = input(0, 0, 61);
    let held = |before: u16| {
        let mut stylizer = stylizer(Config::new());
        stylizer.set_style(&[(before, 1.0)]).unwrap();
        fastest_at_rest(&mut stylizer, &input[..60], &input[60]);
        stylizer.set_style(&[(2, 1.0)]).unwrap();
        let last = *stylizer.last_output().unwrap();
        let (root, turn) = fastest_at_rest(&mut stylizer, &[], &input[60]);
        assert!(root < 1e-3 && turn < 1e-2, "{root} m/s, {turn} rad/s");
        speeds(&last, stylizer.last_output().unwrap()).1 / RATE
    };
    let (other, same) = (held(1), held(2));
    assert!(other > 0.05 && same < 0.01, "{other} and {same} rad");
}

#[test]
fn a_body_that_walks_on_is_that_of_a_stream_that_walked() {
    let input = input(0, 0, 240);
    let mut stopped = stylizer(Config::new());
    fastest_at_rest(&mut stopped, &input[..60], &input[60]);
    let mut walked = stylizer(Config::new());
    let (mut a, mut b) = (Pose::IDENTITY, Pose::IDENTITY);
    for (t, pose) in input.iter().enumerate() {
        let _ = walked.step(pose, &mut a);
        if t > 60 {
            let last = b;
            let _ = stopped.step(pose, &mut b);
            if t > 62 {
                assert!(speeds(&last, &b).1 < 15.0, "frame {t}");
            }
        }
        if t > 180 {
            let turn = speeds(&a, &b).1 / RATE;
            assert!(turn < 0.05, "frame {t}: {turn} rad");
        }
    }
}

/// Noise of sensors and breath come through as they are.
#[test]
fn motion_too_small_for_the_style_is_passed() {
    let pose = input(0, 0, 61)[60];
    let mut stylizer = stylizer(Config::new());
    fastest_at_rest(&mut stylizer, &[], &pose);
    let start = *stylizer.last_output().unwrap();
    let mut moved = pose;
    moved.rotations[3] = quaternion::multiply(moved.rotations[3], quaternion::exp([0.0, 0.002, 0.0]));
    let mut output = Pose::IDENTITY;
    let _ = stylizer.step(&moved, &mut output);
    let turn = quaternion::angle(start.rotations[3], output.rotations[3]);
    assert!((turn - 0.002).abs() < 5e-4, "{turn} rad");
}
