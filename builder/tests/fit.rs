//! `gestus build --fit BOARD`, as somebody calls it. Messages are compared by their words, which are what its user reads.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use gestus_core::Database;
use gestus_database::blob::cut::models_only;
use gestus_motion::{formats::bvh::Bvh, unit::Unit};
use serde_json::Value;

/// A folder of generated walks, and a file for their database.
fn files(test: &str) -> [PathBuf; 2] {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("fit-{test}"));
    let _ = fs::remove_dir_all(&folder);
    let [data, db] = ["data", "k.gestus"].map(|name| folder.join(name));
    fs::create_dir_all(&data).unwrap();
    for clip in common::corpus().examples.iter().map(|example| &example.clip) {
        let text = Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text();
        fs::write(data.join(format!("{}.bvh", clip.name)), text).unwrap();
    }
    [data, db]
}

/// Builds: did it succeed, standard output and standard error.
fn build([data, db]: &[PathBuf; 2], options: &[&str]) -> (bool, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
    command.args(["build", "--data"]).arg(data).arg("-o").arg(db).args(options);
    let output = command.output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

/// Builds, and returns the JSON.
fn built(files: &[PathBuf; 2], options: &[&str]) -> Value {
    let (ok, stdout, stderr) = build(files, &[options, &["--json"]].concat());
    assert!(ok, "{options:?}: {stderr}");
    serde_json::from_str(&stdout).unwrap()
}

#[test]
fn what_can_not_be_is_refused_and_nothing_is_written() {
    let files = files("refused");
    for (options, said) in [
        (&["--fit", "z80"][..], "--fit z80: there is no such part: there are rp2040, rp2350"),
        (&["--fit", "z80"], "m4f for stm32f405"),
        (&["--fps", "30"], "--fit <BOARD>"),
        (&["--fit", "rp2040", "--bytes", "1M"], "cannot be used with"),
        (&["--fit", "rp2040", "--row-error", "0.1"], "cannot be used with"),
        (&["--fit", "rp2040", "--features", "12"], "cannot be used with"),
        (&["--fit", "rp2040", "--fps", "0"], "--fps 0: frames a second from 1 to 1000"),
        (&["--fit", "rp2040", "--fps", "1001"], "--fps 1001: frames a second from 1 to 1000"),
        (&["--fit", "rp2040", "--fps", "NaN"], "--fps NaN"),
        (&["--fit", "rp2040", "--fps", "20", "--rate", "30"], "the database has 30 frames a second (--rate)"),
        (&["--fit", "nrf51822"], "--joints"),
        (&["--fit", "m0"], "bytes of RAM"),
        (
            &["--fit", "ra4m1", "--rate", "30", "--fps", "1000"],
            "nothing keeps 1000 frames a second on this part",
        ),
    ] {
        let (ok, stdout, stderr) = build(&files, options);
        assert!(!ok && stdout.is_empty() && stderr.contains(said), "{options:?}: {stderr}");
        assert!(!files[1].exists(), "{options:?}");
    }
}

/// The database that is built without a part.
fn whole(files: &[PathBuf; 2]) -> Vec<u8> {
    let (ok, _, stderr) = build(files, &[]);
    assert!(ok, "{stderr}");
    fs::read(&files[1]).unwrap()
}

#[test]
fn the_database_is_what_is_said() {
    let files = files("said");
    let whole = whole(&files);
    // An emulated board stands for a part; case and separators do not matter.
    for (asked, board, part) in
        [("M4F", "m4f", "stm32f405"), ("RP2040", "rp2040", "rp2040"), ("ESP32-C3", "esp32-c3", "esp32-c3")]
    {
        let figures = built(&files, &["--fit", asked]);
        let fit = &figures["fit"];
        assert_eq!((&fit["board"], &fit["part"]), (&board.into(), &part.into()));
        assert_eq!((&fit["fps"], &fit["method"]), (&30.0.into(), &"mar".into()));
        // It fits, so nothing is left out.
        assert!(fs::read(&files[1]).unwrap() == whole, "{asked}");
        let bytes = fit["bytes"].as_u64().unwrap();
        assert_eq!((bytes, bytes), (whole.len() as u64, fit["whole_bytes"].as_u64().unwrap()));
        assert!(bytes <= fit["bytes_limit"].as_u64().unwrap());
        assert!(fit["ram_bytes"].as_u64() <= fit["ram_limit"].as_u64());
        assert_eq!(fit["methods"].as_array().unwrap().len(), 6);
    }
    // The database has the rate that is asked for, but where another is.
    assert_eq!(built(&files, &["--fit", "rp2350", "--fps", "15"])["rate_hz"], 15.0);
    let both = built(&files, &["--fit", "rp2350", "--fps", "60", "--rate", "30"]);
    assert_eq!((&both["rate_hz"], &both["fit"]["fps"]), (&30.0.into(), &60.0.into()));
    assert_eq!(built(&files, &["--fit", "rp2350", "--rate", "20"])["fit"]["fps"], 20.0);
    // What is stated otherwise is kept.
    let few = built(&files, &["--fit", "stm32f405", "--cycles", "1"]);
    assert!(few["bytes"].as_u64().unwrap() < whole.len() as u64);
    let (ok, stdout, stderr) = build(&files, &["--fit", "m33"]);
    assert!(ok && stdout.contains("m33: rp2350 (Cortex-M33F, 150 MHz) keeps 30 frames"), "{stdout}{stderr}");
}

#[test]
fn frames_are_left_out_where_only_their_models_keep_the_time() {
    let files = files("models");
    let slow = built(&files, &["--fit", "esp32-c3"]);
    let methods = slow["fit"]["methods"].as_array().unwrap();
    let fps = |method: &str, labelled: bool| {
        let row = methods.iter().find(|row| row["method"] == method && row["labelled"] == labelled);
        row.unwrap()["fps"].as_f64().unwrap()
    };
    assert!(fps("phase", false) > fps("mar", true) && fps("mar", true) > fps("mar", false), "{methods:?}");
    let wanted = format!("{}", 0.5 * (fps("phase", false) + fps("mar", true)));
    let figures = built(&files, &["--fit", "esp32-c3", "--fps", &wanted, "--rate", "30"]);
    assert_eq!((&figures["fit"]["method"], &figures["fit"]["models_only"]), (&"phase".into(), &true.into()));
    assert_eq!((&figures["frames"], &figures["rate_hz"]), (&0.into(), &30.0.into()));
    assert_eq!(fs::metadata(&files[1]).unwrap().len(), figures["fit"]["bytes"].as_u64().unwrap());
    // It is the cut of the whole.
    let cut = fs::read(&files[1]).unwrap();
    let whole = whole(&files);
    assert!(cut == models_only(&Database::open(&whole).unwrap()).unwrap());
    // Between the two of the mixture, labels are asked for.
    let wanted = format!("{}", 0.5 * (fps("mar", false) + fps("mar", true)));
    let figures = built(&files, &["--fit", "esp32-c3", "--fps", &wanted, "--rate", "30"]);
    assert_eq!((&figures["fit"]["method"], &figures["fit"]["labelled"]), (&"mar".into(), &true.into()));
    let (_, stdout, _) = build(&files, &["--fit", "esp32-c3", "--fps", &wanted, "--rate", "30"]);
    assert!(stdout.contains("if the input's action and style are given"), "{stdout}");
    assert!(stdout.contains("where they are unknown, `--method phase` keeps the time too"), "{stdout}");
}
