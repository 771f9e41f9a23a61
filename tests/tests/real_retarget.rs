//! Real clips on other skeletons through a database of Bandai-Namco's: 31 and 21 joints at 120 and 60 frames a second to
//! 21 at 30, and back. Skipped if they are missing, which fails with `CI=true`.

use std::{path::Path, sync::OnceLock};

use gestus_core::{Config, Database, config::Timing};
use gestus_database::{
    build::{BuildOptions, build},
    data_folder::{config::Config as Clips, load::load},
    stream::{Request, input::Input, translate::translate},
};
use gestus_evaluate::{
    measures::{OnDatabase, retarget, servo},
    report::table::Row,
};
use gestus_motion::formats::bvh::{AsBvh, Bvh};
use gestus_tests::real_clips;

/// A database of walks and runs in three styles.
fn blob() -> Option<&'static [u8]> {
    static BLOB: OnceLock<Option<Vec<u8>>> = OnceLock::new();
    let blob = BLOB.get_or_init(|| {
        let folders = ["bandai-namco-2", "xia", "cmu"].map(real_clips::data_set);
        let [Some(data), Some(_), Some(_)] = folders else { return None };
        let list = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect();
        let clips = Clips {
            data: Some(data),
            actions: list(&["walk", "run"]),
            styles: list(&["normal", "elderly", "active"]),
            ..Clips::default()
        };
        let corpus = load(&clips).expect("the real clips load").corpus;
        Some(build(&corpus, &BuildOptions::default()).expect("they make a database").bytes)
    });
    blob.as_deref()
}

fn number(row: &Row, key: &str) -> f64 {
    row.get(key).and_then(serde_json::Value::as_f64).unwrap_or_else(|| panic!("{key} in {row:?}"))
}

#[test]
fn directions_and_contacts_survive_the_way_there_and_back() {
    let Some(blob) = blob() else { return };
    let database = Database::open(blob).unwrap();
    let mut clips = 0;
    for folder in ["xia", "cmu"] {
        let evaluation = retarget::evaluate(&database, &real_clips::root().join(folder)).unwrap();
        for row in &evaluation.rows {
            for key in ["hand_max_deg", "foot_max_deg"] {
                assert!(number(row, key) < 5.0, "{key}: {row:?}");
            }
            assert!(number(row, "contact_max_frames") <= 2.0, "{row:?}");
            // A step at the end of a clip may fall on either side of the threshold on another body, but not on its own.
            let lone = if row["method"] == "round-trip" { 0.0 } else { 1.0 };
            assert!(number(row, "contact_unmatched") <= lone, "{row:?}");
            assert!(number(row, "contact_steps") >= 4.0, "{row:?}");
            if row["method"] == "round-trip" {
                assert!(number(row, "joint_error_cm") < 1.0, "{row:?}");
            }
            clips += 1;
        }
    }
    assert_eq!(clips, 18);
}

#[test]
fn a_foreign_clip_is_stylized_unlabelled_and_comes_back_on_its_own_skeleton() {
    let Some(blob) = blob() else { return };
    let database = Database::open(blob).unwrap();
    let elderly = database.manifest().unwrap().styles.find("elderly").unwrap();
    for (file, rate, leg) in [("xia/neutral_01_000.bvh", 120.0, "LeftLeg"), ("cmu/walk.bvh", 60.0, "LeftLeg")]
    {
        let input = Input::read(&real_clips::root().join(file), &database).unwrap();
        assert!(input.retarget().is_some(), "{file}");
        let read = input.document.as_bvh().unwrap();
        assert_eq!(read.rate_hz(), rate);
        let request = Request { config: Config::new().timing(Timing::Sync), ..Request::style(elderly) };
        let streamed = translate(&database, &input, &request, &mut ()).unwrap();
        let output = input.output(&streamed);
        let text = input.written(&output, Path::new("out.bvh"), None).unwrap();
        let document = Bvh::parse(&text, "out.bvh").unwrap();
        // Its own names, channels and offsets; the database's rate.
        let shape = |d: &Bvh| {
            d.joints().iter().map(|j| (j.name.clone(), j.channels.clone(), j.offset)).collect::<Vec<_>>()
        };
        assert_eq!(shape(&document), shape(&read), "{file}");
        assert_eq!(document.rate_hz(), 30.0);
        assert_eq!(output.frames.len(), input.clip.frames.len());
        // Old people bend their knees more: the shin against the thigh, on average.
        let bend = |frames: &[gestus_motion::clip::Frame]| {
            let knee = input.clip.skeleton.find(leg).unwrap();
            frames.iter().map(|f| f.rotations[knee].angle().to_degrees()).sum::<f64>() / frames.len() as f64
        };
        let (before, after) = (bend(&input.clip.frames), bend(&output.frames));
        assert!(after > before + 5.0, "{file}: knees bent by {before}, then {after} degrees");
        // Feet neither sink nor float: the lowest ankle of the clip stays where it was, within 3 cm.
        let lowest = |frames: &[gestus_motion::clip::Frame]| {
            let foot = input.clip.skeleton.find("LeftFoot").unwrap();
            frames.iter().map(|f| f.positions(&input.clip.skeleton)[foot].y).fold(f64::INFINITY, f64::min)
        };
        let (before, after) = (lowest(&input.clip.frames), lowest(&output.frames));
        assert!((before - after).abs() < 0.03, "{file}: lowest ankle at {before}, then {after} m");
    }
}

#[test]
fn the_toy_robot_keeps_its_limits_on_real_motion() {
    let Some(blob) = blob() else { return };
    let database = Database::open(blob).unwrap();
    let evaluation = servo::Args::default().evaluate(&database, &real_clips::root().join("cmu")).unwrap();
    assert_eq!(evaluation.rows.len(), 10);
    for row in &evaluation.rows {
        assert_eq!(number(row, "limit_violations"), 0.0, "{row:?}");
        assert!(number(row, "peak_jerk_ratio") <= 1.01, "{row:?}");
    }
    let walk = evaluation.rows.iter().find(|r| r["clip"] == "walk" && r["method"] == "drive").unwrap();
    assert!(number(walk, "end_effector_target_deg") < 3.0, "{walk:?}");
}
