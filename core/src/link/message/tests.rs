use super::*;

fn both_ways<'a, T: Serialize + Deserialize<'a> + PartialEq + core::fmt::Debug>(
    message: &T,
    bytes: &'a mut [u8],
) -> usize {
    let bytes: &'a [u8] = postcard::to_slice(message, bytes).expect("it fits");
    assert_eq!(decode::<T>(bytes).as_ref(), Some(message));
    for short in 0..bytes.len() {
        assert_eq!(decode::<T>(&bytes[..short]), None, "{message:?} cut to {short} bytes");
    }
    bytes.len()
}

#[test]
fn every_message_goes_both_ways() {
    let pairs: Pairs = [(0, 0.5), (300, -1.0)].into_iter().collect();
    let mut buffer = PoseBuffer::<3>::new();
    let pose = buffer.pose(&Pose::IDENTITY, 2);
    let requests = [
        Request::Hello { session: u32::MAX },
        Request::Style(pairs.clone()),
        Request::Labels { action: Some(3), input_style: None },
        Request::Mask { group: 2, searched: true },
        Request::Strength(pairs.clone()),
        Request::Configure(pairs.clone()),
        Request::Reset,
        Request::Pose(pose),
        Request::Statistics { skip: 12 },
        Request::Robot { angles: &[1, 2, 3, 4] },
        Request::Drive,
        Request::GroupStyle { group: 1, weights: pairs },
        Request::StepRobot(pose),
    ];
    for (number, request) in requests.iter().enumerate() {
        let mut bytes = [0; 128];
        both_ways(request, &mut bytes);
        assert_eq!(usize::from(bytes[0]), number, "{request:?}");
    }
    let identity = Identity {
        board: "a board",
        build: "1",
        database: 1,
        rate_hz: 30.0,
        joints: 22,
        classes: 28,
        capacity: [22, 40, 28],
        ram_bytes: 24_304,
        buffer_bytes: 512,
    };
    let report = StepReport { classes: [(1, 0.5)].into_iter().collect(), ..StepReport::default() };
    let page = [(1, 2), (3, u64::MAX)].into_iter().collect();
    let replies = [
        Reply::Hello(identity),
        Reply::Done,
        Reply::Pose(pose, report),
        Reply::Statistics { more: true, page },
        Reply::Fault(Fault::Malformed),
        Reply::Robot(RobotIdentity { robot: 7, hinges: 16, capacity: 32, tick_s: 0.02 }),
        Reply::Drive(DriveReport { held: false, at_limit: 300, lag: 0.5, missing_m: 0.0, hinges: &[9; 12] }),
        Reply::StepRobot {
            step: BriefReport { step_s: 0.02, contacts: 3, degraded: 256 },
            ticks: 2,
            drive: DriveReport { held: true, at_limit: 1, lag: 0.5, missing_m: 0.0, hinges: &[9; 6] },
        },
    ];
    for (number, reply) in replies.iter().enumerate() {
        let mut bytes = [0; 160];
        both_ways(reply, &mut bytes);
        assert_eq!(usize::from(bytes[0]), number, "{reply:?}");
    }
}

#[test]
fn poses_travel_bit_by_bit() {
    let mut pose = Pose::<4>::IDENTITY;
    pose.position = [-0.0, f32::NAN, 1e-40];
    pose.rotations[1] = [0.1, -0.2, 0.3, f32::from_bits(0x7f80_0001)];
    let mut buffer = PoseBuffer::new();
    let bytes = buffer.pose(&pose, 3);
    assert_eq!(bytes.joints(), Some(3));
    let mut back = Pose::<4>::IDENTITY;
    bytes.read(&mut back);
    let bits = |p: &Pose<4>| {
        let all = p.position.iter().chain(p.rotations[..3].as_flattened());
        all.map(|v| v.to_bits()).collect::<Vec<_, 16>>()
    };
    assert_eq!(bits(&back), bits(&pose));
    assert_eq!(PoseBytes { rotations: &[0; 17], ..bytes }.joints(), None);
}

#[test]
fn the_longest_messages_fit_the_buffer() {
    const JOINTS: usize = 64;
    let pose = Pose::<JOINTS>::IDENTITY;
    let mut buffer = PoseBuffer::new();
    let report = StepReport {
        visits: u32::MAX,
        bytes_read: u32::MAX,
        degraded: u32::MAX,
        classes: [(u16::MAX, 1.0); MAX_KEPT].into_iter().collect(),
        stages: [u32::MAX; MAX_STAGES].into_iter().collect(),
        ..StepReport::default()
    };
    let mut frame = super::super::Frame::<2000>::new();
    let header = super::super::Header::request(1, 0).reply();
    for joints in [2, 8, 9, 12, 22, 64] {
        let reply = Reply::Pose(buffer.pose(&pose, joints), report.clone());
        let length = frame.write(header, &reply).expect("it fits").len();
        assert!(length <= super::super::buffer_length(joints), "{joints} joints: {length}");
    }
    let driven = crate::robot::Driven { held: true, at_limit: u16::MAX, lag: 1.1, missing_m: 1.1 };
    for hinges in [0, 20, 40, 41, 64] {
        let mut buffer = super::super::HingeBuffer::new();
        let report = buffer.report(&driven, |h| (h < hinges).then_some((1.1, u16::MAX)));
        assert_eq!(report.hinges().count(), hinges);
        let step = BriefReport { step_s: 1.1, contacts: 3, degraded: u32::MAX };
        for reply in [Reply::Drive(report), Reply::StepRobot { step, ticks: u16::MAX, drive: report }] {
            let length = frame.write(header, &reply).expect("it fits").len();
            assert!(length <= super::super::robot_buffer_length(hinges), "{hinges} hinges: {length}");
            // A robot of 40 hinges fits any buffer.
            assert!(hinges > 40 || length <= super::super::buffer_length(2), "{hinges} hinges: {length}");
        }
    }
    let page = [(u16::MAX, u64::MAX); PAGE].into_iter().collect();
    let length = frame.write(header, &Reply::Statistics { more: true, page }).expect("it fits").len();
    assert!(length <= super::super::buffer_length(2), "{length}");
    let pairs: Pairs = [(u16::MAX, 1.0); MAX_PAIRS].into_iter().collect();
    let length = frame.write(header, &Request::Style(pairs)).expect("it fits").len();
    assert!(length <= super::super::buffer_length(2), "{length}");
}
