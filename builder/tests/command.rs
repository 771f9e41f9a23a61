//! The command `gestus`, as somebody calls it: what it refuses before it does anything. Messages are compared by their
//! words, which are what its user reads.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{collections::HashSet, fs, path::Path, process::Command};

use gestus_motion::{clip::Clip, formats::bvh::Bvh, unit::Unit};

/// Runs it: did it succeed, and what did it say on standard error.
fn gestus(arguments: &[&str]) -> (bool, String) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[test]
fn no_input_is_written_over() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command");
    fs::create_dir_all(folder.join("data")).unwrap();
    let [db, clip, robot, page] =
        ["k.gestus", "data/walk_a_1.bvh", "toy.urdf", "page.bvh"].map(|n| folder.join(n));
    fs::write(&db, common::blob()).unwrap();
    let text = Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text();
    fs::write(&clip, &text).unwrap();
    fs::write(&robot, gestus_motion::formats::urdf::TOY).unwrap();
    let [db, clip, robot, page] = [&db, &clip, &robot, &page].map(|p| p.to_str().unwrap());
    let new = &clip.replace("walk_a_1", "new");
    let data = folder.join("data");
    let data = data.to_str().unwrap();
    let [own, pages] = ["own", "pages"].map(|n| folder.join(n));
    fs::create_dir_all(&own).unwrap();
    let config = own.join("gestus.toml");
    fs::write(&config, "licence = \"mine\"\n").unwrap();
    let [own, pages] = [&own, &pages].map(|p| p.to_str().unwrap());
    let translate = ["translate", "--db", db, "--input", clip, "--style", "proud"];
    for (arguments, said) in [
        (vec!["cut", db, "--models-only", "-o", db], "written over an input"),
        (vec!["build", "--data", data, "-o", clip], "written over an input"),
        (vec!["loop", "--data", data, "--style", "a", "-o", clip], "written over an input"),
        (vec!["transfer", "--input", clip, "--reference", clip, "-o", clip], "written over an input"),
        (vec!["retarget", "--db", db, "--input", clip, "--section", db], "written over an input"),
        ([&translate[..], &["-o", clip]].concat(), "-o "),
        ([&translate[..], &["-o", db]].concat(), "-o "),
        ([&translate[..], &["-o", "out.glb"]].concat(), "-o out.glb: glTF is read and not written"),
        (vec!["export", db, "-o", clip], "this is a file: give a folder"),
        (vec!["build", "--data", data, "-o", "k.glb"], "glTF is read and not written"),
        ([&translate[..], &["-o", page, "--page", page]].concat(), "is written there too"),
        ([&translate[..], &["-o", page, "--robot", robot, "--csv", robot]].concat(), "--csv "),
        ([&translate[..], &["-o", page, "--robot", robot]].concat(), "--robot has no output"),
        ([&translate[..], &["-o", new, "--k", "0"]].concat(), "k.gestus: --k 0: from 1 to 64"),
        (
            [&translate[..], &["-o", new, "--mask", "tail"]].concat(),
            "k.gestus: --mask tail: the database has no joint group `tail`",
        ),
        ([&translate[..], &["-o", new, "--lead", "1"]].concat(), "--lead does nothing"),
        (
            [&translate[..], &["-o", new, "--no-contact", "--ease", "1"]].concat(),
            "--ease does nothing with --no-contact",
        ),
        ([&translate[..], &["-o", "/dev/stdout"]].concat(), "-o /dev/stdout: this is standard output"),
        (
            vec!["synth", "-o", own, "--actions", "walk"],
            "gestus.toml is there already, and was not generated",
        ),
        (vec!["page", "-o", pages, "--db", db, "--wasm", clip], "this is not the module gestus_page.wasm"),
        (vec!["graph", "--data", data, "-o", new, "--seconds", "5", "--groups", "legs"], "--groups"),
        (
            [&translate[..], &["-o", &page.replace(".bvh", ".html")]].concat(),
            "this ending can't be written: choose a name that ends in .bvh",
        ),
        (
            [&translate[..], &["-o", new, "--action", "run"]].concat(),
            "--action run: the database has no action `run`: it has walk",
        ),
    ] {
        let (ok, stderr) = gestus(&arguments);
        assert!(!ok && stderr.contains(said), "{arguments:?}: {stderr}");
    }
    assert!(fs::read_to_string(config).unwrap().contains("mine") && !Path::new(pages).exists());
    assert_eq!(fs::read(db).unwrap(), common::blob());
    assert_eq!(fs::read_to_string(clip).unwrap(), text);
    let (ok, stderr) = gestus(&[&translate[..], &["-o", folder.join("out.bvh").to_str().unwrap()]].concat());
    assert!(ok, "{stderr}");
}

/// `page` and `export` wrote over their own input, `page` and `demo` over a person's files.
#[cfg(unix)]
#[test]
fn folders_that_are_written_hold_no_input_and_nothing_of_ones_own() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command-folders");
    let _ = fs::remove_dir_all(&folder);
    let [arrays, site, own, walks] = ["arrays", "site", "own", "walks"].map(|n| folder.join(n));
    for folder in [&arrays, &site, &own, &walks] {
        fs::create_dir_all(folder).unwrap();
    }
    let [db, wasm, data, page] =
        [site.join("data.js"), folder.join("m.wasm"), arrays.join("dofs.npy"), own.join("page.css")];
    fs::write(&db, common::blob()).unwrap();
    fs::write(&wasm, b"\0asm text_length").unwrap();
    fs::write(&page, "mine").unwrap();
    fs::write(walks.join("walk_proud.bvh"), "mine").unwrap();
    std::os::unix::fs::symlink(&db, &data).unwrap();
    let [db, wasm, arrays, site, own, walks] =
        [&db, &wasm, &arrays, &site, &own, &walks].map(|p| p.to_str().unwrap());
    for (arguments, said) in [
        (vec!["export", db, "-o", arrays], "dofs.npy: it would be written over an input"),
        (vec!["page", "-o", site, "--db", db, "--wasm", wasm], "data.js: it would be written over an input"),
        (
            vec!["page", "-o", own, "--db", db, "--wasm", wasm],
            "page.css is there already, and was not generated",
        ),
        (vec!["demo", "--out", walks], "walk_proud.bvh is there already, and was not generated"),
    ] {
        let (ok, stderr) = gestus(&arguments);
        assert!(!ok && stderr.contains(said), "{arguments:?}: {stderr}");
    }
    assert_eq!(fs::read(db).unwrap(), common::blob());
    assert_eq!(fs::read_to_string(page).unwrap(), "mine");
    assert_eq!(fs::read_dir(walks).unwrap().count(), 1);
}

/// What is wrong with a robot was found after the clip was written.
#[test]
fn a_robot_is_refused_before_anything_is_written() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("command-robot");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let [db, clip, ball, map, out, qpos] =
        ["k.gestus", "walk.bvh", "ball.urdf", "map.gestus", "out.bvh", "q.csv"].map(|n| folder.join(n));
    fs::write(&db, common::blob()).unwrap();
    fs::write(&clip, Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text()).unwrap();
    let toy = gestus_motion::formats::urdf::TOY;
    fs::write(&ball, toy.replace("\"left_elbow\" type=\"revolute\"", "\"left_elbow\" type=\"floating\""))
        .unwrap();
    fs::write(&map, gestus_core::robot::layout::MAGIC).unwrap();
    let [db, clip, ball, map, written, qpos, here] =
        [&db, &clip, &ball, &map, &out, &qpos, &folder].map(|p| p.to_str().unwrap());
    let translate = ["translate", "--db", db, "--input", clip, "--style", "proud", "-o", written];
    for (more, said) in [
        (&["--robot", here, "--csv", qpos][..], "--robot "),
        (&["--robot", ball, "--robot-map", here, "--csv", qpos], "--robot-map "),
        (&["--robot", ball, "--qpos", qpos], "ball.urdf: joint `left_elbow`"),
        (&["--robot", clip, "--csv", qpos], "this is a BVH file"),
    ] {
        let (ok, stderr) = gestus(&[&translate[..], more].concat());
        assert!(!ok && stderr.contains(said) && !stderr.contains("over an input"), "{more:?}: {stderr}");
        assert!(!out.exists(), "{more:?}");
    }
    for arguments in [&["inspect", map][..], &["cut", map, "--models-only", "-o", written]] {
        let (ok, stderr) = gestus(arguments);
        assert!(!ok && stderr.contains("map.gestus: it holds the tables of a robot"), "{stderr}");
    }
}

/// A whole clip of blended fragments has no steps and no robot, and its feet are always held: options that are about these
/// were passed over without a word.
#[test]
fn a_whole_clip_takes_no_options_of_streams() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("whole");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let [db, clip, robot, angles, out, page] =
        ["k.gestus", "walk.bvh", "toy.urdf", "a.csv", "out.bvh", "out.html"].map(|n| folder.join(n));
    fs::write(&db, common::blob()).unwrap();
    fs::write(&clip, Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text()).unwrap();
    fs::write(&robot, gestus_motion::formats::urdf::TOY).unwrap();
    let [db, clip, robot, angles, out, page] =
        [&db, &clip, &robot, &angles, &out, &page].map(|p| p.to_str().unwrap());
    let whole = ["translate", "--db", db, "--input", clip, "-o", out, "--method", "effort"];
    let wanted = [&whole[..], &["--effort", "weight=1"]].concat();
    for (options, named) in [
        (&["--robot", robot, "--csv", angles][..], "--robot, --csv would do nothing"),
        (&["--robot", robot, "--trajectory", angles, "--json"], "--robot, --trajectory would"),
        (&["--clean-up"], "--clean-up would"),
        (&["--trace", angles], "--trace would"),
        (&["--no-contact"], "--no-contact would"),
        (&["--action", "walk", "--input-style", "proud"], "--action, --input-style would"),
        (&["--timing", "sync"], "--timing would"),
        (&["--timing", "bounded", "--lead", "0.1", "--lag", "0.1"], "--timing, --lead, --lag would"),
        (&["--safety", "hold"], "--safety would"),
        (&["--preset", "paper"], "--preset would"),
        (&["--mask", "left-arm"], "--mask would"),
        (&["--strength", "left-arm=0.5"], "--strength would"),
        (&["--group-style", "left-arm=proud"], "--group-style would"),
        (&["--ridge", "norm"], "--ridge would"),
        (&["--k", "20"], "--k would"),
        (&["--speed-limit", "0"], "--speed-limit would"),
        (&["--halflife", "1"], "--halflife would"),
    ] {
        let (ok, stderr) = gestus(&[&wanted[..], options].concat());
        assert!(!ok && stderr.contains(named) && stderr.contains("leave out"), "{options:?}: {stderr}");
    }
    assert!(!Path::new(angles).exists() && !Path::new(out).exists());
    let (ok, stderr) = gestus(&whole);
    assert!(!ok && stderr.contains("needs a target: give --effort"), "{stderr}");
    let plain = ["translate", "--db", db, "--input", clip, "-o", out, "--style", "proud", "--labels", angles];
    let (ok, stderr) = gestus(&plain);
    assert!(!ok && stderr.contains("--labels does nothing without --method effort"), "{stderr}");
    // What is so anyway may be said.
    let said =
        ["--timing", "free", "--safety", "follow", "--preset", "default", "--unit", "cm", "--page", page];
    let (ok, stderr) = gestus(&[&wanted[..], &said].concat());
    assert!(ok, "{stderr}");
    assert!(Path::new(out).exists() && Path::new(page).exists());
}

/// Outputs are rated in a table that is written once, and counted when someone has filled it in.
#[test]
fn outputs_are_rated_and_counted() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("outputs");
    let _ = fs::remove_dir_all(&folder);
    fs::create_dir_all(&folder).unwrap();
    let [db, clip, sheet] = ["k.gestus", "walk.bvh", "sheet"].map(|n| folder.join(n));
    fs::write(&db, common::blob()).unwrap();
    fs::write(&clip, Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text()).unwrap();
    let table = sheet.join("outputs.csv");
    let [db, clip, sheet, path] = [&db, &clip, &sheet, &table].map(|p| p.to_str().unwrap());
    let outputs = ["effort", "outputs", "--db", db, "--input", clip, "-o", sheet];
    let (ok, stderr) = gestus(&outputs);
    assert!(ok && Path::new(sheet).join("outputs.html").exists(), "{stderr}");
    let (ok, stderr) = gestus(&outputs);
    assert!(!ok && stderr.contains("is there already"), "{stderr}");
    let (ok, stderr) = gestus(&["effort", "score", path]);
    assert!(!ok && stderr.contains("nothing is rated"), "{stderr}");
    let text = fs::read_to_string(&table).unwrap();
    assert_eq!(text.lines().count(), 7, "{text}");
    fs::write(&table, text.replacen(",\n", ",yes\n", 1)).unwrap();
    let (ok, stderr) = gestus(&["effort", "score", path]);
    assert!(ok, "{stderr}");
}

/// An action that lacks a style is left out of a database; the dial of the others was lost with it.
#[test]
fn a_database_without_one_of_its_actions_has_a_dial() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("dial");
    let _ = fs::remove_dir_all(&folder);
    let [data, db] = ["data", "k.gestus"].map(|n| folder.join(n));
    fs::create_dir_all(&data).unwrap();
    let run = Clip { name: "run_neutral_1".into(), ..common::walk().clone() };
    for clip in common::corpus().examples.iter().map(|e| &e.clip).chain([&run]) {
        let text = Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text();
        fs::write(data.join(format!("{}.bvh", clip.name)), text).unwrap();
    }
    let [data, db] = [&data, &db].map(|p| p.to_str().unwrap());
    let (ok, stderr) = gestus(&["build", "--data", data, "-o", db, "--no-models", "--effort"]);
    assert!(ok, "{stderr}");
    assert_eq!(stderr.matches("1 of action run, which lacks proud").count(), 1, "{stderr}");
    assert!(!stderr.contains("no effort dial"), "{stderr}");
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(["inspect", db, "--json"]).output().unwrap();
    let figures: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    // The names of the styles stand under `styles`; what the dial has of each goes by another name.
    assert_eq!(figures["styles"].as_array().unwrap().len(), 2);
    assert!(figures["effort"]["styles"].is_null());
    for style in ["neutral", "proud"] {
        assert!(figures["effort"]["of_styles"][style]["weight"].is_number(), "{}", figures["effort"]);
    }
    // Two styles are too few to move every factor.
    let fixed = figures["effort"]["fixed"].as_array().unwrap();
    assert_eq!(stderr.contains("the effort dial cannot move "), !fixed.is_empty(), "{stderr}");
    assert!(fixed.iter().all(|factor| stderr.contains(factor.as_str().unwrap())), "{stderr}");
    assert!(!fixed.is_empty(), "{}", figures["effort"]);
    // What the dial does not reach was told twice.
    let [clip, out] = ["data/run_neutral_1.bvh", "out.bvh"].map(|n| folder.join(n));
    let [clip, out] = [&clip, &out].map(|p| p.to_str().unwrap());
    let wanted = "flow=3,weight=3,time=3";
    let (ok, stderr) = gestus(&["translate", "--db", db, "--input", clip, "-o", out, "--effort", wanted]);
    let lines: Vec<&str> = stderr.lines().filter(|line| line.starts_with("--effort: ")).collect();
    assert!(ok && !lines.is_empty() && lines.iter().collect::<HashSet<_>>().len() == lines.len(), "{stderr}");
}

/// The message had the style's number.
#[test]
fn a_style_without_linear_models_is_named() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("few");
    let [data, db] = ["data", "k.gestus"].map(|n| folder.join(n).to_str().unwrap().to_owned());
    let synth = ["synth", "--actions", "walk", "--styles", "neutral,proud", "--clips", "2", "--seconds", "3"];
    let (ok, stderr) = gestus(&[&synth[..], &["-o", &data]].concat());
    assert!(ok, "{stderr}");
    let (ok, stderr) = gestus(&["build", "--data", &data, "--rate", "3", "-o", &db]);
    assert!(ok && stderr.contains("the clips of the style proud are too few"), "{stderr}");
}

/// A robot was blamed where there was no clip.
#[test]
fn a_measure_of_a_database_says_that_a_folder_is_empty() {
    let [folder, _, db] = walks("measure");
    let [none, out] = ["none", "out"].map(|n| folder.join(n));
    fs::create_dir(&none).unwrap();
    let [none, db, out] = [&none, &db, &out].map(|p| p.to_str().unwrap());
    for measure in ["retarget", "servo"] {
        let (ok, stderr) = gestus(&["evaluate", measure, "--db", db, "--data", none, "-o", out]);
        assert!(!ok && stderr.contains("there is no clip in it"), "{stderr}");
    }
}

/// What a board's program needs to know of a database: its capacities and the numbers of what it sets. The columns of the
/// classes did not stand under their heads.
#[test]
fn a_database_is_shown_with_its_groups_and_classes() {
    let [_, _, db] = walks("shown");
    let db = db.to_str().unwrap();
    let shown = |more: &[&str]| {
        let arguments = [&["inspect", db], more].concat();
        let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
        String::from_utf8(output.stdout).unwrap()
    };
    let figures: serde_json::Value = serde_json::from_str(&shown(&["--json"])).unwrap();
    let text = shown(&[]);
    let row = |key: &str| text.lines().find_map(|l| l.trim().strip_prefix(key)).unwrap_or_default().trim();
    assert_eq!(row("groups"), figures["groups"].to_string());
    assert_eq!(row("classes"), figures["classes"].as_array().unwrap().len().to_string());
    let table: Vec<&str> = text.lines().skip_while(|l| !l.contains("k cap")).collect();
    assert_eq!(table.len(), 1 + figures["classes"].as_array().unwrap().len());
    assert!(table.iter().all(|line| line.len() == table[0].len()), "{text}");
}

/// A folder of generated walks in two styles, and the database of them.
fn walks(name: &str) -> [std::path::PathBuf; 3] {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    let [data, db] = ["data", "k.gestus"].map(|n| folder.join(n));
    fs::create_dir_all(&data).unwrap();
    for clip in common::corpus().examples.iter().map(|e| &e.clip) {
        let text = Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text();
        fs::write(data.join(format!("{}.bvh", clip.name)), text).unwrap();
    }
    fs::write(&db, common::blob()).unwrap();
    [folder, data, db]
}

/// The summary counted files, and not why; the lines that it tells now bring the clips back.
#[test]
fn what_is_left_out_is_counted_by_reason_with_the_lines_that_change_it() {
    let [folder, data, _] = walks("left-out");
    let write = |name: &str, clip: &Clip| {
        fs::write(data.join(name), Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
    };
    let mut short = common::walk().clone();
    short.frames.truncate(12);
    // A walk of less than a step, a name without labels, and a file that is none.
    write("walk_proud_still.bvh", &short);
    write("what.bvh", common::walk());
    fs::write(data.join("walk_proud_bad.bvh"), "HIERARCHY").unwrap();
    // In one style alone.
    write("walk_weird_1.bvh", common::walk());
    for style in ["neutral", "weird"] {
        write(&format!("run_{style}_1.bvh"), common::walk());
    }
    let db = folder.join("out.gestus");
    let build = || {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
        command.args(["build", "--no-models", "--json", "--data"]).arg(&data).arg("-o").arg(&db);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    let group = |figures: &serde_json::Value, reason: &str| {
        figures["left_out"].as_array().unwrap().iter().find(|g| g["reason"] == reason).cloned()
    };
    let before = build();
    let counts: Vec<_> = before["left_out"].as_array().unwrap().iter().map(|g| &g["count"]).collect();
    assert_eq!(counts, [1, 1, 1, 2], "{}", before["left_out"]);
    assert_eq!(before["skipped"], 5);
    assert_eq!(before["actions"], serde_json::json!(["walk"]), "{}", before["left_out"]);
    let lines = ["brief", "incomplete"]
        .map(|reason| group(&before, reason).unwrap()["change"].as_str().unwrap().to_owned());
    // As a whole its action would be lost; it has to be longer.
    assert_eq!(lines, ["", "styles = [\"neutral\", \"weird\"]"]);
    fs::write(data.join("gestus.toml"), &lines[1]).unwrap();
    let after = build();
    assert_eq!(after["actions"], serde_json::json!(["run", "walk"]), "{}", after["left_out"]);
    assert!(group(&after, "incomplete").is_none());
}

/// `--strict` passed over an action that lacks a style: the database did without it, and the command succeeded.
#[test]
fn nothing_is_left_out_under_strict() {
    let [folder, data, _] = walks("strict");
    for name in ["run_neutral_1.bvh", "run_weird_1.bvh", "walk_weird_1.bvh"] {
        fs::write(data.join(name), Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text())
            .unwrap();
    }
    fs::write(data.join("walk_weird_2.bvh"), "HIERARCHY").unwrap();
    let db = folder.join("out.gestus");
    let _ = fs::remove_file(&db);
    let [data, db] = [&data, &db].map(|p| p.to_str().unwrap());
    let build = ["build", "--data", data, "-o", db, "--no-models", "--strict"];
    let (ok, stderr) = gestus(&build);
    assert!(!ok && !Path::new(db).exists(), "{stderr}");
    for wanted in [
        "files or clips that can't be used: 3 (--strict",
        "walk_weird_2.bvh:1:",
        "of action run, which lacks proud (run_neutral_1, run_weird_1)",
        "    styles = [\"neutral\", \"weird\"]",
    ] {
        assert!(stderr.contains(wanted), "{wanted}: {stderr}");
    }
    // With the lines it builds, of all that is selected.
    fs::remove_file(Path::new(data).join("walk_weird_2.bvh")).unwrap();
    fs::write(Path::new(data).join("gestus.toml"), "styles = [\"neutral\", \"weird\"]").unwrap();
    let (ok, stderr) = gestus(&build);
    assert!(ok && Path::new(db).exists(), "{stderr}");
}

/// Options that do nothing were passed over without a word, and names that nothing has with them.
#[test]
fn measures_say_what_they_do_not_use() {
    let [folder, data, db] = walks("measures");
    let text = Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text();
    fs::write(data.join("09.bvh"), text).unwrap();
    let out = folder.join("out");
    let [data, db, out] = [&data, &db, &out].map(|p| p.to_str().unwrap());
    let measure = |what: &str, options: &[&str]| {
        gestus(&[&["evaluate", what, "--data", data, "-o", out][..], options].concat())
    };
    for (what, options, said) in [
        ("skate", &["--robot", "nofile"][..], "unexpected argument '--robot'"),
        ("loo", &["--splits", "3"], "unexpected argument '--splits'"),
        ("loo", &["--from", "nosuch"], "no style `nosuch`"),
        ("loo", &["--to", "nosuch"], "no style `nosuch`"),
        ("loo", &["--actions", "nosuch"], "no action is called `nosuch`"),
        ("loo", &["--folds", "-1"], "invalid value '-1' for '--folds"),
        ("timing", &["--lead", "-1"], "--lead -1: seconds from 0 to 10"),
    ] {
        let (ok, stderr) = measure(what, options);
        assert!(!ok && stderr.contains(said), "{what} {options:?}: {stderr}");
    }
    // Options that are common to all measures are never refused.
    let common = ["--actions", "nosuch", "--styles", "nosuch", "--folds", "0", "--from", "no", "--to", "no"];
    let of_clips = ["--rate", "30", "--limit", "1", "--joints", "no", "--groups", "no", "--strict"];
    for what in ["retarget", "servo"] {
        let (ok, stderr) = measure(what, &[&["--db", db][..], &common, &of_clips].concat());
        assert!(ok, "{stderr}");
        let options = common.iter().chain(&of_clips).filter(|word| word.starts_with("--"));
        for option in options {
            assert_eq!(stderr.matches(&format!("{option} has no effect")).count(), 1, "{stderr}");
        }
        // Each clip is of the class that its name says, and of none where it says nothing.
        let json = fs::read_to_string(Path::new(out).join(format!("{what}.json"))).unwrap();
        let table: serde_json::Value = serde_json::from_str(&json).unwrap();
        let rows = table["rows"].as_array().unwrap();
        assert!(rows.iter().any(|row| row["clip"] == "09"));
        for row in rows {
            let named = row["clip"] != "09";
            assert_eq!(row["action"] == "walk", named, "{row}");
            assert_eq!(row["style"].is_string(), named, "{row}");
        }
    }
    let (ok, stderr) = measure("knn", &["--db", "nosuch.gestus", "--to", "nosuch", "--folds", "5"]);
    assert!(ok, "{stderr}");
    for said in
        ["--db has no effect", "--to has no effect", "--folds 5: walk has 2 clips in the style neutral"]
    {
        assert!(stderr.contains(said), "{said}: {stderr}");
    }
}

/// `--rate -5` was "unexpected argument '-5'", and `build --config FILE` read the folder that one stood in.
#[test]
fn builds_take_numbers_as_numbers_and_a_configuration_for_its_folder() {
    let [folder, data, db] = walks("build");
    fs::write(data.join("mine.toml"), "[build]\nmodels = false\n").unwrap();
    let elsewhere = folder.join("elsewhere");
    fs::create_dir_all(&elsewhere).unwrap();
    let build = |config: &str, options: &[&str]| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
        command.current_dir(&elsewhere).args(["build", "--config", config, "--no-effort", "-o"]).arg(&db);
        let output = command.args(options).output().unwrap();
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    let (ok, stderr) = build("../data/mine.toml", &["--actions", "walk, walk"]);
    assert!(ok, "{stderr}");
    for (options, said) in [
        (["--rate", "-5"], "--rate -5: frames a second from 1 to 1000"),
        (["--limit", "-1"], "invalid value '-1' for '--limit"),
    ] {
        let (ok, stderr) = build("../data/mine.toml", &options);
        assert!(!ok && stderr.contains(said), "{stderr}");
    }
}

/// Programs that call the command found nothing on standard output where it failed.
#[test]
fn a_command_that_fails_says_so_in_json_too() {
    let [folder, data, db] = walks("json");
    let [data, db] = [&data, &db].map(|p| p.to_str().unwrap());
    let [out, none] = ["out", "none.bvh"].map(|n| folder.join(n).to_str().unwrap().to_owned());
    fs::write(folder.join("data/bad.bvh"), "no clip").unwrap();
    let translate = ["translate", "--json", "--db", db, "--style", "proud", "-o", &out, "--input"];
    for (arguments, key, said) in [
        (vec!["--json"], "error", "gestus <COMMAND>"),
        (vec!["inspect", "--json", &none], "error", "none.bvh"),
        (vec!["inspect", "--json", db, "--no-such"], "error", "--no-such"),
        ([&translate[..], &[&none]].concat(), "error", "none.bvh"),
        // It tells its results, among them what failed.
        ([&translate[..], &[data]].concat(), "clips", "bad.bvh"),
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(&arguments).output().unwrap();
        assert!(!output.status.success() && !output.stderr.is_empty(), "{arguments:?}");
        let object: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(object[key].to_string().contains(said), "{arguments:?}: {object}");
    }
}

/// A closed standard error, as behind `2>&1 | head -1`, ended the command in a panic.
#[test]
fn a_command_goes_on_where_nobody_reads_its_notes() {
    let [folder, data, db] = walks("notes");
    let clip = fs::read_dir(data).unwrap().next().unwrap().unwrap().path();
    let out = folder.join("out.bvh");
    let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
    command.args(["translate", "--style", "proud", "--db"]).arg(db).arg("--input").arg(clip).arg("-o");
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    assert!(command.arg(&out).stderr(writer).status().unwrap().success());
    assert!(out.is_file());
}

/// Each of these ended in a panic, most of them after they had done their work.
#[cfg(unix)]
#[test]
fn names_need_not_be_text() {
    use std::{ffi::OsStr, os::unix::ffi::OsStrExt};
    let [folder, data, db] = walks("names");
    let odd = |end: &str| folder.join(OsStr::from_bytes(&[b"\xff", end.as_bytes()].concat()));
    fs::create_dir(odd("data")).unwrap();
    for file in fs::read_dir(data).unwrap().map(Result::unwrap) {
        fs::copy(file.path(), odd("data").join(file.file_name())).unwrap();
        fs::copy(file.path(), odd("in.bvh")).unwrap();
    }
    fs::copy(&db, odd("k.gestus")).unwrap();
    let [db, clip, data] = ["k.gestus", "in.bvh", "data"].map(odd);
    let run = |words: &[&str], files: &[(&str, &Path)], output: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
        command.args(words).arg("--json");
        for (option, file) in files {
            command.args((!option.is_empty()).then_some(option)).arg(file);
        }
        let output = command.arg("-o").arg(odd(output)).output().unwrap();
        assert!(output.status.success(), "{words:?}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap()
    };
    run(&["translate", "--style", "proud"], &[("--db", &db), ("--input", &clip)], "one.bvh");
    let all = run(&["translate", "--style", "proud"], &[("--db", &db), ("--input", &data)], "all");
    assert_eq!(all["translated"], common::corpus().examples.len());
    run(&["export"], &[("", &db)], "export");
    run(&["cut", "--models-only"], &[("", &db)], "cut.gestus");
    run(&["transfer"], &[("--input", &clip), ("--reference", &clip)], "transfer.bvh");
    run(&["loop", "--style", "neutral"], &[("--data", &data)], "loop.bvh");
    run(&["graph", "--seconds", "2"], &[("--data", &data)], "graph.bvh");
    run(&["effort", "outputs"], &[("--db", &db), ("--input", &clip)], "outputs");
    run(&["effort", "sheet"], &[("--data", &data)], "sheet");
}

/// One of the two was ignored without a word, and clips were counted that did not exist.
#[test]
fn what_would_be_ignored_is_refused() {
    let [folder, data, db] = walks("twice");
    let [input, output, other] = ["in.bvh", "out.bvh", "generated"].map(|name| folder.join(name));
    fs::write(&input, Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text()).unwrap();
    let [data, db, input, output, other] = [&data, &db, &input, &output, &other].map(|p| p.to_str().unwrap());
    let build = ["build", "--data", data, "-o", output];
    let translate = ["translate", "--db", db, "--input", input, "--style", "proud", "-o", output];
    let transfer = ["transfer", "--input", input, "--reference", input, "-o", output];
    let synth = ["synth", "-o", other, "--clips", "1", "--seconds", "2"];
    for (call, more, said) in [
        (&build[..], &["--groups", "a=Hand_L,a=Hand_R"][..], "--groups: `a` is given twice"),
        (&translate, &["--strength", "left-arm=0.5,left-arm=2"], "--strength: `left-arm` is given twice"),
        (&translate, &["--strength", "left-arm"], "--strength left-arm: how strong? Write left-arm=0.5"),
        (&translate, &["--group-style", "left-arm=proud,left-arm=neutral"], "--group-style: `left-arm`"),
        (&transfer, &["--floor", "1e9"], "--floor 1000000000: metres"),
        (&synth, &["--actions", "walk,walk"], "--actions: `walk` is given twice"),
        (&["evaluate", "timing", "--data", data, "-o", output], &["--to", "proud,proud"], "--to: `proud`"),
        (
            &["evaluate", "timing", "--data", data, "-o", output],
            &["--from", "proud", "--to", "proud"],
            "--to proud",
        ),
    ] {
        let (ok, stderr) = gestus(&[call, more].concat());
        assert!(!ok && stderr.contains(said), "{more:?}: {stderr}");
    }
    // Clips of an earlier call would be built as well.
    let of = |style| gestus(&[&synth[..], &["--actions", "walk", "--styles", style]].concat());
    assert!(of("neutral,proud").0 && of("neutral,proud").0);
    let (ok, stderr) = of("neutral");
    assert!(!ok && stderr.contains("walk_proud_000.bvh"), "{stderr}");
    // The rate is kept to the last digit.
    let rate = ["--rate", "29.97", "--actions", "walk", "--styles", "neutral,proud"];
    assert!(gestus(&[&synth[..], &rate].concat()).0);
    let config = fs::read_to_string(folder.join("generated/gestus.toml")).unwrap();
    assert!(config.contains("rate_hz = 29.97\n"), "{config}");
}

/// The body was pulled to the floor by the plants of the walk, without a word.
#[test]
fn a_transfer_says_which_footplants_it_does_not_hold() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("footplants");
    fs::create_dir_all(&folder).unwrap();
    let file = |action: &str, style: &str| {
        let clip = gestus_database::synth::performance(3, action, style, 30.0, 4.0).unwrap().clip;
        let path = folder.join(format!("{action}_{style}.bvh"));
        fs::write(&path, Bvh::from_clip(&clip, Unit::Centimetres).unwrap().to_text()).unwrap();
        path.to_str().unwrap().to_owned()
    };
    let [walk, run, old] = [file("walk", "neutral"), file("run", "proud"), file("walk", "old")];
    let output = folder.join("out.bvh");
    let transfer = |reference: &str| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_gestus"));
        command.args(["transfer", "--input", &walk, "--reference", reference, "--json", "-o"]).arg(&output);
        let output = command.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{said}");
        (said, serde_json::from_slice::<serde_json::Value>(&output.stdout).unwrap())
    };
    let (said, json) = transfer(&run);
    assert!(said.contains("doubt: of ") && said.contains(" footplants of the clip, "), "{said}");
    assert!(json["footplants_dropped"].as_u64() > Some(0) && json["doubts"][0].is_string(), "{json}");
    let (said, json) = transfer(&old);
    assert!(!said.contains("doubt"), "{said}");
    assert!(json["footplants"].as_u64() > Some(0) && json["footplants_dropped"] == 0, "{json}");
    assert_eq!(json["doubts"].as_array().map(Vec::len), Some(0), "{json}");
}
