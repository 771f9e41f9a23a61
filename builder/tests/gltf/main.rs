//! glTF on files that are made here: the motion that was put in comes out, whatever it was wrapped in, and each error
//! says where and what to do.

#[allow(dead_code, reason = "other tests use more of it")]
#[path = "../common/mod.rs"]
mod common;
mod made;
mod packed;

use std::{fs, path::Path, process::Command};

use base64::{Engine, engine::general_purpose::STANDARD};
use gestus_database::data_folder::{config::Config, load::load};
use gestus_motion::{
    animation::{Animation, Recording},
    binding::{Binding, Options, to_clip},
    capture::{CaptureError, read, read_folder},
    clip::{Clip, Frame},
    files::FileError,
    formats::{
        bvh::{AsBvh, Bvh},
        gltf::{Gltf, GltfError, GltfErrorKind, parse},
    },
    unit::Unit,
};
use nalgebra::Vector3;
use serde_json::{Value, json};

use made::{Made, act, armature, rig, walk};

fn nothing_beside(_: &Path) -> Result<Vec<u8>, FileError> {
    Err(FileError::Io("not found".into()))
}

fn one(bytes: &[u8]) -> Result<Animation, GltfError> {
    Ok(parse(bytes, "hero.glb", &nothing_beside)?.remove(0).1)
}

fn clip(document: &impl Recording) -> Clip {
    to_clip(document, &Options::default()).unwrap().0
}

/// Largest distance of a joint, metres.
fn apart(a: &Clip, b: &Clip) -> f64 {
    assert_eq!((a.frames.len(), &a.skeleton.names), (b.frames.len(), &b.skeleton.names));
    let joints = |(f, g): (&Frame, &Frame)| {
        let (p, q) = (f.positions(&a.skeleton), g.positions(&b.skeleton));
        p.iter().zip(&q).map(|(p, q)| (p - q).norm()).fold(0.0, f64::max)
    };
    a.frames.iter().zip(&b.frames).map(joints).fold(0.0, f64::max)
}

#[test]
fn a_body_below_an_armature_moves_as_it_did() {
    let document = one(&walk().glb()).unwrap();
    let read = clip(&document);
    assert_eq!(read.rate_hz, common::walk().rate_hz);
    let off = apart(common::walk(), &read);
    assert!(off < 2e-6, "{off} m");
    assert_eq!(Binding::new(&document, &Options::default()).unwrap().notes(), [""; 0]);
    // Where the armature scales otherwise, the body is a giant's or a mite's: it is taken for an adult, and that is said.
    for (scale, unit) in [(1.0, Unit::Centimetres), (1e-4, Unit::Other(100.0))] {
        let mut made = walk();
        made.json["nodes"][1]["scale"] = json!([scale, scale, scale]);
        let animation = one(&made.glb()).unwrap();
        let binding = Binding::new(&animation, &Options::default()).unwrap();
        assert!((binding.unit().metres() / unit.metres() - 1.0).abs() < 1e-9, "{:?}", binding.unit());
        assert!(binding.notes()[0].contains("m tall in the format's unit"), "{:?}", binding.notes());
        let told = Options { unit: Some(Unit::Metres), ..Options::default() };
        let binding = Binding::new(&animation, &told).unwrap();
        assert_eq!((binding.unit(), binding.notes()), (Unit::Metres, &[][..]));
    }
    // A large one may be one.
    let mut made = walk();
    made.json["nodes"][1]["scale"] = json!([0.05, 0.05, 0.05]);
    let large = Binding::new(&one(&made.glb()).unwrap(), &Options::default()).unwrap();
    assert_eq!(large.unit(), Unit::Metres);
    // And as text, written and read.
    let again = Bvh::parse(document.as_bvh().unwrap().to_text().as_bytes(), "again.bvh").unwrap();
    assert!(apart(&read, &clip(&again)) < 1e-6);
}

/// Nodes with negative scales mirror what hangs on them: every joint is where the file's matrices put it.
#[test]
fn what_hangs_on_a_mirrored_node_is_where_it_looks() {
    let (walk_clip, spine) = (common::walk(), 1);
    let (turn, place, _) = armature();
    let below = |joint: usize| walk_clip.skeleton.path(joint)[..].contains(&spine) && joint != spine;
    assert!((0..walk_clip.skeleton.joints()).any(below));
    for (at_spine, signs) in [
        (false, [-1.0, 1.0, 1.0]),
        (false, [-1.0, -1.0, -1.0]),
        (false, [1.0, -1.0, -1.0]),
        (true, [1.0, 1.0, -1.0]),
    ] {
        let mut made = walk();
        // The armature is node 1, the hips are node 2.
        let node = &mut made.json["nodes"][if at_spine { 2 + spine } else { 1 }];
        let size = node["scale"][0].as_f64().unwrap_or(1.0);
        node["scale"] = json!(signs.map(|sign| sign * size));
        let read = clip(&one(&made.glb()).unwrap());
        for (frame, plain) in read.frames.iter().zip(&walk_clip.frames) {
            let p = plain.positions(&walk_clip.skeleton);
            let (axes, origin) = if at_spine {
                (plain.rotations[0] * plain.rotations[spine], p[spine])
            } else {
                (turn, place)
            };
            let signs = Vector3::from(signs);
            let mirrored =
                |v: Vector3<f64>| axes * (axes.inverse() * (v - origin)).component_mul(&signs) + origin;
            for (joint, found) in frame.positions(&read.skeleton).into_iter().enumerate() {
                let expected = if !at_spine || below(joint) { mirrored(p[joint]) } else { p[joint] };
                let off = (found - expected).norm();
                assert!(off < 5e-6, "{signs:?} {}: {off} m", read.skeleton.names[joint]);
            }
        }
    }
}

#[test]
fn numbers_are_found_in_the_file_beside_it_and_in_data_uris() {
    let (text, data) = walk().text("my%20numbers.bin");
    let open = |name: &Path| if name == "my numbers.bin" { Ok(data.clone()) } else { nothing_beside(name) };
    let beside = parse(&text, "hero.gltf", &open).unwrap().remove(0).1;
    assert!(apart(common::walk(), &clip(&beside)) < 2e-6);
    let uri = format!("data:application/octet-stream;base64,{}", STANDARD.encode(&data));
    assert_eq!(one(&walk().text(&uri).0).unwrap().poses, beside.poses);
    let marked = [b"\xef\xbb\xbf", &walk().text(&uri).0[..]].concat();
    assert_eq!(one(&marked).unwrap().poses, beside.poses);
    assert_eq!(one(&walk().text(uri.trim_end_matches('=')).0).unwrap().poses, beside.poses);
    // Was an empty buffer, and the file was called damaged.
    let error = one(&walk().text("data:application/octet-stream,%00%01").0).unwrap_err();
    assert!(matches!(error.kind, GltfErrorKind::DataUri { buffer: 0, .. }), "{error}");
    let error = parse(&text, "hero.gltf", &nothing_beside).unwrap_err();
    assert!(
        matches!(&error.kind, GltfErrorKind::Buffer { buffer: 0, uri, .. } if uri == "my%20numbers.bin"),
        "{error}"
    );
}

/// Two joints that turn about Z, by a curve.
fn hinge(times: &[f64], degrees: &[f64], how: &str) -> Made {
    let mut made = Made::new();
    made.push("nodes", json!({"name": "hips", "translation": [0.0, 1.0, 0.0], "children": [1]}));
    made.push("nodes", json!({"name": "leg", "translation": [0.0, -0.9, 0.0]}));
    let input = made.floats("SCALAR", times);
    let turn = |d: &f64| [0.0, 0.0, (0.5 * d.to_radians()).sin(), (0.5 * d.to_radians()).cos()];
    let values: Vec<f64> = degrees.iter().flat_map(turn).collect();
    let output = made.floats("VEC4", &values);
    made.animate("turn", &[(0, "rotation", input, output, how), (1, "rotation", input, output, how)]);
    made
}

fn degrees(clip: &Clip, second: f64) -> f64 {
    clip.at(second * clip.rate_hz).rotations[0].scaled_axis().z.to_degrees()
}

#[test]
fn few_keys_are_filled_in_as_their_curve_says() {
    let times = [0.5, 1.0, 2.5];
    let linear = clip(&one(&hinge(&times, &[0.0, 30.0, 90.0], "LINEAR").glb()).unwrap());
    assert_eq!((linear.rate_hz, linear.frames.len()), (60.0, 121));
    for (second, wanted) in [(0.0, 0.0), (0.25, 15.0), (0.5, 30.0), (1.25, 60.0), (2.0, 90.0)] {
        assert!((degrees(&linear, second) - wanted).abs() < 1e-4, "{second}: {}", degrees(&linear, second));
    }
    let step = clip(&one(&hinge(&times, &[0.0, 30.0, 90.0], "STEP").glb()).unwrap());
    for (second, wanted) in [(0.4, 0.0), (0.5, 30.0), (1.9, 30.0), (2.0, 90.0)] {
        assert!((degrees(&step, second) - wanted).abs() < 1e-4, "{second}: {}", degrees(&step, second));
    }
}

#[test]
fn cubic_splines_go_through_their_keys_with_their_slopes() {
    let mut made = hinge(&[0.0, 2.0], &[0.0, 0.0], "LINEAR");
    // Components of the quaternion: (in, value, out) a key. z is a parabola, z = t - t²/2 scaled, by Hermite exactly.
    let (a, w) = (0.2, 1.0);
    let z = |t: f64| a * (t - 0.5 * t * t);
    let slope = |t: f64| a * (1.0 - t);
    let key = |t: f64| [[0.0, 0.0, slope(t), 0.0], [0.0, 0.0, z(t), w], [0.0, 0.0, slope(t), 0.0]].concat();
    let output = made.floats("VEC4", &[key(0.0), key(2.0)].concat());
    made.json["animations"][0]["samplers"][0]["output"] = json!(output);
    made.json["animations"][0]["samplers"][0]["interpolation"] = json!("CUBICSPLINE");
    let read = clip(&one(&made.glb()).unwrap());
    for second in [0.0, 0.5, 1.0, 1.5, 2.0] {
        let wanted = 2.0 * (z(second) / w).atan().to_degrees();
        assert!(
            (degrees(&read, second) - wanted).abs() < 1e-4,
            "{second}: {} {wanted}",
            degrees(&read, second)
        );
    }
}

#[test]
fn rotations_may_be_whole_numbers() {
    let mut made = hinge(&[0.0, 0.5], &[0.0, 0.0], "LINEAR");
    let values: Vec<u8> =
        [[0i16, 0, 0, 32767], [0, 0, 16384, 28377]].concat().iter().flat_map(|v| v.to_le_bytes()).collect();
    let view = made.view(&values);
    let output = made.push(
        "accessors",
        json!({"bufferView": view, "componentType": 5122, "normalized": true, "type": "VEC4", "count": 2}),
    );
    made.json["animations"][0]["samplers"][0]["output"] = json!(output);
    let read = clip(&one(&made.glb()).unwrap());
    assert!((degrees(&read, 0.5) - 60.0).abs() < 0.01, "{}", degrees(&read, 0.5));
}

#[test]
fn accessors_may_be_sparse() {
    let key = |degrees: f64| {
        let half = 0.5 * degrees.to_radians();
        [0.0, 0.0, half.sin(), half.cos()].map(|v: f64| v as f32)
    };
    let sparse = |made: &mut Made, dense: Option<usize>, indices: &[u8], keys: &[[f32; 4]]| {
        let bytes: Vec<u8> = keys.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let (indices_view, values_view) = (made.view(indices), made.view(&bytes));
        let mut accessor = json!({"componentType": 5126, "type": "VEC4", "count": 3, "sparse": {
            "count": keys.len(), "indices": {"bufferView": indices_view, "componentType": 5121},
            "values": {"bufferView": values_view}}});
        if let Some(dense) = dense {
            accessor["bufferView"] = made.json["accessors"][dense]["bufferView"].clone();
        }
        made.push("accessors", accessor)
    };
    // One key of three is another; or all are, and there is nothing else.
    for (has_dense, indices, degrees) in
        [(true, vec![1], vec![60.0]), (false, vec![0, 1, 2], vec![0.0, 60.0, 90.0])]
    {
        let mut made = hinge(&[0.0, 0.5, 1.0], &[0.0, 30.0, 90.0], "LINEAR");
        let dense = made.json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
        let keys: Vec<[f32; 4]> = degrees.into_iter().map(key).collect();
        let output = sparse(&mut made, has_dense.then_some(dense), &indices, &keys);
        made.json["animations"][0]["samplers"][0]["output"] = json!(output);
        let read = clip(&one(&made.glb()).unwrap());
        for (second, wanted) in [(0.0, 0.0), (0.5, 60.0), (1.0, 90.0)] {
            assert!((self::degrees(&read, second) - wanted).abs() < 1e-3, "{second}");
        }
    }
    // Indices beyond the end, or in no order.
    for indices in [vec![3], vec![1, 0], vec![1, 1]] {
        let mut made = hinge(&[0.0, 0.5, 1.0], &[0.0, 30.0, 90.0], "LINEAR");
        let keys = vec![key(1.0); indices.len()];
        let output = sparse(&mut made, None, &indices, &keys);
        made.json["animations"][0]["samplers"][0]["output"] = json!(output);
        assert!(matches!(one(&made.glb()).unwrap_err().kind, GltfErrorKind::Accessor { .. }), "{indices:?}");
    }
}

/// Accessors of meshes that Draco packs have no data, and neither has one of zeros.
#[test]
fn accessors_without_data_are_zeros() {
    let mut made = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    let plain = one(&made.clone().glb()).unwrap();
    let empty = |kind: &str, count: usize| json!({"componentType": 5126, "type": kind, "count": count});
    made.push("accessors", empty("VEC3", 5000));
    assert_eq!(one(&made.clone().glb()).unwrap(), plain);
    let zeros = made.push("accessors", empty("VEC3", 2));
    let times = made.json["animations"][0]["samplers"][0]["input"].as_u64().unwrap() as usize;
    made.animate("turn", &[(1, "translation", times, zeros, "LINEAR")]);
    let moved = made.json["animations"].as_array_mut().unwrap().pop().unwrap();
    let (mut sampler, mut channel) = (moved["samplers"][0].clone(), moved["channels"][0].clone());
    let animation = &mut made.json["animations"][0];
    (sampler["interpolation"], channel["sampler"]) = (json!("STEP"), json!(2));
    animation["samplers"].as_array_mut().unwrap().push(sampler);
    animation["channels"].as_array_mut().unwrap().push(channel);
    let read = one(&made.clone().glb()).unwrap();
    assert!(read.poses.iter().skip(1).step_by(2).all(|leg| leg.translation.vector.norm() == 0.0));
    // Times are none.
    let never = made.push("accessors", empty("SCALAR", 2));
    made.json["animations"][0]["samplers"][0]["input"] = json!(never);
    assert!(matches!(one(&made.glb()).unwrap_err().kind, GltfErrorKind::Curve { .. }));
}

#[test]
fn bones_that_stretch_and_scales_that_move_are_said() {
    let mut made = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    let input = made.floats("SCALAR", &[0.0, 1.0]);
    let output = made.floats("VEC3", &[0.0, -0.8, 0.0, 0.0, -1.0, 0.0]);
    let scale = made.floats("VEC3", &[1.0, 1.0, 1.0, 2.0, 1.0, 1.0]);
    let rotation = made.json["animations"][0]["samplers"][0]["output"].as_u64().unwrap() as usize;
    made.animate(
        "stretch",
        &[
            (0, "rotation", input, rotation, "LINEAR"),
            (1, "translation", input, output, "LINEAR"),
            (1, "scale", input, scale, "LINEAR"),
        ],
    );
    made.json["animations"].as_array_mut().unwrap().remove(0);
    let document = one(&made.glb()).unwrap();
    let notes = Binding::new(&document, &Options::default()).unwrap().notes().join("; ");
    assert!(
        notes.contains("the scale of leg is animated") && notes.contains("leg is moved by up to 20.0 cm"),
        "{notes}"
    );
    assert!((clip(&document).skeleton.offsets[1].y + 0.9).abs() < 1e-6);
}

#[test]
fn what_is_wrong_is_said_with_its_place() {
    type Change = fn(&mut Value);
    // The words, since several variants leave the place to them.
    let cases: [(&str, Change, &str); 15] = [
        ("no animation", |j| j["animations"] = json!([]), "so nothing moves"),
        (
            "faces",
            |j| {
                let channels = j["animations"][0]["channels"].as_array_mut().unwrap();
                channels.iter_mut().for_each(|c| c["target"]["path"] = json!("weights"));
            },
            "so nothing moves",
        ),
        ("a node too many", |j| j["nodes"][0]["children"] = json!([7]), "children"),
        (
            "nobody",
            |j| j["animations"][0]["channels"][1]["target"]["node"] = json!(2),
            "channels[1].target.node",
        ),
        ("itself", |j| j["nodes"][1]["children"] = json!([0]), "node `hips` is its own ancestor"),
        ("a long list", |j| j["accessors"][0]["count"] = json!(4_000_000_000u64), "accessor 0: it is longer"),
        ("a long view", |j| j["bufferViews"][1]["byteLength"] = json!(999), "accessor 1: its part"),
        ("shapes", |j| j["accessors"][1]["type"] = json!("VEC3"), "accessor 1: it is of another shape"),
        (
            "few values",
            |j| j["accessors"][1]["count"] = json!(1),
            "animation `turn`, node `hips`: it has another",
        ),
        ("backwards", |j| j["animations"][0]["samplers"][0]["input"] = json!(2), "its times do not grow"),
        (
            "for years",
            |j| j["animations"][0]["samplers"][0]["input"] = json!(3),
            "out of proportion to the file",
        ),
        (
            "for days",
            |j| j["animations"][0]["samplers"][0]["input"] = json!(4),
            "out of proportion to the file",
        ),
        (
            "flat",
            |j| j["nodes"][0]["scale"] = json!([1.0, 0.5, 1.0]),
            "node `hips` is scaled by [1.0, 0.5, 1.0]",
        ),
        (
            "far off",
            |j| j["nodes"][1]["translation"] = json!([0.0, 1.4e21, 0.0]),
            "too large in frame 1, joint `leg`",
        ),
        (
            "packed",
            |j| {
                let packing =
                    json!({"buffer": 0, "byteLength": 8, "byteStride": 4, "count": 2, "mode": "ZIP"});
                j["bufferViews"][0]["extensions"] = json!({"EXT_meshopt_compression": packing});
            },
            "bufferViews[0] is packed by meshoptimizer and can't be unpacked: its mode is unknown",
        ),
    ];
    for (what, change, said) in cases {
        let mut made = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
        made.floats("SCALAR", &[1.0, 0.5]);
        made.floats("SCALAR", &[0.0, 1e9]);
        made.floats("SCALAR", &[0.0, 1e5]);
        change(&mut made.json);
        let error = one(&made.glb()).expect_err(what).to_string();
        assert!(error.starts_with("hero.glb: ") && error.contains(said), "{what}: {error}");
    }
    let whole = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR").glb();
    for cut in [10, 13, 40, whole.len() - 5] {
        assert_eq!(one(&whole[..cut]).expect_err("cut").kind, GltfErrorKind::Cut, "{cut}");
    }
    // Its header says that it ends before its parts do.
    for length in [0, 12, 30, whole.len() as u32 - 4] {
        let mut short = whole.clone();
        short[8..12].copy_from_slice(&length.to_le_bytes());
        assert_eq!(one(&short).expect_err("short").kind, GltfErrorKind::Cut, "{length}");
    }
    let more = [&whole[..], b"and more"].concat();
    assert_eq!(one(&more), one(&whole));
    let mut other = whole;
    other[4] = 3;
    assert!(matches!(one(&other).unwrap_err().kind, GltfErrorKind::NotGltf(_)));
    // glTF 1.0, whose lists are objects, and a list that is damaged.
    other[4] = 1;
    assert_eq!(one(&other).unwrap_err().kind, GltfErrorKind::FirstVersion);
    let nodes = |version| format!(r#"{{"asset": {{"version": "{version}"}}, "nodes": {{"hip": {{}}}}}}"#);
    assert_eq!(one(nodes("1.0").as_bytes()).unwrap_err().kind, GltfErrorKind::FirstVersion);
    assert!(matches!(one(nodes("2.0").as_bytes()).unwrap_err().kind, GltfErrorKind::NotGltf(_)));
    let nan = hinge(&[0.0, 1.0], &[0.0, f64::NAN], "LINEAR").glb();
    assert!(matches!(one(&nan).unwrap_err().kind, GltfErrorKind::Accessor { accessor: 1, .. }));
}

#[test]
fn zeros_are_no_rotation() {
    let place = |bytes: &[u8]| match one(bytes).unwrap_err().kind {
        GltfErrorKind::NoRotation { place } => place,
        other => panic!("{other}"),
    };
    // The second key of both joints.
    let mut key = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    key.data[24..40].fill(0);
    assert_eq!(place(&key.glb()), "animation `turn`, node `hips`");
    // A node's own rotation counts where no curve turns it: here that of an armature above the body.
    let mut node = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    node.json["nodes"][0]["rotation"] = json!([0.0, 0.0, 0.0, 0.0]);
    assert!(one(&node.glb()).is_ok());
    let mut above = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    above.push("nodes", json!({"name": "rig", "children": [0], "rotation": [0.0, 0.0, 0.0, 0.0]}));
    assert_eq!(place(&above.glb()), "node `rig`");
}

#[test]
fn of_several_animations_each_is_a_clip_by_its_name() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf");
    fs::create_dir_all(&folder).unwrap();
    let mut made = Made::new();
    let nodes = rig(&mut made, &common::walk().skeleton);
    for name in ["walk_neutral_1", "walk_neutral_2.x", "walk_proud_1"] {
        act(&mut made, &nodes, common::walk(), name);
    }
    let path = folder.join("hero.glb");
    fs::write(&path, made.glb()).unwrap();
    fs::write(folder.join("walk_old_1.bvh"), one(&walk().glb()).unwrap().as_bvh().unwrap().to_text())
        .unwrap();
    fs::write(folder.join("bad.glb"), b"glTF?").unwrap();

    let kind = |error: CaptureError| match error {
        CaptureError::Gltf(error) => error.kind,
        other => panic!("{other}"),
    };
    let several = kind(read(&path).unwrap_err());
    assert!(matches!(&several, GltfErrorKind::Several { names, .. } if names.len() == 3), "{several}");
    // The words say how one is named.
    assert!(several.to_string().contains("hero.glb#walk_neutral_1`"), "{several}");
    let named = |name: &str| read(Path::new(&format!("{}#{name}", path.display())));
    assert!(apart(common::walk(), &clip(&named("walk_proud_1").unwrap())) < 2e-6);
    assert!(named(" walk_proud_1 ").is_ok());
    let error = kind(named("run").unwrap_err());
    assert!(
        matches!(&error, GltfErrorKind::NoSuch { wanted, names } if wanted == "run" && names.len() == 3),
        "{error}"
    );

    let files = read_folder(&folder).unwrap();
    let paths: Vec<_> =
        files.documents.iter().map(|(p, _)| p.strip_prefix(&folder).unwrap().display().to_string()).collect();
    let wanted =
        ["hero/walk_neutral_1.glb", "hero/walk_neutral_2.x.glb", "hero/walk_proud_1.glb", "walk_old_1.bvh"];
    assert_eq!(paths, wanted);
    assert_eq!(files.summary(), "read 4 clips, skipped 1 files that could not be read");
    assert!(files.skipped[0].file().ends_with("bad.glb"));

    let config = Config { data: Some(folder), ..Config::default() };
    let corpus = load(&config).unwrap().corpus;
    let names: Vec<&str> = corpus.examples.iter().map(|e| e.clip.name.as_str()).collect();
    assert_eq!(names, ["walk_neutral_1", "walk_neutral_2.x", "walk_proud_1", "walk_old_1"]);
    let takes: Vec<&str> = corpus.examples.iter().map(|e| e.take.as_str()).collect();
    assert_eq!(takes, ["1", "2.x", "1", "1"]);
    assert_eq!(corpus.styles, ["neutral", "old", "proud"]);
}

/// Sample figures have an animation a joint; each was read as a clip of its own, in which one joint moves.
#[test]
fn animations_of_one_joint_each_are_one_motion() {
    let mut made = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR");
    let first = made.json["animations"][0].clone();
    let of = |node: usize| {
        let mut animation = first.clone();
        let channels = animation["channels"].as_array_mut().unwrap();
        channels.retain(|channel| channel["target"]["path"] == "rotation");
        channels.truncate(1);
        channels[0]["target"]["node"] = json!(node);
        animation
    };
    made.json["animations"] = json!([of(0), of(1)]);
    let bytes = made.glb();
    let error = parse(&bytes, "figure.glb", &nothing_beside).unwrap_err().kind;
    assert!(matches!(error, GltfErrorKind::OneByOne { animations: 2 }), "{error}");
    // Files are read with all of them in one, and written so.
    let joined = |bytes: Vec<u8>| Gltf::of(bytes.into(), "figure.glb", Path::new("")).unwrap();
    let [figure] = &joined(bytes)[..] else { panic!("it is one motion") };
    assert!(figure.animation.notes.iter().any(|note| note.contains("each of its 2 animations")));
    let (clip, binding) = to_clip(&figure.animation, &Options::default()).unwrap();
    let turns = |frame: usize| clip.frames[frame].rotations.iter().filter(|turn| turn.angle() > 1.5).count();
    assert_eq!((turns(0), turns(clip.frames.len() - 1)), (0, 2));
    let [again] = &joined(figure.write(&binding, &clip, None, false).unwrap())[..] else {
        panic!("it is written as one motion")
    };
    assert_eq!(again.animation.poses.len(), figure.animation.poses.len());
    assert!(again.animation.notes.is_empty(), "{:?}", again.animation.notes);
}

/// The clip that `gestus translate` makes of a file.
fn translated(folder: &Path, input: &str) -> Clip {
    let [db, output] = ["walks.gestus", "out.bvh"].map(|name| folder.join(name));
    let options = ["translate", "--style", "proud", "--timing", "sync"];
    let arguments = [&options[..], &["--db", db.to_str().unwrap(), "--input", input, "-o"]].concat();
    let command = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).arg(&output).output().unwrap();
    assert!(command.status.success(), "{}", String::from_utf8_lossy(&command.stderr));
    clip(&read(&output).unwrap())
}

#[test]
fn a_clip_is_translated_as_from_bvh() {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf-translate");
    fs::create_dir_all(&folder).unwrap();
    fs::write(folder.join("walks.gestus"), common::blob()).unwrap();
    fs::write(folder.join("hero.glb"), walk().glb()).unwrap();
    fs::write(folder.join("hero.bvh"), Bvh::from_clip(common::walk(), Unit::Metres).unwrap().to_text())
        .unwrap();
    let [glb, bvh] =
        ["hero.glb#Walk", "hero.bvh"].map(|n| translated(&folder, folder.join(n).to_str().unwrap()));
    let off = apart(&glb, &bvh);
    assert!(off < 1e-4, "{off} m");
    assert!(apart(&glb, common::walk()) > 0.02, "nothing was translated");
}
