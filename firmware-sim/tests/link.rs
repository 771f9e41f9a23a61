//! The command `gestus-sim link`, run as a program. Messages are compared by their words, which
//! are what its user reads.

mod common;

use std::{
    io::{Read, Write},
    path::Path,
    time::Instant,
};

use common::{json as figures, sim};

use gestus_core::{
    Config, Database,
    blob::crc::crc32c,
    robot::layout::{MAX_HINGES, header},
};
use gestus_database::{
    robot::{Machine, RobotMap},
    stream::{Request, input::Input, stream},
};
use gestus_firmware_sim::link::serve::with_board;
use gestus_motion::formats::urdf::TOY;
use gestus_motion::{animation::Recording, capture, formats::urdf::Robot};
use gestus_tests::motion;
use serde_json::json;

/// A database and a clip, as files.
fn files() -> [&'static str; 2] {
    common::files("link", 50)
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
    assert!(capture::read(&out).expect("the output is BVH").frames() > 40);
}

/// A board on a socket, which serves one connection at a time.
fn listening() -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = format!("tcp:{}", listener.local_addr().expect("it has an address"));
    std::thread::spawn(move || {
        let database = Database::open(motion::small()).expect("the generated blob opens");
        with_board(database, Config::new(), None, |board| {
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

/// A board on a serial port: a pseudo-terminal, whose other end it reads.
#[cfg(unix)]
fn plugged_in() -> String {
    use serialport::SerialPort;

    let (mut board_end, our_end) = serialport::TTYPort::pair().expect("the system has terminal devices");
    let port = our_end.name().expect("a device has a name");
    board_end.set_timeout(std::time::Duration::from_millis(20)).expect("any time will do");
    std::thread::spawn(move || {
        let database = Database::open(motion::small()).expect("the generated blob opens");
        with_board(database, Config::new(), None, |board| {
            let mut buffer = [0; 700];
            loop {
                // Nothing has come, or the port is not open.
                let Ok(count) = board_end.read(&mut buffer) else { continue };
                for &byte in &buffer[..count] {
                    if let Some(answer) = board(byte) {
                        board_end.write_all(&answer).expect("the line takes it");
                    }
                }
            }
        })
    });
    // The port stays, for the command to open.
    drop(our_end);
    port
}

/// Every byte of a pose gets through, also those that a terminal would interpret: line ends, ^C, ^S.
#[cfg(unix)]
#[test]
fn a_board_at_a_serial_port_is_asked_and_streamed_through() {
    let ([db, clip], port) = (files(), plugged_in());
    for port in [port.clone(), format!("{port}@115200")] {
        assert_eq!(figures(&["link", &port, "--probe", "--json"])["board"]["board"], "host");
        let arguments = ["link", &port, "--db", db, "--input", clip, "--style", "heavy", "--json"];
        let streamed = figures(&arguments);
        assert_eq!(streamed["bit_exact"], true);
        assert_eq!(streamed["digest"], digest_of_the_core());
        assert_eq!(streamed["line"]["repeats"], 0, "{streamed}");
    }
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
        (vec!["link", "loopback", "--probe"], "--probe needs a real board"),
        (vec!["link", "tcp:127.0.0.1:1", "--probe", "--noise", "lose=0.1"], "--noise"),
        (with(db, &["x"]), "no style `x`"),
        (with(clip, &["heavy"]), "walk.bvh"),
        (with(db, &["heavy", "--noise", "drop=2"]), "drop is `2`, not a probability"),
        (with(db, &["heavy", "--noise", "drop=1", "--repeats", "2"]), "after 2 retries"),
    ] {
        let (ok, stdout, stderr) = sim(&arguments);
        assert!(!ok && stdout.is_empty(), "{arguments:?}: {stdout}");
        assert!(stderr.contains(expected), "{arguments:?}: {stderr}");
    }
}

/// Ends of a line that are no board: what they send back, given what they receive, and what they do then.
fn no_board(answer: fn(&[u8]) -> Vec<u8>) -> String {
    let listener = std::net::TcpListener::bind("127.0.0.1:0").expect("a port is free");
    let port = format!("tcp:{}", listener.local_addr().expect("it has an address"));
    std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().expect("somebody connects");
        let mut buffer = [0; 700];
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            let answer = answer(&buffer[..count]);
            if answer.is_empty() || stream.write_all(&answer).is_err() {
                return;
            }
        }
    });
    port
}

/// A console's text has no zero byte, so it is not even a damaged frame; an echo is a frame, and no reply.
#[test]
fn a_line_without_a_board_is_given_up_with_what_came_over_it() {
    for (answer, expected) in [
        ((|_: &[u8]| b"login: ".to_vec()) as fn(&[u8]) -> Vec<u8>, "the bytes received are not frames"),
        (|received| received.to_vec(), "are this host's own"),
        (|_| Vec::new(), "the line failed: "),
    ] {
        let port = no_board(answer);
        let (ok, _, stderr) = sim(&["link", &port, "--probe", "--timeout", "5", "--repeats", "3"]);
        assert!(!ok && stderr.contains(expected), "{stderr}");
        assert_eq!(stderr.matches(&port).count(), 1, "{stderr}");
        let words: Vec<&str> = stderr.trim().split(": ").collect();
        assert!(words.windows(2).all(|w| w[0] != w[1]), "said twice: {stderr}");
    }
    let (_, _, stderr) = sim(&["link", "/dev/no-such-port", "--probe"]);
    assert_eq!(stderr.matches("no-such-port").count(), 1, "{stderr}");
}

/// A board that is lost while it is set up has not refused the setting.
#[test]
fn a_lost_setting_is_not_called_a_refusal() {
    let [db, clip] = files();
    let start = ["link", "loopback", "--db", db, "--input", clip, "--style", "heavy"];
    let lost = (0..20).find_map(|seed| {
        let noise = format!("drop=0.3,seed={seed}");
        let arguments = [&start[..], &["--noise", noise.as_str(), "--repeats", "0"]].concat();
        let (_, _, stderr) = sim(&arguments);
        stderr.contains("setting the").then_some(stderr)
    });
    let stderr = lost.expect("one of twenty is lost while it is set up");
    assert!(stderr.contains("no reply within") && !stderr.contains("refuse"), "{stderr}");
}

#[test]
fn a_robot_is_driven_through_a_noisy_line_bit_by_bit() {
    let [db, clip] = files();
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let toy = Robot::parse(TOY, "toy.urdf").expect("it is a robot");
    let machine = Machine::new(&database, toy, &RobotMap::default()).expect("it suits the database");
    let [tables, csv] = ["toy.gestus", "toy.csv"].map(|name| Path::new(db).with_file_name(name));
    std::fs::write(&tables, machine.bytes()).expect("it can be written");
    let [tables, csv] = [&tables, &csv].map(|path| path.to_str().expect("a plain path"));
    let link = ["link", "loopback", "--db", db, "--input", clip, "--style", "heavy", "--json"];
    let robot = ["--robot", tables, "--robot-csv", csv, "--robot-at", "0.1,-0.1"];
    let run = |more: &[&str]| figures(&[&link[..], &robot, more].concat());
    let clean = run(&[]);
    let read = || std::fs::read_to_string(csv).expect("it was written");
    let rows = read();
    let noisy = run(&["--noise", "lose=0.0003,drop=0.05,cut=0.05,seed=9"]);
    for figures in [&clean, &noisy] {
        assert_eq!(figures["bit_exact"], true);
        assert_eq!(figures["robot"]["ticks_differing"], 0);
        assert_eq!((&figures["robot"]["hinges"], &figures["frames"]), (&json!(16), &json!(50)));
    }
    assert_eq!(noisy["robot"], clean["robot"]);
    assert_eq!(noisy["digest"], digest_of_the_core());
    // A tick is carried out once, however often it is requested.
    assert_eq!(read(), rows);
    // One request a frame: what the separate requests of the twin come to, through the same noise.
    let one = run(&["--step-robot", "--noise", "lose=0.0003,drop=0.05,cut=0.05,seed=9"]);
    assert_eq!((&one["bit_exact"], &one["robot"]["ticks_differing"]), (&json!(true), &json!(0)));
    assert_eq!(one["digest"], digest_of_the_core());
    let ticked = one["robot"]["ticks"].as_u64().expect("a number");
    assert!(ticked.abs_diff(clean["robot"]["ticks"].as_u64().expect("a number")) <= 1, "{ticked} ticks");
    assert!(one["statistics"]["requests"].as_u64() < clean["statistics"]["requests"].as_u64(), "{one}");
    run(&[]);
    // 50 frames at about 30 a second, depending on the style's time steps, in ticks of 20 ms.
    let ticks = clean["robot"]["ticks"].as_u64().expect("a number");
    assert!((60..110).contains(&ticks), "{ticks}");
    assert_eq!(rows.lines().count() as u64, ticks + 1);
    let first: Vec<f32> =
        rows.lines().nth(1).into_iter().flat_map(|l| l.split(',')).flat_map(str::parse).collect();
    // One tick after 0.1 and -0.1: not further than its servos can turn.
    assert!((first[1] - 0.1).abs() < 0.01 && (first[3] + 0.1).abs() < 0.01, "{first:?}");
    assert!((500.0..2500.0).contains(&first[2]), "{first:?}");
}

/// The loopback once had room for as many hinges as the images.
#[test]
fn a_robot_of_as_many_hinges_as_tables_hold_is_driven_through_the_loopback() {
    let [db, clip] = files();
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let finger = |i: usize| {
        format!(
            "<link name=\"f{i}\"/><joint name=\"finger{i}\" type=\"continuous\"><parent link=\"torso\"/>\
             <child link=\"f{i}\"/><axis xyz=\"0 0 1\"/></joint>"
        )
    };
    let fingers: String = (16..MAX_HINGES).map(finger).collect();
    let text = TOY.replace("</robot>", &format!("{fingers}</robot>"));
    let robot = Robot::parse(&text, "many.urdf").expect("it is a robot");
    let machine = Machine::new(&database, robot, &RobotMap::default()).expect("it suits the database");
    let tables = Path::new(db).with_file_name("many.gestus");
    std::fs::write(&tables, machine.bytes()).expect("it can be written");
    let tables = tables.to_str().expect("a plain path");
    let link = ["link", "loopback", "--db", db, "--input", clip, "--style", "heavy", "--json", "--robot"];
    for more in [&[tables][..], &[tables, "--step-robot"]] {
        let figures = figures(&[&link[..], more].concat());
        assert_eq!((&figures["bit_exact"], &figures["robot"]["hinges"]), (&json!(true), &json!(MAX_HINGES)));
    }
}

#[test]
fn a_robot_that_is_not_the_databases_is_refused() {
    let [db, clip] = files();
    let link = ["link", "loopback", "--db", db, "--input", clip, "--style", "heavy", "--robot"];
    let (ok, stdout, stderr) = sim(&[&link[..], &[db]].concat());
    assert!(!ok && stdout.is_empty() && stderr.contains("small.gestus"), "{stderr}");
    let database = Database::open(motion::small()).expect("the generated blob opens");
    let toy = Robot::parse(TOY, "toy.urdf").expect("it is a robot");
    let machine = Machine::new(&database, toy, &RobotMap::default()).expect("it suits the database");
    let mut bytes = machine.bytes().to_vec();
    let path = Path::new(db).with_file_name("own.gestus");
    std::fs::write(&path, &bytes).expect("it can be written");
    for angles in [["0"; 17].join(","), "nan".to_owned()] {
        let own = [path.to_str().expect("a plain path"), "--robot-at", &angles];
        let (ok, stdout, stderr) = sim(&[&link[..], &own].concat());
        assert!(!ok && stdout.is_empty() && stderr.contains("16 hinges"), "{stderr}");
    }
    // Tables for another skeleton, with a valid checksum.
    let header = [header::SKELETON.start, header::CRC.start, header::CRC.end];
    bytes[header[0]] ^= 1;
    bytes[header[1]..header[2]].fill(0);
    let crc = crc32c(&[&bytes]);
    bytes[header[1]..header[2]].copy_from_slice(&crc.to_le_bytes());
    let path = Path::new(db).with_file_name("other.gestus");
    std::fs::write(&path, &bytes).expect("it can be written");
    let (ok, _, stderr) = sim(&[&link[..], &[path.to_str().expect("a plain path")]].concat());
    assert!(!ok && stderr.contains("other.gestus"), "{stderr}");
    // The message once said to raise a capacity that is large enough.
    assert!(stderr.contains("made for another database") && !stderr.contains("raise J"), "{stderr}");
}
