//! Files that nobody prepared, as somebody gives them to the command. Messages are compared by their words, which are what
//! its user reads.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
};

use gestus_motion::{
    capture::{self, CaptureError},
    clip::{Clip, Frame},
    formats::bvh::Bvh,
    unit::Unit,
};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::Value;

/// Runs the command: did it succeed, and what did it say on standard output and standard error.
fn gestus(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(folder.join("clips/sub")).unwrap();
    fs::write(folder.join("k.gestus"), common::blob()).unwrap();
    folder
}

fn write(path: &Path, clip: &Clip) {
    fs::write(path, Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
}

fn shown(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The walk with the names of Poser.
fn poser() -> Clip {
    let mut clip = common::walk().clone();
    let skeleton = Arc::make_mut(&mut clip.skeleton);
    for name in &mut skeleton.names {
        let (stem, side) = name.split_once('_').map_or((name.as_str(), ""), |(stem, side)| (stem, side));
        let stem = match stem {
            "Hips" => "hip",
            "Spine" => "abdomen",
            "Shoulder" => "Collar",
            "UpperArm" => "Shldr",
            "LowerArm" => "ForeArm",
            "UpperLeg" => "Thigh",
            "LowerLeg" => "Shin",
            "Toes" => "Toe",
            "Chest" => "chest",
            "Neck" => "neck",
            "Head" => "head",
            other => other,
        };
        *name = format!("{}{stem}", side.to_lowercase());
    }
    clip
}

#[test]
fn several_clips_are_translated_in_one_call() {
    let folder = folder("several");
    let [db, clips, out] = ["k.gestus", "clips", "out"].map(|n| folder.join(n));
    write(&clips.join("a.bvh"), common::walk());
    write(&clips.join("sub/poser.bvh"), &poser());
    let translate = ["translate", "--db", shown(&db), "--style", "proud", "-o", shown(&out), "--input"];
    let (ok, said, stderr) = gestus(&[&translate[..], &[shown(&clips)]].concat());
    assert!(ok && said.contains("2 clips translated, 0 refused"), "{said}{stderr}");
    assert!(out.join("a.bvh").exists() && out.join("sub/poser.bvh").exists());
    // One that can't be read is told and counted; the others are there.
    fs::write(clips.join("broken.bvh"), "HIERARCHY\nROOT Hips").unwrap();
    fs::write(clips.join("max.fbx"), b"Kaydara FBX Binary  \0\x1a\0").unwrap();
    fs::remove_dir_all(&out).unwrap();
    let (ok, said, stderr) = gestus(&[&translate[..], &[shown(&clips), "--json"]].concat());
    let told: Value = serde_json::from_str(&said).unwrap();
    assert!(!ok && stderr.contains("2 of 4 clips were refused") && stderr.contains("FBX2glTF"), "{stderr}");
    assert_eq!((&told["translated"], &told["refused"]), (&2.into(), &2.into()));
    assert!(told["clips"][0]["figures"]["digest"].is_string() && out.join("a.bvh").exists());
    let verdicts = told["clips"].as_array().unwrap().iter().map(|clip| &clip["figures"]["verdict"]["like"]);
    assert_eq!(told["unlike"], verdicts.filter(|like| **like == "unlike").count());
    // As a pattern, and as a shell expands one.
    let pattern = clips.join("*.bvh");
    let (ok, said, stderr) = gestus(&[&translate[..], &[shown(&pattern)]].concat());
    assert!(!ok && said.contains("1 clips translated, 1 refused"), "{said}{stderr}");
    let list = [clips.join("a.bvh"), clips.join("sub/poser.bvh")];
    let (ok, said, stderr) = gestus(&[&translate[..], &list.each_ref().map(|p| shown(p))].concat());
    assert!(ok && said.contains("2 clips translated"), "{said}{stderr}");
    // No input is written over, and what is for one clip is refused.
    let onto =
        ["translate", "--db", shown(&db), "--style", "proud", "-o", shown(&clips), "--input", shown(&clips)];
    let before = fs::read(clips.join("a.bvh")).unwrap();
    assert!(!gestus(&onto).0);
    assert_eq!(fs::read(clips.join("a.bvh")).unwrap(), before);
    let (ok, _, stderr) = gestus(&[&translate[..], &[shown(&clips), "--page", "p.html"]].concat());
    assert!(!ok && stderr.contains("--page: only for one clip"), "{stderr}");
}

/// Poser's `rShldr` and `lThigh` were found by shape, with the sides exchanged.
#[test]
fn names_of_poser_come_in_as_they_are() {
    let folder = folder("poser");
    let [db, clip] = ["k.gestus", "poser.bvh"].map(|n| folder.join(n));
    write(&clip, &poser());
    let (ok, said, stderr) =
        gestus(&["retarget", "--check", "--db", shown(&db), "--input", shown(&clip), "--json"]);
    assert!(ok, "{stderr}");
    let told: Value = serde_json::from_str(&said).unwrap();
    for part in told["parts"].as_array().unwrap() {
        assert_eq!(
            part["how"].as_str().map(|h| h.contains("Poser") || h.contains("tree")),
            Some(true),
            "{part}"
        );
        let (input, database) = (part["input"].as_str().unwrap(), part["database"].as_str().unwrap());
        let side = |name: &str| name.rsplit('_').next().unwrap_or("").to_lowercase().chars().next();
        assert!(!database.contains('_') || input.chars().next() == side(database), "{part}");
    }
}

#[test]
fn a_clip_takes_the_style_of_another_skeleton() {
    let folder = folder("transfer");
    let [clip, reference, out] = ["a.bvh", "b.bvh", "out.bvh"].map(|n| folder.join(n));
    write(&clip, common::walk());
    write(&reference, &poser());
    let call =
        ["transfer", "--input", shown(&clip), "--reference", shown(&reference), "-o", shown(&out), "--json"];
    let (ok, said, stderr) = gestus(&call);
    assert!(ok && stderr.contains("retargeted to the skeleton of"), "{stderr}");
    assert_eq!(serde_json::from_str::<Value>(&said).unwrap()["retargeted"], true);
    // The same motion has the same style: what comes out is what went in.
    let read = |path: &Path| capture::read(path).unwrap();
    let poses =
        |path: &Path| gestus_motion::binding::to_clip(&read(path), &Default::default()).unwrap().0.frames;
    let mean_turn = |before: &[Frame], after: &[Frame]| {
        let joints = before.iter().zip(after).flat_map(|(a, b)| a.rotations.iter().zip(&b.rotations));
        let all: Vec<f64> = joints.map(|(a, b)| a.angle_to(b).to_degrees()).collect();
        all.iter().sum::<f64>() / all.len() as f64
    };
    let (before, after) = (poses(&clip), poses(&out));
    let mean = mean_turn(&before, &after);
    assert!(mean < 3.0, "{mean} degrees");

    // Far away and with Z up it is the same.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
    let far = Vector3::new(50_000.0, 20_000.0, 3_000.0);
    let mut moved = common::walk().clone();
    for frame in &mut moved.frames {
        frame.root = turn * frame.root + far;
        frame.rotations[0] = turn * frame.rotations[0];
    }
    write(&clip, &moved);
    let (ok, _, stderr) = gestus(&call);
    assert!(ok, "{stderr}");
    let there = poses(&out);
    assert_eq!(there.len(), after.len());
    for (a, b) in there.iter().zip(&after) {
        assert!((turn.inverse() * (a.root - far) - b.root).norm() < 1e-3, "{} {}", a.root, b.root);
        let joints = a.rotations.iter().zip(&b.rotations).skip(1);
        assert!(joints.map(|(a, b)| a.angle_to(b)).fold(0.0, f64::max) < 0.01);
    }

    // With other axes, rotations of the same names mean something else.
    let axes = UnitQuaternion::from_euler_angles(0.3, -1.1, 0.7);
    let mut turned = common::walk().clone();
    let mut skeleton = (*turned.skeleton).clone();
    for j in 2..skeleton.joints() {
        if skeleton.parents[j].is_some_and(|p| p > 1) {
            skeleton.offsets[j] = axes.inverse() * skeleton.offsets[j];
        }
    }
    for frame in &mut turned.frames {
        for j in 2..skeleton.joints() {
            let before = if skeleton.parents[j].is_some_and(|p| p > 1) {
                axes.inverse()
            } else {
                UnitQuaternion::identity()
            };
            frame.rotations[j] = before * frame.rotations[j] * axes;
        }
    }
    turned.skeleton = skeleton.into();
    write(&clip, common::walk());
    write(&reference, &turned);
    let (ok, said, stderr) = gestus(&call);
    assert!(ok, "{stderr}");
    assert_eq!(serde_json::from_str::<Value>(&said).unwrap()["retargeted"], true);
    let mean = mean_turn(&poses(&clip), &poses(&out));
    assert!(mean < 3.0, "{mean} degrees with other axes");
    write(&clip, &moved);
    write(&reference, &poser());

    // What is told wins, of either clip, and a doubt names the option.
    let told = |more: &[&str]| gestus(&[&call[..], more].concat());
    let (ok, _, stderr) = told(&["--up", "z", "--reference-up", "y"]);
    assert!(ok && !stderr.contains("if it does not lie"), "{stderr}");
    assert_eq!(poses(&out), there);
    let (_, _, stderr) = told(&["--up", "y", "--reference-up", "-z"]);
    let doubts: Vec<&str> = stderr.lines().filter(|line| line.contains("if it does not lie")).collect();
    assert!(doubts.len() == 2 && doubts[0].contains("say --up z"), "{stderr}");
    assert!(doubts[1].contains("say --reference-up y"), "{stderr}");
    assert_ne!(poses(&out), there);
    let (ok, _, stderr) = told(&["--up", "north"]);
    assert!(!ok && stderr.contains("x, y, z, -x, -y or -z"), "{stderr}");
}

/// The clips' up is stated where their bodies do not show it, or show another.
#[test]
fn the_up_of_a_folder_is_stated_in_its_configuration() {
    let folder = folder("up");
    let (clips, out) = (folder.join("clips"), folder.join("out.gestus"));
    for (example, name) in common::corpus().examples.iter().zip(["a", "b", "c", "d"]) {
        let class = if example.style == common::corpus().examples[0].style { "neutral" } else { "proud" };
        write(&clips.join(format!("walk_{class}_{name}.bvh")), &example.clip);
    }
    let build = |up: &str| {
        fs::write(clips.join("gestus.toml"), format!("licence = \"mine\"\nup = \"{up}\"\n")).unwrap();
        gestus(&["build", "--data", shown(&clips), "-o", shown(&out), "--no-models"])
    };
    let (ok, _, stderr) = build("y");
    assert!(ok && !stderr.contains("turned to y"), "{stderr}");
    let (_, _, stderr) = build("-z");
    assert!(stderr.contains("4 clips have -z up: turned to y"), "{stderr}");
    let (ok, _, stderr) = build("north");
    let words = ["gestus.toml", "line 2", "`north` is no axis: x, y, z, -x, -y or -z"];
    assert!(!ok && words.iter().all(|word| stderr.contains(word)), "{stderr}");
}

#[test]
fn fbx_is_told_by_its_bytes_and_a_count_that_is_off_by_one_is_a_note() {
    let folder = folder("told");
    let path = folder.join("clips/walk.bvh");
    for content in [&b"Kaydara FBX Binary  \0\x1a\0"[..], b"; FBX 7.4.0 project file\n"] {
        fs::write(&path, content).unwrap();
        let error = capture::read(&path).unwrap_err();
        assert!(matches!(&error, CaptureError::Fbx { file } if Path::new(file) == path), "{error}");
        // Dropped on a page, there is no file.
        let error = capture::documents(&path, &content.into()).unwrap_err();
        assert!(matches!(error, CaptureError::Fbx { .. }), "{error}");
    }
    let text = Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text();
    let frames = common::walk().frames.len();
    for (promised, fine) in [(frames + 1, true), (frames - 1, true), (frames + 2, false)] {
        let changed = text.replace(&format!("Frames: {frames}\n"), &format!("Frames: {promised}\n"));
        fs::write(&path, changed).unwrap();
        match capture::read(&path) {
            Ok(document) => {
                let notes = gestus_motion::animation::Recording::notes(&document).join(" ");
                assert!(fine && notes.contains(&format!("promises {promised} frames")), "{notes}");
            }
            Err(error) => assert!(!fine, "{error}"),
        }
    }
}

/// One style has nothing to be translated into, and terms that lie in the folder are not lost without a word.
#[test]
fn a_folder_of_one_style_says_so() {
    let folder = folder("one");
    let clips = folder.join("clips");
    write(&clips.join("walk_proud_1.bvh"), common::walk());
    fs::write(clips.join("LICENSE"), "mine").unwrap();
    let db = folder.join("new.gestus");
    let (ok, _, stderr) = gestus(&["build", "--data", shown(&clips), "-o", shown(&db), "--no-models"]);
    assert!(
        ok && stderr.contains("all clips have the style proud") && stderr.contains("LICENSE"),
        "{stderr}"
    );
}
