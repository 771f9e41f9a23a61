//! The board's end of the link: its replies, its counters, and that it steps each pose once.

use gestus_core::{
    Config, ConfigError, Database, Observer, Pose, Report, Stylizer,
    config::parameters,
    link::{
        Board, Fault, Frame, Header, MAX_PAIRS, PAGE, Pairs, PoseBuffer, Receiver, Reply, Request, Server,
        Statistic, StepReport, VERSION, buffer_length, counter, decode,
    },
};
use gestus_database::stream::to_pose;
use gestus_tests::motion;

const J: usize = 22;
const N: usize = buffer_length(J);
type Stylized<'db> = Stylizer<'db, J, 40, 28>;
type Served<'a, 'db, B> = Server<'a, 'db, B, J, 40, 28, N>;

/// A board that counts its calls.
#[derive(Default)]
struct Counting {
    begun: u32,
    ended: u32,
    searched: u32,
}

impl Observer<J> for Counting {
    fn searched(&mut self, _: usize, _: &gestus_core::search::found::Found<'_>) {
        self.searched += 1;
    }
}

impl Board<J> for Counting {
    fn name(&self) -> &str {
        "counting"
    }
    fn build(&self) -> &str {
        "test"
    }
    fn begin(&mut self) {
        self.begun += 1;
    }
    fn end(&mut self, report: &Report) {
        self.ended += 1;
        assert!(report.visits > 0);
    }
    fn stages(&self) -> &[u32] {
        &[1, 2, 3]
    }
    fn statistic(&mut self, index: u16) -> Option<Statistic> {
        (index < 20).then(|| (counter::OWN + index, u64::from(self.ended)))
    }
}

fn stylizer(blob: &[u8]) -> Stylized<'_> {
    let database = Database::open(blob).expect("the generated blob opens");
    Stylizer::new(database, Config::new()).expect("it fits")
}

fn framed(header: Header, request: &Request<'_>) -> Vec<u8> {
    Frame::<N>::new().write(header, request).expect("it fits").to_vec()
}

/// The reply frame to these bytes, if any.
fn sent<B: Board<J>>(server: &mut Served<'_, '_, B>, bytes: &[u8]) -> Option<Vec<u8>> {
    let mut answers = bytes.iter().filter_map(|&b| server.receive(b).map(<[u8]>::to_vec)).collect::<Vec<_>>();
    assert!(answers.len() < 2, "one request, {} answers", answers.len());
    answers.pop()
}

/// Decodes a reply and passes it to a function.
fn with<R>(answer: &[u8], look: impl FnOnce(Header, Reply<'_>) -> R) -> R {
    let mut receiver = Receiver::<N>::new();
    for &byte in answer {
        if let Some(event) = receiver.receive(byte) {
            let received = event.expect("it is whole");
            return look(received.header, decode(received.message).expect("it is a reply"));
        }
    }
    panic!("no frame in {answer:?}");
}

fn is_done(answer: Option<Vec<u8>>) -> bool {
    with(&answer.expect("an answer"), |_, reply| reply == Reply::Done)
}

fn fault(answer: Option<Vec<u8>>) -> Fault {
    with(&answer.expect("an answer"), |_, reply| match reply {
        Reply::Fault(fault) => fault,
        other => panic!("{other:?}"),
    })
}

fn pairs(pairs: &[(u16, f32)]) -> Pairs {
    pairs.iter().copied().collect()
}

/// Sends requests in order, starting with a hello.
struct Host {
    sequence: u16,
}

impl Host {
    fn hello<B: Board<J>>(server: &mut Served<'_, '_, B>, session: u32) -> Self {
        let host = Self { sequence: 500 };
        let answer = sent(server, &framed(host.header(0), &Request::Hello { session })).expect("an answer");
        with(&answer, |header, reply| {
            assert_eq!(header, host.header(0).reply());
            let Reply::Hello(identity) = reply else { panic!("{reply:?}") };
            assert_eq!((identity.joints, identity.capacity), (21, [22, 40, 28]));
            assert_eq!(usize::from(identity.buffer_bytes), N);
        });
        host
    }

    fn header(&self, attempt: u8) -> Header {
        Header::request(self.sequence, attempt)
    }

    fn ask<B: Board<J>>(&mut self, server: &mut Served<'_, '_, B>, request: &Request<'_>) -> Option<Vec<u8>> {
        self.sequence = self.sequence.wrapping_add(1);
        sent(server, &framed(self.header(0), request))
    }
}

fn poses(frames: usize) -> Vec<Pose<J>> {
    motion::unseen(0, 0, frames).frames.iter().map(to_pose).collect()
}

#[test]
fn poses_over_the_link_are_those_of_a_step() {
    let blob = motion::small();
    let (mut plain, mut served) = (stylizer(blob), stylizer(blob));
    plain.set_style(&[(1, 0.25), (2, 0.75)]).expect("they are known");
    plain.set_action(Some(0)).expect("it is known");
    let mut server = Served::new(&mut served, Counting::default());
    let mut host = Host::hello(&mut server, 1);
    assert!(is_done(host.ask(&mut server, &Request::Style(pairs(&[(1, 0.25), (2, 0.75)])))));
    assert!(is_done(host.ask(&mut server, &Request::Labels { action: Some(0), input_style: None })));
    let mut buffer = PoseBuffer::<J>::new();
    for (t, pose) in poses(40).iter().enumerate() {
        let mut output = Pose::IDENTITY;
        let report = plain.step(pose, &mut output);
        let answer = host.ask(&mut server, &Request::Pose(buffer.pose(pose, 21))).expect("an answer");
        with(&answer, |header, reply| {
            let Reply::Pose(bytes, said) = reply else { panic!("{reply:?}") };
            let mut back = Pose::IDENTITY;
            bytes.read(&mut back);
            assert_eq!(header, host.header(0).reply());
            assert_eq!(back, output, "frame {t}");
            assert_eq!(said, StepReport::new(&report, &[1, 2, 3]), "frame {t}");
            assert_eq!(said.classes.first().map(|c| c.0), report.classes.first().map(|s| s.class));
        });
    }
    let counting = server.board();
    assert_eq!((counting.begun, counting.ended), (40, 40));
    assert!(counting.searched >= 40);
}

#[test]
fn a_request_is_carried_out_once_however_often_it_comes() {
    let blob = motion::small();
    let (mut plain, mut served) = (stylizer(blob), stylizer(blob));
    let mut server = Served::new(&mut served, Counting::default());
    let mut host = Host::hello(&mut server, 9);
    let mut buffer = PoseBuffer::<J>::new();
    let mut before: Option<Vec<u8>> = None;
    for (t, pose) in poses(12).iter().enumerate() {
        let mut output = Pose::IDENTITY;
        let _ = plain.step(pose, &mut output);
        host.sequence += 1;
        let request = Request::Pose(buffer.pose(pose, 21));
        // The first two attempts are lost. The line duplicates the third, and the host sends a fourth.
        let answer = sent(&mut server, &framed(host.header(2), &request)).expect("an answer");
        assert_eq!(sent(&mut server, &framed(host.header(2), &request)).as_ref(), Some(&answer));
        assert_eq!(sent(&mut server, &framed(host.header(3), &request)).as_ref(), Some(&answer));
        // A late request has no reply and no effect.
        if let Some(before) = before.replace(framed(host.header(0), &request)) {
            assert_eq!(sent(&mut server, &before), None);
        }
        with(&answer, |_, reply| {
            let Reply::Pose(bytes, _) = reply else { panic!("{reply:?}") };
            let mut back = Pose::IDENTITY;
            bytes.read(&mut back);
            assert_eq!(back, output, "frame {t}");
        });
    }
    let counts = *server.counts();
    assert_eq!(server.board().ended, 12);
    assert_eq!((counts.steps, counts.requests, counts.frames), (12, 13, 1 + 12 * 4 - 1));
    assert_eq!((counts.lost, counts.doubled, counts.repeated, counts.stale), (24, 12, 12, 11));
}

#[test]
fn only_a_hello_begins_a_session() {
    let mut served = stylizer(motion::small());
    let mut server = Served::new(&mut served, ());
    assert_eq!(fault(sent(&mut server, &framed(Header::request(7, 0), &Request::Reset))), Fault::NoSession);
    let mut host = Host::hello(&mut server, 3);
    assert!(is_done(host.ask(&mut server, &Request::Style(pairs(&[(1, 1.0)])))));
    assert!(is_done(host.ask(&mut server, &Request::Configure(pairs(&[(parameters::K, 12.0)])))));
    assert!(is_done(host.ask(&mut server, &Request::Mask { group: 1, searched: false })));
    assert!(is_done(host.ask(&mut server, &Request::Strength(pairs(&[(0, 0.5)])))));
    let own = Request::GroupStyle { group: 2, weights: pairs(&[(2, 1.0), (0, 3.0)]) };
    assert!(is_done(host.ask(&mut server, &own)));
    assert_eq!([0, 1, 2].map(|style| server.stylizer().style_of(2, style)), [0.75, 0.0, 0.25]);
    // A late copy of the first hello belongs to the running session and has no effect.
    let late = framed(Header::request(500, 0), &Request::Hello { session: 3 });
    assert_eq!(sent(&mut server, &late), None);
    assert_eq!(server.stylizer().config().k, 12);
    assert!(!server.stylizer().searches(1));
    // A new session starts from the initial state.
    Host::hello(&mut server, 4);
    assert_eq!(server.stylizer().style(), [1.0, 0.0, 0.0]);
    assert_eq!(server.stylizer().config(), &Config::new());
    assert!(server.stylizer().searches(1));
    assert_eq!(server.stylizer().strength(0), 1.0);
    assert_eq!(server.stylizer().style_of(2, 0), 1.0);
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut served = stylizer(motion::small());
    let mut server = Served::new(&mut served, ());
    let mut host = Host::hello(&mut server, 3);
    assert!(is_done(host.ask(&mut server, &Request::Labels { action: Some(1), input_style: Some(2) })));
    assert!(is_done(host.ask(&mut server, &Request::Strength(pairs(&[(0, 0.5), (1, 1.5)])))));
    let settings = |server: &mut Served<'_, '_, ()>| {
        let stylizer = server.stylizer();
        let strengths: Vec<f32> = (0..8).map(|g| stylizer.strength(g)).collect();
        (stylizer.style().to_vec(), stylizer.labels(), strengths, *stylizer.config())
    };
    let before = settings(&mut server);
    let refused = [
        (Request::Style(pairs(&[(1, 0.5), (3, 0.5)])), ConfigError::Unknown { id: 3, have: 3 }),
        (Request::Style(pairs(&[(1, f32::NAN)])), ConfigError::Weights),
        (Request::Style(pairs(&[])), ConfigError::Weights),
        (Request::Labels { action: Some(0), input_style: Some(9) }, ConfigError::Unknown { id: 9, have: 3 }),
        (Request::Labels { action: Some(2), input_style: None }, ConfigError::Unknown { id: 2, have: 2 }),
        (Request::Strength(pairs(&[(0, 1.0), (1, 2.5)])), ConfigError::OutOfRange),
        (
            Request::Configure(pairs(&[(parameters::LAMBDA, 1.0), (parameters::K, 41.0)])),
            ConfigError::Neighbors { need: 41, have: 40 },
        ),
        (
            Request::Configure(pairs(&[(parameters::DELTA, 1.0), (99, 41.0)])),
            ConfigError::Unknown { id: 99, have: parameters::NAMES.len() as u16 },
        ),
        (Request::Mask { group: 77, searched: true }, ConfigError::Unknown { id: 77, have: 3 }),
        (Request::GroupStyle { group: 1, weights: pairs(&[(1, 1.0); 4]) }, ConfigError::Weights),
    ];
    for (request, expected) in refused {
        assert_eq!(fault(host.ask(&mut server, &request)), Fault::Refused(expected), "{request:?}");
        assert_eq!(settings(&mut server), before, "{request:?}");
    }
    let pose = Pose::<J>::IDENTITY;
    let short = fault(host.ask(&mut server, &Request::Pose(PoseBuffer::new().pose(&pose, 20))));
    assert_eq!(short, Fault::Joints { need: 21, have: 20 });
    host.sequence += 1;
    let nonsense = Frame::<N>::new().write(host.header(0), &[99u8, 1, 2]).expect("it fits").to_vec();
    assert_eq!(fault(sent(&mut server, &nonsense)), Fault::Malformed);
    assert_eq!((server.counts().faults, server.counts().steps), (12, 0));
}

/// Both once softened the output for over a second, as a setting that changes does.
#[test]
fn what_is_refused_or_set_already_leaves_the_stream_as_it_is() {
    let blob = motion::small();
    let mut stylizers = [stylizer(blob), stylizer(blob), stylizer(blob)];
    for stylizer in &mut stylizers {
        stylizer.set_style(&[(1, 1.0)]).expect("it is known");
        stylizer.set_labels(Some(0), Some(0)).expect("they are known");
    }
    let [mut plain, mut changed, mut served] = stylizers;
    let mut server = Served::new(&mut served, ());
    let mut host = Host::hello(&mut server, 3);
    // A session begins with the settings of a new stylizer.
    assert!(is_done(host.ask(&mut server, &Request::Style(pairs(&[(1, 1.0)])))));
    assert!(is_done(host.ask(&mut server, &Request::Labels { action: Some(0), input_style: Some(0) })));
    let mut buffer = PoseBuffer::<J>::new();
    let mut softened = false;
    for (t, pose) in poses(90).iter().enumerate() {
        if t % 10 == 5 {
            let labels = |style| Request::Labels { action: Some(0), input_style: Some(style) };
            assert!(is_done(host.ask(&mut server, &labels(0))));
            fault(host.ask(&mut server, &labels(9)));
            assert!(is_done(host.ask(&mut server, &Request::Strength(pairs(&[(0, 1.0)])))));
            fault(host.ask(&mut server, &Request::Strength(pairs(&[(0, 0.5), (1, 2.5)]))));
            changed.set_labels(None, None).expect("no class is named");
            changed.set_labels(Some(0), Some(0)).expect("they are known");
        }
        let [mut output, mut other, mut back] = [Pose::IDENTITY; 3];
        let _ = plain.step(pose, &mut output);
        let _ = changed.step(pose, &mut other);
        let answer = host.ask(&mut server, &Request::Pose(buffer.pose(pose, 21))).expect("an answer");
        with(&answer, |_, reply| {
            let Reply::Pose(bytes, _) = reply else { panic!("{reply:?}") };
            bytes.read(&mut back);
        });
        assert_eq!(back, output, "frame {t}");
        softened |= other != output;
    }
    assert!(softened, "labels that change are seen in the output");
}

/// docs/LINK.md states the limit for each list. A host that sent all parameters in one message used to receive `Malformed`,
/// which no page explained.
#[test]
fn a_list_of_more_than_twenty_is_malformed() {
    let mut served = stylizer(motion::small());
    let mut server = Served::new(&mut served, ());
    let mut host = Host::hello(&mut server, 3);
    // Style, strength and configuration, by their numbers in the protocol.
    for (number, item) in [(1u8, (1u16, 1.0f32)), (4, (0, 0.5)), (5, (parameters::K, 12.0))] {
        let mut ask = |count: usize| {
            host.sequence += 1;
            let message = (number, &[item; 32][..count]);
            let bytes = Frame::<N>::new().write(host.header(0), &message).expect("it fits").to_vec();
            sent(&mut server, &bytes)
        };
        assert!(is_done(ask(MAX_PAIRS)), "{number}");
        assert_eq!(fault(ask(MAX_PAIRS + 1)), Fault::Malformed, "{number}");
    }
    assert_eq!(MAX_PAIRS, 20);
    assert!(parameters::NAMES.len() > MAX_PAIRS, "the document says that it takes two messages");
}

#[test]
fn other_versions_and_own_echoes_are_distinguished() {
    let mut served = stylizer(motion::small());
    let mut server = Served::new(&mut served, ());
    let mut host = Host::hello(&mut server, 3);
    let echo = framed(host.header(0).reply(), &Request::Reset);
    assert_eq!(sent(&mut server, &echo), None);
    assert!(is_done(host.ask(&mut server, &Request::Reset)));
    let other = Header { version: VERSION + 1, ..host.header(0) };
    let expected = Fault::Version { need: VERSION, have: VERSION + 1 };
    assert_eq!(fault(sent(&mut server, &framed(other, &Request::Reset))), expected);
    assert_eq!(fault(host.ask(&mut server, &Request::Reset)), Fault::NoSession);
    assert_eq!(server.counts().foreign, 2);
}

#[test]
fn statistics_come_page_by_page() {
    let mut served = stylizer(motion::small());
    let mut server = Served::new(&mut served, Counting::default());
    let mut host = Host::hello(&mut server, 3);
    let mut all = vec![];
    loop {
        let skip = u16::try_from(all.len()).expect("there are few");
        let answer = host.ask(&mut server, &Request::Statistics { skip }).expect("an answer");
        let more = with(&answer, |_, reply| {
            let Reply::Statistics { more, page } = reply else { panic!("{reply:?}") };
            assert!(page.len() == PAGE || !more);
            all.extend(page);
            more
        });
        if !more {
            break;
        }
    }
    let value = |number| all.iter().find(|(n, _)| *n == number).map(|(_, v)| *v);
    assert_eq!(all.len(), 12 + 2 + 20);
    assert_eq!(value(counter::STYLIZER_BYTES), Some(size_of::<Stylized<'_>>() as u64));
    assert_eq!(value(counter::REQUESTS), Some(2));
    assert_eq!(value(counter::OWN + 19), Some(0));
}

#[test]
fn a_server_is_small() {
    // Two buffers and little else: it fits a board of 16 KB with 12 joints.
    let size = size_of::<Server<'_, '_, (), 12, 16, 8, { buffer_length(12) }>>();
    assert!(size <= 2 * buffer_length(12) + 184, "{size}");
    assert!(size <= 900, "{size}");
}
