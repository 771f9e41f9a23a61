//! The same body in other words, axes, sizes and worlds, and bodies of other proportions: to the database and back.

use gestus_database::{
    registration::contact::contacts,
    retarget::parts::{Part, Side},
    stream::cleanup::{Limbs, above_floor},
};
use gestus_evaluate::measures::retarget::{directions, offsets};
use gestus_motion::{
    clip::{Clip, Frame},
    landmarks::Landmarks,
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    common::walk,
    foreign::{Foreign, apart},
};

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

/// The hips lay on their back, and the pelvis of the output turned over: the root of some rigs is a pivot above the first joint
/// of the spine, or in front of it. Of one that begins behind the hips, as high as they are, the trunk folded.
#[test]
fn hips_are_upright_though_the_spine_begins_under_or_behind_them() {
    let walk = walk();
    let [spine, chest] = ["Spine", "Chest"].map(|name| walk.skeleton.find(name).unwrap());
    for place in [Vector3::new(0.0, -0.2, -0.15), Vector3::new(0.0, 0.014, -0.071)] {
        let off = place - walk.skeleton.offsets[spine];
        let mut pivoted = Foreign::new().mixamo();
        pivoted.skeleton(|s| {
            s.offsets[spine] += off;
            s.offsets[chest] -= off;
        });
        for (name, foreign) in [("named", pivoted.clone()), ("turned", pivoted.turned())] {
            let mapped = foreign.map().to_target(&foreign.0);
            let turns = walk.frames.iter().zip(&mapped.frames);
            let most = turns.map(|(a, b)| a.rotations[0].angle_to(&b.rotations[0])).fold(0.0, f64::max);
            assert!(most < 0.2, "{place:?}, {name}: the hips are turned by up to {most} rad");
        }
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
    for (what, foreign) in [
        ("names", foreign.clone().mixamo()),
        ("exchanged", foreign.clone().exchanged()),
        ("axes", foreign.clone().mixamo().turned()),
        ("no names", foreign.named(|j, _| format!("joint{j}")).turned()),
    ] {
        let source = foreign.map().source;
        let clip = &foreign.0;
        let legs = source.legs().unwrap();
        let line = source.hips_line(&clip.frames);
        let limbs = Limbs::of_landmarks(&legs, line, clip).unwrap().0;
        let lifted = above_floor(&limbs, &clip.frames[clip.frames.len() - 1..]);
        let p = lifted[0].positions(&clip.skeleton);
        for side in 0..2 {
            let [hip, knee, foot] = [legs.hip_joints, legs.knees, legs.feet].map(|joints| p[joints[side]]);
            let ahead = knee.z - 0.5 * (hip.z + foot.z);
            assert!(ahead > 0.03, "{what}: the knee is {ahead} m ahead");
        }
    }
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

/// A neck that leans at rest came back straight, and a back of more joints than the database's as a curve.
#[test]
fn the_neck_and_the_back_come_back_as_they_were() {
    let truth = walk();
    let leans = |mut foreign: Foreign| {
        foreign.skeleton(|s| {
            let neck = s.names.iter().position(|name| name.ends_with("Neck")).unwrap();
            s.offsets[neck] = Vector3::new(0.0, 0.18, 0.02);
            s.offsets[neck + 1] = Vector3::new(0.0, 0.03, 0.05);
        });
        foreign
    };
    let plain = leans(Foreign::new().mixamo());
    let mut bent = leans(Foreign::new().mixamo().with_more_joints());
    // The joint before the chest moves, too.
    let chest = bent.0.skeleton.names.iter().position(|name| name.ends_with("Chest")).unwrap();
    for (i, frame) in bent.0.frames.iter_mut().enumerate() {
        let bend = UnitQuaternion::from_euler_angles(0.4 + 0.3 * (0.1 * i as f64).sin(), 0.0, 0.1);
        frame.rotations[chest - 1] *= bend;
        frame.rotations[chest] = bend.inverse() * frame.rotations[chest];
    }
    for (what, foreign) in [
        ("as many joints", plain.clone()),
        ("other axes", plain.turned()),
        ("more joints", bent.clone()),
        ("more joints, other axes", bent.turned().z_up()),
    ] {
        let map = foreign.map();
        let mapped = map.to_target(&foreign.0);
        let back = map.to_source(&mapped.frames, &foreign.0.frames);
        let trunk = map.source.parts.spine.iter().chain(&map.source.parts.neck);
        for &joint in trunk {
            let turns = foreign.0.frames.iter().zip(&back);
            let off =
                turns.map(|(a, b)| a.rotations[joint].angle_to(&b.rotations[joint])).fold(0.0, f64::max);
            let name = &foreign.0.skeleton.names[joint];
            assert!(off < 0.017, "{what}: {name} is {off} rad off");
        }
        // The database's head is as upright as it was.
        let head = truth.skeleton.find("Head").unwrap();
        let turn = |frame: &Frame| frame.world(&truth.skeleton).1[head];
        let heads = truth.frames.iter().zip(&mapped.frames).map(|(a, b)| turn(a).angle_to(&turn(b)));
        let most = heads.fold(0.0, f64::max);
        assert!(most < 0.1, "{what}: the head is {most} rad off");
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
