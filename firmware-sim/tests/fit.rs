//! What `gestus build --fit` chooses and estimates is what `gestus-sim run --board` says about the same database and clip.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{fs, path::Path};

use gestus_database::{
    build::{BuildOptions, build},
    data_folder::{config::Config, load::load},
    parts::{
        choose::{Sample, Wanted, choose},
        names::{self, EMULATED},
    },
    synth,
};
use gestus_firmware_sim::board::boards::BOARDS;
use gestus_motion::{formats::bvh::Bvh, unit::Unit};

#[test]
fn every_emulated_board_stands_for_a_part() {
    for board in &BOARDS {
        let part = names::find(board.name).expect(board.name);
        assert_eq!(part.core.has_fpu(), board.has_fpu(), "{} for {}", part.name, board.name);
    }
    assert_eq!(BOARDS.len(), EMULATED.len());
}

#[test]
fn the_estimates_are_those_of_a_run() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("fit");
    let data = folder.join("data");
    fs::create_dir_all(&data).expect("the folder can be made");
    let options = synth::Options::of(&["walk", "kick"], &["neutral", "proud"], 2, 5.0);
    for example in synth::corpus(&options).expect("it is generated").examples {
        let document = Bvh::from_clip(&example.clip, Unit::Centimetres).expect("it is a clip");
        fs::write(data.join(format!("{}.bvh", example.clip.name)), document.to_text())
            .expect("it is written");
    }
    let corpus = load(&Config::of_folder(&data).expect("it has names")).expect("it is read").corpus;
    let samples = Sample::of(&corpus, corpus.plain_style());
    let db = folder.join("k.gestus");
    // Frames and models in external and internal memory; models alone.
    for (board, fps) in [("rp2040", 10.0), ("m4f", 30.0), ("esp32-c3", 90.0)] {
        let (board, part) = names::find_with_name(board).expect("it is in the table");
        let (built, chosen) = choose(&Wanted { board, part, fps }, &samples, |bytes| {
            Ok(build(&corpus, &BuildOptions { bytes, ..BuildOptions::default() })?)
        })
        .expect("it fits");
        fs::write(&db, &built.bytes).expect("it is written");
        let json = chosen.json();
        let mut rows = 0;
        for row in json["methods"].as_array().expect("a list").iter().filter(|row| row["is_held"] == true) {
            let text = |key: &str| row[key].as_str().expect("a name").to_owned();
            let clip = data.join(format!("{}.bvh", text("input")));
            let [db, clip] = [&db, &clip].map(|path| path.to_str().expect("a plain path"));
            let (style, method) = (text("style"), text("method"));
            let mut words =
                vec!["run", "--json", "--db", db, "--input", clip, "--style", &style, "--method", &method];
            let labels = [text("action"), text("input_style")];
            if row["labelled"] == true {
                words.extend(["--action", &labels[0], "--input-style", &labels[1]]);
            }
            let run = common::json(&[&words[..], &["--board", board]].concat())["board"].clone();
            let number = |value: &serde_json::Value| value.as_f64().expect("a number");
            for (mine, theirs) in
                [("fps", "frames_per_second_worst"), ("fps_median", "frames_per_second_median")]
            {
                let (mine, theirs) = (number(&row[mine]), number(&run[theirs]));
                assert!((mine / theirs - 1.0).abs() < 1e-12, "{board} {method}: {mine} {theirs}");
            }
            assert_eq!(row["keeps"], number(&run["frames_per_second_worst"]) >= fps, "{board} {method}");
            assert_eq!(run["fits"], true);
            for (mine, theirs) in [
                ("part", "part"),
                ("place", "blob_in"),
                ("bytes", "blob_bytes"),
                ("ram_bytes", "ram_needed_bytes"),
                ("ram_limit", "ram_bytes"),
                ("state_bytes", "state_bytes"),
            ] {
                assert_eq!(json[mine], run[theirs], "{board}: {mine}");
            }
            rows += 1;
        }
        assert_eq!(rows, if chosen.models_only { 4 } else { 6 }, "{board}");
    }
}
