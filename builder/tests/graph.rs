//! `gestus graph` as somebody calls it: a stream from a folder of clips, with true labels beside it.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use gestus_database::synth::{self, Options};
use gestus_motion::{formats::bvh::Bvh, unit::Unit};

fn gestus(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.success(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn a_stream_has_a_label_for_every_frame_and_every_class() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("graph");
    let data = folder.join("data");
    fs::create_dir_all(&data).unwrap();
    let corpus = synth::corpus(&Options::of(&["walk", "kick"], &["neutral", "old"], 2, 5.0)).unwrap();
    for example in &corpus.examples {
        let path = data.join(format!("{}.bvh", example.clip.name));
        fs::write(path, Bvh::from_clip(&example.clip, Unit::Centimetres).unwrap().to_text()).unwrap();
    }
    let [data, output] = [&data, &folder.join("stream.bvh")].map(|p| p.to_str().unwrap().to_owned());
    let arguments = ["graph", "--data", &data, "-o", &output, "--seconds", "30", "--seed", "7", "--json"];
    let (ok, stdout, stderr) = gestus(&arguments);
    assert!(ok, "{stderr}");
    let figures: serde_json::Value = serde_json::from_str(&stdout).unwrap();
    assert_eq!(figures["frames"], 900);
    assert!(figures["transitions"].as_u64().unwrap() >= 4, "{figures}");
    let stream = Bvh::parse(&fs::read(&output).unwrap(), &output).unwrap();
    assert_eq!(stream.frames(), 900);
    let labels = fs::read_to_string(output.replace(".bvh", ".csv")).unwrap();
    let lines: Vec<Vec<&str>> = labels.lines().map(|l| l.split(',').collect()).collect();
    assert_eq!(lines[0], ["frame", "seconds", "action", "style", "clip", "clip_frame", "blend"]);
    assert_eq!(lines.len(), 901);
    let classes: BTreeSet<(&str, &str)> = lines[1..].iter().map(|l| (l[2], l[3])).collect();
    assert_eq!(classes.len(), 4);
    assert!(lines[1..].iter().all(|l| l[4].starts_with(&format!("{}_{}", l[2], l[3]))));
    // The same seed gives the same file, another one another.
    let first = fs::read(&output).unwrap();
    assert!(gestus(&arguments).0 && fs::read(&output).unwrap() == first);
    let mut other = arguments;
    other[8] = "8";
    assert!(gestus(&other).0 && fs::read(&output).unwrap() != first);
    for (arguments, said) in [
        (vec!["graph", "--data", &data, "-o", &output, "--seconds", "0"], "--seconds 0: from 1 to 3600"),
        (vec!["graph", "--data", &data, "-o", "x.txt"], "-o "),
        (vec!["graph", "--data", &data, "-o", &output, "--stay", "61"], "--stay 61"),
        (vec!["graph", "--data", &data, "-o", &output, "--actions", "dance"], "dance"),
    ] {
        let (ok, _, stderr) = gestus(&arguments);
        assert!(!ok && stderr.contains(said), "{arguments:?}: {stderr}");
    }
}
