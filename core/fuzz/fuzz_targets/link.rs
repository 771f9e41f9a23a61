//! Any bytes on the line to a board: the server neither panics nor hangs, and answers a hello afterwards.
//!
//! Bytes that are no frames are all alike to it, so an input is a row of chunks, `flags, length, bytes`: put on the
//! line as they are, or as the message of a frame with a right checksum.
//!
//! The board's database is the file that GESTUS_BLOB names; `cargo xtask fuzz link` makes it. The first chunk's flags say
//! whether a robot hangs on the board: the one whose tables GESTUS_ROBOT names.
#![no_main]

use std::sync::LazyLock;

use gestus_core::{
    Config, Database, Stylizer,
    link::{Board, Driver, Frame, Header, Request, Server, buffer_length},
    robot::Robot,
};
use libfuzzer_sys::fuzz_target;
use serde::{Serialize, Serializer, ser::SerializeTuple};

const JOINTS: usize = 22;
const N: usize = buffer_length(JOINTS);
type Served<'a, 'db, B> = Server<'a, 'db, B, JOINTS, 40, 28, N>;

static BLOB: LazyLock<Vec<u8>> = LazyLock::new(|| gestus_core_fuzz::named("GESTUS_BLOB"));
static ROBOT: LazyLock<Vec<u8>> = LazyLock::new(|| gestus_core_fuzz::named("GESTUS_ROBOT"));

fuzz_target!(|bytes: &[u8]| {
    let database = Database::open(&BLOB).expect("the database opens");
    let mut stylizer = Stylizer::<JOINTS, 40, 28>::new(database, Config::new()).expect("the database fits");
    if bytes.first().is_some_and(|flags| flags & 16 != 0) {
        let robot = Robot::open(&ROBOT).expect("the robot opens");
        let driver = Driver::<(), 32>::new((), robot, &database).expect("the robot fits");
        serve(Server::new(&mut stylizer, driver), bytes);
    } else {
        serve(Server::new(&mut stylizer, ()), bytes);
    }
});

fn serve<B: Board<JOINTS>>(mut server: Served<'_, '_, B>, bytes: &[u8]) {
    let mut sequence = 0;
    let mut rest = bytes;
    while let [flags, length, tail @ ..] = rest {
        let (chunk, tail) = tail.split_at(usize::from(*length).min(tail.len()));
        rest = tail;
        if flags & 1 == 0 {
            feed(&mut server, chunk);
            continue;
        }
        if flags & 2 == 0 {
            sequence += 1;
        }
        let mut frame = Frame::<600>::new();
        let header = Header::request(sequence, flags >> 2 & 3);
        feed(&mut server, frame.write(header, &Message(chunk)).expect("it fits"));
    }
    let mut hello = Frame::<64>::new();
    let hello = hello.write(Header::request(7, 0), &Request::Hello { session: 0xfeed }).expect("it fits");
    assert!(feed(&mut server, hello), "no answer to a hello");
}

/// True where there was an answer.
fn feed<B: Board<JOINTS>>(server: &mut Served<'_, '_, B>, bytes: &[u8]) -> bool {
    let mut answered = false;
    for &byte in bytes {
        if let Some(answer) = server.receive(byte) {
            assert!(answer.len() <= N && answer.first() == Some(&0) && answer.last() == Some(&0));
            answered = true;
        }
    }
    answered
}

/// Bytes as they are.
struct Message<'a>(&'a [u8]);

impl Serialize for Message<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut tuple = serializer.serialize_tuple(self.0.len())?;
        for byte in self.0 {
            tuple.serialize_element(byte)?;
        }
        tuple.end()
    }
}
