//! Robots that do generated motion: the toy that comes with the project, and one made of the body itself, whose truth is
//! known.

mod common;

use std::{f64::consts::PI, fmt::Write};

use common::{corpus, database, walk};
use gestus_core::{
    BlobError, Pose,
    blob::{crc::crc32c, layout::section},
    robot::{
        Drive, Robot as Tables,
        layout::{group, header, hinge, joint, limb},
    },
};
use gestus_database::robot::{
    Machine, MachineError, RobotMap,
    play::{end_effectors, play, play_frames},
};
use gestus_motion::{
    clip::Skeleton,
    formats::urdf::{Robot, TOY},
};
use proptest::prelude::*;

fn toy(map: &str) -> Machine {
    let map = RobotMap::parse(map, "m.toml").unwrap();
    Machine::new(&database(), Robot::parse(TOY, "toy.urdf").unwrap(), &map).unwrap()
}

/// The generated body as a robot: three hinges a joint, about axes in an order of its own for every joint, strong
/// enough for anything. The same proportions, so hands and feet have to be where the body's are.
fn body_as_robot(skeleton: &Skeleton) -> String {
    let name = |j: usize| {
        let (stem, side) = skeleton.names[j].split_once('_').unwrap_or((&skeleton.names[j], ""));
        let side = match side {
            "L" => "left_",
            "R" => "right_",
            _ => "",
        };
        let stem = match stem {
            "UpperArm" => "shoulder",
            "LowerArm" => "elbow",
            "Hand" => "wrist",
            "UpperLeg" => "hip",
            "LowerLeg" => "knee",
            "Foot" => "ankle",
            "Chest" => "chest",
            "Head" => "head",
            _ => return None,
        };
        Some(format!("{side}{stem}"))
    };
    let mut text = String::from("<robot name=\"body\"><link name=\"j0\"/>");
    let axes = ["1 0 0", "0 1 0", "0 0 1"];
    let orders = [[0, 1, 2], [2, 0, 1], [1, 2, 0], [2, 1, 0], [0, 2, 1], [1, 0, 2]];
    for j in 1..skeleton.joints() {
        let parent = skeleton.parents[j].unwrap();
        // Y up and ahead along Z, as the map says.
        let at = skeleton.offsets[j];
        let origin = format!("<origin xyz=\"{} {} {}\"/>", at.x, at.y, at.z);
        let _ = write!(text, "<link name=\"j{j}\"/>");
        match name(j) {
            None => {
                let _ = write!(
                    text,
                    "<joint name=\"f{j}\" type=\"fixed\"><parent link=\"j{parent}\"/><child link=\"j{j}\"/>{origin}</joint>"
                );
            }
            Some(name) => {
                let order = orders[j % orders.len()];
                for (i, axis) in order.into_iter().enumerate() {
                    let from = if i == 0 { format!("j{parent}") } else { format!("j{j}_{i}") };
                    let to = if i == 2 { format!("j{j}") } else { format!("j{j}_{}", i + 1) };
                    if i < 2 {
                        let _ = write!(text, "<link name=\"{to}\"/>");
                    }
                    let origin = if i == 0 { origin.as_str() } else { "" };
                    let _ = write!(
                        text,
                        "<joint name=\"{name}_{i}\" type=\"continuous\"><parent link=\"{from}\"/><child link=\"{to}\"/>\
                         {origin}<axis xyz=\"{}\"/><limit velocity=\"60\" effort=\"9\" lower=\"-3.14\" upper=\"3.14\"/></joint>",
                        axes[axis]
                    );
                }
            }
        }
    }
    text + "</robot>"
}

#[test]
fn a_robot_like_the_body_has_hands_and_feet_where_the_body_has_them() {
    let text = body_as_robot(&corpus().skeleton);
    let map = "forward = \"z\"\nup = \"y\"\nacceleration = 4000\njerk = 400000\n";
    let map = RobotMap::parse(map, "m.toml").unwrap();
    let machine = Machine::new(&database(), Robot::parse(&text, "body.urdf").unwrap(), &map).unwrap();
    assert_eq!(machine.robot.hinges.len(), 42);
    let played = play(&machine, walk());
    let (reached, wanted) = end_effectors(&machine, &played, walk());
    assert!(wanted < 1.0 && reached < 1.5, "{reached} degrees, targets {wanted}");
    let figures = played.figures(&machine);
    assert_eq!(figures["limit_violations"], 0);
    assert!(figures["tracking_rms_deg"].as_f64().unwrap() < 1.0, "{figures}");
}

#[test]
fn the_toy_walks_within_its_limits_and_its_knees_bend_backwards() {
    let machine = toy("");
    assert!(machine.doubts.iter().all(|d| d.contains("pulses")), "{:?}", machine.doubts);
    let played = play(&machine, walk());
    let figures = played.figures(&machine);
    assert_eq!(figures["limit_violations"], 0, "{figures}");
    assert!(figures["peak_jerk_ratio"].as_f64().unwrap() <= 1.01);
    let (reached, wanted) = end_effectors(&machine, &played, walk());
    assert!(wanted < 3.0 && reached < 8.0, "{reached} degrees, targets {wanted}");
    let of = |name: &str| machine.robot.find(name).unwrap();
    for side in ["left", "right"] {
        let (knee, hip) = (of(&format!("{side}_knee")), of(&format!("{side}_hip_pitch")));
        let angles = |h: usize| played.ticks.iter().skip(30).map(move |t| t.motions[h].position);
        let swing = angles(knee).fold(0.0f32, f32::max);
        assert!((0.5..2.0).contains(&swing), "the {side} knee bends by {swing} rad at most");
        let (back, ahead) = angles(hip).fold((0.0f32, 0.0f32), |(l, h), q| (l.min(q), h.max(q)));
        assert!(back < -0.2 && ahead > 0.1, "the {side} hip swings from {back} to {ahead}");
    }
    // The first tick begins where the robot stands.
    assert!(played.ticks[0].motions.iter().all(|m| m.position.abs() < 0.05));
}

#[test]
fn poses_that_are_none_are_held_and_do_not_move_the_targets() {
    let machine = toy("");
    let mut frames = walk().frames.clone();
    frames.truncate(40);
    for frame in &mut frames[20..30] {
        frame.root.x = f64::NAN;
    }
    let played = play_frames(&machine, &frames);
    for (i, tick) in played.ticks.iter().enumerate() {
        assert_eq!(tick.driven.held, (20..30).contains(&i), "tick {i}");
    }
    assert_eq!(played.ticks[19].targets, played.ticks[29].targets);
    assert_eq!(played.figures(&machine)["limit_violations"], 0);
}

#[test]
fn the_drive_begins_where_the_servos_are() {
    let machine = toy("");
    let start = [0.1, -0.4, 0.9, f32::NAN];
    let mut drive = Drive::<16>::new(machine.tables(), &start).unwrap();
    assert_eq!(drive.motions()[2].position, 0.9);
    assert_eq!(drive.motions()[3].position, 0.0);
    let driven = drive.step(&gestus_database::stream::to_pose::<32>(&walk().frames[0]));
    assert!(!driven.held && driven.lag > 0.1, "{driven:?}");
    assert!((drive.motions()[2].position - 0.9).abs() < 0.05);
    assert!(Drive::<15>::new(machine.tables(), &[]).is_err());
    assert!(machine.tables().fits(&database(), 16).is_ok());
    assert!(machine.tables().fits(&database(), 8).is_err());
}

#[test]
fn maps_set_rates_servos_and_what_is_not_driven() {
    let machine = toy(
        "tick_hz = 100\njerk = 700\n[joints.left_knee]\nacceleration = 33\nservo = { direction = -1, zero_deg = 0, us_per_deg = 10 }\n\
         [joints.left_elbow]\npart = \"\"\n[joints.ghost]\n",
    );
    let knee = machine.robot.find("left_knee").unwrap();
    let limits = machine.tables().limits(knee);
    assert_eq!((limits.acceleration, limits.jerk, limits.velocity), (33.0, 700.0, 6.5));
    let servo = machine.tables().servo(knee);
    assert_eq!(servo.pulse(0.0), 1500);
    assert_eq!(servo.pulse((PI / 6.0) as f32), 1200);
    assert!(machine.doubts.iter().any(|d| d.contains("ghost")), "{:?}", machine.doubts);
    assert!(machine.doubts.iter().any(|d| d.contains("left_elbow")), "{:?}", machine.doubts);
    let played = play(&machine, walk());
    let elbow = machine.robot.find("left_elbow").unwrap();
    assert!(played.ticks.iter().all(|t| t.motions[elbow].position == 0.0));
    assert_eq!(played.tick_hz, 100.0);
    let none = "<robot name=\"r\"><link name=\"a\"/><link name=\"b\"/><joint name=\"j\" type=\"continuous\"><parent link=\"a\"/><child link=\"b\"/><axis xyz=\"0 0 1\"/></joint></robot>";
    let error =
        Machine::new(&database(), Robot::parse(none, "r.urdf").unwrap(), &RobotMap::default()).unwrap_err();
    assert!(matches!(error, MachineError::Nothing { .. }), "{error}");
}

#[test]
fn tables_and_trajectories_have_their_shapes() {
    let machine = toy("");
    let mut clip = walk().clone();
    clip.frames.truncate(20);
    let played = play(&machine, &clip);
    let lines: Vec<String> = played.csv().lines().map(String::from).collect();
    assert_eq!(lines.len(), played.ticks.len() + 1);
    assert!(lines[0].starts_with("time_s,left_hip_roll,"), "{}", lines[0]);
    assert!(lines[1].starts_with("0.020000,"), "{}", lines[1]);
    assert!(lines.iter().all(|l| l.matches(',').count() == 16));
    let pulses = played.servo_csv();
    let numbers = pulses
        .lines()
        .skip(1)
        .flat_map(|l| l.split(',').skip(1).map(|v| v.parse::<u16>().unwrap()).collect::<Vec<_>>());
    assert!(numbers.clone().all(|p| (500..=2500).contains(&p)));
    let trajectory = played.trajectory();
    assert_eq!(trajectory["joint_names"].as_array().unwrap().len(), 16);
    let last = trajectory["points"].as_array().unwrap().last().unwrap();
    assert_eq!(last["positions"].as_array().unwrap().len(), 16);
    let ns = last["time_from_start"]["sec"].as_u64().unwrap() * 1_000_000_000
        + last["time_from_start"]["nanosec"].as_u64().unwrap();
    assert_eq!(ns, played.ticks.len() as u64 * 20_000_000);
}

fn repaired(mut bytes: Vec<u8>) -> Vec<u8> {
    bytes[header::CRC].fill(0);
    let crc = crc32c(&[&bytes]);
    bytes[header::CRC].copy_from_slice(&crc.to_le_bytes());
    bytes
}

#[test]
fn every_check_of_a_robot_is_made() {
    const S: u16 = section::ROBOT;
    let machine = toy("");
    let whole = machine.bytes().to_vec();
    let patched = |at: usize, value: &[u8]| {
        let mut bytes = whole.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        repaired(bytes)
    };
    let (j, h, g) = (21, 16, 10);
    let joints = header::LENGTH;
    let hinges = joints + j * joint::LENGTH;
    let groups = hinges + h * hinge::LENGTH;
    let limbs = groups + g * group::LENGTH;
    let value = |record: usize| BlobError::Value { section: S, record: record as u32 };
    let nan = f32::NAN.to_le_bytes();
    let two = 2.0f32.to_le_bytes();
    let have = whole.len() as u32;
    let cases: Vec<(&str, Vec<u8>, BlobError)> = vec![
        ("magic", patched(0, b"X"), BlobError::Magic),
        ("version", patched(header::VERSION.start, &[9, 0]), BlobError::Version { need: 1, have: 9 }),
        (
            "length",
            repaired(whole[..whole.len() - 4].to_vec()),
            BlobError::Truncated { need: have, have: have - 4 },
        ),
        ("no hinges", patched(header::HINGES.start, &[0, 0]), value(0)),
        ("too many groups", patched(header::GROUPS.start, &[17, 0]), value(0)),
        ("too many limbs", patched(header::LIMBS.start, &[9, 0]), value(0)),
        (
            "counts",
            patched(header::LIMBS.start, &[3, 0]),
            BlobError::Length { section: S, need: have - 20, have },
        ),
        ("reserved", patched(header::RESERVED_2.start, &[1]), BlobError::Reserved { section: S }),
        ("tick", patched(header::TICK.start, &two), value(0)),
        ("base", patched(header::BASE.start, &two), value(0)),
        ("parent", patched(joints + joint::LENGTH + joint::PARENT, &[9]), value(2)),
        ("offset", patched(joints + joint::OFFSET.start, &nan), value(1)),
        ("joint reserved", patched(joints + joint::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("hinge parent", patched(hinges + hinge::PARENT, &[3]), value(j + 1)),
        ("axis", patched(hinges + hinge::AXIS.start, &two), value(j + 1)),
        ("turn", patched(hinges + hinge::TURN.start, &two), value(j + 1)),
        ("hinge offset", patched(hinges + hinge::OFFSET.start, &nan), value(j + 1)),
        ("limits", patched(hinges + hinge::LIMITS.start, &two), value(j + 1)),
        ("servo", patched(hinges + hinge::SERVO.start, &nan), value(j + 1)),
        ("hinge reserved", patched(hinges + hinge::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("group order", patched(groups + group::LENGTH + group::FIRST, &[0]), value(j + h + 2)),
        ("group count", patched(groups + group::COUNT, &[4]), value(j + h + 1)),
        ("group joint", patched(groups + group::JOINT, &[21]), value(j + h + 1)),
        ("group limb", patched(groups + group::LIMB, &[5]), value(j + h + 1)),
        ("group axes", patched(groups + group::AXES.start, &two), value(j + h + 1)),
        ("group zero", patched(groups + group::ZERO.start, &two), value(j + h + 1)),
        ("group turn", patched(groups + group::TURN.start, &two), value(j + h + 1)),
        ("group pointed", patched(groups + group::POINTED.start, &two), value(j + h + 1)),
        ("limb joints", patched(limbs, &[21]), value(j + h + g + 1)),
        ("limb hinges", patched(limbs + limb::HINGES.start, &[0, 6]), value(j + h + g + 1)),
        ("limb scale", patched(limbs + limb::SCALE.start, &nan), value(j + h + g + 1)),
        ("limb tip", patched(limbs + limb::TIP.start, &nan), value(j + h + g + 1)),
    ];
    for (name, bytes, error) in cases {
        assert_eq!(Tables::open(&bytes).err(), Some(error), "{name}");
    }
    let mut damaged = whole.clone();
    damaged[300] ^= 1;
    assert_eq!(Tables::open(&damaged).err(), Some(BlobError::Checksum { section: S }));
    assert!(matches!(Tables::open(&whole[..40]).err(), Some(BlobError::Truncated { .. })));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, ..ProptestConfig::default() })]

    /// Whatever poses come, NaN among them: limits hold at every tick.
    #[test]
    fn limits_hold_for_any_poses(seed in any::<u64>(), tick_hz in 20u32..200) {
        let machine = toy(&format!("tick_hz = {tick_hz}\n"));
        let mut state = seed | 1;
        let mut next = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 40) as f32 / (1u64 << 24) as f32
        };
        let tables = machine.tables();
        let mut drive = Drive::<16>::new(tables, &[]).unwrap();
        let mut pose = Pose::<22>::IDENTITY;
        for tick in 0..300 {
            if tick % (1 + (next() * 6.0) as usize) == 0 {
                for q in &mut pose.rotations {
                    let v = [next(), next(), next(), next()].map(|v| v - 0.5);
                    *q = gestus_core::math::quaternion::normalize(v).unwrap_or([0.0, 0.0, 0.0, 1.0]);
                }
                pose.position[0] = if next() < 0.05 { f32::NAN } else { next() };
            }
            let before = drive.motions().to_vec();
            let _ = drive.step(&pose);
            let seconds = tables.tick_s();
            for (h, (m, b)) in drive.motions().iter().zip(&before).enumerate() {
                let l = tables.limits(h);
                prop_assert!(m.position >= l.low && m.position <= l.high, "hinge {}: {:?}", h, m);
                prop_assert!(m.velocity.abs() <= l.velocity * 1.001, "hinge {}: {:?}", h, m);
                prop_assert!(m.acceleration.abs() <= l.acceleration * 1.001, "hinge {}: {:?}", h, m);
                let jerk = (m.acceleration - b.acceleration) / seconds;
                prop_assert!(jerk.abs() <= l.jerk * 1.01, "hinge {}: jerk {}", h, jerk);
                prop_assert!((500..=2500).contains(&drive.pulse(h)));
            }
        }
    }
}
