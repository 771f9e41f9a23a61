//! The command `gestus-sim run`, run as a program: parts and faults. Messages are compared by their words, which
//! are what its user reads.

mod common;

use common::sim;
use serde_json::Value;

fn files() -> [&'static str; 2] {
    common::files("run", 120)
}

fn run(more: &[&str]) -> (bool, String, String) {
    let [db, clip] = files();
    sim(&[&["run", "--db", db, "--input", clip, "--style", "heavy"], more].concat())
}

fn figures(more: &[&str]) -> Value {
    let [db, clip] = files();
    common::json(&[&["run", "--db", db, "--input", clip, "--style", "heavy", "--json"], more].concat())
}

#[test]
fn a_stream_without_faults_is_as_it_was() {
    let plain = figures(&[]);
    let none = figures(&["--faults", "drop=0,seed=3"]);
    assert_eq!(plain["digest"], none["digest"]);
    let faults = &none["faults"];
    assert_eq!(
        (&faults["error_worst_cm"], &faults["times_off_by_1_cm"]),
        (&Value::from(0.0), &Value::from(0))
    );
    assert_eq!(faults["frames_delivered"], 120);
}

#[test]
fn faults_are_counted_measured_and_recovered_from() {
    let dropped = figures(&["--faults", "drop=0.05,seed=7"]);
    let faults = &dropped["faults"];
    let number = |key: &str| faults[key].as_f64().expect("it is a number");
    assert!(number("frames_dropped") > 1.0);
    assert_eq!(number("frames_delivered"), 120.0 - number("frames_dropped"));
    assert_eq!(dropped["frames"], faults["frames_delivered"]);
    assert!(number("error_worst_cm") > 0.01 && number("error_mean_cm") < number("error_worst_cm"));
    // A foot that is on the floor when a frame is lost stays displaced until it is lifted; how many do depends on the
    // seed.
    let errors: Vec<f64> = (7..12)
        .map(|seed| figures(&["--faults", &format!("drop=0.05,seed={seed}")]))
        .map(|dropped| dropped["faults"]["error_mean_cm"].as_f64().expect("it is a number"))
        .collect();
    assert!(errors.iter().sum::<f64>() / 5.0 < 2.0, "{errors:?}");
    // A flipped bit that makes a rotation invalid is detected; one in the lower digits changes next to nothing.
    let corrupted = figures(&["--faults", "corrupt=0.2,seed=7"]);
    let faults = &corrupted["faults"];
    assert!(corrupted["degraded_by"]["input"].as_u64() > Some(2), "{corrupted}");
    assert!(faults["degraded"].as_u64() > faults["degraded_undisturbed"].as_u64());
    let repeated = figures(&["--faults", "repeat=0.1,delay=0.1:3,seed=7"]);
    assert!(repeated["faults"]["frames_delivered"].as_u64() > Some(120));
    assert!(repeated["faults"]["frames_delayed"].as_u64() > Some(3));
    // The same seed gives the same run; and the output as text.
    let again = figures(&["--faults", "drop=0.05,seed=7"]);
    assert_eq!(again["digest"], dropped["digest"]);
    let (ok, stdout, _) = run(&["--faults", "drop=0.05,seed=7"]);
    assert!(ok && stdout.contains("dropped") && stdout.contains("cm on average"), "{stdout}");
}

#[test]
fn a_part_fits_or_not_and_gives_so_many_frames() {
    let part = |name: &str, more: &[&str]| figures(&[&["--board", name], more].concat())["board"].clone();
    let fast = part("STM32H743", &[]);
    assert_eq!((&fast["part"], &fast["fits"]), (&Value::from("stm32h743"), &Value::from(true)));
    assert_eq!(fast["blob_in"], "internal flash");
    let rate = |board: &Value, key: &str| board[key].as_f64().expect("it is a number");
    let range = |board: &Value| -> [f64; 2] {
        [0, 1].map(|i| board["frames_per_second_median_range"][i].as_f64().expect("it is a number"))
    };
    for name in ["rp2040", "rp2350", "nrf52840", "esp32-c3", "playdate"] {
        let board = part(name, &[]);
        let (median, worst) =
            (rate(&board, "frames_per_second_median"), rate(&board, "frames_per_second_worst"));
        let [low, high] = range(&board);
        assert!(low < median && median < high && worst <= median, "{board}");
        assert!(median < rate(&fast, "frames_per_second_median"), "{board}");
        assert_eq!(board["fits"], true, "{board}");
    }
    // An FPU matters more than twice the clock, even beside `soft-float`.
    let [soft, hard] = ["rp2040", "nrf52840"].map(|n| rate(&part(n, &[]), "frames_per_second_median"));
    assert!(hard > 1.5 * soft, "{hard} {soft}");
    // Labels save work.
    let labelled = part("rp2350", &["--action", "walk", "--input-style", "normal"]);
    assert!(rate(&labelled, "instructions_median") < 0.8 * rate(&part("rp2350", &[]), "instructions_median"));
    // 16 KB of RAM are too few for 21 joints and 40 neighbors; the message says what to do.
    let small = part("nrf51822", &[]);
    assert_eq!(small["fits"], false);
    assert!(small["reasons"][0].as_str().is_some_and(|r| r.contains("fewer joints")), "{small}");
    assert_eq!(figures(&["--board", "all"])["boards"].as_array().map(Vec::len), Some(15));
    let (ok, stdout, _) = run(&["--board", "nrf52840"]);
    assert!(ok && stdout.contains("estimated, not measured"), "{stdout}");
    assert!(stdout.contains("no frame of any stream takes more"), "{stdout}");
    // The bound is known for the mixture on a Cortex-M with an FPU.
    for more in [&["--board", "rp2040"][..], &["--board", "nrf52840", "--method", "statistic"]] {
        let (ok, stdout, stderr) = run(more);
        assert!(ok && stdout.contains("no bound of the worst frame"), "{stdout} {stderr}");
    }
}

#[test]
fn the_table_needs_no_database() {
    let (ok, stdout, stderr) = sim(&["run", "--board", "list"]);
    assert!(ok, "{stderr}");
    assert!(stdout.contains("rp2040") && stdout.contains("DS8626"), "{stdout}");
    let (_, stdout, _) = sim(&["run", "--board", "list", "--json"]);
    let table: Value = serde_json::from_str(&stdout).expect("standard output is one JSON object");
    assert!(table["parts"].as_array().is_some_and(|parts| parts.iter().all(|p| p["ram_bytes"].is_u64())));
}

#[test]
fn what_is_wrong_is_explained() {
    for (more, expected) in [
        (&["--board", "z80"][..], "rp2040"),
        (&["--faults", "drop=2"], "drop is `2`, not a probability"),
        (&["--faults", "dorp=0.1"], "the names are drop, repeat, delay, corrupt and seed"),
        (&["--faults", "seed=7"], "`seed=7` has no effect"),
        (&["--faults", "drop=1"], "no frame arrives"),
    ] {
        let (ok, stdout, stderr) = run(more);
        assert!(!ok && stdout.is_empty() && stderr.contains(expected), "{more:?}: {stderr}");
    }
}

#[test]
fn what_is_read_is_not_written_over() {
    let [db, clip] = files();
    for input in [db, clip] {
        let before = std::fs::read(input).expect("it is there");
        let (ok, _, stderr) = run(&["-o", input]);
        assert!(!ok && stderr.contains("written over an input"), "{stderr}");
        assert_eq!(std::fs::read(input).expect("it is there"), before);
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_standard_output_that_takes_nothing_is_an_error_and_a_closed_one_is_none() {
    use std::process::{Command, Stdio};
    let [db, clip] = files();
    let stream = ["run", "--db", db, "--input", clip, "--style", "heavy"];
    for arguments in [&stream[..], &["run", "--board", "list"]] {
        let command = || {
            let mut command = Command::new(env!("CARGO_BIN_EXE_gestus-sim"));
            command.args(arguments).stderr(Stdio::piped());
            command
        };
        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("Linux has it");
        let output = command().stdout(full).output().expect("it starts");
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{stderr}");
        assert!(stderr.contains("error: ") && !stderr.contains("panicked"), "{stderr}");
        let mut child = command().stdout(Stdio::piped()).spawn().expect("it starts");
        drop(child.stdout.take());
        assert!(child.wait().expect("it ends").success());
    }
}
