//! Input unlike the database is passed on, and the report says so; input of its kind is not.

use gestus_core::{Config, Database, Degraded, Method, Pose, Report, Stylizer, math::quaternion};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const JOINTS: usize = 21;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 6>;

fn streamed(config: Config, input: &[Pose<JOINTS>]) -> (Vec<Pose<JOINTS>>, Vec<Report>) {
    let database = Database::open(motion::small()).unwrap();
    let mut stylizer = Gestus::new(database, config).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    input.iter().map(|pose| (stylizer.step(pose, &mut output), output)).map(|(r, o)| (o, r)).unzip()
}

fn walk(frames: usize) -> Vec<Pose<JOINTS>> {
    motion::unseen(0, 0, frames).frames.iter().map(to_pose).collect()
}

/// A cartwheel of sorts: every joint is turned by what no walk has, more and more.
fn unlike(frames: usize) -> Vec<Pose<JOINTS>> {
    let mut input = walk(frames);
    for (t, pose) in input.iter_mut().enumerate() {
        let angle = 1.2 * (0.05 * t as f32).min(1.0) + 0.4 * (0.3 * t as f32).sin();
        for rotation in &mut pose.rotations[1..] {
            *rotation = quaternion::multiply(*rotation, quaternion::exp([angle, 0.5 * angle, 0.0]));
        }
    }
    input
}

fn is_far(report: &Report) -> bool {
    report.degraded.contains(Degraded::FAR)
}

/// Largest angle between the joints of two poses.
fn apart(a: &Pose<JOINTS>, b: &Pose<JOINTS>) -> f32 {
    a.rotations.iter().zip(b.rotations).map(|(a, b)| quaternion::angle(*a, b)).fold(0.0, f32::max)
}

#[test]
fn what_is_unlike_the_database_is_passed_on() {
    let input = unlike(150);
    for method in Method::ALL {
        let (output, reports) = streamed(Config::new().method(method), &input);
        assert!(reports[60..].iter().all(is_far), "{method:?}");
        assert!(reports[60..].iter().all(|r| r.passed == 1.0 && r.distance_ratio > 1.0), "{method:?}");
        for (t, (output, input)) in output.iter().zip(&input).enumerate().skip(90) {
            assert!(apart(output, input) < 1e-4, "{method:?}, frame {t}: {}", apart(output, input));
        }
    }
    // Switched off, every input is given the style.
    let (styled, reports) = streamed(Config::new().trust(0.0), &input);
    assert!(!reports.iter().any(|r| is_far(r) || r.passed > 0.0));
    assert!(apart(&styled[120], &input[120]) > 0.1);
}

/// From the third frame on, within a quarter of a second.
#[test]
fn what_is_far_from_every_class_is_passed_on_early() {
    let input = &unlike(150)[30..90];
    for method in [Method::Mar, Method::Phase] {
        let (_, reports) = streamed(Config::new().method(method), input);
        assert!(reports[10..].iter().all(|r| is_far(r) && r.passed == 1.0), "{method:?}");
        assert!(reports[..2].iter().all(|r| r.passed == 0.0), "{method:?}");
    }
}

/// Search windows and filters are not full yet. That makes no walk unlike a walk, wherever in its stride it begins.
#[test]
fn a_start_in_mid_stride_is_not_passed_on() {
    let walk = walk(90);
    for method in Method::ALL {
        for start in (0..60).step_by(3) {
            let (_, reports) = streamed(Config::new().method(method), &walk[start..start + 30]);
            assert!(reports.iter().all(|r| r.passed == 0.0), "{method:?}, from frame {start}");
        }
    }
}

#[test]
fn what_is_like_it_is_not() {
    for method in Method::ALL {
        for style in 0..2 {
            let input: Vec<Pose<JOINTS>> = motion::unseen(0, style, 200).frames.iter().map(to_pose).collect();
            let (_, reports) = streamed(Config::new().method(method), &input);
            let far = reports.iter().filter(|r| is_far(r)).count();
            assert_eq!(far, 0, "{method:?}, style {style}");
        }
    }
}

/// Whatever a method knows of the frame, the speed of a body on wheels is not that of a walk.
#[test]
fn a_body_that_is_carried_is_far() {
    let mut input = walk(150);
    for (t, pose) in input.iter_mut().enumerate() {
        pose.position[2] += 0.2 * t as f32;
    }
    for method in Method::ALL {
        let (_, reports) = streamed(Config::new().method(method), &input);
        assert!(reports[60..].iter().all(is_far), "{method:?}");
    }
}

/// A walk backwards has the poses of a walk, and its speed. It is passed on, where a walk forwards is not.
#[test]
fn a_walk_backwards_is_far() {
    for style in 0..3 {
        let mut input: Vec<Pose<JOINTS>> = motion::unseen(0, style, 150).frames.iter().map(to_pose).collect();
        input.reverse();
        for method in Method::ALL {
            let (output, reports) = streamed(Config::new().method(method), &input);
            assert!(reports[30..].iter().all(is_far), "{method:?}, style {style}");
            for (t, (output, input)) in output.iter().zip(&input).enumerate().skip(90) {
                assert!(apart(output, input) < 1e-4, "{method:?}, style {style}, frame {t}");
            }
        }
    }
}

#[test]
fn the_style_comes_back_with_the_motion_that_it_knows() {
    let walk = walk(400);
    let mut input = walk.clone();
    input[100..200].copy_from_slice(&unlike(200)[100..]);
    let (output, reports) = streamed(Config::new(), &input);
    let (clean, _) = streamed(Config::new(), &walk);
    assert!(is_far(&reports[180]) && !is_far(&reports[90]) && !is_far(&reports[260]));
    for t in 330..400 {
        assert!(apart(&output[t], &clean[t]) < 0.05, "frame {t}: {}", apart(&output[t], &clean[t]));
    }
}
