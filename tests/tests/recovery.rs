//! After a single wrong input every method's output comes back: two seconds later posture and height are those of the
//! stream without it, and so are the feet, which hang on both. Only the place on the ground may differ.

use std::thread;

use gestus_core::{Config, Database, Degraded, Method, Pose, Report, Stylizer, math::quaternion};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const JOINTS: usize = 21;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 6>;

/// The frame that is wrong, how many frames later the streams are compared, and for how many: half a cycle.
const WRONG: usize = 60;
const LATER: usize = 60;
const COMPARED: usize = 16;
/// How far apart they may be: a degree, and 2 mm.
const ANGLE: f32 = 0.0175;
const HEIGHT_M: f32 = 0.002;
/// Bits below this one change a number by less than a two-thousandth of it.
const LOW: usize = 12;

/// A stream just before the frame that is wrong.
struct Stream {
    clean: Vec<Pose<JOINTS>>,
    stylizer: Gestus<'static>,
    output: Pose<JOINTS>,
}

impl Stream {
    fn new(method: Method) -> Self {
        let database = Database::open(motion::small()).unwrap();
        let mut stylizer = Gestus::new(database, Config::new().method(method)).unwrap();
        stylizer.set_style(&[(1, 1.0)]).unwrap();
        let clean = motion::unseen(0, 0, WRONG + LATER + COMPARED);
        let clean: Vec<_> = clean.frames.iter().map(to_pose).collect();
        let mut output = Pose::IDENTITY;
        for pose in &clean[..WRONG] {
            let _ = stylizer.step(pose, &mut output);
        }
        Self { clean, stylizer, output }
    }

    /// What comes out from the wrong frame on.
    fn after(&self, wrong: &Pose<JOINTS>) -> Vec<(Pose<JOINTS>, Report)> {
        let (mut stylizer, mut output) = (self.stylizer.clone(), self.output);
        let input = std::iter::once(wrong).chain(&self.clean[WRONG + 1..]);
        input.map(|pose| (stylizer.step(pose, &mut output), output)).map(|(r, o)| (o, r)).collect()
    }
}

/// The largest angle between the rotations of a joint in two poses, radians.
fn turned(a: &Pose<JOINTS>, b: &Pose<JOINTS>) -> f32 {
    a.rotations.iter().zip(&b.rotations).map(|(p, q)| quaternion::angle(*p, *q)).fold(0.0, f32::max)
}

/// The largest difference of a rotation, radians, and of a height, metres, two seconds later.
fn apart(good: &[(Pose<JOINTS>, Report)], bad: &[(Pose<JOINTS>, Report)]) -> (f32, f32) {
    let mut most = (0.0f32, 0.0f32);
    for ((a, _), (b, _)) in good.iter().zip(bad).skip(LATER) {
        most.0 = most.0.max(turned(a, b));
        most.1 = most.1.max((a.position[1] - b.position[1]).abs());
    }
    most
}

#[test]
fn one_wrong_height_or_place_leaves_no_trace() {
    for method in Method::ALL {
        let stream = Stream::new(method);
        let good = stream.after(&stream.clean[WRONG]);
        for wrong in
            [[0.0, -1.8, 0.0], [0.0, -10.0, 0.0], [0.0, 5.0, 0.0], [1000.0, 0.0, 0.0], [0.0, 0.7, 0.0]]
        {
            let mut pose = stream.clean[WRONG];
            for (slot, off) in pose.position.iter_mut().zip(wrong) {
                *slot += off;
            }
            let bad = stream.after(&pose);
            let (angle, height) = apart(&good, &bad);
            assert!(angle < ANGLE && height < HEIGHT_M, "{method:?} {wrong:?}: {angle} rad, {height} m");
            assert!(bad[0].1.degraded.contains(Degraded::LEAP), "{method:?} {wrong:?}");
        }
    }
}

/// The lock lifts a foot that is under the floor. Once it is out of it again, the foot comes down as fast as it steps, in half
/// a second and not in two: until then its leg is bent.
#[test]
fn feet_that_were_under_the_floor_come_down_in_half_a_second() {
    const HALF_A_SECOND: usize = 15;
    for method in Method::ALL {
        let stream = Stream::new(method);
        let good = stream.after(&stream.clean[WRONG]);
        for step in 1..=9 {
            let depth = 0.05 * step as f32;
            let mut sunk = stream.clean[WRONG];
            sunk.position[1] -= depth;
            let bad = stream.after(&sunk);
            let most = turned(&good[HALF_A_SECOND].0, &bad[HALF_A_SECOND].0);
            assert!(most < 0.25, "{method:?}, {depth} m: {most} rad after half a second");
            let (angle, height) = apart(&good, &bad);
            assert!(angle < ANGLE && height < HEIGHT_M, "{method:?}, {depth} m: {angle} rad, {height} m");
        }
    }
}

/// Nor does a pose that is wrong as a whole: every joint at rest, the hips at any height.
#[test]
fn a_wrong_pose_leaves_no_trace() {
    for method in Method::ALL {
        let stream = Stream::new(method);
        let good = stream.after(&stream.clean[WRONG]);
        for step in 0..=9 {
            let mut pose = Pose::IDENTITY;
            pose.position[1] = stream.clean[WRONG].position[1] * (1.0 - step as f32 / 9.0);
            let (angle, height) = apart(&good, &stream.after(&pose));
            assert!(angle < ANGLE && height < HEIGHT_M, "{method:?} {step}: {angle} rad, {height} m");
        }
    }
}

/// A place that is off by less than a body's speed is told by the change of that speed, there and back.
#[test]
fn a_root_that_jerks_leaps() {
    for method in Method::ALL {
        let stream = Stream::new(method);
        let leaps = |off: f32| {
            let mut pose = stream.clean[WRONG];
            pose.position[0] += off;
            let after = stream.after(&pose);
            after.iter().take(6).map(|(_, r)| r.degraded.contains(Degraded::LEAP)).collect::<Vec<_>>()
        };
        assert_eq!(leaps(0.15), [true, true, false, false, false, false], "{method:?}");
        assert_eq!(leaps(0.04), [false; 6], "{method:?}");
    }
    // A speed that lasts is accepted at once.
    let stream = Stream::new(Method::Mar);
    let (mut stylizer, mut output) = (stream.stylizer.clone(), stream.output);
    let carried = stream.clean[WRONG..].iter().enumerate().map(|(t, pose)| {
        let mut pose = *pose;
        pose.position[0] += 0.2 * (t + 1) as f32;
        stylizer.step(&pose, &mut output).degraded.contains(Degraded::LEAP)
    });
    assert_eq!(carried.filter(|leaps| *leaps).count(), 1);
}

/// Every bit of every number of a frame; in debug builds one of the lowest a number, for the time.
#[test]
fn one_wrong_bit_leaves_no_trace() {
    let try_bits = |method: Method| {
        let stream = Stream::new(method);
        let good = stream.after(&stream.clean[WRONG]);
        let bits = (0..3 + 4 * JOINTS).flat_map(|n| (0..32).map(move |bit| (n, bit)));
        for (number, bit) in bits.filter(|(n, bit)| !cfg!(debug_assertions) || *bit >= LOW || *bit == n % LOW)
        {
            let mut pose = stream.clean[WRONG];
            let slot = match number.checked_sub(3) {
                None => &mut pose.position[number],
                Some(n) => &mut pose.rotations.as_flattened_mut()[n],
            };
            *slot = f32::from_bits(slot.to_bits() ^ 1 << bit);
            let (angle, height) = apart(&good, &stream.after(&pose));
            assert!(
                angle < ANGLE && height < HEIGHT_M,
                "{method:?}, bit {bit} of number {number}: {angle} rad, {height} m"
            );
        }
    };
    thread::scope(|scope| {
        for method in Method::ALL {
            scope.spawn(move || try_bits(method));
        }
    });
}

/// Angle by which no joint leaves and comes back within two frames: 6 rad/s.
const SPIKE_ANGLE: f32 = 0.2;

/// A wrong bit that turns a joint twice as far from where it was and will be is reported, at the latest in the next frame.
#[test]
fn wrong_bits_are_reported() {
    for method in Method::ALL {
        let stream = Stream::new(method);
        let [before, right, after] = [WRONG - 1, WRONG, WRONG + 1].map(|t| &stream.clean[t]);
        let mut wrong_bits = 0;
        for (number, bit) in (3..3 + 4 * JOINTS).flat_map(|n| (LOW..32).map(move |bit| (n, bit))) {
            let mut pose = *right;
            let slot = &mut pose.rotations.as_flattened_mut()[number - 3];
            *slot = f32::from_bits(slot.to_bits() ^ 1 << bit);
            let joint = (number - 3) / 4;
            let turned =
                [before, after].map(|p| quaternion::angle(p.rotations[joint], pose.rotations[joint]));
            // The heading is measured as a rate, and a turn about several axes is slower about each.
            if pose.is_valid(JOINTS) && turned.iter().any(|angle| *angle < 2.0 * SPIKE_ANGLE) {
                continue;
            }
            wrong_bits += 1;
            let reports: Vec<_> = stream.after(&pose).into_iter().take(2).map(|(_, r)| r.degraded).collect();
            let wrong = [Degraded::INPUT, Degraded::LEAP, Degraded::SPIKE];
            assert!(
                reports.iter().any(|told| wrong.iter().any(|flag| told.contains(*flag))),
                "{method:?}, bit {bit} of number {number} turned {turned:?} rad: {reports:?}"
            );
        }
        assert!(wrong_bits > 100, "{wrong_bits}");
    }
}
