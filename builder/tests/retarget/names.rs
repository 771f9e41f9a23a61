//! What the names of joints say, where they are wrong, and what a map file says instead.

use gestus_database::retarget::{
    IdentifyError, MapError, MapFile, Retarget,
    parts::{Part, Side},
};

use crate::{
    common::{database, walk},
    foreign::{Foreign, apart},
};

/// Left is where left is.
#[test]
fn names_that_contradict_the_feet_are_exchanged_and_told() {
    let exchanged = Foreign::new().exchanged();
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

/// A character of `cube2-data`, whose arms were taken for legs: its names are of no one family.
#[test]
fn names_of_several_families_and_of_controls_are_understood() {
    let foreign = Foreign::new().named(|_, name| {
        let (stem, side) = name.rsplit_once('_').unwrap_or((name, ""));
        let called = match stem {
            "UpperLeg" => "Femur",
            "LowerLeg" => "Shin",
            "UpperArm" => "Humerus",
            "LowerArm" => "Forearm",
            other => other,
        };
        if side.is_empty() { called.to_owned() } else { format!("CTRL_FK_{called}.{side}") }
    });
    let map = foreign.map();
    let joint = |part| map.source.parts.get(part).map(|j| map.source.skeleton.names[j].as_str());
    for (part, name) in [
        (Part::UpperLeg(Side::Left), "CTRL_FK_Femur.L"),
        (Part::Foot(Side::Right), "CTRL_FK_Foot.R"),
        (Part::UpperArm(Side::Right), "CTRL_FK_Humerus.R"),
        (Part::Hand(Side::Left), "CTRL_FK_Hand.L"),
    ] {
        assert_eq!(joint(part), Some(name));
    }
    assert!(map.doubts().iter().all(|doubt| !doubt.contains("by shape")), "{:?}", map.doubts());
}

/// Legs with a joint more, whose shins were taken for thighs.
#[test]
fn what_follows_named_bones_is_their_end() {
    let foreign = Foreign::new().named(|_, name| {
        name.replace("Foot_", "UpperFoot_").replace("Toes_", "LowerFoot_").replace("Hand_", "Paw_")
    });
    let map = foreign.map();
    let joint = |part| map.source.parts.get(part).map(|j| map.source.skeleton.names[j].as_str());
    assert_eq!(joint(Part::Foot(Side::Left)), Some("UpperFoot_L"));
    assert_eq!(joint(Part::Toes(Side::Right)), Some("LowerFoot_R"));
    assert_eq!(joint(Part::Hand(Side::Left)), Some("Paw_L"));
    assert!(map.doubts().iter().all(|doubt| !doubt.contains("by shape")), "{:?}", map.doubts());
}

/// Names that say a limb which the skeleton is not: shape is right, and the doubt says what the name is.
#[test]
fn a_name_that_shape_contradicts_is_told() {
    let foreign = Foreign::new().named(|_, name| match name {
        "UpperLeg_L" => "LowerLeg_L".into(),
        "LowerLeg_L" => "UpperLeg_L".into(),
        other => other.to_owned(),
    });
    let map = foreign.map();
    let wanted = "by its name `LowerLeg_L` is the left-lower-leg, and by shape the left-upper-leg";
    assert!(map.doubts().iter().any(|doubt| doubt.contains(wanted)), "{:?}", map.doubts());
}

#[test]
fn what_is_no_body_is_refused_with_the_part_that_is_missing() {
    let mut foreign = Foreign::new();
    // Half a body: no legs.
    foreign.skeleton(|s| {
        s.names.truncate(13);
        s.parents.truncate(13);
        s.offsets.truncate(13);
    });
    foreign.0.frames.iter_mut().for_each(|f| f.rotations.truncate(13));
    let error = Retarget::new(&database(), &foreign.0, &MapFile::default()).unwrap_err();
    let MapError::Source(IdentifyError::Missing { missing, .. }) = error else { panic!("{error}") };
    assert!(missing.contains("left-upper-leg"), "{missing}");
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
    for words in ["left-foot (`Foot_L`)", "but below `master_ik`", "`KneePole.R` are controls", "baked"] {
        assert!(message.contains(words), "{words}: {message}");
    }
    // A tree that is odd in another way names none.
    let message = rig(&[]);
    assert!(!message.contains("control") && message.contains("map file"), "{message}");
}
