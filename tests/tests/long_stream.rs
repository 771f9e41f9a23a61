//! The long stream: 10,000 frames with changing labels and styles, and one digest for every machine.
//!
//! This test runs on the host at the tests' optimisation level. `cargo xtask firmware` compares the emulated boards and an
//! optimised host with the same digest. `GESTUS_RECORD=1 cargo test -p gestus-tests --test long_stream` records it again.

use std::{collections::BTreeSet, fs, path::PathBuf};

use gestus_core::Database;
use gestus_firmware_sim::{
    board::command::{LONG_BLOB, LONG_CHANGE, LONG_FRAMES},
    recording::Recording,
};

#[test]
fn the_long_stream_has_its_digest() {
    let database = Database::open(LONG_BLOB).unwrap();
    let recording = Recording::long(&database, LONG_FRAMES, LONG_CHANGE);
    assert_eq!(recording.frames.len(), 10_000);
    // The stream contains mixes of styles, labels of every kind, and invalid poses.
    let settings: BTreeSet<String> = recording.frames.iter().map(|(s, _)| format!("{s:?}")).collect();
    assert!(settings.len() > 20, "{} settings", settings.len());
    let labels: BTreeSet<_> =
        recording.frames.iter().map(|(s, _)| (s.action.is_some(), s.input_style.is_some())).collect();
    assert_eq!(labels.len(), 4, "labelled in every way, and not at all");
    assert!(recording.frames.iter().any(|(_, pose)| pose.position[1].is_nan()));

    let digest = format!("{LONG_FRAMES} frames, digest {:08x}\n", recording.digest(&database).unwrap());
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("golden/long-stream.txt");
    if std::env::var_os("GESTUS_RECORD").is_some() {
        fs::write(&path, &digest).unwrap();
    }
    assert_eq!(digest, fs::read_to_string(&path).unwrap_or_default());
}
