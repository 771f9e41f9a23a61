//! Skeletons without useful names: characters of many joints, and bodies whose sides nothing shows.

use std::sync::Arc;

use gestus_core::retarget::layout::MAX_SOURCES;
use gestus_database::retarget::{IdentifyError, MapError, MapFile, Retarget, parts::Part, shape::ShapeError};
use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    common::{database, walk},
    foreign::{Foreign, apart},
};

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

#[test]
fn fingers_are_no_legs() {
    let body = Foreign::new().named(|j, _| format!("joint{j}"));
    body.map();
    // The same shape, on a hand.
    let hand = Foreign::new().named(|j, _| if j == 0 { "palm".to_owned() } else { format!("joint{j}") });
    let error = Retarget::new(&database(), &hand.0, &MapFile::default()).unwrap_err();
    let MapError::Source(IdentifyError::Missing { shape, .. }) = &error else { panic!("{error}") };
    assert_eq!(*shape, ShapeError::NoLegs.to_string());
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
