//! docs/LINK.md shows frames byte by byte: they are the code's.

use gestus_core::{
    ConfigError, Pose,
    link::{
        Fault, Frame, Header, Identity, PoseBuffer, Receiver, Reply, Request, StepReport, VERSION,
        buffer_length, counter, parameter,
    },
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
    let requests: [(&str, Header, Request<'_>); 5] = [
        ("hello, session 5", first, Request::Hello { session: 5 }),
        ("style 1 and 4, half of each", at(1, 0), Request::Style(pairs(&[(1, 0.5), (4, 0.5)]))),
        ("the input's action is 2", at(2, 0), Request::Labels { action: Some(2), input_style: None }),
        ("a pose of two joints", at(3, 0), Request::Pose(bytes)),
        ("the same once more, since no answer came", at(3, 1), Request::Pose(bytes)),
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
    let replies: [(&str, Header, Reply<'_>); 4] = [
        ("who it is", first, Reply::Hello(identity)),
        ("done", at(1, 0), Reply::Done),
        (
            "no, there is no action 2 among 2",
            at(2, 0),
            Reply::Fault(Fault::Refused(ConfigError::Unknown { id: 2, have: 2 })),
        ),
        ("the pose in its style, and a report", at(3, 0), Reply::Pose(bytes, report)),
    ];
    for (caption, header, reply) in &replies {
        let bytes = frame.write(header.reply(), reply).expect("it fits");
        assert_eq!(hex(&shown(caption)), hex(bytes), "{caption}");
        // And back.
        let mut receiver = Receiver::<{ buffer_length(2) }>::new();
        let heard = bytes.iter().find_map(|&b| {
            let received = receiver.receive(b)?.expect("it is whole");
            Some(gestus_core::link::decode::<Reply<'_>>(received.message) == Some(reply.clone()))
        });
        assert_eq!(heard, Some(true), "{caption}");
    }
}

#[test]
fn the_document_has_every_number() {
    let row = |number: u16, name: &str| format!("| {number} | `{name}` |");
    for (number, name) in counter::NAMES.iter().chain(parameter::NAMES) {
        assert!(DOCUMENT.contains(&row(*number, name)), "no row {}", row(*number, name));
    }
    assert!(DOCUMENT.starts_with(&format!("# The link, protocol version {VERSION}\n")));
    for joints in [12, 22] {
        let text = format!("{} bytes for {joints} joints", buffer_length(joints));
        assert!(DOCUMENT.contains(&text), "the document does not say: {text}");
    }
}
