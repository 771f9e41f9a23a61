//! Style and servos in one call are the separate calls, bit for bit: in the core, from another skeleton, over the link.

use gestus_core::{
    Config, Database, Pose, Stylizer,
    link::{
        BriefReport, Driver, Fault, Frame, Header, HingeBuffer, PoseBuffer, Receiver, Reply, Request, Server,
        buffer_length, decode,
    },
    robot::{Drive, Follower, MAX_TICKS},
};
use gestus_database::{
    retarget::{MapFile, Retarget},
    robot::{Machine, RobotMap},
    stream::to_pose,
};
use gestus_motion::{clip::Clip, formats::urdf};
use gestus_tests::motion;

const J: usize = 22;
type Stylized = Stylizer<'static, J, 40, 28>;

fn machine(map: &str) -> Machine {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let toy = urdf::Robot::parse(urdf::TOY, "toy.urdf").expect("it is a robot");
    let map = RobotMap::parse(map, "map.toml").expect("it is a map");
    Machine::new(&database, toy, &map).expect("it suits the database")
}

fn stylizer() -> Stylized {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let mut stylizer = Stylizer::new(database, Config::new()).expect("it fits");
    stylizer.set_style(&[(1, 1.0)]).expect("it is known");
    stylizer
}

fn clip(frames: usize) -> Clip {
    motion::unseen(0, 0, frames)
}

/// Angles and pulses, bit by bit.
fn hinges(drive: &Drive<'_, 16>) -> Vec<(u32, u32, u16)> {
    let motions = drive.motions().iter().enumerate();
    motions.map(|(h, m)| (m.position.to_bits(), m.velocity.to_bits(), drive.pulse(h))).collect()
}

/// The number of ticks of a pose, by whole numbers: those whose time lies before the middle between two.
fn due(shown_s: f64, ticked: usize, tick_s: f64) -> usize {
    let mut due = 0;
    while shown_s - (ticked + due) as f64 * tick_s >= 0.5 * tick_s {
        due += 1;
    }
    due
}

#[test]
fn one_call_is_the_chain_of_separate_calls() {
    for (map, rate_hz) in
        [("", 50.0), ("tick_hz = 30\n", 30.0), ("tick_hz = 200\n", 200.0), ("tick_hz = 7\n", 7.0)]
    {
        let machine = machine(map);
        let (mut stylized, mut other) = (stylizer(), stylizer());
        let mut follower = Follower::new(Drive::<16>::new(machine.tables(), &[0.1]).expect("they fit"));
        let mut drive = Drive::<16>::new(machine.tables(), &[0.1]).expect("they fit");
        let (mut output, mut plain) = (Pose::IDENTITY, Pose::IDENTITY);
        let (mut shown_s, mut ticked) = (0.0, 0);
        for (t, frame) in clip(90).frames.iter().enumerate() {
            let mut input: Pose<J> = to_pose(frame);
            if t == 40 {
                input.position[0] = f32::NAN;
            }
            let mut seen = Vec::new();
            let step =
                follower.step_robot(&mut stylized, &input, &mut output, |drive, _| seen.push(hinges(drive)));
            let report = other.step(&input, &mut plain);
            assert_eq!((&step.report, output), (&report, plain), "frame {t}");
            shown_s += f64::from(report.step_s);
            let due = due(shown_s, ticked, 1.0 / rate_hz);
            assert_eq!(usize::from(step.ticks), due, "frame {t} at {rate_hz} ticks a second");
            ticked += due;
            for seen in &seen {
                let driven = drive.step(&plain);
                assert_eq!(seen, &hinges(&drive), "frame {t}");
                assert_eq!(step.driven.held, driven.held, "frame {t}");
            }
            assert_eq!(seen.len(), due);
            assert_eq!(hinges(follower.drive()), hinges(&drive), "frame {t}");
        }
        assert!((shown_s - ticked as f64 / rate_hz).abs() <= 0.51 / rate_hz, "{shown_s} s, {ticked} ticks");
    }
}

/// The hinges went to the pose that `output` happened to hold.
#[test]
fn before_the_first_valid_pose_the_hinges_stay() {
    let machine = machine("");
    let mut stylized = stylizer();
    let mut follower = Follower::new(Drive::<16>::new(machine.tables(), &[]).expect("they fit"));
    let start = hinges(follower.drive());
    let mut output = Pose::IDENTITY;
    let frames = clip(30).frames;
    for (t, frame) in frames.iter().enumerate() {
        let mut input: Pose<J> = to_pose(frame);
        let valid = t >= 10;
        if !valid {
            input.position[0] = f32::NAN;
        }
        let step = follower.step_robot(&mut stylized, &input, &mut output, |_, _| {});
        assert_eq!(step.ticks > 0 && step.driven.held, !valid, "frame {t}");
        assert_eq!(hinges(follower.drive()) == start, !valid, "frame {t}");
    }
}

#[test]
fn a_step_makes_a_bounded_number_of_ticks() {
    let machine = machine("tick_hz = 1000\n");
    let mut follower = Follower::new(Drive::<16>::new(machine.tables(), &[]).expect("they fit"));
    let pose = Pose::<J>::IDENTITY;
    for (step_s, ticks) in [(1e9, MAX_TICKS), (f32::NAN, 0), (f32::INFINITY, 0), (-1e9, 0), (0.0031, 3)] {
        assert_eq!(follower.follow(&pose, step_s, |_, _| {}).0, ticks, "{step_s} s");
    }
}

#[test]
fn poses_of_another_skeleton_are_mapped_first() {
    // The same body under other names and twice as large.
    let mut clip = clip(40);
    let mut skeleton = (*clip.skeleton).clone();
    skeleton.offsets.iter_mut().for_each(|offset| *offset *= 2.0);
    clip.skeleton = skeleton.into();
    clip.frames.iter_mut().for_each(|frame| frame.root *= 2.0);
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let retarget = Retarget::new(&database, &clip, &MapFile::default()).expect("it is a body");
    let map = gestus_core::retarget::Map::open(retarget.bytes()).expect("it is a map");
    let machine = machine("");
    let (mut stylized, mut other) = (stylizer(), stylizer());
    let mut follower = Follower::new(Drive::<16>::new(machine.tables(), &[]).expect("they fit"));
    let mut chain = follower.clone();
    let [mut between, mut output, mut plain, mut mapped] = [Pose::<J>::IDENTITY; 4];
    for frame in &clip.frames {
        let input: Pose<31> = to_pose(frame);
        let step =
            follower.step_robot_mapped(&mut stylized, (&map, &input), &mut between, &mut output, |_, _| {});
        map.to_target(&input, &mut mapped);
        let report = other.step(&mapped, &mut plain);
        let (ticks, driven) = chain.follow(&plain, report.step_s, |_, _| {});
        assert_eq!((step.report, step.ticks, step.driven), (report, ticks, driven));
        assert_eq!((between, output), (mapped, plain));
        assert_eq!(hinges(follower.drive()), hinges(chain.drive()));
    }
}

/// Sends a request and looks at the reply.
fn ask<R>(
    receive: &mut impl FnMut(u8) -> Option<Vec<u8>>,
    sequence: &mut u16,
    request: &Request<'_>,
    look: impl FnOnce(Reply<'_>) -> R,
) -> R {
    *sequence += 1;
    let mut frame = Frame::<{ buffer_length(J) }>::new();
    let bytes = frame.write(Header::request(*sequence, 0), request).expect("it fits");
    let answer = bytes.iter().find_map(|&byte| receive(byte)).expect("an answer");
    let mut receiver = Receiver::<{ buffer_length(J) }>::new();
    for &byte in &answer {
        if let Some(event) = receiver.receive(byte) {
            return look(decode(event.expect("it is whole").message).expect("it is a reply"));
        }
    }
    panic!("no frame in {answer:?}");
}

#[test]
fn one_request_is_the_chain_of_requests() {
    let machine = machine("");
    let (mut stylized, mut other) = (stylizer(), stylizer());
    let database = *stylized.database();
    let driver = Driver::<(), 16>::new((), machine.tables(), &database).expect("it fits");
    let mut server = Server::<_, J, 40, 28, { buffer_length(J) }>::new(&mut stylized, driver);
    let mut receive = |byte| server.receive(byte).map(<[u8]>::to_vec);
    let mut sequence = 0;
    let session = Request::Hello { session: 3 };
    assert!(ask(&mut receive, &mut sequence, &session, |reply| matches!(reply, Reply::Hello(_))));
    let style = Request::Style([(1, 1.0)].into_iter().collect());
    assert!(ask(&mut receive, &mut sequence, &style, |reply| reply == Reply::Done));
    let mut follower = Follower::new(Drive::<16>::new(machine.tables(), &[]).expect("they fit"));
    let mut buffer = PoseBuffer::<J>::new();
    for (t, frame) in clip(40).frames.iter().enumerate() {
        let input: Pose<J> = to_pose(frame);
        let mut output = Pose::IDENTITY;
        let expected = follower.step_robot(&mut other, &input, &mut output, |_, _| {});
        let mut hinges = HingeBuffer::new();
        let drive = follower.drive();
        let of = |h: usize| Some((drive.motions().get(h)?.position, drive.pulse(h)));
        let report = hinges.report(&expected.driven, of);
        let expected = Reply::StepRobot {
            step: BriefReport::new(&expected.report),
            ticks: expected.ticks,
            drive: report,
        };
        let request = Request::StepRobot(buffer.pose(&input, 21));
        ask(&mut receive, &mut sequence, &request, |reply| assert_eq!(reply, expected, "frame {t}"));
    }
    let short = Request::StepRobot(buffer.pose(&Pose::IDENTITY, 5));
    let refused = ask(&mut receive, &mut sequence, &short, |reply| {
        matches!(reply, Reply::Fault(Fault::Joints { need: 21, have: 5 }))
    });
    assert!(refused);
}

#[test]
fn a_board_without_a_robot_refuses_before_it_steps() {
    let (mut stylized, mut other) = (stylizer(), stylizer());
    let mut server = Server::<_, J, 40, 28, { buffer_length(J) }>::new(&mut stylized, ());
    let mut receive = |byte| server.receive(byte).map(<[u8]>::to_vec);
    let mut sequence = 0;
    ask(&mut receive, &mut sequence, &Request::Hello { session: 3 }, |_| ());
    let style = Request::Style([(1, 1.0)].into_iter().collect());
    ask(&mut receive, &mut sequence, &style, |_| ());
    let mut buffer = PoseBuffer::<J>::new();
    let poses: Vec<Pose<J>> = clip(4).frames.iter().map(to_pose).collect();
    let request = Request::StepRobot(buffer.pose(&poses[3], 21));
    assert!(ask(&mut receive, &mut sequence, &request, |reply| reply == Reply::Fault(Fault::NoRobot)));
    for pose in &poses {
        let mut output = Pose::IDENTITY;
        let _ = other.step(pose, &mut output);
        let request = Request::Pose(buffer.pose(pose, 21));
        ask(&mut receive, &mut sequence, &request, |reply| {
            let Reply::Pose(bytes, _) = reply else { panic!("{reply:?}") };
            let mut back = Pose::IDENTITY;
            bytes.read(&mut back);
            assert_eq!(back, output);
        });
    }
}

#[test]
fn following_costs_forty_bytes() {
    assert!(size_of::<Follower<'_, 16>>() <= size_of::<Drive<'_, 16>>() + 40);
}
