//! BVH in and out on small documents: what is read, what each error says, what comes back.

use gestus_motion::{
    animation::Recording,
    binding::{Binding, ConvertError, Options, to_clip},
    capture::read_folder,
    formats::bvh::{Bvh, BvhErrorKind as Kind, MAX_DEPTH},
    unit::Unit,
};

const SMALL: &str = "HIERARCHY
ROOT Hips
{
\tOFFSET 0 90 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT Foot
\t{
\t\tOFFSET 0 -85 0
\t\tCHANNELS 3 Yrotation Xrotation Zrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0 -5 20
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.0333333
1 91 2 10 20 30 40 50 60
2 92 3 11 21 31 41 51 61
";

fn parse(text: &str) -> Bvh {
    Bvh::parse(text.as_bytes(), "small.bvh").unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn forms_of_white_space_and_case_are_one_document() {
    let document = parse(SMALL);
    assert_eq!(document.to_text(), SMALL);
    assert_eq!(document.rate_hz(), 30.0);
    let forms = [
        SMALL.replace('\n', "\r\n"),
        SMALL.replace('\n', "\r"),
        SMALL.replace('\n', "\n\n \t\n"),
        SMALL.replace(' ', " \t  "),
        SMALL.replace('\t', ""),
        format!("\u{feff}{SMALL}"),
        SMALL.trim_end().to_string(),
        SMALL.replace("OFFSET", "Offset").replace("position", "POSITION").replace("MOTION", "motion"),
        SMALL.replace("Frames: ", "Frames:").replace("Frame Time: ", "Frame Time :\t"),
        SMALL.replace("\n{", " {").replace("End Site", "end"),
        SMALL.replace(" 91 ", " +9.1E1 ").replace("-85", "-85.000"),
    ];
    for form in forms {
        assert_eq!(parse(&form), document, "{form}");
    }
}

#[test]
fn every_error_names_its_place_and_what_to_do() {
    let deep = format!(
        "HIERARCHY\nROOT a {{\n{}",
        (0..=MAX_DEPTH).map(|i| format!("JOINT j{i} {{\n")).collect::<String>()
    );
    let frames = |rows: &str| SMALL.split("1 91").next().unwrap_or_default().to_string() + rows;
    // What is wrong, the text, the place, and words that the message must hold.
    let cases: Vec<(&str, String, (usize, usize), &str)> = vec![
        (
            "empty",
            String::new(),
            (1, 1),
            "expected HIERARCHY, found the end of the file; is this a BVH file?",
        ),
        ("another format", "solid cube".into(), (1, 1), "expected HIERARCHY, found `solid`"),
        ("no root", SMALL.replace("ROOT", "JOINT"), (2, 1), "expected ROOT"),
        ("no name", SMALL.replace("JOINT Foot", "JOINT"), (7, 2), "expected the joint's name"),
        ("no brace", SMALL.replacen("{", "", 1), (4, 2), "expected {"),
        ("bad word", SMALL.replace("JOINT", "BONE"), (6, 2), "found `BONE`"),
        (
            "cut hierarchy",
            SMALL.split("\tJOINT").next().unwrap_or_default().into(),
            (6, 1),
            "expected a closing brace, found the end",
        ),
        ("no motion", SMALL.split("MOTION").next().unwrap_or_default().into(), (16, 1), "no MOTION part"),
        ("brace too many", SMALL.replace("MOTION", "}\nMOTION"), (16, 1), "expected MOTION, found `}`"),
        ("two roots", SMALL.replace("MOTION", "ROOT Other"), (16, 1), "second ROOT"),
        ("same name", SMALL.replace("Foot", "Hips"), (6, 8), "(the first is on line 2)"),
        ("two offsets", SMALL.replace("\tJOINT", "\tOFFSET 1 2 3\n\tJOINT"), (6, 2), "second OFFSET"),
        ("no offset", SMALL.replace("\t\tOFFSET 0 -85 0\n", ""), (13, 2), "`Foot` has no OFFSET"),
        ("late channels", SMALL.replace("}\nMOTION", "CHANNELS 0\n}\nMOTION"), (15, 1), "second CHANNELS"),
        ("channel count", SMALL.replace("CHANNELS 3", "CHANNELS 7"), (9, 12), "from 0 to 6, found `7`"),
        ("channel missing", SMALL.replace("CHANNELS 3", "CHANNELS 4"), (10, 3), "expected a channel"),
        (
            "channel more",
            SMALL.replace("CHANNELS 3", "CHANNELS 2"),
            (9, 34),
            "more channel names than the expected 2",
        ),
        (
            "channel twice",
            SMALL.replace("Yrotation X", "Xrotation X"),
            (9, 24),
            "names the channel Xrotation twice",
        ),
        (
            "no channels",
            SMALL
                .replace("CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation", "")
                .replace("CHANNELS 3 Yrotation Xrotation Zrotation", ""),
            (16, 7),
            "no joint has a channel",
        ),
        ("deep", deep, (MAX_DEPTH + 2, 1), "more than 256 deep"),
        ("end site", SMALL.replace("OFFSET 0 -5 20", ""), (13, 3), "expected OFFSET, found `}`"),
        ("no frames line", SMALL.replace("Frames:", ""), (17, 2), "expected Frames"),
        ("frames", SMALL.replace("Frames: 2", "Frames: two"), (17, 9), "whole number of frames, found `two`"),
        ("frames below zero", SMALL.replace("Frames: 2", "Frames: -2"), (17, 9), "found `-2`"),
        (
            "lying",
            SMALL.replace("Frames: 2", "Frames: 18446744073709551615"),
            (17, 9),
            "promises 18446744073709551615 frames, found 2",
        ),
        ("lying less", SMALL.replace("Frames: 2", "Frames: 0"), (17, 9), "promises 0 frames, found 2"),
        ("no frames", frames(""), (17, 9), "has no frames"),
        (
            "nothing after motion",
            SMALL.split("Frames").next().unwrap_or_default().into(),
            (16, 7),
            "has no frames",
        ),
        ("zero time", SMALL.replace("0.0333333", "0"), (18, 13), "frame time from 0.000001 to 1 second"),
        (
            "short time",
            SMALL.replace("0.0333333", "1e-12"),
            (18, 13),
            "from 0.000001 to 1 second, found `1e-12`",
        ),
        (
            "no time",
            SMALL.replace(" 0.0333333\n1 91", "\n-1.367468 91"),
            (18, 12),
            "expected a frame time in seconds, found the end of the line; 30 frames",
        ),
        (
            "no time before a value that would be one",
            SMALL.replace(" 0.0333333\n1 91", "\n0.5 91"),
            (18, 12),
            "expected a frame time in seconds, found the end of the line",
        ),
        (
            "no count",
            SMALL.replace("Frames: 2", "Frames:"),
            (17, 8),
            "expected a number of frames, found the end of the line",
        ),
        ("no MOTION line", SMALL.replace("MOTION\n", ""), (16, 1), "write a line MOTION before it"),
        ("milliseconds", SMALL.replace("0.0333333", "33.3333"), (18, 13), "is it in milliseconds"),
        ("negative time", SMALL.replace("0.0333333", "-0.03"), (18, 13), "found `-0.03`"),
        ("comma time", SMALL.replace("0.0333333", "0,0333333"), (18, 13), "decimal comma"),
        ("fewer", frames("1 2 3\n1 2 3 4 5 6 7 8 9\n"), (19, 6), "frame 1 has 3 values, expected 9"),
        ("fewer at the end", frames("1 2 3 4 5 6 7 8 9\n1 2"), (20, 4), "frame 2 has 2 values"),
        ("more", frames("1 2 3 4 5 6 7 8 9 10\n"), (19, 19), "frame 1 has more than the expected 9"),
        ("nan", SMALL.replace("92", "nan"), (20, 3), "finite number, found `nan`"),
        ("inf", SMALL.replace("92", "-inf"), (20, 3), "finite number, found `-inf`"),
        ("old nan", SMALL.replace("92", "-1.#IND"), (20, 3), "finite number"),
        ("overflow", SMALL.replace("92", "1e999"), (20, 3), "too large"),
        ("comma", SMALL.replace("92", "92,5"), (20, 3), "decimal comma"),
        ("word", SMALL.replace("92", "9z2"), (20, 3), "expected a number, found `9z2`"),
        ("two points", SMALL.replace("92", "1.2.3"), (20, 3), "expected a number, found `1.2.3`"),
        ("lone sign", SMALL.replace("92", "-"), (20, 3), "expected a number, found `-`"),
        ("far", SMALL.replace("92", "1e11"), (20, 3), "the length `1e11` is beyond 1e10"),
        ("farther", SMALL.replace("92", "-1e300"), (20, 3), "the length `-1e300`"),
        ("long bone", SMALL.replace("-85", "1e11"), (8, 12), "the length `1e11`"),
        ("long end", SMALL.replace("-5", "1e11"), (12, 13), "the length `1e11`"),
        ("turned", SMALL.replace(" 31 ", " 1e39 "), (20, 14), "the angle `1e39` is beyond 1e7 degrees"),
    ];
    let mut wrong = Vec::new();
    for (what, text, (line, column), words) in cases {
        let error = Bvh::parse(text.as_bytes(), "bad.bvh").expect_err(what);
        let message = error.to_string();
        if !message.starts_with(&format!("bad.bvh:{line}:{column}: ")) || !message.contains(words) {
            wrong.push(format!("{what}: {message}"));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    let late = "HIERARCHY ROOT a { OFFSET 0 0 0 JOINT b { OFFSET 0 0 0 } CHANNELS 0 }";
    assert!(matches!(Bvh::parse(late.as_bytes(), "").unwrap_err().kind, Kind::LateChannels { .. }));
    let latin = [b"HIERARCHY\nROOT H".as_slice(), &[0xfc, b'f', b't', b'e']].concat();
    let error = Bvh::parse(&latin, "latin.bvh").unwrap_err();
    assert_eq!((error.line, error.column, error.kind), (2, 7, Kind::NotUtf8));
    assert_eq!(Bvh::parse(b"\x89PNG\r\n", "picture.bvh").unwrap_err().kind, Kind::Binary);
}

#[test]
fn positions_replace_offsets_and_channels_go_in_their_order() {
    let (clip, binding) =
        to_clip(&parse(SMALL), &Options { unit: Some(Unit::Centimetres), root: None }).unwrap();
    assert!((clip.frames[0].root - nalgebra::Vector3::new(0.01, 0.91, 0.02)).norm() < 1e-12);
    assert!((clip.skeleton.offsets[1].y + 0.85).abs() < 1e-12);
    let axis = |a: usize, degrees: f64| {
        let axis = nalgebra::Unit::new_unchecked(nalgebra::Vector3::ith(a, 1.0));
        nalgebra::UnitQuaternion::from_axis_angle(&axis, f64::to_radians(degrees))
    };
    let hips = axis(2, 10.0) * axis(0, 20.0) * axis(1, 30.0);
    let foot = axis(1, 40.0) * axis(0, 50.0) * axis(2, 60.0);
    assert!(clip.frames[0].rotations[0].angle_to(&hips) < 1e-7);
    assert!(clip.frames[0].rotations[1].angle_to(&foot) < 1e-7);
    assert!(binding.notes().is_empty());
    assert_eq!(binding.write(&parse(SMALL), &clip).unwrap(), parse(SMALL));
}

#[test]
fn a_carrier_above_the_hips_is_applied_dropped_and_written_back() {
    let inner = SMALL.split("ROOT").nth(1).and_then(|s| s.split("MOTION").next()).unwrap();
    let text = format!(
        "HIERARCHY ROOT joint_Root {{ OFFSET 1 2 3 CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation \
         Yrotation JOINT {inner} }}\nMOTION Frames: 1 Frame Time: 0.01\n0 10 0 0 0 90 1 80 2 10 20 30 40 50 60\n"
    );
    let document = parse(&text);
    let (clip, binding) = to_clip(&document, &Options::default()).unwrap();
    assert_eq!(clip.skeleton.names, ["Hips", "Foot"]);
    assert_eq!(clip.rate_hz, 100.0);
    // A quarter turn about Y takes X to -Z and Z to X.
    assert!((clip.frames[0].root - nalgebra::Vector3::new(0.02, 0.9, -0.01)).norm() < 1e-12);
    assert_eq!(binding.write(&document, &clip).unwrap(), document);
    // The same with a joint between the two that never moves: the carrier was taken for the hips.
    for (channels, values) in [("0", ""), ("3 Zrotation Xrotation Yrotation", "0 0 0 ")] {
        let (head, tail) = text.split_once("JOINT").unwrap();
        let pivot = format!("{head}JOINT pivot {{ OFFSET 0 0 0 CHANNELS {channels} JOINT{tail}")
            .replacen("}\nMOTION", "}}\nMOTION", 1)
            .replacen("0 10 0 0 0 90 ", &format!("0 10 0 0 0 90 {values}"), 1);
        let between = parse(&pivot);
        let (same, binding) = to_clip(&between, &Options::default()).unwrap();
        assert_eq!((&same.skeleton.names, &same.frames), (&clip.skeleton.names, &clip.frames));
        assert_eq!(binding.write(&between, &same).unwrap(), between);
    }
    let named = Options { root: Some("joint_Root".into()), ..Options::default() };
    assert_eq!(to_clip(&document, &named).unwrap().0.skeleton.joints(), 3);
    let missing = Options { root: Some("Pelvis".into()), ..Options::default() };
    let expected =
        ConvertError::NoSuchRoot { name: "Pelvis".into(), joints: "joint_Root, Hips, Foot".into() };
    assert_eq!(Binding::new(&document, &missing).unwrap_err(), expected);
}

/// The body's rise and fall was lost, since the armature was taken for its hips.
#[test]
fn an_armature_that_also_carries_a_camera_is_not_the_hips() {
    let turns = "CHANNELS 3 Zrotation Xrotation Yrotation";
    let moves = "CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation";
    let limb =
        ["a", "b", "c", "d"].iter().rev().fold("End Site { OFFSET 0 1 0 }".to_owned(), |below, name| {
            format!("JOINT {name} {{ OFFSET 0 10 0 {turns} {below} }}")
        });
    let text = |armature: f64| {
        let frame = |height: f64| format!("{armature} 0 0 0 0 0 0 {height} 0 0 0 0 {}", "0 ".repeat(3 * 5));
        format!(
            "HIERARCHY ROOT Figure {{ OFFSET 0 0 0 {moves} JOINT groin {{ OFFSET 0 90 0 {moves} {limb} }} \
             JOINT camera {{ OFFSET 0 0 99 {turns} End Site {{ OFFSET 0 0 1 }} }} }}\n\
             MOTION Frames: 3 Frame Time: 0.1\n{}\n{}\n{}\n",
            frame(90.0),
            frame(95.0),
            frame(90.0).replacen(&armature.to_string(), "0", 1),
        )
    };
    let names = |text: &str| to_clip(&parse(text), &Options::default()).unwrap().0.skeleton.names.clone();
    assert_eq!(names(&text(0.0)), ["groin", "a", "b", "c", "d"]);
    // One that moves carries the body itself.
    assert_eq!(names(&text(7.0))[0], "Figure");
}

#[test]
fn a_clip_without_a_document_is_written_and_read() {
    let (clip, _) = to_clip(&parse(SMALL), &Options::default()).unwrap();
    let text = Bvh::from_clip(&clip, Unit::Metres).unwrap().to_text();
    let options = Options { unit: Some(Unit::Metres), root: None };
    let (back, _) = to_clip(&parse(&text), &options).unwrap();
    assert_eq!(back.skeleton.names, clip.skeleton.names);
    assert_eq!(back.rate_hz, clip.rate_hz);
    for (a, b) in clip.frames.iter().zip(&back.frames) {
        assert!((a.root - b.root).norm() < 2e-6);
        assert!(a.rotations.iter().zip(&b.rotations).all(|(p, q)| p.angle_to(q).to_degrees() < 1e-4));
    }
}

#[test]
fn another_skeleton_or_document_is_refused() {
    let (clip, binding) = to_clip(&parse(SMALL), &Options::default()).unwrap();
    let other = parse(&SMALL.replace("Foot", "Paw"));
    let error = binding.write(&other, &clip).unwrap_err();
    assert!(matches!(error, ConvertError::OtherDocument { .. }), "{error}");
    let (paw, _) = to_clip(&other, &Options::default()).unwrap();
    let error = binding.write(&parse(SMALL), &paw).unwrap_err();
    assert!(matches!(error, ConvertError::OtherSkeleton { .. }), "{error}");
}

/// The file's name is said by whoever reads it: `bad.bvh: bad.bvh: frame 2 ...` was said once.
#[test]
fn what_is_too_large_for_its_unit_is_refused_without_the_files_name() {
    let metres = Options { unit: Some(Unit::Metres), root: None };
    let far = to_clip(&parse(&SMALL.replace("92", "1e8")), &metres).unwrap_err();
    assert!(
        matches!(far, ConvertError::TooFar { frame: 2, metres } if (metres / 1e8 - 1.0).abs() < 1e-6),
        "{far}"
    );
    let long = to_clip(&parse(&SMALL.replace("-85", "-850")), &metres).unwrap_err();
    assert_eq!(long, ConvertError::TooLong { joint: "Foot".into(), metres: 850.0 });
    for error in [far, long] {
        assert!(!error.to_string().contains("small.bvh"), "{error}");
    }
    let whole = SMALL.replace(" 31 ", " 3600031 ");
    assert!(to_clip(&parse(&whole), &Options::default()).is_ok(), "many turns are motion");
}

/// macOS puts a `._walk.bvh` beside a `walk.bvh` on foreign discs; it is no motion.
#[test]
fn hidden_files_and_folders_are_no_clips() {
    let folder = std::env::temp_dir().join(format!("gestus-hidden-{}", std::process::id()));
    std::fs::create_dir_all(folder.join(".trash")).unwrap();
    for (name, text) in [("a.bvh", SMALL), ("._a.bvh", "\0\u{5}"), (".b.bvh", SMALL), (".trash/c.bvh", SMALL)]
    {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let read = read_folder(&folder).unwrap();
    assert_eq!(read.documents.len(), 1);
    // A folder that is named is read, whatever its name.
    assert_eq!(read_folder(&folder.join(".trash")).unwrap().documents.len(), 1);
    std::fs::remove_dir_all(&folder).unwrap();
}

/// Files of SOMA state each joint's rotation at rest behind its offset; channels hold the whole rotation.
#[test]
fn rotations_behind_offsets_are_read_over() {
    let text = SMALL.replace("OFFSET 0 -85 0", "OFFSET 0 -85 0 89.9 0.2 -1e-9");
    let (plain, turned) = (Bvh::parse(SMALL.as_bytes(), "a.bvh"), Bvh::parse(text.as_bytes(), "a.bvh"));
    let (plain, turned) = (plain.unwrap(), turned.unwrap());
    assert_eq!(plain.to_text(), turned.to_text());
    assert!(plain.notes().is_empty() && turned.notes()[0].contains("rotations at rest"));
    let short = SMALL.replace("OFFSET 0 -85 0", "OFFSET 0 -85 0 89.9");
    assert!(matches!(Bvh::parse(short.as_bytes(), "a.bvh").unwrap_err().kind, Kind::NotANumber { .. }));
}

#[test]
fn a_file_that_cannot_be_read_is_listed() {
    let folder = std::env::temp_dir().join(format!("gestus-bvh-{}", std::process::id()));
    std::fs::create_dir_all(folder.join("inner")).unwrap();
    for (name, text) in [("b.bvh", SMALL), ("inner/a.BVH", SMALL), ("c.bvh", "nothing"), ("d.txt", "no")] {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let read = read_folder(&folder).unwrap();
    let names: Vec<_> =
        read.documents.iter().map(|(p, _)| p.strip_prefix(&folder).unwrap().to_owned()).collect();
    assert_eq!(names, [std::path::Path::new("b.bvh"), std::path::Path::new("inner/a.BVH")]);
    assert_eq!(read.skipped.len(), 1);
    assert!(read.summary().starts_with("read 2 clips, skipped 1 files"));
    assert!(read.skipped[0].file().ends_with("c.bvh"));
    std::fs::remove_dir_all(&folder).unwrap();
    assert!(read_folder(&folder).is_err());
}
