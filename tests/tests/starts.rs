//! The second after a start, a reset, a leap, or a change of style or labels: no joint turns faster than the fastest of the
//! output's style, by every method.

use gestus_core::{Config, Database, Method, Pose, Report, Stylizer, math::quaternion};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const JOINTS: usize = 21;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 6>;

/// Frames before the event, and those in the second after it.
const BEFORE: usize = 75;
const SECOND: usize = 30;

fn walk(frames: usize) -> Vec<Pose<JOINTS>> {
    motion::unseen(0, 0, frames).frames.iter().map(to_pose).collect()
}

/// Speed of the fastest joint of the style among the database's classes, rad/s.
fn fastest(database: &Database<'_>, style: u16) -> f32 {
    let of_style = database.classes().enumerate().filter(|(_, class)| class.style == style);
    of_style.map(|(number, _)| database.trust_limits(number).unwrap().turning).fold(0.0, f32::max)
}

/// Steps through poses; the fastest joint from each output to the next, rad/s, the last output before them included if
/// there is one. What is put out of the input as it is, is held to the input's speed, and is not counted.
fn speeds(stylizer: &mut Gestus<'_>, input: &[Pose<JOINTS>]) -> Vec<f32> {
    let mut last = stylizer.last_output().copied();
    let mut output = Pose::IDENTITY;
    let mut step = |pose: &Pose<JOINTS>| {
        let Report { step_s, passed, .. } = stylizer.step(pose, &mut output);
        let turned = |last: &Pose<JOINTS>| {
            let pairs = last.rotations.iter().zip(&output.rotations);
            pairs.map(|(a, b)| quaternion::angle(*a, *b)).fold(0.0, f32::max) / step_s
        };
        let speed = last.as_ref().filter(|_| passed == 0.0).map_or(0.0, turned);
        last = Some(output);
        speed
    };
    input.iter().map(&mut step).collect()
}

fn styled<'db>(database: Database<'db>, method: Method) -> Gestus<'db> {
    let mut stylizer = Gestus::new(database, Config::new().method(method)).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    stylizer
}

#[test]
fn a_stream_that_begins_in_mid_stride_does_not_throw_its_arms() {
    let database = Database::open(motion::small()).unwrap();
    let most = fastest(&database, 1);
    let clip = walk(BEFORE + SECOND);
    for method in Method::ALL {
        for start in (0..BEFORE).step_by(5) {
            let mut stylizer = styled(database, method);
            let found = speeds(&mut stylizer, &clip[start..start + SECOND]).into_iter().fold(0.0, f32::max);
            assert!(found < 1.001 * most, "{method:?} from frame {start}: {found} rad/s of {most}");
        }
    }
}

#[test]
fn what_changes_in_mid_stream_changes_softly() {
    let database = Database::open(motion::small()).unwrap();
    let clip = walk(BEFORE + SECOND);
    let elsewhere: Vec<Pose<JOINTS>> = clip[..SECOND]
        .iter()
        .map(|pose| {
            let [x, y, z] = pose.position;
            let mut pose = *pose;
            pose.position = [x + 30.0, y, z];
            // Faces the other way.
            let about = quaternion::about_y(3.0);
            pose.rotations[0] = quaternion::multiply(about, pose.rotations[0]);
            pose
        })
        .collect();
    type Event = fn(&mut Gestus<'_>);
    let events: [(&str, Event); 5] = [
        ("reset", |stylizer| stylizer.reset()),
        ("leap", |_| ()),
        ("style", |stylizer| stylizer.set_style(&[(2, 1.0)]).unwrap()),
        ("action", |stylizer| stylizer.set_action(Some(0)).unwrap()),
        ("input style", |stylizer| stylizer.set_input_style(Some(0)).unwrap()),
    ];
    for method in Method::ALL {
        for (name, event) in events {
            let mut stylizer = styled(database, method);
            speeds(&mut stylizer, &clip[..BEFORE]);
            event(&mut stylizer);
            let after = if name == "leap" { &elsewhere[..] } else { &clip[BEFORE..BEFORE + SECOND] };
            let most = fastest(&database, if name == "style" { 2 } else { 1 });
            let found = speeds(&mut stylizer, after).into_iter().fold(0.0, f32::max);
            assert!(found < 1.001 * most, "{method:?}, {name}: {found} rad/s of {most}");
        }
    }
}

/// The limit is one of the style: a weaker style has as much less of it, and without a speed limit there is none.
#[test]
fn what_is_not_of_the_style_is_not_held_to_it() {
    let database = Database::open(motion::small()).unwrap();
    let clip = walk(SECOND);
    let mut stylizer = styled(database, Method::Mar);
    for group in 0..database.counts().groups {
        stylizer.set_strength(group as u16, 0.0).unwrap();
    }
    let mut output = Pose::IDENTITY;
    for (t, pose) in clip.iter().enumerate() {
        let _ = stylizer.step(pose, &mut output);
        for (own, input) in output.rotations.iter().zip(&pose.rotations).skip(1) {
            assert!(quaternion::angle(*own, *input) < 1e-3, "frame {t}");
        }
    }
    let mut stylizer = styled(database, Method::Statistic);
    stylizer.set_config(Config::new().method(Method::Statistic).speed_limit(0.0)).unwrap();
    speeds(&mut stylizer, &clip[..10]);
    stylizer.set_style(&[(2, 1.0)]).unwrap();
    let jump = speeds(&mut stylizer, &clip[10..11])[0];
    assert!(jump > fastest(&database, 2), "{jump} rad/s");
}
