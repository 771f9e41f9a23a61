//! docs/LINK.md shows frames byte by byte: they are the code's.

use gestus_core::{
    ConfigError, Degraded, Pose,
    link::{
        BriefReport, Fault, Frame, HINGE_BYTES, Header, HingeBuffer, Identity, MAX_PAIRS, MAX_STAGES,
        PoseBuffer, Receiver, Reply, Request, RobotIdentity, StepReport, VERSION, buffer_length, counter,
        robot_buffer_length,
    },
    methods::weights::MAX_KEPT,
    robot::{Driven, layout::MAX_HINGES},
};

const DOCUMENT: &str = include_str!("../../docs/LINK.md");

/// The bytes below the line `## title`'s caption `> caption` in the document.
fn shown(caption: &str) -> Vec<u8> {
    let heading = format!("> {caption}\n");
    let at = DOCUMENT.find(&heading).unwrap_or_else(|| panic!("the document has no example `{caption}`"));
    let lines =
        DOCUMENT[at + heading.len()..].lines().take_while(|l| !l.starts_with('>') && !l.starts_with("```"));
    lines
        .flat_map(|l| l.split(';').next().unwrap_or("").split_whitespace())
        .map(|byte| u8::from_str_radix(byte, 16).unwrap_or_else(|_| panic!("{caption}: `{byte}` is no byte")))
        .collect()
}

/// The number of a message.
fn first_byte(message: &impl serde::Serialize) -> u8 {
    let mut bytes = [0; 64];
    postcard::to_slice(message, &mut bytes).expect("it fits")[0]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|b| format!("{b:02x}")).collect::<Vec<_>>().join(" ")
}

#[test]
fn the_bytes_in_the_document_are_the_codes() {
    let mut pose = Pose::<2>::IDENTITY;
    pose.position = [0.0, 0.875, -2.0];
    let mut buffer = PoseBuffer::new();
    let bytes = buffer.pose(&pose, 2);
    let report = StepReport {
        step_s: 0.03125,
        predicted_step_s: 0.03125,
        distance2: 0.25,
        visits: 300,
        bytes_read: 20_000,
        contacts: 1,
        degraded: 16,
        classes: [(3, 1.0)].into_iter().collect(),
        ..StepReport::default()
    };
    let first = Header::request(0x1234, 0);
    let at = |n: u16, attempt| Header::request(0x1234 + n, attempt);
    let pairs = |p: &[(u16, f32)]| p.iter().copied().collect();
    let mut frame = Frame::<{ buffer_length(2) }>::new();
    let angles = [0.5f32.to_le_bytes(), 0.0f32.to_le_bytes()];
    let requests: [(&str, Header, Request<'_>); 8] = [
        ("hello, session 5", first, Request::Hello { session: 5 }),
        ("style 1 and 4, half of each", at(1, 0), Request::Style(pairs(&[(1, 0.5), (4, 0.5)]))),
        ("the input's action is 2", at(2, 0), Request::Labels { action: Some(2), input_style: None }),
        ("a pose of two joints", at(3, 0), Request::Pose(bytes)),
        ("the same once more, since no answer came", at(3, 1), Request::Pose(bytes)),
        (
            "the robot's two hinges stand at 0.5 and 0 radians",
            at(4, 0),
            Request::Robot { angles: angles.as_flattened() },
        ),
        ("a tick of the robot", at(5, 0), Request::Drive),
        ("the pose again, and the ticks behind it", at(6, 0), Request::StepRobot(bytes)),
    ];
    for (caption, header, request) in &requests {
        let bytes = frame.write(*header, request).expect("it fits");
        assert_eq!(hex(&shown(caption)), hex(bytes), "{caption}");
    }
    let identity = Identity {
        board: "toy",
        build: "1.0",
        database: 0xe306_9283,
        rate_hz: 30.0,
        joints: 2,
        classes: 4,
        capacity: [2, 16, 4],
        ram_bytes: 5000,
        buffer_bytes: buffer_length(2) as u16,
    };
    let robot = RobotIdentity { robot: 0x1234_5678, hinges: 2, capacity: 32, tick_s: 0.0625 };
    let driven = Driven { held: false, at_limit: 1, lag: 0.25, missing_m: 0.0 };
    let mut hinges = HingeBuffer::new();
    let drive = hinges.report(&driven, |h| [(0.5, 1800), (-0.125, 1400)].get(h).copied());
    let step = BriefReport { step_s: 0.03125, contacts: 1, degraded: 16 };
    let replies: [(&str, Header, Reply<'_>); 7] = [
        ("who it is", first, Reply::Hello(identity)),
        ("done", at(1, 0), Reply::Done),
        (
            "no, there is no action 2 among 2",
            at(2, 0),
            Reply::Fault(Fault::Refused(ConfigError::Unknown { id: 2, have: 2 })),
        ),
        ("the pose in its style, and a report", at(3, 0), Reply::Pose(bytes, report)),
        ("which robot it is", at(4, 0), Reply::Robot(robot)),
        ("where its hinges are now", at(5, 0), Reply::Drive(drive)),
        ("two ticks, and where its hinges are then", at(6, 0), Reply::StepRobot { step, ticks: 2, drive }),
    ];
    for (caption, header, reply) in &replies {
        let bytes = frame.write(header.reply(), reply).expect("it fits");
        assert_eq!(hex(&shown(caption)), hex(bytes), "{caption}");
        // And back.
        let mut receiver = Receiver::<{ buffer_length(2) }>::new();
        let received = bytes.iter().find_map(|&b| {
            let received = receiver.receive(b)?.expect("it is whole");
            Some(gestus_core::link::decode::<Reply<'_>>(received.message) == Some(reply.clone()))
        });
        assert_eq!(received, Some(true), "{caption}");
    }
}

#[test]
fn the_document_has_every_number() {
    let row = |number: u16, name: &str| format!("| {number} | `{name}` |");
    for (number, name) in counter::NAMES {
        assert!(DOCUMENT.contains(&row(*number, name)), "no row {}", row(*number, name));
    }
    assert!(DOCUMENT.starts_with(&format!("# The link, protocol version {VERSION}\n")));
    // Requests, replies and faults by the numbers that go over the line.
    let robot = RobotIdentity { robot: 0, hinges: 0, capacity: 0, tick_s: 0.0 };
    let mut hinges = HingeBuffer::new();
    let report = hinges.report(&Driven::default(), |_| None);
    let step_robot = Reply::StepRobot { step: BriefReport::default(), ticks: 0, drive: report };
    let drive = Reply::Drive(report);
    let mut poses = PoseBuffer::<1>::new();
    let pose = poses.pose(&Pose::IDENTITY, 1);
    for (name, number, first) in [
        ("Robot", 9, first_byte(&Request::Robot { angles: &[] })),
        ("Drive", 10, first_byte(&Request::Drive)),
        ("Robot", 5, first_byte(&Reply::Robot(robot))),
        ("Drive", 6, first_byte(&drive)),
        ("StepRobot", 12, first_byte(&Request::StepRobot(pose))),
        ("StepRobot", 7, first_byte(&step_robot)),
    ] {
        assert_eq!(first, number, "{name}");
        assert!(DOCUMENT.contains(&row(u16::from(number), name)), "{}", row(u16::from(number), name));
    }
    let fault = first_byte(&Fault::NoRobot);
    assert!(DOCUMENT.contains(&format!("{fault} `NoRobot`")), "{fault}");
    assert!(DOCUMENT.contains(&format!("a string of {HINGE_BYTES} bytes a hinge")));
    for joints in [12, 22] {
        says(&format!("{} bytes for {joints} joints", buffer_length(joints)));
    }
    says("a robot of up to 40 hinges");
    assert!(robot_buffer_length(40) <= buffer_length(1));
    says(&format!("{} bytes a hinge and {} (`robot_buffer_length`)", HINGE_BYTES, robot_buffer_length(0)));
}

fn says(text: &str) {
    assert!(DOCUMENT.contains(text), "the document does not say: {text}");
}

/// A refusal by its number, its fields as large as can be, as a debugger shows it; `None` behind the last.
fn refusal(number: u8) -> Option<String> {
    // Two numbers of 16 bits; those without fields leave them alone.
    let bytes = [number, 0xff, 0xff, 0x03, 0xff, 0xff, 0x03];
    let (refusal, _) = postcard::take_from_bytes::<ConfigError>(&bytes).ok()?;
    Some(format!("{refusal:?}"))
}

#[test]
fn the_document_has_every_refusal_with_its_fields() {
    let refusals: Vec<String> = (0..=u8::MAX).map_while(refusal).collect();
    for (number, shown) in refusals.iter().enumerate() {
        // `Joints { need: 65535, have: 65535 }`
        let (name, fields) = shown.split_once(" {").unwrap_or((shown, ""));
        let fields: Vec<String> = fields
            .split([',', '}'])
            .filter_map(|field| field.split_once(": "))
            .map(|(field, value)| {
                assert_eq!(value.trim(), "65535", "{shown}: the document says u16");
                format!("{} u16", field.trim())
            })
            .collect();
        let fields = if fields.is_empty() { " |".to_owned() } else { format!(" {} |", fields.join(", ")) };
        says(&format!("| {number} | `{name}` |{fields}"));
    }
    assert_eq!(
        refusals.last().map(String::as_str),
        Some("Parameter { number: 65535 }"),
        "a new one goes to the end"
    );
}

#[test]
fn the_document_has_every_flag_and_limit() {
    for (flag, name) in Degraded::NAMES {
        says(&format!("| {} | `{name}` | ", flag.bits().trailing_zeros()));
    }
    for (name, item) in [
        ("Style", "(style u16, weight f32)"),
        ("Strength", "(group u16, strength f32)"),
        ("Configure", "(parameter u16, value f32)"),
    ] {
        says(&format!("`{name}` | list of {item}, at most {MAX_PAIRS}"));
    }
    says(&format!("list of (class u16, proportion f32), at most {MAX_KEPT}"));
    says(&format!("list of instructions by stage u32, at most {MAX_STAGES}"));
    says(&format!("at most {MAX_HINGES} hinges"));
}
