//! Bodies that lie or crawl, throughout or from some moment on: the map of such a clip is that of the walk that it was made
//! of, and left is left.

use std::f64::consts::FRAC_PI_2;

use gestus_database::retarget::{MapFile, Retarget, parts::Part};
use gestus_motion::clip::Frame;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::{
    common::{database, walk},
    foreign::Foreign,
};

/// Puts the walk on another skeleton.
type Body = fn(Foreign) -> Foreign;

/// How a body lies: on its back, belly or side.
const LIES: [(&str, f64, f64); 3] =
    [("back", -FRAC_PI_2, 0.0), ("belly", FRAC_PI_2, 0.0), ("side", -FRAC_PI_2, FRAC_PI_2)];

/// A frame of a body that is tipped over and rolled, low over the floor, its feet pointed. Its right leg does what the left
/// one does: one that strides would walk, whatever is up.
fn laid(frame: &Frame, tip: f64, roll: f64) -> Frame {
    let about = UnitQuaternion::from_axis_angle;
    let world = about(&Vector3::z_axis(), roll) * about(&Vector3::x_axis(), tip);
    let mut frame = frame.clone();
    frame.rotations[0] = world * frame.rotations[0];
    let joint = |name: &str| walk().skeleton.find(name).unwrap();
    frame.rotations[joint("Foot_L")] *= about(&Vector3::x_axis(), 0.9);
    for part in ["UpperLeg", "LowerLeg", "Foot"] {
        let left = frame.rotations[joint(&format!("{part}_L"))];
        let mirrored = Quaternion::new(left.w, left.i, -left.j, -left.k);
        frame.rotations[joint(&format!("{part}_R"))] = UnitQuaternion::from_quaternion(mirrored);
    }
    frame.root = Vector3::new(0.4, 0.0, 0.0);
    let lowest = frame.positions(&walk().skeleton).iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
    frame.root.y = 0.05 - lowest;
    frame
}

/// Which joint is which part, and the angle of each part's axes to those of the walk; returns the heights of the ankles.
fn compare(name: &str, walks: &Foreign, lies: &Foreign, gltf: bool) -> [f64; 2] {
    let file = MapFile { has_y_up: gltf, ..MapFile::default() };
    let of = |foreign: &Foreign| Retarget::new(&database(), &foreign.0, &file).unwrap();
    let (truth, map) = (of(walks), of(lies));
    assert_eq!(map.world, UnitQuaternion::identity(), "{name}");
    assert_eq!(truth.source.parts.joints, map.source.parts.joints, "{name}");
    assert!(!map.doubts().iter().any(|doubt| doubt.contains("exchanged")), "{name}: {:?}", map.doubts());
    for (part, &joint) in &truth.source.parts.joints {
        let (a, b) = (truth.source.anatomy.frame(joint), map.source.anatomy.frame(joint));
        let angle = a.zip(b).map_or(0.0, |(a, b)| a.angle_to(&b).to_degrees());
        // Pointed feet are at no right angle to their shins.
        let most = if matches!(part, Part::Foot(_) | Part::Toes(_)) { 60.0 } else { 25.0 };
        assert!(angle < most, "{name}: {part} is {angle} degrees off");
    }
    [truth, map].map(|map| map.source.anatomy.ankle_m)
}

/// The walk on another skeleton, and the same with other poses.
fn both(of: Body, change: impl Fn(usize, &Frame) -> Frame) -> [Foreign; 2] {
    let mut changed = Foreign::new();
    changed.0.frames = changed.0.frames.iter().enumerate().map(|(t, frame)| change(t, frame)).collect();
    [of(Foreign::new()), of(changed)]
}

/// Toes that point away from the head were taken to point ahead: on its belly a body had its sides exchanged, and feet that
/// lie were level.
#[test]
fn a_body_that_lies_throughout_keeps_its_sides() {
    let skeletons: [(&str, Body); 3] = [
        ("names", Foreign::mixamo),
        ("axes", |foreign| foreign.mixamo().turned()),
        ("no names", |foreign| foreign.named(|j, _| format!("joint{j}"))),
    ];
    for (name, tip, roll) in LIES {
        for (what, of) in skeletons {
            let [walks, lies] = both(of, |_, frame| laid(frame, tip, roll));
            for gltf in [false, true] {
                compare(&format!("{name}, {what}, {gltf}"), &walks, &lies, gltf);
            }
        }
    }
}

/// One that falls is measured where it stands.
#[test]
fn a_body_that_falls_and_stays_down_is_measured_while_it_stands() {
    let count = walk().frames.len();
    for (name, tip, roll) in LIES {
        for stands in [count / 6, count / 2] {
            let fall = |t, frame: &Frame| if t < stands { frame.clone() } else { laid(frame, tip, roll) };
            let [walks, falls] = both(|foreign| foreign.mixamo().turned(), fall);
            let [truth, found] = compare(&format!("{name} after {stands} frames"), &walks, &falls, false);
            assert!(
                (found - truth).abs() < 0.01,
                "{name} after {stands} frames: ankles at {found}, not {truth}"
            );
        }
    }
}
