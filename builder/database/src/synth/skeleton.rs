//! The generated body: 21 joints, 1.7 m tall, arms level at rest (a T-pose).
//!
//! At heading 0 it faces +Z, its left is +X and up is +Y. Soles are not joints: [`HEEL`] and [`BALL_HEIGHT_M`] say
//! where they are below the ankle and the toes.

use std::sync::Arc;

use nalgebra::Vector3;

use gestus_motion::clip::Skeleton;

/// Joints by name, with their index.
pub mod joint {
    /// Root of the animated body.
    pub const HIPS: usize = 0;
    /// Lower spine.
    pub const SPINE: usize = 1;
    /// Upper spine, which carries the arms.
    pub const CHEST: usize = 2;
    /// Lower end of the neck.
    pub const NECK: usize = 3;
    /// Base of the skull.
    pub const HEAD: usize = 4;
    /// First joint of each arm (the collarbone), left and right; upper arm, lower arm and hand follow it.
    pub const SHOULDER: [usize; 2] = [5, 9];
    /// First joint of each leg (the thigh), left and right; lower leg, foot and toes follow it.
    pub const UPPER_LEG: [usize; 2] = [13, 17];
}

/// Length of the thigh, metres.
pub const THIGH_M: f64 = 0.41;
/// Length of the shin, metres.
pub const SHIN_M: f64 = 0.40;
/// Height of the hip joints below the root, metres.
pub const HIP_DROP_M: f64 = 0.06;
/// Height of the ankle over the floor where the foot is flat, metres.
pub const ANKLE_HEIGHT_M: f64 = 0.08;
/// Height of the toes joint (the ball of the foot) over the floor in stance, metres.
pub const BALL_HEIGHT_M: f64 = 0.025;
/// From the ankle to the toes joint, in the foot's frame, metres.
pub const BALL: Vector3<f64> = Vector3::new(0.0, BALL_HEIGHT_M - ANKLE_HEIGHT_M, 0.13);
/// From the ankle to the rear end of the sole, in the foot's frame, metres.
pub const HEEL: Vector3<f64> = Vector3::new(0.0, -ANKLE_HEIGHT_M, -0.05);
/// From the toes joint to the tip of the sole, in the toes' frame, metres.
pub const TIP: Vector3<f64> = Vector3::new(0.0, -BALL_HEIGHT_M, 0.06);

/// The skeleton that all generated clips share.
pub fn skeleton() -> Skeleton {
    const TRUNK: [(&str, Option<usize>, [f64; 3]); 5] = [
        ("Hips", None, [0.0, 0.0, 0.0]),
        ("Spine", Some(joint::HIPS), [0.0, 0.10, 0.0]),
        ("Chest", Some(joint::SPINE), [0.0, 0.16, 0.0]),
        ("Neck", Some(joint::CHEST), [0.0, 0.24, -0.01]),
        ("Head", Some(joint::NECK), [0.0, 0.10, 0.02]),
    ];
    let mut names = Vec::new();
    let mut parents = Vec::new();
    let mut offsets = Vec::new();
    let mut add = |name: String, parent: Option<usize>, offset: Vector3<f64>| {
        names.push(name);
        parents.push(parent);
        offsets.push(offset);
        names.len() - 1
    };
    for (name, parent, [x, y, z]) in TRUNK {
        add(name.to_owned(), parent, Vector3::new(x, y, z));
    }
    for (side, sign) in [("L", 1.0), ("R", -1.0)] {
        let bones = [
            ("Shoulder", [0.03 * sign, 0.19, 0.0]),
            ("UpperArm", [0.14 * sign, 0.0, 0.0]),
            ("LowerArm", [0.27 * sign, 0.0, 0.0]),
            ("Hand", [0.25 * sign, 0.0, 0.0]),
        ];
        let mut parent = joint::CHEST;
        for (name, [x, y, z]) in bones {
            parent = add(format!("{name}_{side}"), Some(parent), Vector3::new(x, y, z));
        }
    }
    for (side, sign) in [("L", 1.0), ("R", -1.0)] {
        let bones = [
            ("UpperLeg", Vector3::new(0.09 * sign, -HIP_DROP_M, 0.0)),
            ("LowerLeg", Vector3::new(0.0, -THIGH_M, 0.0)),
            ("Foot", Vector3::new(0.0, -SHIN_M, 0.0)),
            ("Toes", BALL),
        ];
        let mut parent = joint::HIPS;
        for (name, offset) in bones {
            parent = add(format!("{name}_{side}"), Some(parent), offset);
        }
    }
    Skeleton { names, parents, offsets }
}

/// The same, to be shared.
pub(super) fn shared() -> Arc<Skeleton> {
    Arc::new(skeleton())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn indices_are_those_of_the_names() {
        let skeleton = skeleton();
        assert_eq!(skeleton.joints(), 21);
        for (name, index) in [
            ("Hips", joint::HIPS),
            ("Head", joint::HEAD),
            ("Shoulder_L", joint::SHOULDER[0]),
            ("Shoulder_R", joint::SHOULDER[1]),
            ("UpperLeg_L", joint::UPPER_LEG[0]),
            ("Toes_R", joint::UPPER_LEG[1] + 3),
        ] {
            assert_eq!(skeleton.find(name), Some(index), "{name}");
        }
    }
}
