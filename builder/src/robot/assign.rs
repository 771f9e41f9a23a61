//! Which hinge stands for which body part: by the map file, by the words in joint names, by the tree.
//!
//! Hinges of one part are those that follow each other in the chain and bear its word: `left_hip_yaw`,
//! `left_hip_roll` and `left_hip_pitch` are the left upper leg, in whatever order. Where a leg's or arm's words are
//! missing, its chain is cut by where hinges sit: those within a tenth of the chain's length of each other are one
//! joint of the body.

use std::collections::BTreeMap;

use crate::{
    retarget::parts::{Part, Side, split},
    urdf::Robot,
};

use super::file::RobotMap;

/// Hinges that stand for a part, in chain order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assigned {
    /// The part.
    pub part: Part,
    /// Its hinges, one to three, each on the one before.
    pub hinges: Vec<usize>,
}

/// The assignment, and what a person should look at.
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Groups, in the order of their hinges.
    pub groups: Vec<Assigned>,
    /// Hinges that stand for nothing, and rest at zero.
    pub undriven: Vec<usize>,
    /// Doubts, in words.
    pub doubts: Vec<String>,
}

/// The words by which a joint's name tells its part; the first that is in the name counts.
const WORDS: [(&str, fn(Side) -> Part); 16] = [
    ("knee", Part::LowerLeg),
    ("shin", Part::LowerLeg),
    ("calf", Part::LowerLeg),
    ("tibia", Part::LowerLeg),
    ("ankle", Part::Foot),
    ("foot", Part::Foot),
    ("hip", Part::UpperLeg),
    ("thigh", Part::UpperLeg),
    ("femur", Part::UpperLeg),
    ("elbow", Part::LowerArm),
    ("forearm", Part::LowerArm),
    ("lowerarm", Part::LowerArm),
    ("wrist", Part::Hand),
    ("clavicle", Part::Clavicle),
    ("shoulder", Part::UpperArm),
    ("upperarm", Part::UpperArm),
];

/// Words of the trunk.
const TRUNK: [(&str, Part); 8] = [
    ("neck", Part::Head),
    ("head", Part::Head),
    ("waist", Part::Chest),
    ("torso", Part::Chest),
    ("trunk", Part::Chest),
    ("chest", Part::Chest),
    ("spine", Part::Chest),
    ("abdomen", Part::Chest),
];

/// Fingers are nobody's part.
const NOT: [&str; 7] = ["finger", "thumb", "gripper", "index", "pinky", "eye", "toe"];

/// The side and part that a joint's name tells.
fn named(name: &str) -> Option<Part> {
    let (side, stem) = split(name);
    if NOT.iter().any(|w| stem.contains(w)) {
        return None;
    }
    let side = side.or_else(|| {
        // `LShoulderPitch`, `lhipyaw`: the letter sits on the word.
        let glued = |c: char| {
            let rest = stem.strip_prefix(c)?;
            WORDS.iter().any(|(w, _)| rest.starts_with(w)).then_some(())
        };
        glued('l').map(|()| Side::Left).or_else(|| glued('r').map(|()| Side::Right))
    });
    match side {
        Some(side) => WORDS.iter().find(|(w, _)| stem.contains(w)).map(|(_, part)| part(side)),
        None => TRUNK.iter().find(|(w, _)| stem.contains(w)).map(|(_, part)| *part),
    }
}

/// Assigns a robot's hinges.
pub fn assign(robot: &Robot, map: &RobotMap) -> Assignment {
    let mut parts: Vec<Option<Part>> = Vec::with_capacity(robot.hinges.len());
    let mut result = Assignment::default();
    for hinge in &robot.hinges {
        let by_file = map.part(&hinge.name);
        let part = match by_file {
            Some(part) => part,
            None if hinge.mimics => None,
            None => named(&hinge.name).or_else(|| named(&hinge.link)),
        };
        parts.push(part);
    }
    for name in map.joints.keys().filter(|n| robot.find(n).is_none()) {
        result.doubts.push(format!("the map file speaks of `{name}`, which is no hinge of the robot"));
    }
    let has = |parts: &[Option<Part>], part: Part| parts.contains(&Some(part));
    let limb_named = |parts: &[Option<Part>]| {
        Side::BOTH.iter().all(|&s| has(parts, Part::UpperLeg(s)) && has(parts, Part::UpperArm(s)))
    };
    if !limb_named(&parts) && parts.iter().all(Option::is_none) {
        by_tree(robot, &mut parts, map);
        if parts.iter().any(Option::is_some) {
            result.doubts.push(
                "joint names say nothing: hinges were assigned by where they sit; check them, or say in a map file"
                    .into(),
            );
        }
    }
    // Runs of hinges of one part, each on the one before.
    let mut runs: BTreeMap<Part, Vec<Vec<usize>>> = BTreeMap::new();
    for (h, part) in parts.iter().enumerate() {
        let Some(part) = *part else { continue };
        let runs = runs.entry(part).or_default();
        match runs.last_mut().filter(|r| r.last() == robot.hinges[h].parent.as_ref() && r.last() == Some(&h.wrapping_sub(1))) {
            Some(run) => run.push(h),
            None => runs.push(vec![h]),
        }
    }
    let names = |hinges: &[usize]| hinges.iter().map(|&h| robot.hinges[h].name.as_str()).collect::<Vec<_>>().join(", ");
    for (part, mut runs) in runs {
        // The longest run is the joint; of equals, the one nearest to the base.
        runs.sort_by_key(|r| std::cmp::Reverse(r.len()));
        let mut rest = runs.split_off(1).concat();
        let mut hinges = runs.remove(0);
        if hinges.len() > 3 {
            rest.extend(hinges.split_off(3));
        }
        if !rest.is_empty() {
            result.doubts.push(format!(
                "{part} has more hinges than one joint takes: {} rest at zero",
                names(&rest)
            ));
        }
        result.groups.push(Assigned { part, hinges });
    }
    result.groups.sort_by_key(|g| g.hinges[0]);
    let driven = |h: &usize| result.groups.iter().any(|g| g.hinges.contains(h));
    result.undriven = (0..robot.hinges.len()).filter(|h| !driven(h)).collect();
    for side in Side::BOTH {
        for part in [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side), Part::UpperArm(side), Part::LowerArm(side)] {
            if !result.groups.iter().any(|g| g.part == part) {
                result.doubts.push(format!("no hinge stands for the {part}"));
            }
        }
    }
    if !result.undriven.is_empty() {
        result.doubts.push(format!("not driven, and resting at zero: {}", names(&result.undriven)));
    }
    result
}

/// By the tree alone: the two lowest chains are legs, the two widest of the others arms.
fn by_tree(robot: &Robot, parts: &mut [Option<Part>], map: &RobotMap) {
    let Some(axes) = map.axes() else { return };
    let places = robot.places(&vec![0.0; robot.hinges.len()]);
    let at = |h: usize| axes.inverse() * places[h].translation.vector;
    let leaves = (0..robot.hinges.len()).filter(|&h| !robot.hinges.iter().any(|o| o.parent == Some(h)));
    let mut chains: Vec<Vec<usize>> = leaves
        .map(|leaf| {
            let mut chain = vec![leaf];
            while let Some(p) = robot.hinges[chain[chain.len() - 1]].parent {
                // Up to where several hinges hang.
                if robot.hinges.iter().filter(|o| o.parent == Some(p)).count() > 1 {
                    break;
                }
                chain.push(p);
            }
            chain.reverse();
            chain
        })
        .filter(|c| c.len() >= 3)
        .collect();
    let low = |c: &Vec<usize>| at(c[c.len() - 1]).y;
    chains.sort_by(|a, b| low(a).total_cmp(&low(b)));
    let mut chains = chains.into_iter();
    let legs: Vec<Vec<usize>> = chains.by_ref().take(2).collect();
    let mut others: Vec<Vec<usize>> = chains.collect();
    let wide = |c: &Vec<usize>| at(c[0]).x.abs();
    others.sort_by(|a, b| wide(b).total_cmp(&wide(a)));
    let arms: Vec<Vec<usize>> = others.into_iter().take(2).collect();
    for (pair, limbs) in [
        (legs, [Part::UpperLeg as fn(Side) -> Part, Part::LowerLeg, Part::Foot]),
        (arms, [Part::UpperArm, Part::LowerArm, Part::Hand]),
    ] {
        if pair.len() != 2 {
            continue;
        }
        for chain in &pair {
            let side = if at(chain[0]).x > 0.0 { Side::Left } else { Side::Right };
            let way = |a: usize, b: usize| (at(a) - at(b)).norm();
            let length: f64 = chain.windows(2).map(|w| way(w[0], w[1])).sum();
            let mut joint = 0;
            for (i, &h) in chain.iter().enumerate() {
                if i > 0 && way(h, chain[i - 1]) > 0.15 * length {
                    joint += 1;
                }
                parts[h] = limbs.get(joint).map(|part| part(side));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_known_robots_tell_their_parts() {
        use Side::{Left, Right};
        for (name, part) in [
            ("left_hip_yaw", Some(Part::UpperLeg(Left))),
            ("left_hip_yaw_joint", Some(Part::UpperLeg(Left))),
            ("LShoulderPitch", Some(Part::UpperArm(Left))),
            ("RElbowRoll", Some(Part::LowerArm(Right))),
            ("RHipYawPitch", Some(Part::UpperLeg(Right))),
            ("l_ankle_roll", Some(Part::Foot(Left))),
            ("r_knee", Some(Part::LowerLeg(Right))),
            ("HeadYaw", Some(Part::Head)),
            ("waist_yaw_joint", Some(Part::Chest)),
            ("left_wrist_roll", Some(Part::Hand(Left))),
            ("LThumb1", None),
            ("left_finger_joint", None),
            ("wheel", None),
        ] {
            assert_eq!(named(name), part, "{name}");
        }
    }

    #[test]
    fn the_toy_is_assigned_by_name_and_without_names() {
        let toy = include_str!("../../assets/toy.urdf");
        let robot = Robot::parse(toy, "toy.urdf").unwrap();
        let named = assign(&robot, &RobotMap::default());
        assert_eq!(named.undriven, Vec::<usize>::new());
        let counts: Vec<(Part, usize)> = named.groups.iter().map(|g| (g.part, g.hinges.len())).collect();
        use Side::{Left, Right};
        for side in [Left, Right] {
            for (part, count) in [(Part::UpperLeg(side), 2), (Part::LowerLeg(side), 1), (Part::Foot(side), 2), (Part::UpperArm(side), 2), (Part::LowerArm(side), 1)] {
                assert!(counts.contains(&(part, count)), "{part}: {counts:?}");
            }
        }
        let mut nameless = robot.clone();
        for (i, hinge) in nameless.hinges.iter_mut().enumerate() {
            hinge.name = format!("m{i}");
            hinge.link = format!("p{i}");
        }
        let by_tree = assign(&nameless, &RobotMap::default());
        assert_eq!(by_tree.groups, named.groups);
        assert!(by_tree.doubts[0].contains("names say nothing"), "{:?}", by_tree.doubts);
    }
}
