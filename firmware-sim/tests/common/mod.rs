//! Shared by the tests of the command: a database and a clip as files, and running the program.

use std::{
    path::{Path, PathBuf},
    process::Command,
    sync::OnceLock,
};

use gestus_motion::{formats::bvh::Bvh, unit::Unit};
use gestus_tests::motion;
use serde_json::Value;

/// Writes a database and a clip of that many frames to a folder of that test, and returns their paths.
pub fn files(test: &str, frames: usize) -> [&'static str; 2] {
    static FILES: OnceLock<[PathBuf; 2]> = OnceLock::new();
    let files = FILES.get_or_init(|| {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(test);
        std::fs::create_dir_all(&folder).expect("the test's folder can be made");
        let files = ["small.gestus", "walk.bvh"].map(|name| folder.join(name));
        std::fs::write(&files[0], motion::small()).expect("it can be written");
        let document = Bvh::from_clip(&motion::unseen(0, 0, frames), Unit::Metres).expect("it is a clip");
        std::fs::write(&files[1], document.to_text()).expect("it can be written");
        files
    });
    [0, 1].map(|i| files[i].to_str().expect("a plain path"))
}

/// Runs `gestus-sim`; returns whether it succeeded, its standard output and its standard error.
pub fn sim(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus-sim")).args(arguments).output().expect("it starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

/// Runs `gestus-sim`, whose standard output is one JSON object.
pub fn json(arguments: &[&str]) -> Value {
    let (ok, stdout, stderr) = sim(arguments);
    assert!(ok, "{arguments:?}: {stderr}");
    serde_json::from_str(&stdout).expect("standard output is one JSON object")
}
