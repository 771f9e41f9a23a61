//! The command `gestus-sim link`, as somebody calls it.

use std::{
    io::{Read, Write},
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
    time::Instant,
};

use gestus_builder::{
    bvh::{Bvh, Unit},
    stream::{Request, stream},
    translate::Input,
};
use gestus_core::{Config, Database};
use gestus_firmware_sim::link::serve::with_board;
use gestus_tests::motion;
use serde_json::{Value, json};

/// A database and a clip, as files.
fn files() -> [&'static str; 2] {
    static FILES: OnceLock<[PathBuf; 2]> = OnceLock::new();
    let files = FILES.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("link");
        std::fs::create_dir_all(&folder).expect("the test's folder can be made");
        let files = ["small.gestus", "walk.bvh"].map(|name| folder.join(name));
        std::fs::write(&files[0], motion::small()).expect("it can be written");
        let document = Bvh::from_clip(&motion::unseen(0, 0, 50), Unit::Metres).expect("it is a clip");
        std::fs::write(&files[1], document.to_text()).expect("it can be written");
        files
    });
    [0, 1].map(|i| files[i].to_str().expect("a plain path"))
}

fn sim(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus-sim")).args(arguments).output().expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

fn figures(arguments: &[&str]) -> Value {
    let (ok, stdout, stderr) = sim(arguments);
    assert!(ok, "{arguments:?}: {stderr}");
    serde_json::from_str(&stdout).expect("standard output is one JSON object")
}

fn digest_of_the_core() -> String {
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let input = Input::read(Path::new(files()[1]), &database).expect("it is on the skeleton");
    let streamed = stream(&database, &input.mapped, &Request::style(1), &mut ()).expect("it suits");
    format!("{:08x}", streamed.digest)
}

#[test]
fn a_clip_over_a_noisy_loopback_is_that_of_the_core() {
    let [db, clip] = files();
    let out = Path::new(db).with_file_name("out.bvh");
    let noise = "lose=0.0003,drop=0.05,cut=0.05,seed=4";
    let figures = figures(
        &[
            &[
                "link", "loopback", "--db", db, "--input", clip, "--style", "heavy", "--noise", noise,
                "--json", "-o",
            ][..],
            &[out.to_str().expect("a plain path")],
        ]
        .concat(),
    );
    assert_eq!(figures["bit_exact"], true);
    assert_eq!(figures["frames"], 50);
    assert_eq!(figures["digest"], digest_of_the_core());
    assert_eq!(figures["statistics"]["steps"], 50);
    assert!(figures["line"]["repeats"].as_u64() > Some(0), "{figures}");
    assert!(figures["round_trip_median_ms"].as_f64() > Some(1.0), "{figures}");
    assert!(Bvh::read(&out).expect("the output is BVH").frames() > 40);
}

/// A board at a socket, one connection after the other.
fn listening() -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = format!("tcp:{}", listener.local_addr().expect("it has an address"));
    std::thread::spawn(move || {
        let database = Database::open(motion::small()).expect("the generated blob opens");
        with_board(database, Config::new(), |board| {
            for stream in listener.incoming() {
                let mut stream = stream.expect("somebody connects");
                let mut buffer = [0; 700];
                while let Ok(count @ 1..) = stream.read(&mut buffer) {
                    for &byte in &buffer[..count] {
                        if let Some(answer) = board(byte) {
                            stream.write_all(&answer).expect("somebody listens");
                        }
                    }
                }
            }
        })
    });
    port
}

#[test]
fn a_board_at_a_socket_is_asked_and_streamed_through() {
    let ([db, clip], port) = (files(), listening());
    let probed = figures(&["link", &port, "--probe", "--json"]);
    assert_eq!(probed["board"]["board"], "host");
    assert_eq!(probed["board"]["capacity"], json!([22, 40, 28]));
    assert_eq!(probed["statistics"]["steps"], 0);
    let stream = ["link", &port, "--db", db, "--input", clip, "--style", "heavy"];
    let streamed = figures(&[&stream[..], &["--json"]].concat());
    assert_eq!(streamed["digest"], digest_of_the_core());
    assert_eq!(streamed["line"]["repeats"], 0);
    // At the database's rate: the last of 50 frames at 30 Hz is sent after 1.63 s.
    let start = Instant::now();
    let (ok, stdout, stderr) = sim(&[&stream[..], &["--pace"]].concat());
    assert!(ok, "{stderr}");
    assert!(stdout.contains("all bit-exact"), "{stdout}");
    assert!(start.elapsed().as_secs_f64() > 1.6);
}

#[test]
fn what_is_wrong_is_said_with_the_name_of_the_line_or_file() {
    let [db, clip] = files();
    let with = |db: &'static str, more: &[&'static str]| -> Vec<&'static str> {
        [&["link", "loopback", "--db", db, "--input", clip, "--style"], more].concat()
    };
    for (arguments, expected) in [
        (vec!["link", "/dev/no-such-port", "--probe"], "/dev/no-such-port"),
        (vec!["link", "loopback"], "--db"),
        (vec!["link", "loopback", "--probe"], "loopback has no board"),
        (vec!["link", "tcp:127.0.0.1:1", "--probe", "--noise", "lose=0.1"], "--noise"),
        (with(db, &["x"]), "no style `x`"),
        (with(clip, &["heavy"]), "walk.bvh"),
        (with(db, &["heavy", "--noise", "drop=2"]), "`drop=2`: a probability is 0 to 1"),
        (with(db, &["heavy", "--noise", "drop=1", "--repeats", "2"]), "no answer after 2 repetitions"),
    ] {
        let (ok, stdout, stderr) = sim(&arguments);
        assert!(!ok && stdout.is_empty(), "{arguments:?}: {stdout}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}
