//! The stylizer's behaviour as its caller sees it: errors, held poses, resets, and stability.

use gestus_core::{
    Config, ConfigError, Database, Degraded, Digest, Observer, Pose, Stylizer,
    blob::layout::{class, header, section},
    config::parameters::NAMES,
    search::query::Feature,
};
use gestus_database::stream::{from_pose, to_pose};
use gestus_tests::{
    motion,
    patch::{patched, put, with_section},
};

/// The capacities for which the documented figures hold: 22 joints, 40 neighbors, 28 classes.
type Standard<'db> = Stylizer<'db, 22, 40, 28>;

fn stylizer(blob: &[u8]) -> Standard<'_> {
    // These tests check predictions; `feet.rs` checks how the foot lock changes them.
    Standard::new(Database::open(blob).unwrap(), Config::new().contacts(false)).unwrap()
}

fn poses(action: usize, style: usize, frames: usize) -> Vec<Pose<22>> {
    motion::unseen(action, style, frames).frames.iter().map(to_pose).collect()
}

/// Every output pose and step, and their digest.
fn run(stylizer: &mut Standard<'_>, input: &[Pose<22>]) -> (Vec<Pose<22>>, u32) {
    let mut digest = Digest::new();
    let mut output = Pose::IDENTITY;
    let outputs = input
        .iter()
        .map(|pose| {
            let report = stylizer.step(pose, &mut output);
            digest.add(&output, 21, report.step_s);
            output
        })
        .collect();
    (outputs, digest.value())
}

/// Largest angle between the joints of two poses, radians, without the root.
fn apart(a: &Pose<22>, b: &Pose<22>) -> f64 {
    let (a, b) = (from_pose(a, 21), from_pose(b, 21));
    a.rotations[1..].iter().zip(&b.rotations[1..]).map(|(p, q)| p.angle_to(q)).fold(0.0, f64::max)
}

/// Records the dofs only.
#[derive(Default)]
struct Dofs {
    query: Vec<f32>,
    y_prev: Vec<f32>,
    predicted: Vec<f32>,
}

impl Observer<22> for Dofs {
    fn query(&mut self, feature: &Feature) {
        self.query = feature.to_vec();
    }
    fn predicted(
        &mut self,
        _: &[[f32; 4]; 22],
        _: &[[f32; 4]; 22],
        y_prev: &[[f32; 4]; 22],
        predicted: &[[f32; 4]; 22],
    ) {
        self.y_prev = y_prev.as_flattened()[..67].to_vec();
        self.predicted = predicted.as_flattened()[..67].to_vec();
    }
}

#[test]
fn the_state_fits_24_kilobytes() {
    let bytes = size_of::<Standard<'_>>();
    assert!(bytes <= 24 * 1024, "{bytes} bytes");
}

#[test]
fn input_that_is_no_pose_is_held_and_reported() {
    let mut stylizer = stylizer(motion::small());
    let mut untouched = stylizer.clone();
    let input = poses(0, 0, 30);
    let bad: Vec<(&str, Pose<22>)> = [
        ("NaN position", Pose { position: [f32::NAN, 1.0, 0.0], ..input[9] }),
        ("endless position", Pose { position: [0.0, f32::INFINITY, 0.0], ..input[9] }),
        ("beyond the room", Pose { position: [2e5, 1.0, 0.0], ..input[9] }),
    ]
    .into_iter()
    .chain([[0.0; 4], [f32::NAN, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, 2.0]].map(|q| {
        let mut pose = input[9];
        pose.rotations[20] = q;
        ("no rotation", pose)
    }))
    .collect();
    // Before the first pose there is no output: the caller's pose is left unchanged.
    let mut output = input[3];
    let report = stylizer.step(&bad[0].1, &mut output);
    assert_eq!(output, input[3]);
    assert!(stylizer.last_output().is_none());
    assert!(report.degraded.contains(Degraded::INPUT));
    let mut expected = Pose::IDENTITY;
    for pose in &input[..10] {
        let _ = stylizer.step(pose, &mut output);
        let _ = untouched.step(pose, &mut expected);
    }
    for (name, pose) in &bad {
        let mut held = Pose::IDENTITY;
        let report = stylizer.step(pose, &mut held);
        assert_eq!(report.degraded, Degraded::INPUT, "{name}");
        assert_eq!(held, output, "{name}");
        assert!(report.classes.is_empty() && report.visits == 0, "{name}");
        assert_eq!(report.step_s, 1.0 / 30.0, "{name}");
    }
    // And they leave no trace in the state.
    for pose in &input[10..] {
        let report = stylizer.step(pose, &mut output);
        assert_eq!(report, untouched.step(pose, &mut expected));
        assert_eq!(output, expected);
    }
    // Joints beyond those of the database are not checked.
    let mut pose = input[29];
    pose.rotations[21] = [f32::NAN; 4];
    assert!(!stylizer.step(&pose, &mut output).degraded.contains(Degraded::INPUT));
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut stylizer = stylizer(motion::small());
    stylizer.set_style(&[(1, 1.0), (2, 3.0)]).unwrap();
    stylizer.set_action(Some(1)).unwrap();
    stylizer.set_mask(1, false).unwrap();
    stylizer.set_mask(2, false).unwrap();
    stylizer.set_strength(2, 0.5).unwrap();
    assert_eq!(stylizer.style(), [0.0, 0.25, 0.75]);
    let settings = |s: &Standard<'_>| {
        (s.style().to_vec(), s.labels(), [0, 1, 2].map(|g| s.searches(g)), [0, 1, 2].map(|g| s.strength(g)))
    };
    let before = settings(&stylizer);

    for weights in [&[][..], &[(0, 0.0)], &[(0, -1.0), (1, 3.0)], &[(0, f32::NAN)], &[(0, f32::INFINITY)]] {
        assert_eq!(stylizer.set_style(weights), Err(ConfigError::Weights), "{weights:?}");
    }
    assert_eq!(stylizer.set_style(&[(0, 1.0), (3, 1.0)]), Err(ConfigError::Unknown { id: 3, have: 3 }));
    assert_eq!(stylizer.set_action(Some(2)), Err(ConfigError::Unknown { id: 2, have: 2 }));
    assert_eq!(stylizer.set_input_style(Some(u16::MAX)), Err(ConfigError::Unknown { id: u16::MAX, have: 3 }));
    assert_eq!(stylizer.set_mask(3, true), Err(ConfigError::Unknown { id: 3, have: 3 }));
    assert_eq!(stylizer.set_mask(0, false), Err(ConfigError::OutOfRange), "no group would be left");
    assert_eq!(stylizer.set_strength(3, 1.0), Err(ConfigError::Unknown { id: 3, have: 3 }));
    for strength in [-0.1, 2.1, f32::NAN, f32::INFINITY] {
        assert_eq!(stylizer.set_strength(0, strength), Err(ConfigError::OutOfRange), "{strength}");
    }
    assert_eq!(settings(&stylizer), before);
}

/// A database whose last class has an action of its own, and the class's action before and its style.
fn with_a_lone_class() -> (Vec<u8>, u16, u16) {
    let database = Database::open(motion::small()).unwrap();
    let actions = database.manifest().unwrap().actions.0.to_owned();
    let at = database.counts().classes - 1;
    let [action, style] = database.labels(at);
    let own = database.counts().actions as u16;
    let more = with_section(motion::small(), section::MANIFEST, |bytes| {
        let place = bytes.windows(actions.len()).position(|w| w == actions.as_bytes()).unwrap();
        bytes.splice(place - 1..place, [actions.len() as u8 + 5]);
        bytes.splice(place + actions.len()..place + actions.len(), *b"\nlone");
    });
    let more = put(&more, header::ACTIONS.start, &(own + 1).to_le_bytes());
    let place = at * class::LENGTH + class::ACTION.start;
    (patched(&more, section::CLASSES, place, &own.to_le_bytes()), action, style)
}

#[test]
fn labels_that_no_class_has_together_are_refused_and_stay() {
    let (blob, before, style) = with_a_lone_class();
    let mut stylizer = stylizer(&blob);
    let own = stylizer.database().counts().actions as u16 - 1;
    stylizer.set_labels(Some(own), Some(style)).unwrap();
    assert_ne!(style, 0);
    assert_eq!(stylizer.set_input_style(Some(0)), Err(ConfigError::NoClass));
    assert_eq!(stylizer.set_labels(Some(before), Some(style)), Err(ConfigError::NoClass));
    assert_eq!(stylizer.labels(), (Some(own), Some(style)));
    assert!(stylizer.searches(0) && !stylizer.searches(7));
    // Not the bytes, which a failed `unwrap` would print.
    assert!(format!("{:?}", stylizer.database()).len() < 1000);
}

#[test]
fn capacities_and_parameters_are_checked() {
    let database = Database::open(motion::small()).unwrap();
    let joints = Stylizer::<20, 40, 28>::new(database, Config::new()).err();
    assert_eq!(joints, Some(ConfigError::Joints { need: 21, have: 20 }));
    let classes = Stylizer::<22, 40, 5>::new(database, Config::new()).err();
    assert_eq!(classes, Some(ConfigError::Classes { need: 6, have: 5 }));
    let neighbors = Stylizer::<22, 6, 6>::new(database, Config::new()).err();
    assert_eq!(neighbors, Some(ConfigError::Neighbors { need: 8, have: 6 }));
    let none = Standard::new(database, Config::new().k(0)).err();
    assert_eq!(none, Some(ConfigError::Neighbors { need: 0, have: 40 }));
    assert!(Stylizer::<21, 40, 6>::new(database, Config::new()).is_ok());

    let new = Config::new;
    let wrong = [
        ("lambda", new().lambda(0.0)),
        ("lambda", new().lambda(f32::NAN)),
        ("feedback", new().feedback(0.0)),
        ("feedback", new().feedback(f32::NAN)),
        ("delta", new().delta(0.0)),
        ("prune", new().prune(1.0)),
        ("prune", new().prune(-0.1)),
        ("classes", new().classes(0)),
        ("classes", new().classes(9)),
        ("kappa", new().kappa(-1.0)),
        ("rho", new().rho(1.1)),
        ("visits", new().visits(63)),
        ("visits", new().visits(449)),
        ("pool", new().pool(0)),
        ("pool", new().pool(65)),
        ("jump", new().jump(0.5)),
        ("speed_limit", new().speed_limit(0.5)),
        ("speed_limit", new().speed_limit(f32::NAN)),
        ("timing_width", new().timing_width(f32::INFINITY)),
    ];
    for (name, config) in wrong {
        let number = NAMES.iter().position(|n| *n == name).expect("it is a parameter");
        assert_eq!(
            Standard::new(database, config).err(),
            Some(ConfigError::Parameter { number: number as u16 }),
            "{name}"
        );
    }
}

/// Two stylizers that differ only in their last output: in one, the arms are a radian higher.
#[test]
fn an_error_of_a_radian_is_gone_in_30_frames() {
    let input = poses(0, 0, 120);
    let mut right = stylizer(motion::large());
    let mut wrong = right.clone();
    wrong.set_style(&[(2, 1.0)]).unwrap();
    run(&mut right, &input[..60]);
    run(&mut wrong, &input[..60]);
    wrong.set_style(&[(0, 1.0)]).unwrap();
    let (mut a, mut b) = (Pose::IDENTITY, Pose::IDENTITY);
    let (mut seen, mut known) = (Dofs::default(), Dofs::default());
    for (t, pose) in input[60..].iter().enumerate() {
        let _ = right.step_observed(pose, &mut a, &mut known);
        let _ = wrong.step_observed(pose, &mut b, &mut seen);
        let fed_back = seen.y_prev.iter().zip(&known.y_prev).skip(7).map(|(a, b)| (a - b).abs());
        let error = fed_back.fold(0.0, f32::max);
        if t == 0 {
            assert!(error > 0.9, "the error to recover from is {error} rad");
        }
        if t >= 30 {
            assert!(apart(&a, &b) < 0.02, "frame {t}: still {} rad apart", apart(&a, &b));
        }
    }
}

#[test]
fn a_minute_of_walk_does_not_drift() {
    for (style, config) in [(1, Config::new()), (2, Config::paper())] {
        let mut stylizer = Standard::new(Database::open(motion::small()).unwrap(), config).unwrap();
        stylizer.set_style(&[(style, 1.0)]).unwrap();
        let (mut output, mut dofs) = (Pose::IDENTITY, Dofs::default());
        // Smallest and largest value of each dof in the first and in the last ten seconds.
        let mut ranges = [[[f32::INFINITY; 67], [f32::NEG_INFINITY; 67]]; 2];
        for (t, pose) in poses(0, 0, 1800).iter().enumerate() {
            let report = stylizer.step_observed(pose, &mut output, &mut dofs);
            assert!(!report.degraded.contains(Degraded::PREDICTION), "frame {t}");
            assert!(output.is_valid(21) && (0.01..0.1).contains(&report.step_s), "frame {t}: {report:?}");
            let part = if t < 300 { 0 } else { 1 };
            if !(300..1500).contains(&t) {
                for (d, &value) in dofs.predicted.iter().enumerate() {
                    ranges[part][0][d] = ranges[part][0][d].min(value);
                    ranges[part][1][d] = ranges[part][1][d].max(value);
                }
            }
        }
        let [first, last] = ranges;
        for d in (0..67).filter(|d| *d != 6) {
            // The stride changes slowly and differs between the two parts: allow a quarter of the range, 2 cm or 1 degree.
            let slack = 0.25 * (first[1][d] - first[0][d]) + 0.02;
            assert!(last[0][d] > first[0][d] - slack && last[1][d] < first[1][d] + slack, "dof {d}");
        }
    }
}

#[test]
fn strength_0_gives_the_input_back() {
    let mut stylizer = stylizer(motion::small());
    stylizer.set_style(&[(2, 1.0)]).unwrap();
    for group in 0..3 {
        stylizer.set_strength(group, 0.0).unwrap();
    }
    let mut output = Pose::IDENTITY;
    for (t, pose) in poses(1, 0, 300).iter().enumerate() {
        let report = stylizer.step(pose, &mut output);
        assert!((report.step_s - 1.0 / 30.0).abs() < 1e-7);
        let (input, output) = (from_pose(pose, 21), from_pose(&output, 21));
        for (j, (p, q)) in input.rotations.iter().zip(&output.rotations).enumerate() {
            // The error of f32 in a logarithm and an exponential.
            assert!(p.angle_to(q) < 2e-6, "frame {t}, joint {j}: {}", p.angle_to(q));
        }
        // Velocities are integrated over the stream.
        assert!((input.root - output.root).norm() < 1e-4, "frame {t}: {} {}", input.root, output.root);
    }
}

#[test]
fn strength_of_a_group_moves_no_other() {
    let input = poses(0, 0, 60);
    let mut whole = stylizer(motion::small());
    whole.set_style(&[(2, 1.0)]).unwrap();
    let mut part = whole.clone();
    part.set_strength(1, 0.0).unwrap();
    let (a, b) = (run(&mut whole, &input).0, run(&mut part, &input).0);
    let database = *whole.database();
    for ((a, b), x) in a.iter().zip(&b).zip(&input) {
        assert_eq!(a.position, b.position);
        for j in 0..21 {
            if database.joint_group(j) == 1 {
                let (x, b) = (from_pose(x, 21), from_pose(b, 21));
                assert!(x.rotations[j].angle_to(&b.rotations[j]) < 2e-6);
            } else {
                assert_eq!(a.rotations[j], b.rotations[j], "joint {j}");
            }
        }
    }
}

#[test]
fn after_a_reset_the_stream_repeats_bit_for_bit() {
    let input = poses(1, 2, 80);
    let mut stylizer = stylizer(motion::large());
    stylizer.set_style(&[(0, 1.0), (1, 2.0)]).unwrap();
    let first = run(&mut stylizer, &input);
    let on = run(&mut stylizer, &input);
    assert_ne!(first.1, on.1, "without a reset the stream goes on");
    stylizer.reset();
    let again = run(&mut stylizer, &input);
    assert_eq!(first, again);
    assert_eq!(stylizer.style(), [1.0 / 3.0, 2.0 / 3.0, 0.0], "settings stay");
}

#[test]
fn stylizers_on_one_database_do_not_disturb_each_other() {
    let database = Database::open(motion::large()).unwrap();
    let inputs = [poses(0, 0, 60), poses(1, 1, 60)];
    let fresh = || {
        let mut both = [0, 1].map(|_| Standard::new(database, Config::new()).unwrap());
        both[0].set_style(&[(1, 1.0)]).unwrap();
        both[1].set_style(&[(2, 1.0)]).unwrap();
        both[1].set_action(Some(1)).unwrap();
        both
    };
    let [mut a, mut b] = fresh();
    let alone = [run(&mut a, &inputs[0]).0, run(&mut b, &inputs[1]).0];
    let [mut a, mut b] = fresh();
    let mut output = Pose::IDENTITY;
    for t in 0..60 {
        let _ = a.step(&inputs[0][t], &mut output);
        assert_eq!(output, alone[0][t]);
        let _ = b.step(&inputs[1][t], &mut output);
        assert_eq!(output, alone[1][t]);
    }
}

/// The features of the body do not depend on the arms, and the query does not depend on a mask.
#[test]
fn arms_and_masks_leave_the_features_of_the_body_alone() {
    let database = Database::open(motion::small()).unwrap();
    let body: Vec<usize> =
        (0..database.counts().features).filter(|&f| database.feature_group(f) == 0).collect();
    assert!(!body.is_empty() && body.len() < database.counts().features);
    let mut plain = Standard::new(database, Config::new().contacts(false)).unwrap();
    let mut masked = plain.clone();
    masked.set_mask(1, false).unwrap();
    masked.set_mask(2, false).unwrap();
    let mut waving = masked.clone();
    let (mut a, mut b, mut c) = (Dofs::default(), Dofs::default(), Dofs::default());
    let mut outputs = [Pose::IDENTITY; 3];
    for pose in &poses(0, 1, 40) {
        let mut wave = *pose;
        for j in 5..13 {
            wave.rotations[j] = gestus_core::math::quaternion::exp([0.9, -0.4, 0.7]);
        }
        let _ = plain.step_observed(pose, &mut outputs[0], &mut a);
        let quiet = masked.step_observed(pose, &mut outputs[1], &mut b);
        let loud = waving.step_observed(&wave, &mut outputs[2], &mut c);
        assert_eq!(a.query, b.query);
        assert!(body.iter().all(|&f| a.query[f] == c.query[f]));
        assert_ne!(a.query, c.query, "the arms' own features have to change");
        // With masked arms, neither the search nor the legs depend on the arms.
        assert_eq!((quiet.classes, quiet.distance2), (loud.classes, loud.distance2));
        for j in (0..5).chain(13..21) {
            assert_eq!(outputs[1].rotations[j], outputs[2].rotations[j], "joint {j}");
        }
    }
}
