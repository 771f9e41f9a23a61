//! The command `gestus`, as somebody calls it: what it refuses before it does anything.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{fs, path::Path, process::Command};

use gestus_builder::bvh::{Bvh, Unit};

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
        ["k.gestus", "data/walk_a_1.bvh", "toy.urdf", "page.html"].map(|n| folder.join(n));
    fs::write(&db, common::blob()).unwrap();
    let text = Bvh::from_clip(common::walk(), Unit::Centimetres).unwrap().to_text();
    fs::write(&clip, &text).unwrap();
    fs::write(&robot, include_str!("../assets/toy.urdf")).unwrap();
    let [db, clip, robot, page] = [&db, &clip, &robot, &page].map(|p| p.to_str().unwrap());
    let data = folder.join("data");
    let data = data.to_str().unwrap();
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
        ([&translate[..], &["-o", page, "--page", page]].concat(), "goes there too"),
        ([&translate[..], &["-o", page, "--robot", robot, "--csv", robot]].concat(), "--csv "),
        ([&translate[..], &["-o", page, "--robot", robot]].concat(), "nothing is asked of it"),
        ([&translate[..], &["-o", page, "--k", "0"]].concat(), "k.gestus: --k 0: from 1 to 64"),
        (
            [&translate[..], &["-o", page, "--mask", "tail"]].concat(),
            "k.gestus: the database has no joint group `tail`",
        ),
        ([&translate[..], &["-o", page, "--lead", "1"]].concat(), "--lead does nothing"),
    ] {
        let (ok, stderr) = gestus(&arguments);
        assert!(!ok && stderr.contains(said), "{arguments:?}: {stderr}");
    }
    assert_eq!(fs::read(db).unwrap(), common::blob());
    assert_eq!(fs::read_to_string(clip).unwrap(), text);
    let (ok, stderr) = gestus(&[&translate[..], &["-o", folder.join("out.bvh").to_str().unwrap()]].concat());
    assert!(ok, "{stderr}");
}
