//! After a single wrong input every method's output comes back: within seven seconds posture and height are those of the stream
//! without it. The prediction is back in three; the speed limit remembers for up to four how fast a joint was, and a foot that
//! came down elsewhere moves the next ones.

use gestus_core::{Config, Database, Degraded, Method, Pose, Report, Stylizer, math::quaternion};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const JOINTS: usize = 21;
type Gestus<'db> = Stylizer<'db, JOINTS, 16, 6>;

/// The frame that is wrong, and how many frames later the streams are compared.
const WRONG: usize = 60;
const LATER: usize = 210;

fn clean() -> Vec<Pose<JOINTS>> {
    motion::unseen(0, 0, WRONG + LATER + 30).frames.iter().map(to_pose).collect()
}

/// What comes out of a stream from seven seconds after the wrong frame on, and the reports up to there.
fn streamed(method: Method, input: &[Pose<JOINTS>]) -> (Vec<Pose<JOINTS>>, Vec<Report>) {
    let database = Database::open(motion::small()).unwrap();
    let mut stylizer = Gestus::new(database, Config::new().method(method)).unwrap();
    stylizer.set_style(&[(1, 1.0)]).unwrap();
    let mut output = Pose::IDENTITY;
    input.iter().map(|pose| (stylizer.step(pose, &mut output), output)).map(|(r, o)| (o, r)).unzip()
}

/// Largest difference of joints to their parents, radians, and of heights, metres.
fn apart(a: &[Pose<JOINTS>], b: &[Pose<JOINTS>]) -> (f32, f32) {
    let mut most = (0.0f32, 0.0f32);
    for (a, b) in a.iter().zip(b).skip(WRONG + LATER) {
        for (p, q) in a.rotations.iter().zip(&b.rotations).skip(1) {
            let between = quaternion::multiply(quaternion::conjugate(*p), *q);
            let [x, y, z, _] = between;
            most.0 = most.0.max(2.0 * (x * x + y * y + z * z).sqrt());
        }
        most.1 = most.1.max((a.position[1] - b.position[1]).abs());
    }
    most
}

#[test]
fn one_wrong_height_or_place_leaves_no_trace() {
    let clean = clean();
    for method in Method::ALL {
        let (good, _) = streamed(method, &clean);
        for wrong in
            [[0.0, -1.8, 0.0], [0.0, -10.0, 0.0], [0.0, 5.0, 0.0], [1000.0, 0.0, 0.0], [0.0, 0.7, 0.0]]
        {
            let mut input = clean.clone();
            for (slot, off) in input[WRONG].position.iter_mut().zip(wrong) {
                *slot += off;
            }
            let (bad, reports) = streamed(method, &input);
            let (angle, height) = apart(&good, &bad);
            assert!(angle < 0.01 && height < 0.001, "{method:?} {wrong:?}: {angle} rad, {height} m");
            assert!(reports[WRONG].degraded.contains(Degraded::LEAP), "{method:?} {wrong:?}");
        }
    }
}

/// Every bit of the position, and the ones that change a rotation most.
#[test]
fn one_wrong_bit_leaves_no_trace() {
    let clean = clean();
    for method in Method::ALL {
        let (good, _) = streamed(method, &clean);
        let numbers = (0..3).flat_map(|n| (16..32).map(move |bit| (n, bit)));
        let turns = (0..4 * JOINTS).step_by(5).flat_map(|n| [22, 24, 31].map(|bit| (3 + n, bit)));
        for (number, bit) in numbers.chain(turns) {
            let mut input = clean.clone();
            let pose = &mut input[WRONG];
            let slot = match number.checked_sub(3) {
                None => &mut pose.position[number],
                Some(n) => &mut pose.rotations.as_flattened_mut()[n],
            };
            *slot = f32::from_bits(slot.to_bits() ^ 1 << bit);
            let (bad, _) = streamed(method, &input);
            let (angle, height) = apart(&good, &bad);
            assert!(
                angle < 0.01 && height < 0.001,
                "{method:?}, bit {bit} of number {number}: {angle} rad, {height} m"
            );
        }
    }
}
