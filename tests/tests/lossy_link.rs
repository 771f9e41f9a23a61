//! A stream over a line that loses, duplicates, truncates, corrupts and delays bytes continues, and every bit is right.

use std::time::Duration;

use gestus_core::{
    Config, Database, Stylizer,
    link::{
        Fault, Frame, Header, Identity, PoseBuffer, Receiver, Reply, Request, Server, VERSION, buffer_length,
        counter, decode,
    },
};
use gestus_database::stream::Request as StreamRequest;
use gestus_firmware_sim::link::{
    Client, LinkError, RetryPolicy,
    loopback::Loopback,
    noise::{FaultCounts, Noise},
    serve::with_board,
    session::Session,
    stream::{Linked, stream},
};
use gestus_motion::clip::Clip;
use gestus_tests::motion;
use proptest::prelude::*;

/// The result of a clip over a line with faults.
struct Outcome {
    linked: Linked,
    faults: [FaultCounts; 2],
    statistics: Vec<(u16, u64)>,
    repeats: u64,
    seconds: f64,
}

impl Outcome {
    fn counted(&self, number: u16) -> u64 {
        self.statistics.iter().find(|(n, _)| *n == number).map_or(0, |(_, value)| *value)
    }
}

fn stream_request() -> StreamRequest {
    StreamRequest { style: vec![(1, 0.5), (2, 0.5)], strength: vec![(0, 0.75)], ..StreamRequest::style(1) }
}

fn send(noise: &str, clip: &Clip) -> Result<Outcome, anyhow::Error> {
    use gestus_firmware_sim::link::Line;
    let noise: Noise = noise.parse()?;
    let database = Database::open(motion::small())?;
    with_board(database, Config::new(), None, |twin| {
        with_board(database, Config::new(), None, |board| {
            let mut line = Loopback::new(board, noise);
            let retry = RetryPolicy { retries: 60, ..RetryPolicy::default() };
            let client = Client::new(&mut line, 77, retry);
            let mut session = Session::begin(client, twin, &database)?;
            session.apply(&stream_request())?;
            let linked = stream(&mut session, clip, None, || ())?;
            let statistics = session.board().statistics()?;
            let repeats = session.counts().repeats;
            let seconds = line.now().as_secs_f64();
            Ok(Outcome { linked, faults: line.fault_counts(), statistics, repeats, seconds })
        })?
    })?
}

/// Digest of the clip through the core alone.
fn expected(clip: &Clip) -> u32 {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    gestus_database::stream::stream(&database, clip, &stream_request(), &mut ()).expect("it suits").digest
}

#[test]
fn every_kind_of_fault_is_recovered_from_and_every_bit_is_right() {
    let clip = motion::unseen(0, 0, 90);
    let digest = expected(&clip);
    let cases = [
        "drop=0",
        "lose=0.0005,seed=1",
        "double=0.0005,seed=2",
        "corrupt=0.0005,seed=3",
        "drop=0.1,seed=4",
        "repeat=0.2,seed=5",
        "cut=0.1,seed=6",
        // Later than the first retry, and than the second.
        "delay=0.2:1500,seed=7",
        "lose=0.0003,double=0.0002,corrupt=0.0003,drop=0.05,repeat=0.05,cut=0.05,delay=0.1:900,seed=8",
        // Three quarters of all round trips fail.
        "drop=0.5,seed=9",
    ];
    for noise in cases {
        let outcome = send(noise, &clip).unwrap_or_else(|e| panic!("{noise}: {e:#}"));
        assert_eq!(outcome.linked.differing, 0, "{noise}");
        assert_eq!(outcome.linked.streamed.digest, digest, "{noise}");
        assert_eq!(outcome.linked.host_digest, digest, "{noise}");
        assert_eq!(outcome.counted(counter::STEPS), 90, "{noise}: each pose is stepped once");
        let faults: u64 = outcome.faults.iter().flat_map(|h| h.all()).map(|(_, n)| n).sum();
        let (quiet, repeats) = (noise == "drop=0", outcome.repeats);
        assert_eq!(quiet, faults == 0, "{noise}: {faults} faults");
        if quiet {
            assert_eq!(repeats, 0);
        }
        println!("{noise}: {repeats} repeats in {:.1} s, {:?}", outcome.seconds, outcome.faults);
    }
}

#[test]
fn faults_are_counted_where_they_happen() {
    let clip = motion::unseen(0, 1, 60);
    // Lost frames: requests that the board missed and requests that it got again add up to the retries.
    let outcome = send("drop=0.2,seed=11", &clip).expect("it recovers");
    let [there, back] = outcome.faults;
    assert!(there.dropped_frames > 3 && back.dropped_frames > 3);
    assert_eq!(outcome.repeats, there.dropped_frames + back.dropped_frames);
    // The last page of statistics was requested after its counters were read, so one fault may be missing there.
    let missed = outcome.counted(counter::LOST) + outcome.counted(counter::REPEATED);
    assert!(missed <= outcome.repeats && missed + 6 >= outcome.repeats, "{missed} of {}", outcome.repeats);
    // Frames that arrive twice.
    let outcome = send("repeat=0.3,seed=12", &clip).expect("it recovers");
    let doubled = outcome.counted(counter::DOUBLED);
    assert_eq!(outcome.repeats, 0);
    let there = outcome.faults[0].repeated_frames;
    assert!(doubled <= there && doubled + 3 >= there && doubled > 5, "{doubled} of {there}");
    // Corrupted bytes.
    let outcome = send("corrupt=0.0004,seed=13", &clip).expect("it recovers");
    let damaged = outcome.counted(counter::CORRUPTED) + outcome.counted(counter::CUT);
    let changed = outcome.faults[0].corrupted_bytes;
    // A byte that becomes zero splits a frame in two.
    assert!(damaged > 3 && damaged <= 2 * changed, "{damaged} of {changed}");
    assert_eq!(outcome.linked.differing, 0);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    let clip = motion::unseen(0, 0, 30);
    let noise = "lose=0.001,drop=0.1,delay=0.1:400,seed=21";
    let [a, b] = [(); 2].map(|()| send(noise, &clip).expect("it recovers"));
    assert_eq!((a.faults, a.repeats, a.statistics), (b.faults, b.repeats, b.statistics));
    assert_eq!(a.seconds, b.seconds);
}

#[test]
fn a_dead_line_is_given_up_with_advice() {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let retry = RetryPolicy {
        first_timeout: Duration::from_millis(100),
        max_timeout: Duration::from_millis(400),
        retries: 4,
    };
    let error = with_board(database, Config::new(), None, |board| {
        let mut client = Client::new(Loopback::new(board, "drop=1".parse().expect("it is right")), 1, retry);
        client.hello().map(|_| ()).expect_err("nobody hears")
    })
    .expect("it fits");
    let LinkError::Timeout { retries, seconds, counts } = error else { panic!("{error}") };
    // 100 + 200 + 400 + 400 + 400 ms.
    assert_eq!((retries, seconds), (4, 1.5));
    assert_eq!((counts.repeats, counts.frames), (4, 0));
}

#[test]
fn another_database_is_refused() {
    let (database, other) = (motion::small(), motion::tiny());
    let [database, other] = [database, other].map(|b| Database::open(b).expect("the generated blob opens"));
    assert_ne!(database.identity(), other.identity());
    let error = with_board(database, Config::new(), None, |twin| {
        with_board(other, Config::new(), None, |board| {
            let client = Client::new(Loopback::new(board, Noise::default()), 1, RetryPolicy::default());
            Session::begin(client, twin, &database).map(|_| ()).expect_err("it is another one")
        })
    });
    let error = error.expect("it fits").expect("it fits");
    let Some(&LinkError::Database { board, file }) = error.downcast_ref() else { panic!("{error}") };
    assert_eq!((board, file), (other.identity(), database.identity()));
}

/// A board that does not use this crate's server, with buffers of any length: it identifies itself, and no more.
fn of_other_make(database: &Database<'_>, buffer_bytes: usize) -> impl FnMut(u8) -> Option<Vec<u8>> {
    let identity = Identity {
        board: "own",
        build: "1",
        database: database.identity(),
        rate_hz: database.rate_hz(),
        joints: 21,
        classes: 6,
        capacity: [22, 40, 28],
        ram_bytes: 24_000,
        buffer_bytes: buffer_bytes as u16,
    };
    let (mut receiver, mut frame) = (Receiver::<N>::new(), Frame::<N>::new());
    move |byte| {
        let received = receiver.receive(byte)?.expect("the line is clean");
        let reply = match decode(received.message)? {
            Request::Hello { .. } => Reply::Hello(identity),
            other => panic!("{other:?}: it should not have come to that"),
        };
        Some(frame.write(received.header.reply(), &reply).expect("it fits").to_vec())
    }
}

/// 400 bytes hold a pose of 21 joints, but not every reply to one; 345 bytes hold no such pose, and the board ignores
/// it. The host used to report this as a line that had become worse.
#[test]
fn a_board_with_short_buffers_is_refused_before_the_stream() {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let begun = |bytes| {
        with_board(database, Config::new(), None, |twin| {
            let board = Loopback::new(of_other_make(&database, bytes), Noise::default());
            let client = Client::new(board, 1, RetryPolicy::default());
            Session::begin(client, twin, &database).map(|_| ())
        })
        .expect("it fits")
    };
    let need = buffer_length(21);
    for bytes in [345, 400, need - 1] {
        let error = begun(bytes).expect_err("it is too short");
        let Some(LinkError::Buffers { have, need: needed }) = error.downcast_ref() else { panic!("{error}") };
        assert_eq!((*have, *needed), (bytes, need));
    }
    assert!(begun(need).is_ok());
}

/// Its reply was read as one of this version.
#[test]
fn a_board_of_another_version_is_refused() {
    let (mut receiver, mut frame) = (Receiver::<N>::new(), Frame::<N>::new());
    let newer = VERSION + 1;
    let board = move |byte| {
        let header = receiver.receive(byte)?.expect("the line is clean").header.reply();
        let bytes = frame.write(Header { version: newer, ..header }, &Reply::Done).expect("it fits");
        Some(bytes.to_vec())
    };
    let mut client = Client::new(Loopback::new(board, Noise::default()), 1, RetryPolicy::default());
    let error = client.set(&Request::Style(Default::default())).expect_err("it speaks another version");
    let LinkError::Fault(Fault::Version { need, have }) = error else { panic!("{error}") };
    assert_eq!((need, have), (newer, VERSION));
}

#[test]
fn a_restarted_board_is_detected() {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let pose = gestus_database::stream::to_pose::<22>(&motion::unseen(0, 0, 1).frames[0]);
    let mut buffer = PoseBuffer::new();
    // Two boards; the second one does not know the session of the first.
    let error = with_board(database, Config::new(), None, |first| {
        with_board(database, Config::new(), None, |second| {
            let mut bytes = 0;
            let line = Loopback::new(
                |byte| {
                    bytes += 1;
                    if bytes < 400 { first(byte) } else { second(byte) }
                },
                Noise::default(),
            );
            let mut client = Client::new(line, 5, RetryPolicy::default());
            client.hello().expect("the first is there");
            let request = Request::Pose(buffer.pose(&pose, 21));
            (0..9).find_map(|_| client.call(&request).err()).expect("the second board knows of no session")
        })
    });
    let error = error.expect("it fits").expect("it fits");
    assert!(matches!(error, LinkError::Fault(Fault::NoSession)), "{error}");
}

const N: usize = buffer_length(22);

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// After any bytes the server still replies to the next hello.
    #[test]
    fn no_bytes_hang_or_crash_a_server(
        chunks in prop::collection::vec(
            prop_oneof![
                // Noise, including zeros and group lengths.
                prop::collection::vec(prop_oneof![any::<u8>(), Just(0), Just(1), Just(255)], 0..600),
                // Any message in a frame with a correct checksum.
                (any::<u16>(), any::<u8>(), prop::collection::vec(any::<u8>(), 0..80)).prop_map(|(s, a, m)| sealed(s, a, &m)),
                // A valid request, which is carried out: the session's numbers continue from 1.
                (0u16..40, 0u8..3, 0u8..9).prop_map(|(s, a, kind)| request(s, a, kind)),
            ],
            1..40,
        ),
    ) {
        let database = Database::open(motion::tiny()).expect("the generated blob opens");
        let mut stylizer = Stylizer::<22, 40, 28>::new(database, Config::new()).expect("it fits");
        let mut server = Server::<_, 22, 40, 28, N>::new(&mut stylizer, ());
        let mut answers = 0;
        for byte in chunks.concat() {
            if let Some(answer) = server.receive(byte) {
                prop_assert!(answer.len() <= N && answer.first() == Some(&0) && answer.last() == Some(&0));
                answers += 1;
            }
        }
        let counts = *server.counts();
        prop_assert!(answers <= counts.frames);
        // Synchronised again at the next zero, which every frame has.
        let mut frame = Frame::<64>::new();
        let hello = frame.write(Header::request(9, 0), &Request::Hello { session: 0xdead_beef }).expect("it fits");
        let mut answered = false;
        for &byte in hello {
            answered |= server.receive(byte).is_some();
        }
        prop_assert!(answered);
    }
}

fn sealed(sequence: u16, attempt: u8, message: &[u8]) -> Vec<u8> {
    // A tuple is encoded as bytes without a length.
    let mut raw = vec![0x10, attempt];
    raw.extend(sequence.to_le_bytes());
    raw.extend(message);
    raw.extend(gestus_core::blob::crc::crc32c(&[&raw]).to_le_bytes());
    let mut bytes = vec![0];
    for group in raw.split(|&b| b == 0) {
        // Messages are short: no group is full.
        bytes.push(group.len() as u8 + 1);
        bytes.extend(group);
    }
    bytes.push(0);
    bytes
}

fn request(sequence: u16, attempt: u8, kind: u8) -> Vec<u8> {
    let pose = gestus_database::stream::to_pose::<22>(&motion::unseen(0, 0, 1).frames[0]);
    let mut buffer = PoseBuffer::new();
    let pairs = [(u16::from(attempt), 1.0)].into_iter().collect();
    let request = match kind {
        0 => Request::Hello { session: u32::from(attempt) },
        1 => Request::Style(pairs),
        2 => Request::Labels { action: Some(0), input_style: Some(u16::from(attempt)) },
        3 => Request::Mask { group: u16::from(attempt), searched: false },
        4 => Request::Strength(pairs),
        5 => Request::Configure(pairs),
        6 => Request::Reset,
        7 => Request::Pose(buffer.pose(&pose, 21)),
        _ => Request::Statistics { skip: sequence },
    };
    Frame::<N>::new().write(Header::request(sequence, attempt), &request).expect("it fits").to_vec()
}
