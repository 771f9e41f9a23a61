use super::*;

/// Joints of a skeleton of each family: hips and head, then the left side from the collarbone to the toes. The right
/// side is the same with the words for left replaced.
const SKELETONS: [(&str, &str, [&str; 10]); 21] = [
    (
        "Poser",
        "Poser or DAZ",
        ["hip", "head", "lCollar", "lShldr", "lForeArm", "lHand", "lThigh", "lShin", "lFoot", "lToe"],
    ),
    (
        "DAZ Genesis",
        "Poser or DAZ",
        [
            "hip",
            "head",
            "lCollar",
            "lShldrBend",
            "lForearmBend",
            "lHand",
            "lThighBend",
            "lShin",
            "lFoot",
            "lToe",
        ],
    ),
    (
        "DAZ Genesis 9",
        "DAZ Genesis 9",
        [
            "hip",
            "head",
            "l_shoulder",
            "l_upperarm",
            "l_forearm",
            "l_hand",
            "l_thigh",
            "l_shin",
            "l_foot",
            "l_toes",
        ],
    ),
    (
        "camelCase",
        "Unity humanoid or Bandai-Namco",
        [
            "hips",
            "head",
            "leftShoulder",
            "leftUpperArm",
            "leftLowerArm",
            "leftHand",
            "leftUpperLeg",
            "leftLowerLeg",
            "leftFoot",
            "leftToes",
        ],
    ),
    (
        "suffixes",
        "Unity humanoid or Bandai-Namco",
        [
            "Hips",
            "Head",
            "Shoulder_L",
            "UpperArm_L",
            "LowerArm_L",
            "Hand_L",
            "UpperLeg_L",
            "LowerLeg_L",
            "Foot_L",
            "Toes_L",
        ],
    ),
    (
        "suffixes without a mark",
        "Unity humanoid or Bandai-Namco",
        [
            "Hips",
            "Head",
            "ShoulderL",
            "UpperArmL",
            "LowerArmL",
            "HandL",
            "UpperLegL",
            "LowerLegL",
            "FootL",
            "ToesL",
        ],
    ),
    (
        "Mixamo",
        "Mixamo, Perception Neuron or CMU (BVH)",
        [
            "mixamorig:Hips",
            "mixamorig:Head",
            "mixamorig:LeftShoulder",
            "mixamorig:LeftArm",
            "mixamorig:LeftForeArm",
            "mixamorig:LeftHand",
            "mixamorig:LeftUpLeg",
            "mixamorig:LeftLeg",
            "mixamorig:LeftFoot",
            "mixamorig:LeftToeBase",
        ],
    ),
    (
        "Mixamo in three.js",
        "Mixamo, Perception Neuron or CMU (BVH)",
        [
            "mixamorigHips",
            "mixamorigHead",
            "mixamorigLeftShoulder",
            "mixamorigLeftArm",
            "mixamorigLeftForeArm",
            "mixamorigLeftHand",
            "mixamorigLeftUpLeg",
            "mixamorigLeftLeg",
            "mixamorigLeftFoot",
            "mixamorigLeftToeBase",
        ],
    ),
    (
        "Unreal mannequin",
        "Unreal mannequin",
        [
            "pelvis",
            "head",
            "clavicle_l",
            "upperarm_l",
            "lowerarm_l",
            "hand_l",
            "thigh_l",
            "calf_l",
            "foot_l",
            "ball_l",
        ],
    ),
    (
        "3ds Max Biped",
        "3ds Max Biped",
        [
            "Bip01 Pelvis",
            "Bip01 Head",
            "Bip01 L Clavicle",
            "Bip01 L UpperArm",
            "Bip01 L Forearm",
            "Bip01 L Hand",
            "Bip01 L Thigh",
            "Bip01 L Calf",
            "Bip01 L Foot",
            "Bip01 L Toe0",
        ],
    ),
    (
        "Unity humanoid",
        "Unity humanoid or Bandai-Namco",
        [
            "Hips",
            "Head",
            "LeftShoulder",
            "LeftUpperArm",
            "LeftLowerArm",
            "LeftHand",
            "LeftUpperLeg",
            "LeftLowerLeg",
            "LeftFoot",
            "LeftToes",
        ],
    ),
    (
        "VRM",
        "VRM humanoid",
        [
            "J_Bip_C_Hips",
            "J_Bip_C_Head",
            "J_Bip_L_Shoulder",
            "J_Bip_L_UpperArm",
            "J_Bip_L_LowerArm",
            "J_Bip_L_Hand",
            "J_Bip_L_UpperLeg",
            "J_Bip_L_LowerLeg",
            "J_Bip_L_Foot",
            "J_Bip_L_ToeBase",
        ],
    ),
    (
        "SMPL",
        "SMPL",
        [
            "m_avg_Pelvis",
            "m_avg_Head",
            "m_avg_L_Collar",
            "m_avg_L_Shoulder",
            "m_avg_L_Elbow",
            "m_avg_L_Wrist",
            "m_avg_L_Hip",
            "m_avg_L_Knee",
            "m_avg_L_Ankle",
            "m_avg_L_Foot",
        ],
    ),
    (
        "SMPL-X",
        "SMPL",
        [
            "pelvis",
            "head",
            "left_collar",
            "left_shoulder",
            "left_elbow",
            "left_wrist",
            "left_hip",
            "left_knee",
            "left_ankle",
            "left_foot",
        ],
    ),
    (
        "Rigify",
        "Rigify (Blender)",
        [
            "DEF-spine",
            "DEF-spine.006",
            "DEF-shoulder.L",
            "DEF-upper_arm.L",
            "DEF-forearm.L",
            "DEF-hand.L",
            "DEF-thigh.L",
            "DEF-shin.L",
            "DEF-foot.L",
            "DEF-toe.L",
        ],
    ),
    (
        "CMU (ASF)",
        "CMU (ASF)",
        ["root", "head", "lclavicle", "lhumerus", "lradius", "lhand", "lfemur", "ltibia", "lfoot", "ltoes"],
    ),
    (
        "CMU (BVH)",
        "Mixamo, Perception Neuron or CMU (BVH)",
        [
            "Hips",
            "Head",
            "LeftShoulder",
            "LeftArm",
            "LeftForeArm",
            "LeftHand",
            "LeftUpLeg",
            "LeftLeg",
            "LeftFoot",
            "LeftToeBase",
        ],
    ),
    (
        "Biovision",
        "Biovision or Xsens (BVH)",
        [
            "Hips",
            "Head",
            "LeftCollar",
            "LeftShoulder",
            "LeftElbow",
            "LeftWrist",
            "LeftHip",
            "LeftKnee",
            "LeftAnkle",
            "LeftToe",
        ],
    ),
    (
        "Perception Neuron",
        "Mixamo, Perception Neuron or CMU (BVH)",
        [
            "Robot_Hips",
            "Robot_Head",
            "Robot_LeftShoulder",
            "Robot_LeftArm",
            "Robot_LeftForeArm",
            "Robot_LeftHand",
            "Robot_LeftUpLeg",
            "Robot_LeftLeg",
            "Robot_LeftFoot",
            "Robot_LeftToeBase",
        ],
    ),
    (
        "Blender, limbs numbered",
        "Blender, limbs numbered",
        ["Body", "Head", "Shoulder.L", "Arm1.L", "Arm2.L", "Hand.L", "Leg1.L", "Leg2.L", "Foot.L", "Toes.L"],
    ),
    (
        "Rokoko",
        "Rokoko",
        [
            "Hips",
            "Head",
            "LeftShoulder",
            "LeftArm",
            "LeftForeArm",
            "LeftHand",
            "LeftThigh",
            "LeftShin",
            "LeftFoot",
            "LeftToe",
        ],
    ),
];

/// A name of the left side as the right side has it.
fn mirrored(name: &str) -> String {
    let exact = [
        ("Left", "Right"),
        ("left", "right"),
        ("_L_", "_R_"),
        (" L ", " R "),
        ("l_", "r_"),
        ("_l", "_r"),
        ("_L", "_R"),
        (".L", ".R"),
    ];
    if let Some((from, to)) = exact.iter().find(|(from, _)| {
        name.contains(from)
            && (*from != "l_" || name.starts_with(from))
            && (!["_l", "_L", ".L"].contains(from) || name.ends_with(from))
    }) {
        return name.replacen(from, to, 1);
    }
    match name.strip_suffix('L') {
        Some(stem) => format!("{stem}R"),
        None => format!("r{}", &name[1..]),
    }
}

/// The joints of both sides of a skeleton of [`SKELETONS`], by name, and the parts that they are.
fn both_sides(joints: &[&str; 10]) -> Vec<(String, Part)> {
    let mut all: Vec<(String, Part)> = vec![(joints[0].into(), Hips), (joints[1].into(), Head)];
    for side in Side::BOTH {
        let of_side = |n: &&str| if side == Side::Left { (*n).to_owned() } else { mirrored(n) };
        all.extend(joints[2..].iter().map(of_side).zip(LIMBS.map(|part| part(side))));
    }
    all
}

#[test]
fn every_family_is_known_by_its_names() {
    for (what, family, joints) in &SKELETONS {
        let all = both_sides(joints);
        let names: Vec<&str> = all.iter().map(|(name, _)| name.as_str()).collect();
        let best = families(&named(&names))[0];
        assert_eq!(best.name, *family, "{what}");
        for (name, part) in &all {
            assert_eq!(part_in(best, name), Some(*part), "{what}: {name}");
        }
    }
}

/// Avatars of Decentraland have `Avatar_` before the names of Mixamo, and something else beside the body: the arms of some
/// were found in their fingers, by shape.
#[test]
fn families_are_known_under_a_characters_name() {
    for (what, family, joints) in &SKELETONS {
        let all = both_sides(joints);
        let mut names: Vec<String> =
            all.iter().map(|(n, _)| format!("Avatar_{}", n.split(':').next_back().unwrap())).collect();
        names.push("Prop".to_owned());
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        let joints = named(&names);
        let best = families(&joints)[0];
        assert_eq!(best.name, *family, "{what}");
        for (joint, (_, part)) in joints.iter().zip(&all) {
            assert_eq!(joint.part_in(best), Some(*part), "{what}: {joint:?}");
        }
    }
}

#[test]
fn parts_are_known_by_their_names() {
    for part in Part::all() {
        assert_eq!(Part::named(&part.to_string()), Some(part));
        assert_eq!(Part::named(&part.to_string().replace('-', "_").to_uppercase()), Some(part));
    }
    assert_eq!(Part::named("tail"), None);
}
