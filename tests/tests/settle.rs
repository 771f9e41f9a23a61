//! What is put out beside what is predicted: as lively as the style, without jumps, and without lag.

use gestus_core::{Config, Database, Pose, Stylizer};
use gestus_database::stream::{from_pose, to_pose};
use gestus_motion::clip::Frame;
use gestus_tests::motion;

const PLAIN: Config = Config::new().contacts(false).speed_limit(0.0).liveliness(0.0).settle_s(0.0);
/// Frame at which the style changes.
const CHANGE: usize = 40;

/// Streams a walk to style 1, and to style `then` from [`CHANGE`] on; `label` is its action and input style, if told.
fn streamed(config: Config, label: Option<u16>, then: u16) -> Vec<Frame> {
    let database = Database::open(motion::small()).unwrap();
    let mut stylizer = Stylizer::<22, 40, 28>::new(database, config).unwrap();
    stylizer.set_action(label).unwrap();
    stylizer.set_input_style(label).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    let input = motion::unseen(0, 0, 90);
    let step = |(t, frame): (usize, &Frame)| {
        if t == CHANGE {
            stylizer.set_style(&[(then, 1.0)]).unwrap();
        }
        let _ = stylizer.step(&to_pose(frame), &mut output);
        from_pose(&output, 21)
    };
    input.frames.iter().enumerate().map(step).collect()
}

/// Largest angle between the joints of two poses, radians, without the root.
fn apart(a: &Frame, b: &Frame) -> f64 {
    a.rotations[1..].iter().zip(&b.rotations[1..]).map(|(p, q)| p.angle_to(q)).fold(0.0, f64::max)
}

/// Root of the mean squared largest angle between two streams, the second `lag` frames earlier.
fn difference(a: &[Frame], b: &[Frame], lag: isize) -> f64 {
    let pairs = (10..a.len() - 10).map(|t| apart(&a[t], &b[t.wrapping_add_signed(-lag)]));
    (pairs.map(|angle| angle * angle).sum::<f64>() / (a.len() - 20) as f64).sqrt()
}

#[test]
fn a_change_of_style_does_not_jump_and_is_complete_after_half_a_second() {
    // A gait settles in a quarter of the time, if it has all the weight; several classes settle in the whole time at most.
    for (label, settle_s) in [(Some(0), 0.4), (None, 0.1)] {
        let [plain, settled] = [PLAIN, PLAIN.settle_s(settle_s)].map(|config| streamed(config, label, 2));
        let jump = |frames: &[Frame]| apart(&frames[CHANGE], &frames[CHANGE - 1]);
        assert!(jump(&plain) > 0.5, "the styles hardly differ: {}", jump(&plain));
        // A tenth of a second holds back 72% in a frame of a thirtieth, a fortieth 26%.
        let most = if label.is_some() { 0.45 } else { 0.75 };
        assert!(jump(&settled) < most * jump(&plain), "{} of {}", jump(&settled), jump(&plain));
        for t in CHANGE + 15..plain.len() {
            assert!(apart(&settled[t], &plain[t]) < 0.05, "frame {t}: {}", apart(&settled[t], &plain[t]));
        }
    }
}

#[test]
fn what_settles_does_not_lag() {
    let (plain, settled) = (streamed(PLAIN, None, 1), streamed(PLAIN.settle_s(1.2), None, 1));
    let at_once = difference(&settled, &plain, 0);
    for lag in [-2, -1, 1, 2] {
        let late = difference(&settled, &plain, lag);
        assert!(at_once < late, "{lag} frames: {late}, at once {at_once}");
    }
}

#[test]
fn more_liveliness_keeps_more_of_the_input() {
    // So little is kept that twice the liveliness keeps twice as much.
    let plain = PLAIN.rho(0.5);
    let calm = streamed(plain.liveliness(0.01), None, 1);
    let kept = [0.25, 0.5, 1.0, 2.0].map(|l| difference(&streamed(plain.liveliness(l), None, 1), &calm, 0));
    assert!(kept[0] > 1e-3 && kept.windows(2).all(|w| w[1] > 1.5 * w[0]), "{kept:?}");
}
