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
