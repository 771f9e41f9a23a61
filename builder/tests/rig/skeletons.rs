//! What clips look like on characters of other names, axes, units and poses of rest.

use std::fs;

use gestus_database::data_folder::{
    config::Config,
    load::{Loaded, load},
};
use gestus_motion::{clip::Clip, corpus::Corpus, formats::bvh::Bvh, unit::Unit};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    character::Character,
    common,
    foreign::{Foreign, apart},
    walks, with_rest,
};

/// Loads the walks on a character.
fn loaded(name: &str, file: &str, bytes: &[u8]) -> Loaded {
    let [folder, data] = walks(name);
    let path = folder.join(file);
    fs::write(&path, bytes).unwrap();
    load(&Config { data: Some(data), rig: Some(path), ..Config::default() }).unwrap()
}

/// The clips of a corpus on the joints of another, by name, with its poses of rest cut off.
fn truth(of: impl Fn(Foreign) -> Foreign, skeleton: &gestus_motion::clip::Skeleton) -> Vec<Clip> {
    let clip = |example: &gestus_motion::corpus::Example| {
        let foreign = of(with_rest(&example.clip));
        let joints: Vec<usize> =
            skeleton.names.iter().map(|name| foreign.0.skeleton.find(name).unwrap()).collect();
        let mut clip = foreign.0;
        clip.frames.pop();
        clip.frames.iter_mut().for_each(|frame| *frame = frame.on_joints(&joints));
        clip.skeleton = gestus_motion::joints::skeleton_of(&clip.skeleton, &joints);
        clip
    };
    common::corpus().examples.iter().map(clip).collect()
}

/// Share of the frames and feet whose contacts are those of another corpus.
fn same_contacts(a: &Corpus, b: &Corpus) -> f64 {
    let pairs = a.examples.iter().zip(&b.examples).flat_map(|(a, b)| a.contacts.iter().zip(&b.contacts));
    let same: Vec<bool> = pairs.flat_map(|(a, b)| [a[0] == b[0], a[1] == b[1]]).collect();
    same.iter().filter(|same| **same).count() as f64 / same.len() as f64
}

fn a_pose(character: &mut Character) {
    for (name, angle) in [("LeftArm", -0.8), ("RightArm", 0.8)] {
        let joint = character.skeleton.names.iter().position(|n| n.ends_with(name)).unwrap();
        let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), angle);
        character.nodes.rotations[joint] = turn;
    }
    character.bound = Some(character.nodes.clone());
}

/// A character is measured on its rest pose alone, and its clips are as the same body would do them.
#[test]
fn clips_on_a_character_are_those_of_its_body() {
    let mixamo = |f: Foreign| f.mixamo();
    let turned = |f: Foreign| f.mixamo().turned();
    let larger = |f: Foreign| f.mixamo().turned().scaled(1.25);
    let more = |f: Foreign| f.mixamo().with_more_joints();
    type Change = fn(Foreign) -> Foreign;
    type Pose = fn(&mut Character);
    let cases: [(&str, Change, Pose); 9] = [
        ("T-pose", mixamo, |_| ()),
        ("A-pose", mixamo, a_pose),
        ("no skin", mixamo, |c| c.bound = None),
        ("own axes", turned, |_| ()),
        ("own axes, no skin", turned, |c| c.bound = None),
        ("centimetres under a scaled armature", turned, |c| c.unit_m = 0.01),
        ("a mesh that lies", turned, |c| {
            c.unit_m = 0.01;
            c.mesh = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        }),
        ("larger", larger, |_| ()),
        ("helpers and fingers", more, |_| ()),
    ];
    let plain = {
        let [_, data] = walks("rig-plain");
        load(&Config { data: Some(data), ..Config::default() }).unwrap().corpus
    };
    for (i, (name, change, pose)) in cases.into_iter().enumerate() {
        let mut character = Character::of(&change(with_rest(common::walk())));
        pose(&mut character);
        let loaded = loaded(&format!("rig-{i}"), "hero.glb", &character.glb());
        let rig = loaded.rig.as_ref().unwrap();
        assert_eq!((rig.file.as_str(), &rig.notes), ("hero.glb", &Vec::new()), "{name}");
        let corpus = &loaded.corpus;
        let fingers = corpus.skeleton.names.iter().any(|n| n.contains("Finger"));
        assert!(!fingers && corpus.skeleton.joints() >= 21, "{name}: {:?}", corpus.skeleton.names);
        for (clip, truth) in corpus.examples.iter().map(|e| &e.clip).zip(truth(change, &corpus.skeleton)) {
            let scale = truth.skeleton.offsets[1].norm() / 0.1;
            let (mean, most) = apart(&clip.frames, &truth.frames, &truth.skeleton);
            assert!(mean < 1.0 * scale && most < 5.0 * scale, "{name}: {mean} cm, at most {most}");
            let drop = clip.frames.iter().zip(&truth.frames).map(|(a, b)| (a.root.y - b.root.y).abs());
            let drop = drop.fold(0.0, f64::max);
            assert!(drop < 0.015 * scale, "{name}: the hips are {drop} m off");
        }
        let same = same_contacts(corpus, &plain);
        assert!(same > 0.97, "{name}: {same} of the contacts are the same");
    }
}

/// Exporters write a frame of some animation as the pose of the nodes; the mesh's is the T-pose.
#[test]
fn the_pose_of_the_mesh_is_taken_where_the_nodes_are_in_another() {
    let change = |f: Foreign| f.mixamo().turned();
    let foreign = change(with_rest(common::walk()));
    let mut character = Character::of(&foreign);
    // In mid-stride, with its hips lower.
    character.nodes = foreign.0.frames[20].clone();
    let loaded = loaded("rig-stride", "hero.glb", &character.glb());
    assert_eq!(loaded.rig.unwrap().notes, Vec::<String>::new());
    let corpus = loaded.corpus;
    let truth = truth(change, &corpus.skeleton);
    let (mean, most) = apart(&corpus.examples[0].clip.frames, &truth[0].frames, &truth[0].skeleton);
    assert!(mean < 1.5 && most < 6.0, "{mean} cm, at most {most}");
}

/// Left is where the feet say that it is, and a body without toes is one.
#[test]
fn a_character_without_toes_stands_on_the_floor_on_its_left_and_right() {
    let mut foreign = with_rest(common::walk()).mixamo();
    let toes = |name: &String| name.ends_with("ToeBase");
    let kept: Vec<usize> =
        (0..foreign.0.skeleton.joints()).filter(|&j| !toes(&foreign.0.skeleton.names[j])).collect();
    foreign.0.frames.iter_mut().for_each(|frame| *frame = frame.on_joints(&kept));
    foreign.0.skeleton = gestus_motion::joints::skeleton_of(&foreign.0.skeleton, &kept);
    let loaded = loaded("rig-toeless", "hero.glb", &Character::of(&foreign).glb());
    let corpus = &loaded.corpus;
    let [left, right] =
        ["LeftFoot", "RightFoot"].map(|n| corpus.skeleton.find(&format!("mixamorig:{n}")).unwrap());
    for (example, plain) in corpus.examples.iter().zip(&common::corpus().examples) {
        let names = &plain.clip.skeleton;
        let [l, r] = ["Foot_L", "Foot_R"].map(|n| names.find(n).unwrap());
        for ((frame, truth), stands) in
            example.clip.frames.iter().zip(&plain.clip.frames).zip(&example.contacts)
        {
            let (p, q) = (frame.positions(&corpus.skeleton), truth.positions(names));
            assert!((p[left] - p[right] - (q[l] - q[r])).norm() < 0.02, "the feet are elsewhere");
            for (foot, stands) in [left, right].into_iter().zip(stands) {
                assert!(p[foot].y > 0.065 && (!stands || p[foot].y < 0.25), "a foot at {}", p[foot].y);
            }
        }
    }
}

/// Exporters forget to scale: a character 170 m tall is one in centimetres, and its clips are found to be so as well.
#[test]
fn a_character_in_centimetres_that_says_metres_is_found_to_be_one() {
    let change = |f: Foreign| f.mixamo();
    let mut character = Character::of(&change(with_rest(common::walk())).scaled(100.0));
    character.bound = None;
    let loaded = loaded("rig-large", "hero.glb", &character.glb());
    let rig = loaded.rig.as_ref().unwrap();
    assert!((rig.body.anatomy.leg_m - 0.81).abs() < 0.01, "{}", rig.body.anatomy.leg_m);
    assert!(rig.notes[0].contains("0.01 m; if that is wrong, give the unit"), "{:?}", rig.notes);
    let truth = truth(change, &loaded.corpus.skeleton);
    let (mean, most) = apart(&loaded.corpus.examples[0].clip.frames, &truth[0].frames, &truth[0].skeleton);
    assert!(mean < 1.0 && most < 5.0, "{mean} cm, at most {most}");
}

/// A BVH file says no unit, and a child is no adult in another: its unit can be stated.
#[test]
fn a_child_is_as_tall_as_its_stated_unit_makes_it() {
    let child = with_rest(common::walk()).mixamo().scaled(0.6).0;
    let rest = Clip { frames: child.frames[child.frames.len() - 1..].to_vec(), ..child };
    let decimetres = Unit::Other(0.1);
    let text = Bvh::from_clip(&rest, decimetres).unwrap().to_text();
    let legs = |unit: Option<&str>| {
        let [folder, data] = walks("rig-child");
        let path = folder.join("child.bvh");
        fs::write(&path, &text).unwrap();
        let rig_unit = unit.map(str::to_owned);
        let config = Config { data: Some(data), rig: Some(path), rig_unit, ..Config::default() };
        load(&config).unwrap().rig.unwrap().body.anatomy.leg_m
    };
    let truth = 0.6 * 0.81;
    assert!((legs(Some("0.1")) - truth).abs() < 0.01, "{}", legs(Some("0.1")));
    assert!((legs(None) - truth).abs() > 0.1, "{}", legs(None));
}

/// Joints of a skeleton put before its legs, each with no length and its rotation in all poses; the legs hang on the last.
fn with_hip_joints(mut foreign: Foreign, names: [&str; 2], turns: [UnitQuaternion<f64>; 2]) -> Foreign {
    // The thighs, left and right, are joints 13 and 17.
    for (at, (name, turn)) in [13, 18].into_iter().zip(names.into_iter().zip(turns)) {
        foreign.skeleton(|s| {
            s.parents.iter_mut().flatten().filter(|p| **p >= at).for_each(|p| *p += 1);
            s.names.insert(at, name.to_owned());
            s.offsets.insert(at, Vector3::zeros());
            s.parents.insert(at, Some(0));
            s.parents[at + 1] = Some(at);
            s.offsets[at + 1] = turn.inverse() * s.offsets[at + 1];
        });
        for frame in &mut foreign.0.frames {
            frame.rotations[at] = turn.inverse() * frame.rotations[at];
            frame.rotations.insert(at, turn);
        }
    }
    foreign
}

/// Thighs on joints of their own, whose axes turn the hips' line away with zero rotations.
#[test]
fn joints_between_hips_and_thighs_may_be_turned() {
    let about = |v: Vector3<f64>| UnitQuaternion::from_scaled_axis(v);
    let turns = [about(Vector3::new(0.3, 1.4, 0.0)), about(Vector3::new(0.2, -1.5, 0.4))];
    let change = |f: Foreign| with_hip_joints(f.mixamo(), ["Hip.L", "Hip.R"], turns);
    let character = Character::of(&change(with_rest(common::walk())));
    let corpus = loaded("rig-askew", "hero.glb", &character.glb()).corpus;
    let truth = truth(change, &corpus.skeleton);
    let (mean, most) = apart(&corpus.examples[0].clip.frames, &truth[0].frames, &truth[0].skeleton);
    assert!(mean < 1.0 && most < 5.0, "{mean} cm, at most {most}");
    let body = gestus_motion::body::Body::of(&corpus).unwrap();
    assert!(body.hips_line.angle(&Vector3::x()) < 0.1, "{}", body.hips_line);
}

/// The mesh's rig may have its pelvis beside the joint that carries the arms.
#[test]
fn a_pelvis_beside_the_arms_is_not_the_whole_body() {
    let mut foreign = with_rest(common::walk());
    let same = [UnitQuaternion::identity(); 2];
    foreign = with_hip_joints(foreign.mixamo(), ["pelvis", "spare"], same);
    foreign.skeleton(|s| {
        s.names[0] = "body_ctrl".to_owned();
        let right = s.names.iter().position(|n| n.ends_with("RightUpLeg")).unwrap();
        s.parents[right] = Some(13);
    });
    let corpus = loaded("rig-pelvis", "hero.glb", &Character::of(&foreign).glb()).corpus;
    assert_eq!(corpus.skeleton.names[0], "body_ctrl");
    assert!(corpus.skeleton.find("mixamorig:LeftHand").is_some() && corpus.skeleton.find("spare").is_none());
}

/// Whatever a file holds, it is read or refused.
#[test]
fn damaged_characters_are_refused_or_harmless() {
    let whole = Character::of(&with_rest(common::walk()).mixamo().turned()).glb();
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("rig-damaged");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join("hero.glb");
    let mut state = 11u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    let mut read = 0;
    for _ in 0..400 {
        let mut bytes = whole.clone();
        for _ in 0..1 + next() % 4 {
            let at = 20 + next() % (bytes.len() - 20);
            bytes[at] = next() as u8;
        }
        fs::write(&path, &bytes).unwrap();
        let rig = gestus_database::data_folder::rig::Rig::read(&path, &Default::default(), None, &[]);
        match rig {
            Ok(rig) => {
                read += 1;
                assert!(rig.body.skeleton.offsets.iter().all(|o| o.norm() < 100.0));
            }
            Err(error) => assert!(error.to_string().contains("hero.glb"), "{error}"),
        }
    }
    assert!((20..400).contains(&read), "{read} of 400 could be read");
}
