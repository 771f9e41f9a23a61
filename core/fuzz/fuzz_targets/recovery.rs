//! One wrong frame of a stream, whatever is wrong with it: two and a half seconds later posture and height are those of
//! the stream without it. The place on the ground may differ. Where feet are held so may the legs, and the height by as
//! much as the hips drop for a stretched leg: a foot that is held far from its prediction goes back to it over some
//! steps.
//!
//! An input is `method, settings, frame`, then a byte for a number of the frame and one for what is done to it, as often
//! as there are bytes. A fuzzer keeps what reaches new code; here it also keeps what takes longer to come back than all
//! before, by counters that libFuzzer reads as if they were branches.
//!
//! The database and the stream are the files that GESTUS_BLOB and GESTUS_POSES name; `cargo xtask fuzz recovery` makes
//! them.
#![no_main]

use std::sync::{
    LazyLock,
    atomic::{AtomicU8, Ordering},
};

use gestus_core::{
    Config, Database, Method, Pose, Safety, Stylizer,
    config::Timing,
    math::quaternion::{angle, exp, multiply},
};
use libfuzzer_sys::fuzz_target;

const JOINTS: usize = 22;
/// Frames in which a stream comes back, two and a half seconds, and for which it then has to be back: half a cycle.
/// Almost all are back in two; the longest that was found took 61 frames, by phase tables.
const BACK: usize = 75;
const COMPARED: usize = 16;
/// The first frames that can be wrong: what a stream begins with is softer.
const FIRST: usize = 45;
/// How far apart they may be, radians and metres. The speed limit remembers for four seconds how fast the frames beside the
/// wrong one were; where that holds a joint, it is some degrees off in single frames.
const ANGLE: f32 = 0.1;
const HEIGHT_M: f32 = 0.005;
/// How far the hips drop for the stretched leg of a held foot, metres.
const HIP_DROP_M: f32 = 0.04;

// `used`: nothing here reads it.
// SAFETY: libFuzzer reads this section as an array of bytes, which atomic bytes are.
#[used]
#[unsafe(link_section = "__libfuzzer_extra_counters")]
static LATEST: [[AtomicU8; BACK]; Method::ALL.len()] =
    [const { [const { AtomicU8::new(0) }; BACK] }; Method::ALL.len()];

static BLOB: LazyLock<Vec<u8>> = LazyLock::new(|| gestus_core_fuzz::named("GESTUS_BLOB"));
/// A walk that is not in the database.
static CLEAN: LazyLock<Vec<Pose<JOINTS>>> = LazyLock::new(|| {
    let bytes = gestus_core_fuzz::named("GESTUS_POSES");
    let numbers: Vec<f32> = bytes.as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).collect();
    let pose = |numbers: &[f32; 3 + 4 * JOINTS]| {
        let (position, rotations) = numbers.split_at(3);
        let mut pose = Pose::IDENTITY;
        pose.position.copy_from_slice(position);
        pose.rotations.as_flattened_mut().copy_from_slice(rotations);
        pose
    };
    numbers.as_chunks().0.iter().map(pose).collect()
});

fuzz_target!(|bytes: &[u8]| {
    let [method, settings, frame, wrong @ ..] = bytes else { return };
    let clean = &*CLEAN;
    let database = Database::open(&BLOB).expect("the database opens");
    let kind = usize::from(*method) % Method::ALL.len();
    let config = Config::new()
        .method(Method::ALL[kind])
        .safety([Safety::Follow, Safety::Hold, Safety::Rest][usize::from(settings & 3) % 3])
        .timing(if settings & 4 == 0 { Timing::Free } else { Timing::Sync })
        .contacts(settings & 8 == 0);
    let height = HEIGHT_M + if config.contacts { HIP_DROP_M } else { 0.0 };
    let free = free_joints(&database, config.contacts);
    let mut stylizer = Stylizer::<JOINTS, 16, 4>::new(database, config).expect("the database fits");
    stylizer.set_style(&[(1, 1.0)]).expect("there are two styles");
    let at = FIRST + usize::from(*frame) % (clean.len() - FIRST - BACK - COMPARED);
    let mut output = Pose::IDENTITY;
    for pose in &clean[..at] {
        let _ = stylizer.step(pose, &mut output);
    }
    let mut pose = clean[at];
    for pair in wrong.as_chunks::<2>().0 {
        spoil(&mut pose, *pair);
    }
    let after = |first: &Pose<JOINTS>| {
        let (mut stylizer, mut output) = (stylizer.clone(), output);
        let input = std::iter::once(first).chain(&clean[at + 1..]).take(BACK + COMPARED);
        let step = |pose: &Pose<JOINTS>| {
            let _ = stylizer.step(pose, &mut output);
            output
        };
        input.map(step).collect::<Vec<_>>()
    };
    let (good, bad) = (after(&clean[at]), after(&pose));
    let differs = |(good, bad)| differs(good, bad, &free, height);
    let back = BACK + COMPARED - good.iter().zip(&bad).rev().take_while(|pair| !differs(*pair)).count();
    assert!(back <= BACK, "{:?}: {back} frames", Method::ALL[kind]);
    for slot in LATEST[kind].iter().take(back) {
        slot.store(1, Ordering::Relaxed);
    }
});

/// Flips a bit of a number of the pose; or turns a joint by up to half a turn, or moves the root by up to six metres.
fn spoil(pose: &mut Pose<JOINTS>, [number, how]: [u8; 2]) {
    let number = usize::from(number) % (3 + 4 * JOINTS);
    let way = (f32::from(how) - 192.0) / 20.0;
    match number.checked_sub(3) {
        None if how >= 128 => pose.position[number] += 2.0 * way,
        Some(n) if how >= 128 => {
            let mut turn = [0.0; 3];
            turn[n % 3] = way;
            let rotation = &mut pose.rotations[n / 4];
            *rotation = multiply(*rotation, exp(turn));
        }
        place => {
            let slot = match place {
                None => &mut pose.position[number],
                Some(n) => &mut pose.rotations.as_flattened_mut()[n],
            };
            *slot = f32::from_bits(slot.to_bits() ^ 1 << (how & 31));
        }
    }
}

/// The joints that no held foot moves.
fn free_joints(database: &Database<'_>, held: bool) -> Vec<usize> {
    let legs = database.legs().filter(|_| held).into_iter().flatten();
    let moved: Vec<usize> =
        legs.flat_map(|leg| [leg.hip, leg.knee, leg.ankle].into_iter().chain(leg.toe)).collect();
    (0..database.counts().joints).filter(|joint| !moved.contains(joint)).collect()
}

fn differs(a: &Pose<JOINTS>, b: &Pose<JOINTS>, joints: &[usize], height: f32) -> bool {
    (a.position[1] - b.position[1]).abs() > height
        || joints.iter().any(|&joint| angle(a.rotations[joint], b.rotations[joint]) > ANGLE)
}
