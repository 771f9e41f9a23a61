//! What retargeting and a robot cost: instructions of a frame in, a frame back, and a tick of the drive.
//!
//! Holds a map and a robot that are named when it is built (`GESTUS_MAP`, `GESTUS_ROBOT`); poses sway, and jump now and
//! then, so that every hinge is under way.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use gestus_core::{
    Pose,
    math::sin_cos,
    quaternion::{Quaternion, normalize},
    retarget::Map,
    robot::{Drive, Robot},
};
use gestus_firmware::counter::{Counter, SysTick};

const MAP: &[u8] = include_bytes!(env!("GESTUS_MAP"));
const ROBOT: &[u8] = include_bytes!(env!("GESTUS_ROBOT"));
const FRAMES: usize = 300;

fn pose<const J: usize>(frame: usize) -> Pose<J> {
    let mut pose = Pose::IDENTITY;
    let jump = if frame % 60 < 30 { 0.0 } else { 0.6 };
    for (j, rotation) in pose.rotations.iter_mut().enumerate() {
        let (s, c) = sin_cos(0.07 * frame as f32 + j as f32);
        let wanted: Quaternion = [0.25 * s + jump * 0.3, 0.1 * c, 0.1 * s * c, 1.0];
        *rotation = normalize(wanted).unwrap_or(*rotation);
    }
    pose.position = [0.0, 0.9, 0.01 * frame as f32];
    pose
}

fn count(counter: &SysTick<40_000>, counts: &mut [u32; FRAMES], mut frame: impl FnMut(usize)) {
    for (i, slot) in counts.iter_mut().enumerate() {
        let start = counter.now();
        frame(i);
        let ticks = counter.since(start, counter.now());
        *slot = SysTick::<40_000>::instructions(u64::from(ticks)) as u32;
    }
    counts.sort_unstable();
}

#[entry]
fn main() -> ! {
    let Some(peripherals) = cortex_m::Peripherals::take() else { semihosting::process::exit(1) };
    let counter = SysTick::<40_000>::start(peripherals.SYST);
    let (Ok(map), Ok(robot)) = (Map::open(MAP), Robot::open(ROBOT)) else { semihosting::process::exit(2) };
    let Ok(mut drive) = Drive::<32>::new(robot, &[]) else { semihosting::process::exit(3) };
    let mut counts = [0; FRAMES];
    let report = |name: &str, counts: &[u32; FRAMES]| {
        semihosting::println!("{name}: median {} most {}", counts[FRAMES / 2], counts[FRAMES - 1]);
    };
    let mut body = Pose::<22>::IDENTITY;
    let mut back = Pose::<31>::IDENTITY;
    count(&counter, &mut counts, |_| {});
    report("nothing", &counts);
    // Making the pose is taken off by making it outside: once a frame, before the count begins.
    count(&counter, &mut counts, |i| {
        black_box(pose::<31>(i));
    });
    report("pose of 31", &counts);
    count(&counter, &mut counts, |i| map.bring(&black_box(pose::<31>(i)), &mut body));
    report("pose and in", &counts);
    count(&counter, &mut counts, |i| map.take_back(&black_box(body), &black_box(pose::<31>(i)), &mut back));
    report("pose and back", &counts);
    count(&counter, &mut counts, |i| {
        let input = black_box(pose::<22>(i));
        let _ = black_box(drive.step(&input));
        for h in 0..robot.hinges() {
            black_box(drive.pulse(h));
        }
    });
    report("pose of 22 and drive", &counts);
    semihosting::process::exit(0)
}
