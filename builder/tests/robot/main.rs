//! Robots that do generated motion: the toy that comes with the project, and one made of the body itself, whose truth is
//! known.

mod bodies;
#[path = "../common/mod.rs"]
mod common;

use std::f64::consts::PI;

use bodies::{body_as_robot, with_hinge_before};
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
    Machine, MachineError, RobotMap, RobotMapError,
    play::{end_effectors, play, play_frames, play_round, play_standing},
    stand::to_robot_world,
    write::QposError,
};
use nalgebra::{Isometry3, Quaternion, UnitQuaternion, Vector3};

use gestus_motion::formats::urdf::{Robot, TOY};
use proptest::prelude::*;

fn toy(map: &str) -> Machine {
    let map = RobotMap::parse(map, "m.toml").unwrap();
    Machine::new(&database(), Robot::parse(TOY, "toy.urdf").unwrap(), &map).unwrap()
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
    assert!(played.doubts().is_empty() && machine.stand.doubts.is_empty());
}

/// A Y-up file without a map was taken for a robot with Z up that sits, and nothing was said of it, nor of what it missed.
#[test]
fn a_robot_whose_feet_are_not_below_its_hips_is_doubted() {
    let text = body_as_robot(&corpus().skeleton);
    let map = RobotMap::default();
    let machine = Machine::new(&database(), Robot::parse(&text, "body.urdf").unwrap(), &map).unwrap();
    let doubts = &machine.stand.doubts;
    assert!(doubts.iter().any(|d| d.contains("up = \"y\"")), "{doubts:?}");
    assert!(machine.doubts.iter().any(|d| doubts.contains(d)));
}

/// The figures were in JSON alone.
#[test]
fn a_robot_that_is_too_slow_for_the_motion_is_doubted() {
    let text = TOY.replace("velocity=\"6.5\"", "velocity=\"0.3\"");
    let slow = Machine::new(&database(), Robot::parse(&text, "toy.urdf").unwrap(), &RobotMap::default());
    let slow = slow.unwrap();
    let doubts = play(&slow, walk()).doubts();
    assert!(doubts.iter().any(|d| d.contains("too low for the motion")), "{doubts:?}");
    assert!(play(&toy(""), walk()).doubts().is_empty(), "{:?}", play(&toy(""), walk()).doubts());
}

/// iCub's file has textures without a file name, which `urdf-rs` refuses; xacro was "0 links have no joint above them".
#[test]
fn textures_are_left_out_and_xacro_is_named() {
    let material = "<visual><geometry><sphere radius=\"0.1\"/></geometry><material name=\"m\"><texture/></material></visual>";
    let at = TOY.find("<link name=").map(|at| at + TOY[at..].find('>').unwrap()).unwrap();
    assert!(TOY.as_bytes()[at - 1] != b'/');
    let text = format!("{}{material}{}", &TOY[..=at], &TOY[at + 1..]);
    assert_eq!(
        Robot::parse(&text, "a.urdf").unwrap().hinges.len(),
        Robot::parse(TOY, "toy.urdf").unwrap().hinges.len()
    );
    let xacro = "<robot name=\"r\" xmlns:xacro=\"x\"><xacro:include filename=\"a.xacro\"/></robot>";
    let error = Robot::parse(xacro, "r.xacro").unwrap_err().to_string();
    assert!(error.contains("xacro FILE"), "{error}");
    assert!(Robot::parse(" \n", "r.urdf").unwrap_err().to_string().contains("empty"));
}

/// Such hinges were placed in the base, so that what hangs on them turned wrongly, and a limb's moved.
#[test]
fn hinges_that_no_group_drives_stay_and_carry_the_others() {
    let map =
        "forward = \"z\"\nup = \"y\"\nacceleration = 4000\njerk = 400000\n[joints.extra]\npart = \"\"\n";
    let map = RobotMap::parse(map, "m.toml").unwrap();
    for first in ["left_shoulder_0", "left_elbow_0"] {
        let text = with_hinge_before(&body_as_robot(&corpus().skeleton), first, "extra");
        let machine = Machine::new(&database(), Robot::parse(&text, "body.urdf").unwrap(), &map).unwrap();
        let extra = machine.robot.find("extra").unwrap();
        assert_eq!(machine.assignment.undriven, [extra]);
        let played = play(&machine, walk());
        assert!(played.ticks.iter().all(|t| t.motions[extra].position == 0.0));
        let (reached, wanted) = end_effectors(&machine, &played, walk());
        assert!(wanted < 1.0 && reached < 1.5, "{first}: {reached} degrees, targets {wanted}");
    }
}

/// Hinges in the world, by forward kinematics of a row of `qpos`.
fn world(robot: &Robot, qpos: &[f64]) -> Vec<Isometry3<f64>> {
    let turn = UnitQuaternion::new_normalize(Quaternion::new(qpos[3], qpos[4], qpos[5], qpos[6]));
    let base = Isometry3::from_parts(Vector3::new(qpos[0], qpos[1], qpos[2]).into(), turn);
    robot.places(&qpos[7..]).into_iter().map(|place| base * place).collect()
}

/// The rows of a file with `qpos`, and the names of its columns.
fn read_qpos(path: &std::path::Path) -> (Vec<String>, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names = lines.next().unwrap().split(',').map(String::from).collect();
    (names, lines.map(|l| l.split(',').map(|v| v.parse().unwrap()).collect()).collect())
}

#[test]
fn qpos_puts_a_robot_like_the_body_where_the_body_is() {
    let skeleton = corpus().skeleton.clone();
    let map = "forward = \"z\"\nup = \"y\"\nacceleration = 4000\njerk = 400000\n";
    let map = RobotMap::parse(map, "m.toml").unwrap();
    let robot = Robot::parse(&body_as_robot(&skeleton), "body.urdf").unwrap();
    let machine = Machine::new(&database(), robot, &map).unwrap();
    let played = play(&machine, walk());
    let folder = std::env::temp_dir().join(format!("gestus-qpos-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join("walk.csv");
    played.write_qpos(&machine.robot, &path).unwrap();
    let (names, rows) = read_qpos(&path);
    assert_eq!(names[..7].join(" "), "root_x root_y root_z root_qw root_qx root_qy root_qz");
    assert!(names[7..].iter().eq(machine.robot.hinges.iter().map(|h| &h.name)));
    let clip = walk().resampled(50.0);
    assert_eq!(rows.len(), clip.frames.len());
    let to_robot = to_robot_world();
    // The soles of the two bodies are told apart by the ankles' height alone.
    let ankles = Vector3::new(0.0, 0.0, machine.stand.ankle_m - 0.08);
    let mut worst = 0.0f64;
    for (row, frame) in rows.iter().zip(&clip.frames).skip(25) {
        let (robot, body) = (world(&machine.robot, row), frame.positions(&skeleton));
        for (hinge, joint) in [
            ("left_ankle_0", "Foot_L"),
            ("right_ankle_0", "Foot_R"),
            ("left_wrist_0", "Hand_L"),
            ("right_knee_0", "LowerLeg_R"),
            ("head_0", "Head"),
        ] {
            let ours = robot[machine.robot.find(hinge).unwrap()].translation.vector;
            let theirs = to_robot * body[skeleton.find(joint).unwrap()];
            let apart = ours - theirs;
            worst = worst.max(Vector3::new(apart.x, apart.y, apart.z - ankles.z).norm());
        }
    }
    assert!(worst < 0.03, "{worst} m at most");
    // As an array: the same numbers, 64 bits each.
    let array = folder.join("walk.npy");
    played.write_qpos(&machine.robot, &array).unwrap();
    let bytes = std::fs::read(&array).unwrap();
    let data = &bytes[bytes.len() - rows.len() * names.len() * 8..];
    let first: Vec<f64> =
        data.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).take(names.len()).collect();
    assert!(first.iter().zip(&rows[0]).all(|(a, b)| (a - b).abs() < 1e-6), "{first:?}");
    assert!(String::from_utf8_lossy(&bytes[..128]).contains(&format!("({}, {}", rows.len(), names.len())));
    let refused = played.write_qpos(&machine.robot, &folder.join("walk.txt")).unwrap_err();
    assert!(matches!(&refused, QposError::Ending { file } if file.ends_with("walk.txt")), "{refused}");
    std::fs::remove_dir_all(folder).unwrap();
}

/// The quaternion's sign changed between rows, and whoever interpolated them saw the base turn around.
#[test]
fn the_base_turns_without_a_leap_of_its_quaternion() {
    let machine = toy("");
    let frame = |i: usize| {
        let mut frame = walk().frames[0].clone();
        frame.rotations[0] =
            UnitQuaternion::from_axis_angle(&Vector3::y_axis(), i as f64 * 0.1) * frame.rotations[0];
        frame
    };
    // Two turns and a half.
    let frames: Vec<_> = (0..157).map(frame).collect();
    let played = play_frames(&machine, &frames);
    let (_, qpos) = played.qpos(&machine.robot).unwrap();
    let qpos: Vec<[f64; 4]> = qpos.iter().map(|row| std::array::from_fn(|k| row[3 + k])).collect();
    let dot = |a: &[f64; 4], b: &[f64; 4]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    assert!(qpos[0][0] >= 0.0 && qpos.iter().any(|q| q[0] < -0.5), "{:?}", qpos[0]);
    assert!(qpos.windows(2).all(|pair| dot(&pair[0], &pair[1]) > 0.9));
    let csv = played.csv();
    let of_csv = csv.lines().skip(1).map(|line| {
        let row: Vec<f64> = line.split(',').map(|v| v.parse().unwrap_or(0.0)).collect();
        std::array::from_fn(|k| row[1 + 16 + 3 + k])
    });
    let points = played.trajectory()["base"]["points"].as_array().unwrap().clone();
    let of_points = points.iter().map(|point| {
        let turn = &point["transforms"][0]["rotation"];
        ["w", "x", "y", "z"].map(|k| turn[k].as_f64().unwrap())
    });
    for rows in [of_csv.collect::<Vec<_>>(), of_points.take(qpos.len()).collect()] {
        assert!(rows.len() == qpos.len() && rows.iter().zip(&qpos).all(|(a, b)| dot(a, b) > 0.999));
    }
}

/// The drive began at zero, so the rows of a loop were none.
#[test]
fn a_round_of_a_loop_ends_where_it_begins() {
    let machine = toy("");
    let mut round = walk().clone();
    // An arm that swings once in 41 frames of 30 a second: 68.3 ticks.
    let arm = round.skeleton.find("UpperArm_L").unwrap();
    round.frames = (0..=41)
        .map(|i| {
            let mut frame = walk().frames[0].clone();
            let swing = 0.6 + 0.3 * (2.0 * PI * f64::from(i) / 41.0).sin();
            frame.rotations[arm] *= UnitQuaternion::from_axis_angle(&Vector3::x_axis(), swing);
            frame
        })
        .collect();
    let open = play(&machine, &round);
    let played = play_round(&machine, &round, &[[true, false], [false, true]]);
    assert_eq!((played.ticks.len(), played.stop.len()), (68 + 1, 0));
    assert!(open.gap_deg() > 10.0 && played.gap_deg() < 0.1, "{} {}", open.gap_deg(), played.gap_deg());
    assert_eq!(played.figures(&machine)["limit_violations"], 0);
    let feet: Vec<_> = [0, 1, 68].iter().map(|&tick: &usize| played.ticks[tick].contacts.unwrap()).collect();
    assert_eq!(feet, [[true, false], [false, true], [true, false]]);
    assert!(played.csv().lines().nth(1).is_some_and(|row| row.starts_with("0.020000,")));
}

#[test]
fn the_toy_stands_on_the_floor() {
    let machine = toy("acceleration = 4000\njerk = 400000\nvelocity = 60\n");
    let (_, rows) = play(&machine, walk()).qpos(&machine.robot).unwrap();
    let feet = ["left_ankle_pitch", "right_ankle_pitch"].map(|name| machine.robot.find(name).unwrap());
    let heights = rows.iter().skip(25).map(|row| {
        let places = world(&machine.robot, row);
        feet.map(|h| places[h].translation.vector.z).into_iter().fold(f64::MAX, f64::min)
    });
    let heights: Vec<f64> = heights.collect();
    let (low, high) = heights.iter().fold((f64::MAX, f64::MIN), |(l, h), &z| (l.min(z), h.max(z)));
    // The roll of the ankle is 6 mm below its pitch, the box of the foot 30 mm below that.
    assert!((machine.stand.ankle_m - 0.036).abs() < 1e-9, "{}", machine.stand.ankle_m);
    assert!(
        (low - machine.stand.ankle_m).abs() < 0.006 && high < machine.stand.ankle_m + 0.02,
        "{low} to {high}"
    );
    let told = toy("ankle_m = 0.05\n");
    assert_eq!(told.stand.ankle_m, 0.05);
    assert!(told.stand.doubts.is_empty(), "{:?}", told.stand.doubts);
    let [doubt] = &toy("ankle_m = 0.5\n").stand.doubts[..] else { panic!("one doubt") };
    assert!(doubt.contains("ankles 50 cm above the ground"), "{doubt}");
    let error = RobotMap::parse("ankle_m = -1.0", "m.toml").unwrap_err();
    assert!(matches!(&error, RobotMapError::Value { key, found: -1.0, .. } if key == "ankle_m"), "{error}");
}

#[test]
fn qpos_has_a_number_for_every_joint_of_the_model() {
    // A slide before the left elbow, and one that turns without a range behind the last hinge.
    let text = TOY
        .replace("<joint name=\"left_elbow\" type=\"revolute\">", "<joint name=\"left_elbow\" type=\"prismatic\">")
        .replace(
            "</robot>",
            "<link name=\"tail\"/><joint name=\"wag\" type=\"revolute\"><parent link=\"torso\"/><child link=\"tail\"/>\
             <axis xyz=\"0 0 1\"/><limit lower=\"0.5\" upper=\"0.5\" velocity=\"1\" effort=\"1\"/></joint></robot>",
        );
    let robot = Robot::parse(&text, "toy.urdf").unwrap();
    assert_eq!(robot.hinges.len(), 15);
    let machine = Machine::new(&database(), robot, &RobotMap::default()).unwrap();
    let (names, rows) = play(&machine, walk()).qpos(&machine.robot).unwrap();
    let at = names.iter().position(|n| n == "left_elbow").unwrap();
    assert_eq!((names.len(), names.last().map(String::as_str)), (7 + 17, Some("wag")));
    assert!(names[at - 1].starts_with("left_shoulder") && names[at + 1].starts_with("right_"), "{names:?}");
    assert!(rows.iter().all(|row| row.len() == 24 && row[at] == 0.0 && row[23] == 0.5));
    let ball = TOY.replace(
        "<joint name=\"left_elbow\" type=\"revolute\">",
        "<joint name=\"left_elbow\" type=\"floating\">",
    );
    let machine =
        Machine::new(&database(), Robot::parse(&ball, "toy.urdf").unwrap(), &RobotMap::default()).unwrap();
    let refused = play(&machine, walk()).qpos(&machine.robot).unwrap_err();
    assert!(matches!(&refused, QposError::Joint { joint } if joint == "left_elbow"), "{refused}");
}

#[test]
fn the_toy_walks_within_its_limits_and_its_knees_bend_backwards() {
    let machine = toy("");
    assert_eq!(machine.doubts, Vec::<String>::new());
    assert!(machine.servo_doubts.iter().all(|d| d.contains("pulses")), "{:?}", machine.servo_doubts);
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

/// A joint that follows another one has no motor, and was written as 0.
#[test]
fn joints_that_follow_move_with_their_leaders() {
    let follow = |text: &str, joint: &str, mimic: &str| {
        let start = format!("<joint name=\"{joint}\" type=\"revolute\">");
        text.replace(&start, &format!("{start}<mimic joint={mimic}/>"))
    };
    let of = |text: &str, map: &str| {
        let robot = Robot::parse(text, "toy.urdf").unwrap();
        Machine::new(&database(), robot, &RobotMap::parse(map, "map.toml").unwrap()).unwrap()
    };
    // The right elbow follows one that follows itself.
    let text = follow(TOY, "left_elbow", "\"left_knee\" multiplier=\"-0.5\" offset=\"0.1\"");
    let text = follow(&text, "right_elbow", "\"left_elbow\" multiplier=\"2\"");
    let machine = of(&text, "");
    let said = "following another joint: left_elbow, right_elbow";
    assert!(machine.doubts.iter().any(|d| d == said), "{:?}", machine.doubts);
    let played = play(&machine, walk());
    let [knee, left, right] =
        ["left_knee", "left_elbow", "right_elbow"].map(|name| machine.robot.find(name).unwrap());
    assert!(played.ticks.iter().any(|t| t.motions[knee].position.abs() > 0.3));
    for tick in &played.ticks {
        let [knee, left, right] = [knee, left, right].map(|h| tick.motions[h]);
        assert!((left.position - (0.1 - 0.5 * knee.position)).abs() < 1e-6, "{left:?} {knee:?}");
        assert!((left.velocity + 0.5 * knee.velocity).abs() < 1e-5, "{left:?} {knee:?}");
        assert!((right.position - 2.0 * left.position).abs() < 1e-6, "{right:?} {left:?}");
    }
    let (names, rows) = played.qpos(&machine.robot).unwrap();
    let column = names.iter().position(|name| name == "left_elbow").unwrap();
    assert_eq!(rows[9][column], f64::from(played.ticks[9].motions[left].position));
    // A map gives it a motor; a circle, or a joint that is not there, leads nobody.
    let driven = of(&text, "[joints.left_elbow]\npart = \"left-lower-arm\"\n");
    assert!(!driven.assignment.undriven.contains(&left) && driven.assignment.undriven.contains(&right));
    let circle = follow(TOY, "left_elbow", "\"right_elbow\"");
    for text in [follow(&circle, "right_elbow", "\"left_elbow\""), follow(TOY, "left_elbow", "\"ghost\"")] {
        assert_eq!(play(&of(&text, ""), walk()).ticks[9].motions[left].position, 0.0);
    }
    let wild = follow(TOY, "left_elbow", "\"left_knee\" multiplier=\"1e9\"");
    assert!(Robot::parse(&wild, "toy.urdf").is_err());
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
    assert!(lines.iter().all(|l| l.matches(',').count() == 16 + 9));
    assert!(lines[0].ends_with(",right_elbow,base_x_m,base_y_m,base_z_m,base_qw,base_qx,base_qy,base_qz,left_contact,right_contact"), "{}", lines[0]);
    // Nothing tells which feet stand.
    assert!(lines[1].ends_with(",,"), "{}", lines[1]);
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
    let count = played.ticks.len() + played.stop.len();
    assert_eq!(ns, count as u64 * 20_000_000);
    // The walk is cut in mid-stride: the robot comes to rest where the walk ends, as controllers demand.
    assert!((2..100).contains(&played.stop.len()), "{}", played.stop.len());
    let fastest = |point: &serde_json::Value| {
        let velocities = point["velocities"].as_array().unwrap();
        velocities.iter().map(|v| v.as_f64().unwrap().abs()).fold(0.0, f64::max)
    };
    let points = trajectory["points"].as_array().unwrap();
    assert!(fastest(&points[played.ticks.len() - 1]) > 0.1 && fastest(last) == 0.0);
    let positions = |point: &serde_json::Value| point["positions"].as_array().unwrap().clone();
    for ((position, target), before) in
        positions(last).iter().zip(&played.ticks.last().unwrap().targets).zip(positions(&points[count - 2]))
    {
        let position = position.as_f64().unwrap();
        assert!((position - f64::from(*target)).abs() < 1e-3, "{position} {target}");
        assert!((position - before.as_f64().unwrap()).abs() < 1e-4);
    }
    let base = &trajectory["base"];
    assert_eq!(base["joint_names"][0], "torso");
    let places = base["points"].as_array().unwrap();
    assert_eq!(
        (places.len(), &places[3]["time_from_start"]),
        (count, &trajectory["points"][3]["time_from_start"])
    );
    let place = &places[3]["transforms"][0];
    let at = played.ticks[3].base.translation.vector;
    assert_eq!(place["translation"]["z"].as_f64(), Some(at.z));
    assert!(place["rotation"]["w"].as_f64().unwrap() > 0.5, "{place}");
    assert_eq!(trajectory["contacts"]["points"].as_array().unwrap().len(), count);
    let standing = play_standing(&machine, &clip.resampled(50.0), &[[true, false], [false, true]]);
    let lines: Vec<String> = standing.csv().lines().map(String::from).collect();
    assert!(
        lines[1].ends_with(",1,0") && lines[2].ends_with(",0,1") && lines[3].ends_with(",,"),
        "{lines:?}"
    );
    assert_eq!(standing.trajectory()["contacts"]["points"][1], serde_json::json!([false, true]));
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
