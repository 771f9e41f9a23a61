//! The command: what it writes and says, what it then takes as it is, and what it refuses. Messages are compared by their
//! words, which are what its user reads.

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use gestus_motion::{
    binding::{Options, to_clip},
    capture,
    clip::Clip,
    formats::{
        bvh::Bvh,
        gltf::{parse, toy},
    },
    unit::Unit,
};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::{
    character::{Character, container},
    common,
    foreign::Foreign,
    walks, with_rest, write,
};

/// Runs the command: did it succeed, and what did it say on standard output and standard error.
fn gestus(arguments: &[&str]) -> (bool, String, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8_lossy(&bytes).into_owned();
    (output.status.success(), text(output.stdout), text(output.stderr))
}

fn json_of(arguments: &[&str]) -> Value {
    let (ok, stdout, stderr) = gestus(&[arguments, &["--json"]].concat());
    assert!(ok, "{stderr}");
    serde_json::from_str(&stdout).unwrap()
}

fn shown(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// A generated walk on a character's skeleton, as an animation of its own file.
fn on_character(folder: &Path, change: impl Fn(Foreign) -> Foreign) -> (PathBuf, Clip) {
    let mut clip = change(with_rest(common::walk())).0;
    clip.frames.pop();
    let path = folder.join("walk_on_hero.glb");
    fs::write(&path, toy(&[("walk", &clip)])).unwrap();
    (path, clip)
}

/// The point of it all: a clip of the character needs no retargeting, and others do as ever.
#[test]
fn clips_of_the_character_are_taken_joint_by_joint() {
    let [folder, data] = walks("rig-command");
    let change = |f: Foreign| f.mixamo().turned();
    let [rig, db, plain] = ["hero.glb", "hero.gestus", "walk.bvh"].map(|name| folder.join(name));
    fs::write(&rig, Character::of(&change(with_rest(common::walk()))).glb()).unwrap();
    fs::write(data.join("gestus.toml"), "licence = \"CC0 of nobody\"\n").unwrap();
    let build = ["build", "--data", shown(&data), "--rig", shown(&rig), "-o", shown(&db), "--no-models"];
    let built = json_of(&build);
    assert_eq!((&built["rig"]["file"], &built["rig"]["notes"]), (&json!("hero.glb"), &json!([])));
    assert_eq!(built["rig"]["parts"]["left-upper-arm"], "mixamorig:LeftArm");
    assert_eq!(built["rig"]["joints"].as_array().unwrap().len(), 21);
    assert_eq!((&built["joints"], &built["skipped"]), (&json!(21), &json!(0)));
    let shown_by_inspect = json_of(&["inspect", shown(&db)]);
    assert_eq!(shown_by_inspect["licences"], json!(["CC0 of nobody"]));
    assert!(shown_by_inspect["parameters"].as_array().unwrap().contains(&json!("rig = hero.glb")));

    let (own, clip) = on_character(&folder, change);
    write(&plain, common::walk());
    for (input, is_same) in [(&own, true), (&plain, false)] {
        let check = json_of(&["retarget", "--check", "--db", shown(&db), "--input", shown(input)]);
        assert_eq!(check["same_body"], json!(is_same), "{input:?}");
        assert_eq!(check["verdict"]["like"], "like", "{}", check["verdict"]);
        let output = folder.join("out").with_extension(input.extension().unwrap());
        let translate = ["translate", "--db", shown(&db), "--style", "proud", "--input", shown(input)];
        let said = json_of(&[&translate[..], &["--timing", "sync", "-o", shown(&output)]].concat());
        assert_eq!(said["verdict"]["like"], "like", "{}", said["verdict"]);
        assert!(output.exists());
    }
    let (ok, stdout, _) = gestus(&["retarget", "--check", "--db", shown(&db), "--input", shown(&own)]);
    assert!(ok && stdout.contains("the database's own body"), "{stdout}");
    // The output has the style of the database: as a plain one would give it, on the character.
    let bytes = fs::read(folder.join("out.glb")).unwrap();
    let (_, out) = parse(&bytes, "out.glb", &|_| unreachable!()).unwrap().remove(0);
    assert_eq!(out.joints.len(), clip.skeleton.joints());
}

/// Biped's clips move a joint above the hips as well.
#[test]
fn clips_that_move_a_joint_above_the_hips_are_the_characters() {
    let [folder, data] = walks("rig-carried");
    let carried = |mut f: Foreign| {
        f = f.mixamo();
        f.skeleton(|s| {
            s.parents =
                std::iter::once(None).chain(s.parents.iter().map(|p| Some(p.map_or(0, |p| p + 1)))).collect();
            s.names.insert(0, "Bip01".to_owned());
            s.offsets.insert(0, Vector3::zeros());
            s.offsets[1] = Vector3::new(0.0, 0.95, 0.0);
        });
        for frame in &mut f.0.frames {
            frame.root.y -= 0.95;
            frame.rotations.insert(0, UnitQuaternion::identity());
        }
        f
    };
    let (rig, db, input) = (folder.join("hero.glb"), folder.join("k.gestus"), folder.join("walk.bvh"));
    fs::write(&rig, Character::of(&carried(with_rest(common::walk()))).glb()).unwrap();
    let built =
        json_of(&["build", "--data", shown(&data), "--rig", shown(&rig), "-o", shown(&db), "--no-models"]);
    assert_eq!(built["rig"]["joints"][0], "mixamorig:Hips");
    // A clip whose hips have six channels too, on a root that moves.
    let clip = carried(Foreign(common::walk().clone())).0;
    let text = Bvh::from_clip(&clip, Unit::Metres).unwrap().to_text();
    let (head, motion) = text.split_once("MOTION").unwrap();
    let (top, hips) = head.split_once("JOINT").unwrap();
    let hips = hips.replacen("CHANNELS 3", "CHANNELS 6 Xposition Yposition Zposition", 1);
    let rows = motion.lines().map(|line| {
        let numbers: Vec<&str> = line.split_whitespace().collect();
        let is_row = numbers.len() > 6 && numbers[0].parse::<f64>().is_ok();
        if is_row {
            [&numbers[..6], &["0", "0.95", "0"], &numbers[6..]].concat().join(" ")
        } else {
            line.to_owned()
        }
    });
    let rows: Vec<String> = rows.collect();
    fs::write(&input, format!("{top}JOINT{hips}MOTION{}", rows.join("\n"))).unwrap();
    let check = json_of(&["retarget", "--check", "--db", shown(&db), "--input", shown(&input)]);
    assert_eq!(check["same_body"], true, "{check}");
    let out = folder.join("out.bvh");
    let translate = ["translate", "--db", shown(&db), "--style", "proud", "--timing", "sync"];
    json_of(&[&translate[..], &["--input", shown(&input), "-o", shown(&out)]].concat());
    let read = |path: &Path| to_clip(&capture::read(path).unwrap(), &Options::default()).unwrap().0;
    let (before, after) = (read(&input), read(&out));
    let last = |clip: &Clip| clip.frames[clip.frames.len() - 1].positions(&clip.skeleton)[1];
    assert!((last(&before) - last(&after)).norm() < 1.0, "{} and {}", last(&before), last(&after));
    assert!((last(&before) - before.frames[0].root).norm() > 3.0);
}

/// `gestus.toml` names a character that lies among the clips.
#[test]
fn a_configuration_names_the_character() {
    let [folder, data] = walks("rig-config");
    let character = Character::of(&with_rest(common::walk()).mixamo());
    fs::write(data.join("hero.glb"), character.glb()).unwrap();
    fs::write(data.join("gestus.toml"), "rig = \"hero.glb\"\nstrict = true\n").unwrap();
    let db = folder.join("k.gestus");
    let built = json_of(&["build", "--data", shown(&data), "-o", shown(&db), "--no-models"]);
    assert_eq!((&built["rig"]["file"], &built["skipped"]), (&json!("hero.glb"), &json!(0)));
    // Nor are its animations clips, whose names are no labels.
    let walk = with_rest(common::walk()).mixamo().0;
    fs::write(data.join("hero.glb"), toy(&[("idle", &walk), ("nod", &walk)])).unwrap();
    let again = ["--rig", shown(&data.join("../data/hero.glb"))].map(str::to_owned);
    let build = ["build", "--data", shown(&data), "-o", shown(&db), "--no-models", &again[0], &again[1]];
    assert_eq!(json_of(&build)["skipped"], 0);
    fs::write(data.join("hero.glb"), character.glb()).unwrap();
    // Fewer joints, and more: those that are named.
    let narrow = "mixamorig:Hips,mixamorig:LeftUpLeg,mixamorig:LeftLeg,mixamorig:LeftFoot,mixamorig:RightUpLeg,\
                  mixamorig:RightLeg,mixamorig:RightFoot";
    let build = ["build", "--data", shown(&data), "-o", shown(&db), "--no-models", "--joints"];
    assert_eq!(json_of(&[&build[..], &[narrow]].concat())["joints"], 7);
    let (ok, _, stderr) = gestus(&[&build[..], &["mixamorig:Hips,Tail"]].concat());
    assert!(!ok && stderr.contains("hero.glb: the skeleton has no joint `Tail`"), "{stderr}");
    // Not the character itself is overwritten.
    let rig = data.join("hero.glb");
    let (ok, _, stderr) = gestus(&["build", "--data", shown(&data), "-o", shown(&rig)]);
    assert!(!ok && stderr.contains("hero.glb"), "{stderr}");
}

#[test]
fn what_is_no_character_is_refused_with_what_to_do() {
    let [folder, data] = walks("rig-refused");
    let db = folder.join("k.gestus");
    let build = |rig: &Path, more: &[&str]| {
        let build = ["build", "--data", shown(&data), "--rig", shown(rig), "-o", shown(&db), "--no-models"];
        let (ok, _, stderr) = gestus(&[&build[..], more].concat());
        assert!(ok == db.exists(), "{stderr}");
        (ok, stderr)
    };
    let crate_of = |nodes: Value| container(&json!({"asset": {"version": "2.0"}, "nodes": nodes}), &[]);
    let mut legless = Character::of(&with_rest(common::walk()).mixamo());
    for name in &mut legless.skeleton.names {
        *name = name.replace("Left", "Fin").replace("Right", "Tail");
    }
    legless.skeleton.offsets[13..].iter_mut().for_each(|offset| *offset *= 0.0);
    for (name, bytes, said) in [
        ("none.glb", None, "none.glb: cannot be read"),
        ("empty.glb", Some(Vec::new()), "empty.glb: "),
        ("text.glb", Some(b"glTF, they said".to_vec()), "export it again"),
        ("nothing.glb", Some(crate_of(json!([]))), "it has no nodes"),
        ("crate.glb", Some(crate_of(json!([{"name": "Crate"}]))), "no left-upper-arm"),
        ("fish.glb", Some(legless.glb()), "name them in a map file: [joints] "),
        ("hero.fbx", Some(b"Kaydara FBX Binary  ".to_vec()), "convert it to glTF"),
    ] {
        let path = folder.join(name);
        if let Some(bytes) = bytes {
            fs::write(&path, bytes).unwrap();
        }
        let (ok, stderr) = build(&path, &[]);
        assert!(!ok && stderr.contains(said) && stderr.contains(name), "{name}: {stderr}");
    }
    // Names that say nothing, and a map that does.
    let mut numbered = Character::of(&with_rest(common::walk()).mixamo());
    let arm = numbered.skeleton.names.iter().position(|n| n.ends_with("LeftArm")).unwrap();
    numbered.skeleton.names[arm] = "Thing".to_owned();
    let (path, map) = (folder.join("odd.glb"), folder.join("map.toml"));
    fs::write(&path, numbered.glb()).unwrap();
    fs::write(&map, "[joints]\nleft-upper-arm = \"Thing\"\n").unwrap();
    let (ok, stderr) = build(&path, &["--rig-map", shown(&map)]);
    assert!(ok, "{stderr}");
    fs::remove_file(&db).unwrap();
    let (ok, _, stderr) =
        gestus(&["build", "--data", shown(&data), "--rig-map", shown(&map), "-o", shown(&db)]);
    assert!(!ok && stderr.contains("--rig-map without --rig"), "{stderr}");
    let (ok, _, stderr) = gestus(&["build", "--data", shown(&data), "--rig-unit", "cm", "-o", shown(&db)]);
    assert!(!ok && stderr.contains("--rig-unit without --rig"), "{stderr}");
}
