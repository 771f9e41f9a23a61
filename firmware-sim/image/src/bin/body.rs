//! Counts the instructions of the work around a step: retargeting a frame from another skeleton and back, retiming a
//! frame, a tick of a robot's hinges with its pulses, and a setting of the effort dial. It also counts the unpacking of
//! one row of the database; a step unpacks many.
//!
//! The map and the robot are built in (`GESTUS_MAP`, `GESTUS_ROBOT`); the dial is that of the database in the flash
//! window. The poses sway and jump now and then, so that every hinge moves. Prints a line `name median max` for each
//! figure, for `gestus-sim board m4f --around`.
#![no_std]
#![no_main]

use core::hint::black_box;

use cortex_m_rt::entry;
use gestus_core::{
    Database, Effort, Pose,
    math::{
        quaternion::{Quaternion, normalize},
        sin_cos,
    },
    output::retime::{Bounds, Retimer},
    retarget::Map,
    robot::{Drive, Robot},
};
use gestus_firmware::{
    counter::{Counter, Mps2Timer as Time},
    exit, flash,
};

const MAP: &[u8] = include_bytes!(env!("GESTUS_MAP"));
const ROBOT: &[u8] = include_bytes!(env!("GESTUS_ROBOT"));
const FRAMES: usize = 300;
/// Rates of the stream and the robot, millihertz.
const RATES: (u32, u32) = (30_000, 50_000);
/// A lead and a lag of 0.2 s.
const BOUNDS: Bounds = Bounds { lead_s: 0.2, lag_s: 0.2 };

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

/// Counts the instructions of some work in each frame, on an input prepared for it, without those of reading the
/// counter.
fn count<T>(counter: &Time, name: &str, prepare: impl Fn(usize) -> T, mut work: impl FnMut(&T)) {
    let mut counts = [0u32; FRAMES];
    let empty = counter.since(counter.now(), counter.now());
    for (frame, slot) in counts.iter_mut().enumerate() {
        let prepared = black_box(prepare(frame));
        let start = counter.now();
        work(black_box(&prepared));
        let ticks = counter.since(start, counter.now()).saturating_sub(empty);
        *slot = Time::instructions(u64::from(ticks)) as u32;
    }
    counts.sort_unstable();
    semihosting::println!("{name} {} {}", counts[FRAMES / 2], counts[FRAMES - 1]);
}

#[entry]
fn main() -> ! {
    // SAFETY: this is the address of the board's first timer, and nothing else in the image uses it.
    let counter = unsafe { Time::start() };
    let (Ok(map), Ok(robot)) = (Map::open(MAP), Robot::open(ROBOT)) else {
        semihosting::process::exit(exit::DATABASE)
    };
    let Ok(database) = Database::open(flash::blob()) else { semihosting::process::exit(exit::DATABASE) };
    let Ok(mut drive) = Drive::<32>::new(robot, &[]) else { semihosting::process::exit(exit::CAPACITY) };
    let Ok(mut retimer) = Retimer::<22, 24>::new(RATES.0, RATES.1, BOUNDS) else {
        semihosting::process::exit(exit::CAPACITY)
    };
    let mut body = Pose::<22>::IDENTITY;
    let mut back = Pose::<31>::IDENTITY;
    count(&counter, "retarget_in", pose::<31>, |input| map.to_target(input, &mut body));
    let like = pose::<31>(7);
    count(&counter, "retarget_back", pose::<22>, |output| map.to_source(output, &like, &mut back));
    // A style that is alternately faster and slower than its input, so that every tick is between two poses.
    let step_s = |frame: usize| if frame % 40 < 20 { 0.026 } else { 0.042 };
    count(
        &counter,
        "retiming",
        |frame| (pose::<22>(frame), step_s(frame)),
        |(output, step_s)| {
            retimer.push(output, *step_s);
            while retimer.is_due() {
                let _ = black_box(retimer.tick(&mut body));
            }
        },
    );
    count(&counter, "servo", pose::<22>, |output| {
        let _ = black_box(drive.step(output));
        for hinge in 0..robot.hinges() {
            black_box(drive.pulse(hinge));
        }
    });
    let (rows, mut dofs) = (database.counts().rows, [0.0; 96]);
    count(
        &counter,
        "row_decode",
        |frame| frame * rows / FRAMES,
        |row| {
            database.decode(*row, &mut dofs);
            black_box(&dofs);
        },
    );
    if let Some(dial) = database.dial() {
        let target = |frame: usize| {
            let (flow, weight) = sin_cos(0.1 * frame as f32);
            Effort::new([3.0 * flow, 3.0 * weight, flow * weight])
        };
        count(&counter, "effort", target, |target| {
            let _ = black_box(dial.weights(*target));
        });
    }
    semihosting::process::exit(0)
}
