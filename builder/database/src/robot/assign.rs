//! Assigns hinges to body parts: by the map file, by words in joint names, by the tree.
//!
//! Hinges of a part are consecutive in the chain and have its word: `left_hip_yaw`, `left_hip_roll` and `left_hip_pitch`
//! are the left upper leg, in any order. If names have no words for parts (`arm_left_1` to `arm_left_7`), the chain of an
//! arm or leg is cut at its two widest gaps, which are the bones.

use std::collections::BTreeMap;

use crate::retarget::parts::{Part, Side, split};
use gestus_motion::formats::urdf::{Mimic, Robot};

use crate::robot::file::RobotMap;

/// The hinges of a part, in chain order.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Assigned {
    /// The part.
    pub part: Part,
    /// Its hinges, one to three, each on the one before.
    pub hinges: Vec<usize>,
}

/// The assignment, with doubts for the user to check.
#[derive(Debug, Clone, Default)]
pub struct Assignment {
    /// Groups, in the order of their hinges.
    pub groups: Vec<Assigned>,
    /// Hinges that stand for nothing, and rest at zero.
    pub undriven: Vec<usize>,
    /// Doubts, in words.
    pub doubts: Vec<String>,
}

/// A word, and the part of a side that it tells.
type Word = (&'static str, fn(Side) -> Part);

/// The words by which a joint's name tells its part; the first that is in the name counts.
const WORDS: [Word; 16] = [
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

/// Words of fingers, eyes and toes, which belong to no part.
const IGNORED: [&str; 7] = ["finger", "thumb", "gripper", "index", "pinky", "eye", "toe"];

/// The side and part that a joint's name tells.
fn named(name: &str) -> Option<Part> {
    let lower = name.to_ascii_lowercase();
    if IGNORED.iter().any(|w| lower.contains(w)) {
        return None;
    }
    match side_of(name) {
        Some(side) => {
            WORDS.iter().find(|(w, _)| lower.replace('_', "").contains(w)).map(|(_, part)| part(side))
        }
        None => TRUNK.iter().find(|(w, _)| lower.contains(w)).map(|(_, part)| *part),
    }
}

/// The side that a joint's name tells. A letter at its end may be an axis (`RLEG_HIP_R` rolls): the beginning counts
/// first.
fn side_of(name: &str) -> Option<Side> {
    let lower = name.to_ascii_lowercase();
    if lower.contains("left") || lower.contains("right") {
        return Some(if lower.contains("left") { Side::Left } else { Side::Right });
    }
    let rest = lower.get(1..).unwrap_or("");
    let on_word = rest.starts_with(['_', '.', '-'])
        || ["leg", "arm"].iter().any(|w| rest.starts_with(w))
        || WORDS.iter().any(|(w, _)| rest.starts_with(w));
    match lower.chars().next() {
        Some('l') if on_word => Some(Side::Left),
        Some('r') if on_word => Some(Side::Right),
        _ => split(name).0,
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
            None if hinge.mimics.is_some() => None,
            None => named(&hinge.name).or_else(|| named(&hinge.link)),
        };
        parts.push(part);
    }
    for name in map.joints.keys().filter(|n| robot.find(n).is_none()) {
        result.doubts.push(format!("the map file names `{name}`, which is not a hinge of the robot"));
    }
    if by_tree(robot, &mut parts, map) {
        result.doubts.push(
            "joint names say too little: some hinges were assigned by where they sit; check them, or say in a map file"
                .into(),
        );
    }
    // Runs of hinges of one part, each on the one before.
    let mut runs: BTreeMap<Part, Vec<Vec<usize>>> = BTreeMap::new();
    for (h, part) in parts.iter().enumerate() {
        let Some(part) = *part else { continue };
        let runs = runs.entry(part).or_default();
        match runs
            .last_mut()
            .filter(|r| r.last() == robot.hinges[h].parent.as_ref() && r.last() == Some(&h.wrapping_sub(1)))
        {
            Some(run) => run.push(h),
            None => runs.push(vec![h]),
        }
    }
    let names = |hinges: &[usize]| {
        hinges.iter().map(|&h| robot.hinges[h].name.as_str()).collect::<Vec<_>>().join(", ")
    };
    for (part, mut runs) in runs {
        // The longest run is the joint; of equals, the one nearest to the base.
        runs.sort_by_key(|r| std::cmp::Reverse(r.len()));
        let mut rest = runs.split_off(1).concat();
        let mut hinges = runs.remove(0);
        if hinges.len() > 3 {
            rest.extend(hinges.split_off(3));
        }
        if !rest.is_empty() {
            result
                .doubts
                .push(format!("{part} has more hinges than one joint takes: {} rest at zero", names(&rest)));
        }
        result.groups.push(Assigned { part, hinges });
    }
    result.groups.sort_by_key(|g| g.hinges[0]);
    let driven = |h: &usize| result.groups.iter().any(|g| g.hinges.contains(h));
    result.undriven = (0..robot.hinges.len()).filter(|h| !driven(h)).collect();
    for side in Side::BOTH {
        for part in [
            Part::UpperLeg(side),
            Part::LowerLeg(side),
            Part::Foot(side),
            Part::UpperArm(side),
            Part::LowerArm(side),
        ] {
            if !result.groups.iter().any(|g| g.part == part) {
                result.doubts.push(format!("no hinge stands for the {part}"));
            }
        }
    }
    let (following, resting): (Vec<usize>, Vec<usize>) =
        result.undriven.iter().partition(|&&h| leader(robot, h, &result.undriven).is_some());
    for (hinges, what) in
        [(resting, "not driven, and resting at zero"), (following, "following another joint")]
    {
        if !hinges.is_empty() {
            result.doubts.push(format!("{what}: {}", names(&hinges)));
        }
    }
    result
}

/// The hinge that one without a motor moves with, at the end of those that it follows, and how. `None` if it has a motor,
/// or follows no hinge. `undriven`: those without a motor.
pub fn leader(robot: &Robot, hinge: usize, undriven: &[usize]) -> Option<(usize, Mimic)> {
    let mut end = (hinge, Mimic { joint: String::new(), multiplier: 1.0, offset: 0.0 });
    // A circle has no end.
    for _ in 0..robot.hinges.len() {
        let mimics = robot.hinges[end.0].mimics.as_ref().filter(|_| undriven.contains(&end.0));
        let Some(Mimic { joint, multiplier, offset }) = mimics else {
            return (end.0 != hinge).then_some(end);
        };
        let (offset, multiplier) = (end.1.multiplier * offset + end.1.offset, end.1.multiplier * multiplier);
        end = (robot.find(joint)?, Mimic { joint: joint.clone(), multiplier, offset });
    }
    None
}

/// By the tree: the two lowest chains are legs, the two widest of the others arms. Chains whose part
/// a name has given stay as they are. True where something was assigned.
fn by_tree(robot: &Robot, parts: &mut [Option<Part>], map: &RobotMap) -> bool {
    let Some(axes) = map.axes() else { return false };
    let places = robot.places(&vec![0.0; robot.hinges.len()]);
    let at = |h: usize| axes.inverse() * places[h].translation.vector;
    // Fingers and followers hang on a hand, and are no part of its chain.
    let usable: Vec<bool> = robot
        .hinges
        .iter()
        .map(|h| {
            h.mimics.is_none()
                && map.part(&h.name) != Some(None)
                && !IGNORED.iter().any(|w| h.name.to_ascii_lowercase().contains(w))
        })
        .collect();
    let children = |p: usize| {
        let usable = &usable;
        (0..robot.hinges.len()).filter(move |&o| usable[o] && robot.hinges[o].parent == Some(p))
    };
    let mut chains: Vec<Vec<usize>> = (0..robot.hinges.len())
        .filter(|&h| usable[h] && children(h).next().is_none())
        .map(|leaf| {
            let mut chain = vec![leaf];
            while let Some(p) = robot.hinges[chain[chain.len() - 1]].parent {
                // Up to where several hang.
                if children(p).count() > 1 {
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
    let wide = |c: &Vec<usize>| at(c[c.len() - 1]).x.abs();
    others.sort_by(|a, b| wide(b).total_cmp(&wide(a)));
    let arms: Vec<Vec<usize>> = others.into_iter().take(2).collect();
    let mut any = false;
    for (pair, limbs) in [
        (legs, [Part::UpperLeg as fn(Side) -> Part, Part::LowerLeg, Part::Foot]),
        (arms, [Part::UpperArm, Part::LowerArm, Part::Hand]),
    ] {
        if pair.len() != 2 {
            continue;
        }
        for chain in &pair {
            if chain.iter().any(|&h| parts[h].is_some()) {
                continue;
            }
            let side = if at(chain[0]).x > 0.0 { Side::Left } else { Side::Right };
            // The two widest gaps are the two bones, where they are bones and not the build of a shoulder.
            let gaps: Vec<f64> = chain.windows(2).map(|w| (at(w[0]) - at(w[1])).norm()).collect();
            let widest = gaps.iter().copied().fold(0.0, f64::max);
            let mut order: Vec<usize> = (0..gaps.len()).filter(|&i| gaps[i] > 0.35 * widest).collect();
            order.sort_by(|&a, &b| gaps[b].total_cmp(&gaps[a]));
            order.truncate(2);
            for (i, &h) in chain.iter().enumerate() {
                let joint = order.iter().filter(|&&gap| gap < i).count();
                parts[h] = Some(limbs[joint](side));
                any = true;
            }
        }
    }
    any
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
            ("RLEG_HIP_P", Some(Part::UpperLeg(Right))),
            ("LLEG_HIP_R", Some(Part::UpperLeg(Left))),
            ("RARM_SHOULDER_R", Some(Part::UpperArm(Right))),
            ("leg_left_3_joint", None),
            ("LThumb1", None),
            ("left_finger_joint", None),
            ("wheel", None),
        ] {
            assert_eq!(named(name), part, "{name}");
        }
    }

    #[test]
    fn the_toy_is_assigned_by_name_and_without_names() {
        let toy = gestus_motion::formats::urdf::TOY;
        let robot = Robot::parse(toy, "toy.urdf").unwrap();
        let named = assign(&robot, &RobotMap::default());
        assert_eq!(named.undriven, Vec::<usize>::new());
        let counts: Vec<(Part, usize)> = named.groups.iter().map(|g| (g.part, g.hinges.len())).collect();
        use Side::{Left, Right};
        for side in [Left, Right] {
            for (part, count) in [
                (Part::UpperLeg(side), 2),
                (Part::LowerLeg(side), 1),
                (Part::Foot(side), 2),
                (Part::UpperArm(side), 2),
                (Part::LowerArm(side), 1),
            ] {
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
        assert!(by_tree.doubts[0].contains("names say too little"), "{:?}", by_tree.doubts);
    }
}
