//! glTF in, glTF out: the animation is the clip's, on the file's own nodes, and all else of the file stays.

#[allow(dead_code, reason = "other tests use more of it")]
mod common;

use std::{
    fs,
    path::{Path, PathBuf},
    process::Command,
    sync::Arc,
};

use base64::{Engine, engine::general_purpose::STANDARD};
use gestus_motion::{
    animation::Recording,
    binding::{Binding, Options},
    capture::{Document, read},
    clip::{Clip, Frame, Skeleton},
    formats::gltf::{Gltf, toy},
};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

/// A `.glb` taken apart.
#[derive(Clone)]
struct Parts {
    json: Value,
    bin: Vec<u8>,
    others: Vec<u8>,
}

impl Parts {
    fn of(bytes: &[u8]) -> Self {
        let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
        let json = 20 + number(12);
        let bin = json + 8 + number(json);
        assert_eq!((&bytes[16..20], &bytes[json + 4..json + 8]), (&b"JSON"[..], &b"BIN\0"[..]));
        assert!(json % 4 == 0 && bin % 4 == 0);
        Self {
            json: serde_json::from_slice(&bytes[20..json]).unwrap(),
            bin: bytes[json + 8..bin].to_vec(),
            others: bytes[bin..].to_vec(),
        }
    }

    fn bytes(&self) -> Vec<u8> {
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let mut bytes = b"glTF".to_vec();
        bytes.extend(2u32.to_le_bytes());
        bytes.extend(
            (28 + json.len() as u32 + self.bin.len() as u32 + self.others.len() as u32).to_le_bytes(),
        );
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &self.bin)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes.extend(&self.others);
        bytes
    }

    fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Adds numbers; returns the accessor.
    fn floats(&mut self, kind: &str, count: usize, values: &[f32]) -> usize {
        let start = self.bin.len();
        self.bin.extend(values.iter().flat_map(|v| v.to_le_bytes()));
        self.json["buffers"][0]["byteLength"] = json!(self.bin.len());
        let length = self.bin.len() - start;
        let view = self.push("bufferViews", json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        let mut accessor = json!({"bufferView": view, "componentType": 5126, "type": kind, "count": count});
        if kind == "SCALAR" {
            (accessor["min"], accessor["max"]) = (json!([values[0]]), json!([values[count - 1]]));
        }
        self.push("accessors", accessor)
    }
}

/// Scale of the armature.
const SCALE: f64 = 0.01;

/// A character of two animations, below an armature in centimetres and Z up, with all that files have besides.
fn hero() -> Parts {
    let (turn, place) = (UnitQuaternion::from_euler_angles(-1.5, 0.2, 0.0), Vector3::new(0.1, 0.2, -0.3));
    let below = |clip: &Clip| {
        let offsets = clip.skeleton.offsets.iter().map(|offset| offset / SCALE).collect();
        let frames = clip.frames.iter().map(|f| {
            let mut frame = f.clone();
            frame.root = turn.inverse() * (f.root - place) / SCALE;
            frame.rotations[0] = turn.inverse() * f.rotations[0];
            frame
        });
        let skeleton = Arc::new(Skeleton { offsets, ..(*clip.skeleton).clone() });
        Clip { frames: frames.collect(), skeleton, ..clip.clone() }
    };
    let clips = [below(common::walk()), below(&rotated(common::walk(), 0.3))];
    let mut parts = Parts::of(&toy(&[("Walk", &clips[0]), ("Idle", &clips[1])]));
    let numbers = [turn.i, turn.j, turn.k, turn.w];
    let armature = json!({
        "name": "Armature", "children": [1], "translation": place.as_slice(), "rotation": numbers, "scale": vec![SCALE; 3],
    });
    let armature = parts.push("nodes", armature);
    parts.json["scenes"][0]["nodes"] = json!([0, armature]);
    // A face that the animation moves.
    let keys = parts.floats("SCALAR", 2, &[0.0, 1.5]);
    let smile = parts.floats("SCALAR", 2, &[0.0, 1.0]);
    let walk = &mut parts.json["animations"][0];
    walk["extras"] = json!({"loop": true});
    let samplers = walk["samplers"].as_array_mut().unwrap();
    samplers.push(json!({"input": keys, "output": smile, "interpolation": "STEP"}));
    let sampler = samplers.len() - 1;
    let channels = walk["channels"].as_array_mut().unwrap();
    channels.insert(0, json!({"sampler": sampler, "target": {"node": 0, "path": "weights"}}));
    let target = parts.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"].clone();
    parts.json["meshes"][0]["primitives"][0]["targets"] = json!([{"POSITION": target}]);
    parts.json["meshes"][0]["weights"] = json!([0.0]);
    parts.json["extras"] =
        json!({"author": "nobody", "exact": 0.100_000_000_000_000_02, "big": 9_007_199_254_740_993u64});
    parts.json["extensionsUsed"] = json!(["VENDOR_unheard_of"]);
    parts.json["extensions"] = json!({"VENDOR_unheard_of": {"bones": [1, 2, 3], "text": "ä\u{1F600}"}});
    parts.json["materials"][0]["extensions"] = json!({"VENDOR_unheard_of": {"shine": 1e-7}});
    parts.others = [&4u32.to_le_bytes()[..], b"XYZ\0", b"abcd"].concat();
    parts
}

/// The clip with each rotation turned a little.
fn rotated(clip: &Clip, angle: f64) -> Clip {
    let turn = UnitQuaternion::from_euler_angles(angle, 0.4 * angle, -angle);
    let frame = |f: &Frame| Frame {
        root: f.root + Vector3::new(0.1, 0.2, 0.3) * angle,
        rotations: f.rotations.iter().map(|q| q * turn).collect(),
    };
    Clip { frames: clip.frames.iter().map(frame).collect(), ..clip.clone() }
}

fn animations(bytes: &[u8], folder: &Path) -> Vec<Gltf> {
    Gltf::of(Arc::from(bytes), "hero.glb", folder).unwrap()
}

fn clip(recording: &impl Recording) -> Clip {
    gestus_motion::binding::to_clip(recording, &Options::default()).unwrap().0
}

/// Largest distance of a joint, metres, and of a rotation, radians.
fn apart(a: &Clip, b: &Clip) -> f64 {
    assert_eq!((a.frames.len(), &a.skeleton.names), (b.frames.len(), &b.skeleton.names));
    assert_eq!(a.rate_hz, b.rate_hz);
    let off = |(f, g): (&Frame, &Frame)| {
        let (p, q) = (f.positions(&a.skeleton), g.positions(&b.skeleton));
        let places = p.iter().zip(&q).map(|(p, q)| (p - q).norm());
        places.chain(f.rotations.iter().zip(&g.rotations).map(|(a, b)| a.angle_to(b))).fold(0.0, f64::max)
    };
    a.frames.iter().zip(&b.frames).map(off).fold(0.0, f64::max)
}

/// All of the file but the animation at `index`, and what has been appended, is as before.
fn assert_kept(before: &Parts, after: &Parts, index: usize) {
    let (old, new) = (before.json.as_object().unwrap(), after.json.as_object().unwrap());
    assert!(old.keys().eq(new.keys()), "the same parts in the same order");
    for (key, value) in old {
        match (value.as_array(), new[key].as_array()) {
            (Some(old), Some(new)) if ["accessors", "bufferViews"].contains(&key.as_str()) => {
                assert_eq!(old[..], new[..old.len()], "{key}");
            }
            (Some(old), Some(new)) if key == "animations" => {
                let others = |list: &[Value]| {
                    let others = list[..old.len()].iter().enumerate().filter(|(i, _)| *i != index);
                    others.map(|(_, a)| a.clone()).collect::<Vec<_>>()
                };
                assert_eq!(others(old), others(new), "{key}");
            }
            _ if key == "buffers" => {
                assert!(new[key][0]["byteLength"].as_u64() > value[0]["byteLength"].as_u64())
            }
            _ => assert_eq!(value.to_string(), new[key].to_string(), "{key}"),
        }
    }
    assert_eq!(before.bin[..], after.bin[..before.bin.len()]);
    assert_eq!(before.others, after.others);
}

#[test]
fn a_clip_replaces_its_animation_and_nothing_else() {
    let before = hero();
    let read = animations(&before.bytes(), Path::new("")).remove(0);
    let binding = Binding::new(&read.animation, &Options::default()).unwrap();
    let original = binding.to_clip(&read.animation).unwrap();
    assert!(apart(common::walk(), &original) < 1e-5);
    let wanted = rotated(&original.resampled(60.0), 0.2);
    let bytes = read.write(&binding, &wanted, None, false).unwrap();
    let after = Parts::of(&bytes);
    assert_kept(&before, &after, 0);
    let again = animations(&bytes, Path::new(""));
    assert_eq!(again.iter().map(Gltf::name).collect::<Vec<_>>(), ["Walk", "Idle"]);
    let off = apart(&wanted, &clip(&again[0].animation));
    assert!(off < 1e-5, "{off}");
    // As BVH, which rounds to 1e-6 degrees.
    let text = binding.write(&Document::Gltf(Box::new(read.clone())), &wanted).unwrap();
    let off = apart(&clip(&text), &clip(&again[0].animation));
    assert!(off < 1e-4, "{off}");
    assert_eq!(again[1].animation, animations(&before.bytes(), Path::new(""))[1].animation);
    // The face's curve and the extras stay; no sampler is left over.
    let walk = &after.json["animations"][0];
    assert_eq!((&walk["name"], &walk["extras"]), (&json!("Walk"), &json!({"loop": true})));
    assert_eq!(walk["channels"][0]["target"], json!({"node": 0, "path": "weights"}));
    let face = &walk["samplers"][walk["channels"][0]["sampler"].as_u64().unwrap() as usize];
    assert_eq!(face["interpolation"], "STEP");
    let (samplers, channels) = (walk["samplers"].as_array().unwrap(), walk["channels"].as_array().unwrap());
    assert_eq!(samplers.len(), channels.len());
    // A clip written twice is the clip.
    let twice = again[0].write(&binding, &wanted, None, false).unwrap();
    assert!(apart(&wanted, &clip(&animations(&twice, Path::new(""))[0].animation)) < 1e-5);
}

/// What is read from below a mirrored node is written back as the node mirrors it.
#[test]
fn a_clip_below_a_mirrored_node_comes_back() {
    for (node, signs) in [(None, [-1.0, 1.0, 1.0]), (None, [-1.0; 3]), (Some(2), [1.0, -1.0, 1.0])] {
        let mut before = hero();
        let armature = before.json["nodes"].as_array().unwrap().len() - 1;
        let node = node.unwrap_or(armature);
        let size = if node == armature { SCALE } else { 1.0 };
        before.json["nodes"][node]["scale"] = json!(signs.map(|sign| sign * size));
        let read = animations(&before.bytes(), Path::new("")).remove(0);
        let binding = Binding::new(&read.animation, &Options::default()).unwrap();
        let original = binding.to_clip(&read.animation).unwrap();
        assert!(apart(common::walk(), &original) > 0.1, "it is mirrored");
        let wanted = rotated(&original, 0.2);
        let bytes = read.write(&binding, &wanted, None, false).unwrap();
        let off = apart(&wanted, &clip(&animations(&bytes, Path::new(""))[0].animation));
        assert!(off < 1e-5, "{signs:?}: {off}");
        assert_kept(&before, &Parts::of(&bytes), 0);
    }
}

#[test]
fn a_new_name_adds_an_animation_and_a_known_one_replaces_it() {
    let before = hero();
    let read = animations(&before.bytes(), Path::new("")).remove(0);
    let binding = Binding::new(&read.animation, &Options::default()).unwrap();
    let wanted = rotated(&binding.to_clip(&read.animation).unwrap(), 0.2);
    for (name, names, index) in [
        ("Proud", vec!["Walk", "Idle", "Proud"], 2),
        ("Idle", vec!["Walk", "Idle"], 1),
        ("Walk", vec!["Walk", "Idle"], 0),
    ] {
        let bytes = read.write(&binding, &wanted, Some(name), false).unwrap();
        assert_kept(&before, &Parts::of(&bytes), index);
        let again = animations(&bytes, Path::new(""));
        assert_eq!(again.iter().map(Gltf::name).collect::<Vec<_>>(), names);
        assert!(apart(&wanted, &clip(&again[index].animation)) < 1e-5);
    }
}

/// A joint that does not move gets no curve, one that stays turned gets one key, and a node with a matrix gets a pose.
#[test]
fn still_joints_have_few_keys() {
    let mut before = hero();
    let head = 1 + common::walk().skeleton.joints() - 1;
    let walk = &mut before.json["animations"][0];
    walk["channels"].as_array_mut().unwrap().retain(|c| c["target"]["node"] != json!(head));
    let place = before.json["nodes"][head]["translation"].clone();
    let matrix = json!([1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, place[0], place[1], place[2], 1]);
    let node = before.json["nodes"][head].as_object_mut().unwrap();
    node.remove("translation");
    node.insert("matrix".into(), matrix);
    let read = animations(&before.bytes(), Path::new("")).remove(0);
    let binding = Binding::new(&read.animation, &Options::default()).unwrap();
    let mut wanted = binding.to_clip(&read.animation).unwrap();
    let joint = wanted.skeleton.find(before.json["nodes"][head]["name"].as_str().unwrap()).unwrap();
    let keys = |clip: &Clip| {
        let after = Parts::of(&read.write(&binding, clip, None, false).unwrap());
        let walk = &after.json["animations"][0];
        let channel =
            walk["channels"].as_array().unwrap().iter().find(|c| c["target"]["node"] == json!(head));
        let accessor =
            |c: &Value| walk["samplers"][c["sampler"].as_u64().unwrap() as usize]["output"].clone();
        let count = channel.map_or(json!(0), |c| {
            after.json["accessors"][accessor(c).as_u64().unwrap() as usize]["count"].clone()
        });
        (count, after.json["nodes"][head]["matrix"].is_null())
    };
    assert_eq!(keys(&wanted), (json!(0), false));
    wanted
        .frames
        .iter_mut()
        .for_each(|f| f.rotations[joint] = UnitQuaternion::from_euler_angles(0.2, 0.0, 0.0));
    assert_eq!(keys(&wanted), (json!(1), true));
    let bytes = read.write(&binding, &wanted, None, false).unwrap();
    assert!(apart(&wanted, &clip(&animations(&bytes, Path::new(""))[0].animation)) < 1e-5);
    wanted.frames[3].rotations[joint] = UnitQuaternion::identity();
    assert_eq!(keys(&wanted), (json!(wanted.frames.len()), true));
}

/// `gestus` with those arguments has to succeed.
fn run(arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn refused(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO_BIN_EXE_gestus")).args(arguments).output().unwrap();
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A folder for a test, with the database, and a file in it by name.
fn folder(name: &str) -> (PathBuf, impl Fn(&str) -> String) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    fs::create_dir_all(folder.join("elsewhere")).unwrap();
    fs::write(folder.join("walks.gestus"), common::blob()).unwrap();
    let at = folder.clone();
    (folder, move |name: &str| at.join(name).to_str().unwrap().to_owned())
}

#[test]
fn translate_writes_what_it_was_given() {
    let (folder, file) = folder("gltf-write");
    let before = hero();
    fs::write(folder.join("hero.glb"), before.bytes()).unwrap();
    let (db, input) = (file("walks.gestus"), file("hero.glb#Walk"));
    let translate = ["translate", "--db", &db, "--input", &input, "--style", "proud"];
    let to = |name: &str, more: &[&str]| run(&[&translate[..], &["-o", &file(name)], more].concat());
    to("out.glb", &[]);
    to("out.bvh", &[]);
    to("added.glb", &["--animation", "Proud"]);
    assert_kept(&before, &Parts::of(&fs::read(folder.join("out.glb")).unwrap()), 0);
    let clip_of = |name: &str| clip(&read(&folder.join(name)).unwrap());
    let bvh = clip_of("out.bvh");
    for name in ["out.glb#Walk", "added.glb#Proud"] {
        let off = apart(&bvh, &clip_of(name));
        assert!(off < 1e-4, "{name}: {off}");
    }
    // VRM is glTF, whatever the file is called.
    fs::copy(folder.join("hero.glb"), folder.join("hero.vrm")).unwrap();
    let input = file("hero.vrm#Walk");
    run(&["translate", "--db", &db, "--input", &input, "--style", "proud", "-o", &file("out.vrm")]);
    assert_eq!(fs::read(folder.join("out.vrm")).unwrap(), fs::read(folder.join("out.glb")).unwrap());
    assert_eq!(clip_of("added.glb#Walk").frames, clip_of("hero.glb#Walk").frames);
    for (output, said) in [
        ("hero.glb", "over an input"),
        ("out.gltf", "choose a name that ends in .bvh or .glb"),
        ("out.fbx", "this ending can't be written: choose a name that ends in .bvh or .glb"),
    ] {
        let message = refused(&[&translate[..], &["-o", &file(output)]].concat());
        assert!(message.contains(said), "{output}: {message}");
    }
    let message = refused(&[&translate[..], &["-o", &file("out.bvh"), "--animation", "x"]].concat());
    assert!(message.contains("--animation x does nothing"), "{message}");
}

/// A `.gltf` keeps its files beside it; in another folder, where they are not, they are put into it.
#[test]
fn text_keeps_its_files() {
    let (folder, file) = folder("gltf-write-text");
    let mut parts = hero();
    parts.json["buffers"][0]["uri"] = json!("hero%20data.bin");
    parts.json["images"] = json!([{"uri": "skin.png"}]);
    fs::write(folder.join("hero.gltf"), parts.json.to_string()).unwrap();
    fs::write(folder.join("hero data.bin"), &parts.bin).unwrap();
    fs::write(folder.join("skin.png"), b"no picture").unwrap();
    let (db, input) = (file("walks.gestus"), file("hero.gltf#Walk"));
    let translate = ["translate", "--db", &db, "--input", &input, "--style", "proud"];
    let json_of = |name: &str| -> Value {
        run(&[&translate[..], &["-o", &file(name)]].concat());
        serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
    };
    let (here, there) = (json_of("out.gltf"), json_of("elsewhere/out.gltf"));
    assert_eq!((&here["buffers"][0], &here["images"]), (&parts.json["buffers"][0], &parts.json["images"]));
    let data = |bytes: &[u8], media: &str| json!(format!("data:{media};base64,{}", STANDARD.encode(bytes)));
    assert_eq!(there["buffers"][0]["uri"], data(&parts.bin, "application/octet-stream"));
    assert_eq!(there["images"][0]["uri"], data(b"no picture", "image/png"));
    let clips = ["out.gltf#Walk", "elsewhere/out.gltf#Walk"].map(|n| clip(&read(&folder.join(n)).unwrap()));
    assert_eq!(clips[0].frames, clips[1].frames);
    fs::remove_file(folder.join("skin.png")).unwrap();
    let message = refused(&[&translate[..], &["-o", &file("elsewhere/out.gltf")]].concat());
    assert!(message.contains("it needs skin.png, which can't be copied"), "{message}");
}
