//! Other skeletons made from generated motion, so that the truth is known: renamed, rescaled, with other axes and rest
//! poses, more joints, another up.

mod common;

use std::sync::Arc;

use common::{database, walk};
use gestus_core::{
    BlobError, Pose,
    blob::{crc::crc32c, layout::section},
    retarget::{
        Map,
        layout::{self, MAX_SOURCES, header, joint, limb, record},
    },
};
use gestus_database::{
    registration::contact::contacts,
    retarget::{
        IdentifyError, MapError, MapFile, Retarget,
        parts::{Part, Side},
        shape::ShapeError,
    },
    stream::cleanup::{Limbs, above_floor},
};
use gestus_evaluate::measures::retarget::{directions, offsets};
use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    landmarks::Landmarks,
};
use nalgebra::{UnitQuaternion, Vector3};

/// The same motion on another skeleton.
#[derive(Clone)]
struct Foreign(Clip);

impl Foreign {
    fn new() -> Self {
        Self(walk().clone())
    }

    fn skeleton(&mut self, change: impl FnOnce(&mut Skeleton)) {
        let mut skeleton = (*self.0.skeleton).clone();
        change(&mut skeleton);
        self.0.skeleton = Arc::new(skeleton);
    }

    fn named(mut self, name: impl Fn(usize, &str) -> String) -> Self {
        self.skeleton(|s| s.names = s.names.iter().enumerate().map(|(j, n)| name(j, n)).collect());
        self
    }

    /// Names as Mixamo has them.
    fn mixamo(self) -> Self {
        self.named(|_, name| {
            let (stem, side) = name.split_once('_').unwrap_or((name, ""));
            let side = match side {
                "L" => "Left",
                "R" => "Right",
                _ => "",
            };
            let stem = match stem {
                "UpperArm" => "Arm",
                "LowerArm" => "ForeArm",
                "UpperLeg" => "UpLeg",
                "LowerLeg" => "Leg",
                "Toes" => "ToeBase",
                other => other,
            };
            format!("mixamorig:{side}{stem}")
        })
    }

    /// Every joint in axes of its own: the rest pose is a heap of bones, the motion is the same.
    fn turned(mut self) -> Self {
        let own = |j: usize| {
            let v = Vector3::new(
                (1.7 * j as f64).sin(),
                (2.3 * j as f64 + 1.0).cos(),
                (0.9 * j as f64 + 2.0).sin(),
            );
            UnitQuaternion::from_scaled_axis(v * 2.0)
        };
        let parents = self.0.skeleton.parents.clone();
        self.skeleton(|s| {
            for j in 1..s.joints() {
                s.offsets[j] = own(parents[j].unwrap()).inverse() * s.offsets[j];
            }
        });
        for frame in &mut self.0.frames {
            for j in 0..frame.rotations.len() {
                let before = parents[j].map_or_else(UnitQuaternion::identity, own);
                frame.rotations[j] = before.inverse() * frame.rotations[j] * own(j);
            }
        }
        self
    }

    fn scaled(mut self, scale: f64) -> Self {
        self.skeleton(|s| s.offsets.iter_mut().for_each(|o| *o *= scale));
        self.0.frames.iter_mut().for_each(|f| f.root *= scale);
        self
    }

    /// Z up, as robots and some tools have it.
    fn z_up(mut self) -> Self {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        for frame in &mut self.0.frames {
            frame.root = turn * frame.root;
            frame.rotations[0] = turn * frame.rotations[0];
        }
        self
    }

    /// One more joint, which does not turn.
    fn with_joint(mut self, on: &str, offset: Vector3<f64>) -> Self {
        let on = self.0.skeleton.find(on);
        self.skeleton(|s| {
            s.names.push(format!("thing {}", s.joints()));
            s.parents.push(on);
            s.offsets.push(offset);
        });
        self.0.frames.iter_mut().for_each(|f| f.rotations.push(UnitQuaternion::identity()));
        self
    }

    /// A joint in the middle of a bone, which does not turn; and two that hang on the hand.
    fn with_more_joints(mut self) -> Self {
        let s = &self.0.skeleton;
        let arm = s.names.iter().position(|n| n.contains("ForeArm") && n.contains("Left")).unwrap();
        let hand = s.names.iter().position(|n| n.contains("LeftHand")).unwrap();
        let chest = s.names.iter().position(|n| n.ends_with("Chest")).unwrap();
        let count = s.joints();
        // New order: the old joints, with the new ones put in front of what hangs on them.
        type Bone = (String, Option<usize>, Vector3<f64>, Option<usize>);
        let mut order: Vec<Bone> = Vec::new();
        let mut place = vec![0; count];
        for j in 0..count {
            let parent = s.parents[j].map(|p| place[p]);
            let mut offset = s.offsets[j];
            let mut parent = parent;
            if j == arm || j == chest {
                order.push((format!("Helper{j}"), parent, offset * 0.4, None));
                parent = Some(order.len() - 1);
                offset *= 0.6;
            }
            place[j] = order.len();
            order.push((s.names[j].clone(), parent, offset, Some(j)));
            if j == hand {
                for finger in 0..2 {
                    let at = Vector3::new(0.07, 0.0, 0.01 * f64::from(finger));
                    order.push((format!("LeftFinger{finger}"), Some(place[j]), at, None));
                }
            }
        }
        let frames = self.0.frames.iter().map(|f| Frame {
            root: f.root,
            rotations: order
                .iter()
                .map(|o| o.3.map_or_else(UnitQuaternion::identity, |j| f.rotations[j]))
                .collect(),
        });
        self.0 = Clip {
            frames: frames.collect(),
            skeleton: Arc::new(Skeleton {
                names: order.iter().map(|o| o.0.clone()).collect(),
                parents: order.iter().map(|o| o.1).collect(),
                offsets: order.iter().map(|o| o.2).collect(),
            }),
            ..self.0
        };
        self
    }

    fn map(&self) -> Retarget {
        Retarget::new(&database(), &self.0, &MapFile::default()).unwrap()
    }
}

/// Mean and largest distance between the joints of two clips of one skeleton, hips at one place, centimetres.
fn apart(a: &[Frame], b: &[Frame], skeleton: &Skeleton) -> (f64, f64) {
    let (mut sum, mut most, mut count) = (0.0, 0.0f64, 0);
    for (f, g) in a.iter().zip(b) {
        let (p, q) = (f.positions(skeleton), g.positions(skeleton));
        for j in 0..skeleton.joints() {
            let d = 100.0 * ((p[j] - p[0]) - (q[j] - q[0])).norm();
            sum += d;
            most = most.max(d);
            count += 1;
        }
    }
    (sum / f64::from(count), most)
}

#[test]
fn the_same_body_in_other_words_axes_sizes_and_worlds_comes_in_as_it_was() {
    let numbered = |f: Foreign| f.named(|j, _| format!("joint{j}"));
    let cases: Vec<(&str, Foreign)> = vec![
        ("names", Foreign::new().mixamo()),
        ("axes", Foreign::new().mixamo().turned()),
        ("size", Foreign::new().mixamo().scaled(0.37)),
        ("up", Foreign::new().mixamo().z_up()),
        ("joints", Foreign::new().mixamo().with_more_joints()),
        ("no names", numbered(Foreign::new())),
        ("no names, other axes", numbered(Foreign::new().turned())),
        ("no names, up", numbered(Foreign::new().z_up())),
        ("no names, a sword", numbered(Foreign::new().with_joint("Hand_L", Vector3::new(0.0, 0.0, 1.2)))),
        (
            "no names, things in both hands, and a tail",
            numbered(
                Foreign::new()
                    .with_joint("Hand_L", Vector3::new(0.0, 0.0, 0.5))
                    .with_joint("Hand_R", Vector3::new(0.0, 0.0, 0.9))
                    .with_joint("Hips", Vector3::new(0.0, 0.0, -0.6)),
            ),
        ),
        ("everything", Foreign::new().mixamo().with_more_joints().turned().scaled(2.2).z_up()),
    ];
    let truth = walk();
    for (name, foreign) in cases {
        let map = foreign.map();
        let mapped = map.to_target(&foreign.0);
        let (mean, most) = apart(&truth.frames, &mapped.frames, &truth.skeleton);
        assert!(mean < 1.0 && most < 4.0, "{name}: {mean} cm, at most {most}");
        // The floor is where it was.
        let height = |f: &Frame| f.root.y;
        let drop = truth.frames.iter().zip(&mapped.frames).map(|(a, b)| (height(a) - height(b)).abs());
        let drop = drop.fold(0.0, f64::max);
        assert!(drop < 0.02, "{name}: the hips are {drop} m off");
    }
}

/// Some rigs carry the body by a root on the floor and turn the hips only: the feet of a few poses are above that root.
#[test]
fn up_is_where_the_hip_joints_are_though_the_root_is_on_the_floor() {
    let walk = walk();
    let height = walk.frames[0].root.y;
    let mut foreign = Foreign::new().mixamo();
    foreign.skeleton(|s| {
        s.names.insert(0, "Carrier".to_owned());
        s.parents =
            std::iter::once(None).chain(s.parents.iter().map(|p| Some(p.map_or(0, |p| p + 1)))).collect();
        s.offsets.insert(0, Vector3::zeros());
        s.offsets[1] = Vector3::new(0.0, height, 0.0);
    });
    for (frame, before) in foreign.0.frames.iter_mut().zip(&walk.frames) {
        frame.root = before.root - Vector3::new(0.0, height, 0.0);
        frame.rotations.insert(0, UnitQuaternion::identity());
    }
    for frames in [1, 20] {
        let mut few = foreign.clone();
        few.0.frames.truncate(frames);
        let map = few.map();
        assert!(map.world.angle() < 1e-6, "{frames} frames: up is turned by {}", map.world.angle());
        let mapped = map.to_target(&few.0);
        // Of one pose, elbows and knees that are straight tell no axis.
        let (mean, most) = apart(&walk.frames[..frames], &mapped.frames, &walk.skeleton);
        assert!(mean < 2.0 && most < 12.0, "{frames} frames: {mean} cm, at most {most}");
    }
}

/// Knees were bent backwards: the legs that lift feet out of the floor were found by names and by what zero rotations give.
#[test]
fn knees_of_lifted_feet_bend_ahead_whatever_the_names_and_axes() {
    let walk = walk();
    let ankle = |f: &Frame| {
        let p = f.positions(&walk.skeleton);
        let of = |name: &str| p[walk.skeleton.find(name).unwrap()].y;
        of("Foot_L").min(of("Foot_R"))
    };
    // Straight legs, 5 cm in the floor.
    let mut sunk = walk.frames[0].clone();
    sunk.rotations.iter_mut().for_each(|q| *q = UnitQuaternion::identity());
    let stands = walk.frames.iter().map(ankle).fold(f64::INFINITY, f64::min);
    sunk.root.y += stands - 0.05 - ankle(&sunk);
    let mut foreign = Foreign::new();
    foreign.0.frames.push(sunk);
    let exchanged = |name: &str| match name.rsplit_once('_') {
        Some((stem, "L")) => format!("{stem}_R"),
        Some((stem, "R")) => format!("{stem}_L"),
        _ => name.to_owned(),
    };
    for (what, foreign) in [
        ("names", foreign.clone().mixamo()),
        ("exchanged", foreign.clone().named(|_, name| exchanged(name))),
        ("axes", foreign.clone().mixamo().turned()),
        ("no names", foreign.named(|j, _| format!("joint{j}")).turned()),
    ] {
        let source = foreign.map().source;
        let clip = &foreign.0;
        let legs = source.legs().unwrap();
        let line = source.hips_line(&clip.frames);
        let limbs = Limbs::of_landmarks(&legs, line, clip).unwrap().0;
        let lifted = above_floor(&limbs, &clip.frames[clip.frames.len() - 1..], 0.01);
        let p = lifted[0].positions(&clip.skeleton);
        for side in 0..2 {
            let [hip, knee, foot] = [legs.hip_joints, legs.knees, legs.feet].map(|joints| p[joints[side]]);
            let ahead = knee.z - 0.5 * (hip.z + foot.z);
            assert!(ahead > 0.03, "{what}: the knee is {ahead} m ahead");
        }
    }
}

/// Left is where left is.
#[test]
fn names_that_contradict_the_feet_are_exchanged_and_told() {
    let exchanged = Foreign::new().named(|_, name| match name.rsplit_once('_') {
        Some((stem, "L")) => format!("{stem}_R"),
        Some((stem, "R")) => format!("{stem}_L"),
        _ => name.to_owned(),
    });
    let map = exchanged.map();
    let left = map.source.parts.get(Part::UpperLeg(Side::Left)).unwrap();
    assert_eq!(map.source.skeleton.names[left], "UpperLeg_R");
    assert!(map.doubts().iter().any(|d| d.contains("left and right are exchanged")), "{:?}", map.doubts());
    let mapped = map.to_target(&exchanged.0);
    let (mean, most) = apart(&walk().frames, &mapped.frames, &walk().skeleton);
    assert!(mean < 1.0 && most < 4.0, "{mean} cm, at most {most}");
    assert!(Foreign::new().map().doubts().iter().all(|d| !d.contains("exchanged")));
}

#[test]
fn what_goes_in_comes_back() {
    for foreign in [
        Foreign::new().mixamo(),
        Foreign::new().mixamo().turned().scaled(1.3),
        Foreign::new().mixamo().with_more_joints().z_up(),
    ] {
        let map = foreign.map();
        let back = map.to_source(&map.to_target(&foreign.0).frames, &foreign.0.frames);
        let (mean, most) = apart(&foreign.0.frames, &back, &foreign.0.skeleton);
        let size = 100.0 * map.source.anatomy.leg_m;
        assert!(mean < 0.003 * size && most < 0.03 * size, "{mean} cm, at most {most}");
        let moved = foreign.0.frames.iter().zip(&back).map(|(a, b)| (a.root - b.root).norm());
        assert!(moved.fold(0.0, f64::max) < 1e-3);
    }
}

#[test]
fn other_proportions_keep_directions_and_contacts() {
    let mut foreign = Foreign::new().mixamo();
    foreign.skeleton(|s| {
        for j in 0..s.joints() {
            let name = s.names[j].clone();
            // Long lower arms, short thighs, a long trunk.
            let factor = match () {
                () if name.ends_with("Hand") => 1.25,
                () if name.ends_with("LeftLeg") || name.ends_with("RightLeg") => 0.85,
                () if name.ends_with("Chest") => 1.2,
                () => 1.0,
            };
            s.offsets[j] *= factor;
        }
    });
    // The hips come down by what the thighs lost.
    let lost = 0.15 * 0.41;
    foreign.0.frames.iter_mut().for_each(|f| f.root.y -= lost);
    let map = foreign.map();
    let mapped = map.to_target(&foreign.0);
    let stands = |clip: &Clip| contacts(clip, &Landmarks::find(&clip.skeleton).unwrap());
    for side in Side::BOTH {
        for (from, to) in [(Part::UpperArm(side), Part::Hand(side)), (Part::UpperLeg(side), Part::Foot(side))]
        {
            let d = directions((&map.source, &foreign.0.frames), (&map.target, &mapped.frames), from, to)
                .unwrap();
            assert!(d.max_deg < 5.0, "{to}: {d:?}");
        }
    }
    let steps = offsets(&stands(&foreign.0), &stands(&mapped), 8);
    assert!(steps.matched >= 8 && steps.unmatched == 0 && steps.max_frames <= 2.0, "{steps:?}");
}

#[test]
fn a_file_says_what_names_and_shape_do_not() {
    // Legs that are called arms: names lead astray, the file leads back.
    let foreign = Foreign::new().named(|_, name| match name {
        "UpperLeg_L" => "one".into(),
        "LowerLeg_L" => "two".into(),
        "Foot_L" => "three".into(),
        other => other.to_owned(),
    });
    let file = MapFile::parse(
        "[joints]\nleft-upper-leg = \"one\"\nleft-lower-leg = \"two\"\nleft-foot = \"three\"\nleft-toes = \"\"\n",
        "m.toml",
    )
    .unwrap();
    let map = Retarget::new(&database(), &foreign.0, &file).unwrap();
    assert_eq!(map.source.parts.get(Part::Foot(Side::Left)), foreign.0.skeleton.find("three"));
    assert_eq!(map.source.parts.get(Part::Toes(Side::Left)), None);
    let wrong = MapFile::parse("[joints]\nleft-foot = \"four\"\n", "m.toml").unwrap();
    let error = Retarget::new(&database(), &foreign.0, &wrong).unwrap_err();
    assert!(matches!(error, MapError::Source(IdentifyError::NoSuchJoint { .. })), "{error}");
}

#[test]
fn what_is_no_body_is_refused_in_words() {
    let mut foreign = Foreign::new();
    // Half a body: no legs.
    foreign.skeleton(|s| {
        s.names.truncate(13);
        s.parents.truncate(13);
        s.offsets.truncate(13);
    });
    foreign.0.frames.iter_mut().for_each(|f| f.rotations.truncate(13));
    let message = Retarget::new(&database(), &foreign.0, &MapFile::default()).unwrap_err().to_string();
    assert!(message.contains("left-upper-leg") && message.contains("--map"), "{message}");
}

/// Characters with hair, faces and clothes were refused for their number of joints.
#[test]
fn a_character_of_many_joints_is_mapped_by_its_body() {
    let mut hairy = Foreign::new().mixamo();
    for i in 0..120 {
        let on = if i % 2 == 0 { "mixamorig:Head" } else { "mixamorig:Hips" };
        hairy = hairy.with_joint(on, Vector3::new(0.0, 0.05, -0.01 * f64::from(i)));
    }
    let joints = hairy.0.skeleton.joints();
    assert!(joints > MAX_SOURCES);
    let own = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.3);
    hairy.0.frames.iter_mut().for_each(|f| f.rotations[joints - 1] = own);
    let map = hairy.map();
    let mapped = map.to_target(&hairy.0);
    let (mean, most) = apart(&walk().frames, &mapped.frames, &walk().skeleton);
    assert!(mean < 1.0 && most < 4.0, "{mean} cm, at most {most}");
    let back = map.to_source(&mapped.frames, &hairy.0.frames);
    let (mean, most) = apart(&hairy.0.frames, &back, &hairy.0.skeleton);
    assert!(mean < 0.3 && most < 3.0, "{mean} cm, at most {most}");
    assert!(back.iter().all(|f| f.rotations[joints - 1] == own));
}

/// A skeleton of two combs of equal bones has as many pairs of limbs as there are.
#[test]
fn shapes_of_many_joints_are_looked_at_in_bounded_time() {
    for joints in [1_000usize, 4_000] {
        let parent = |j: usize| if j < 3 { 0 } else { j - 2 };
        let skeleton = Skeleton {
            names: (0..joints).map(|j| format!("joint{j}")).collect(),
            parents: (0..joints).map(|j| (j > 0).then(|| parent(j))).collect(),
            offsets: (0..joints)
                .map(|j| Vector3::new(0.0, -0.01 * f64::from(u8::from(j > 0)), 0.0))
                .collect(),
        };
        let pose = Frame { root: Vector3::zeros(), rotations: vec![UnitQuaternion::identity(); joints] };
        let clip = Clip { skeleton: Arc::new(skeleton), frames: vec![pose; 30], ..walk().clone() };
        let start = std::time::Instant::now();
        let error = Retarget::new(&database(), &clip, &MapFile::default()).unwrap_err();
        assert!(matches!(error, MapError::Source(IdentifyError::Missing { .. })), "{error}");
        assert!(start.elapsed().as_secs_f64() < 20.0, "{:?}", start.elapsed());
    }
}

/// Exchanged sides turn a body around, so they are not guessed.
#[test]
fn sides_that_nothing_shows_are_not_guessed() {
    let mut still = Foreign::new().named(|j, _| format!("joint{j}"));
    let toes = ["Toes_L", "Toes_R"].map(|name| walk().skeleton.find(name).unwrap());
    still.skeleton(|s| toes.iter().for_each(|&j| s.offsets[j] = Vector3::zeros()));
    let straight = Frame {
        root: still.0.frames[0].root,
        rotations: vec![UnitQuaternion::identity(); still.0.skeleton.joints()],
    };
    let walks = Retarget::new(&database(), &still.0, &MapFile::default());
    assert!(walks.is_ok(), "the way shows it: {}", walks.unwrap_err());
    still.0.frames = vec![straight; 30];
    let error = Retarget::new(&database(), &still.0, &MapFile::default()).unwrap_err();
    let MapError::Source(IdentifyError::Missing { shape, .. }) = &error else { panic!("{error}") };
    assert_eq!(*shape, ShapeError::NoSides.to_string());
    // With a map file they need not be.
    let mut words = String::from("[joints]\n");
    for part in Part::all() {
        let name = |joint: usize| format!("{part} = \"joint{joint}\"\n");
        words += &Foreign::new().map().source.parts.get(part).map_or(String::new(), name);
    }
    let file = MapFile::parse(&words, "m.toml").unwrap();
    assert!(Retarget::new(&database(), &still.0, &file).is_ok());
}

#[test]
fn feet_that_hang_on_controls_are_refused_with_the_controls_names() {
    let rig = |controls: &[(&str, &str)]| {
        let mut foreign = Foreign::new().named(|_, name| {
            controls.iter().find(|(was, _)| *was == name).map_or(name, |(_, now)| now).to_owned()
        });
        foreign.skeleton(|s| {
            let foot = s.names.iter().position(|n| n == "Foot_L").unwrap();
            s.parents[foot] = Some(0);
        });
        Retarget::new(&database(), &foreign.0, &MapFile::default()).unwrap_err().to_string()
    };
    let message = rig(&[("Hips", "master_ik"), ("Toes_R", "KneePole.R")]);
    for words in ["left-foot (`Foot_L`)", "but on `master_ik`", "`KneePole.R` are controls", "baked"] {
        assert!(message.contains(words), "{words}: {message}");
    }
    // A tree that is odd in another way names none.
    let message = rig(&[]);
    assert!(!message.contains("control") && message.contains("--map"), "{message}");
}

/// A map with bytes changed and the checksum made right again.
fn patched(at: usize, bytes: &[u8]) -> Vec<u8> {
    let mut map = Foreign::new().mixamo().map().bytes().to_vec();
    map[at..at + bytes.len()].copy_from_slice(bytes);
    repaired(map)
}

fn repaired(mut map: Vec<u8>) -> Vec<u8> {
    map[header::CRC].fill(0);
    let crc = crc32c(&[&map]);
    map[header::CRC].copy_from_slice(&crc.to_le_bytes());
    map
}

#[test]
fn every_check_of_a_map_is_made() {
    const S: u16 = section::RETARGET;
    let whole = Foreign::new().mixamo().map().bytes().to_vec();
    assert!(Map::open(&whole).is_ok());
    let joints = header::LENGTH;
    let n = 21;
    let records = joints + 2 * n * joint::LENGTH;
    let limbs = records + 2 * n * record::LENGTH;
    let value = |record: usize| BlobError::Value { section: S, record: record as u32 };
    let nan = f32::NAN.to_le_bytes();
    let two = 2.0f32.to_le_bytes();
    let cases: Vec<(&str, Vec<u8>, BlobError)> = vec![
        ("magic", patched(0, b"X"), BlobError::Magic),
        ("version", patched(header::VERSION.start, &[9, 0]), BlobError::Version { need: 1, have: 9 }),
        (
            "length",
            repaired(whole[..whole.len() - 8].to_vec()),
            BlobError::Truncated { need: whole.len() as u32, have: whole.len() as u32 - 8 },
        ),
        (
            "counts",
            patched(header::LIMBS.start, &[1, 0]),
            BlobError::Length { section: S, need: whole.len() as u32 - 24, have: whole.len() as u32 },
        ),
        ("too many limbs", patched(header::LIMBS.start, &[9, 0]), value(0)),
        ("no joints", patched(header::SOURCES.start, &[0, 0]), value(0)),
        ("reserved", patched(header::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("scale", patched(header::SCALE.start, &nan), value(0)),
        ("world", patched(header::WORLD.start, &two), value(0)),
        ("hips", patched(header::SOURCE_HIPS.start, &nan), value(0)),
        ("ankle", patched(header::TARGET_ANKLE.start, &nan), value(0)),
        ("parent", patched(joints + joint::LENGTH + joint::PARENT, &[7]), value(2)),
        ("root", patched(joints + joint::PARENT, &[0]), value(1)),
        ("segment", patched(joints + joint::SEGMENT, &[9]), value(1)),
        ("joint reserved", patched(joints + joint::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
        ("offset", patched(joints + n * joint::LENGTH + joint::OFFSET.start, &nan), value(n + 1)),
        ("kind", patched(records + record::KIND, &[2]), value(2 * n + 1)),
        ("root stays", patched(records + record::KIND, &[0]), value(2 * n + 1)),
        ("from", patched(records + record::FROM.start, &[21]), value(2 * n + 1)),
        ("weight", patched(records + record::WEIGHT.start, &two), value(2 * n + 1)),
        ("turn", patched(records + record::TURNS.start, &two), value(2 * n + 1)),
        ("record reserved", patched(records + record::RESERVED, &[1]), BlobError::Reserved { section: S }),
        ("limb", patched(limbs, &[20, 3, 4]), value(4 * n + 1)),
        ("limb kind", patched(limbs + limb::KIND, &[7]), value(4 * n + 1)),
        ("limb reserved", patched(limbs + limb::RESERVED.start, &[1]), BlobError::Reserved { section: S }),
    ];
    for (name, bytes, error) in cases {
        assert_eq!(Map::open(&bytes).err(), Some(error), "{name}");
    }
    let mut damaged = whole.clone();
    damaged[200] ^= 1;
    assert_eq!(Map::open(&damaged).err(), Some(BlobError::Checksum { section: S }));
    assert!(matches!(Map::open(&whole[..50]).err(), Some(BlobError::Truncated { .. })));
    assert_eq!(whole.len(), layout::total(n, n, 4));
}

#[test]
fn any_bytes_are_refused_or_harmless() {
    let whole = Foreign::new().mixamo().map().bytes().to_vec();
    let mut state = 7u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as usize
    };
    let input = gestus_database::stream::to_pose::<24>(&walk().frames[3]);
    for _ in 0..3000 {
        let mut bytes = whole.clone();
        for _ in 0..1 + next() % 3 {
            let at = next() % bytes.len();
            bytes[at] = next() as u8;
        }
        let bytes = repaired(bytes);
        if let Ok(map) = Map::open(&bytes) {
            // Too small a pose is no reason to break either.
            let (mut pose, mut small, mut back) =
                (Pose::<22>::IDENTITY, Pose::<5>::IDENTITY, Pose::<24>::IDENTITY);
            map.to_target(&input, &mut pose);
            map.to_target(&input, &mut small);
            map.to_source(&pose, &input, &mut back);
            assert!(pose.rotations.iter().all(|q| q.iter().all(|v| v.is_finite())));
        }
    }
}

#[test]
fn a_pose_that_is_none_does_no_harm() {
    let foreign = Foreign::new().mixamo();
    let map = foreign.map();
    let map = Map::open(map.bytes()).unwrap();
    let mut input = Pose::<24>::IDENTITY;
    input.position = [f32::NAN, f32::INFINITY, 1.0];
    input.rotations[5] = [f32::NAN; 4];
    let (mut pose, mut back) = (Pose::<22>::IDENTITY, Pose::<24>::IDENTITY);
    map.to_target(&input, &mut pose);
    map.to_source(&pose, &input, &mut back);
    // The stylizer sees that this is no pose, and holds.
    assert!(!pose.is_valid(21));
    // So it does where one rotation alone is none, whatever body part it is of.
    for joint in 0..map.sources() {
        for none in [[f32::NAN; 4], [0.0; 4]] {
            let mut input = Pose::<24>::IDENTITY;
            input.rotations[joint] = none;
            let (mut pose, mut back) = (Pose::<22>::IDENTITY, Pose::<24>::IDENTITY);
            map.to_target(&input, &mut pose);
            assert!(!pose.is_valid(21), "joint {joint}");
            // And the answer's joints without a counterpart stay where they were.
            back.rotations.fill([0.0, 0.6, 0.0, 0.8]);
            let before = back;
            map.to_source(&Pose::<22>::IDENTITY, &input, &mut back);
            assert!(back.is_valid(map.sources()));
            let mut wanted = before;
            map.to_source(&Pose::<22>::IDENTITY, &before, &mut wanted);
            assert_eq!(back, wanted, "joint {joint}");
        }
    }
    assert!(map.fits(&database(), 24).is_ok());
    assert!(map.fits(&database(), 20).is_err());
}
