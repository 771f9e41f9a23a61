//! A body's height, estimated from the lengths of its bones, whatever the pose.

use nalgebra::Vector3;

use crate::{
    animation::Joint,
    names::{names, split},
};

/// Height of a body over its longest chain from hips to a tip.
const HEIGHT_OF_CHAIN: f64 = 1.55;
/// Longest tip of a chain of bones that tells a body's height, in the length of the bone before it.
const MAX_TIP_RATIO: f64 = 2.0;

/// Where a joint is, as its name or that of one above it says.
#[derive(Clone, Copy, PartialEq)]
enum Limb {
    Trunk,
    Head,
    /// Hair, hats and faces.
    OnHead,
    Leg,
    Arm,
}

impl Limb {
    /// That of a joint under one of this limb.
    fn of(self, name: &str) -> Self {
        match self {
            Limb::Head | Limb::OnHead => Limb::OnHead,
            Limb::Leg | Limb::Arm => self,
            Limb::Trunk if names().is_leg(name) => Limb::Leg,
            Limb::Trunk if names().is_arm(name) => Limb::Arm,
            Limb::Trunk if names().others.head.contains(&split(name).1) => Limb::Head,
            Limb::Trunk => Limb::Trunk,
        }
    }
}

/// Height of the body of `joints`, hips first, whose mean places in their parents are `means`; file units. By names from
/// the soles to the head; else by the longest chain of bones, which goes to the toes or to the fingers.
pub(crate) fn estimate(
    all: &[Joint],
    joints: &[usize],
    place: &[Option<usize>],
    means: &[Vector3<f64>],
) -> f64 {
    let mut chains = vec![(0.0, Limb::Trunk); joints.len()];
    // Length to the end of each joint's tip.
    let mut ends = Vec::with_capacity(joints.len());
    for (s, &j) in joints.iter().enumerate() {
        let joint = &all[j];
        if s > 0 {
            let (reach, limb) = joint.parent.and_then(|p| place[p]).map_or((0.0, Limb::Trunk), |p| chains[p]);
            chains[s] = (reach + means[s].norm(), limb.of(&joint.name));
        }
        let tip = joint.tips.iter().map(Vector3::norm).fold(0.0, f64::max);
        // Blender writes tips of fourteen metres for bones of glTF, which has none.
        let (reach, limb) = chains[s];
        ends.push((reach + tip.min(MAX_TIP_RATIO * means[s].norm()), limb));
    }
    let longest = |among: &dyn Fn(Limb) -> bool| {
        ends.iter().filter(|end| among(end.1)).map(|end| end.0).fold(0.0, f64::max)
    };
    let of = |limb: Limb| longest(&|other| other == limb);
    let (leg, head) = (of(Limb::Leg), of(Limb::Head));
    let trunk = if head > 0.0 { head } else { of(Limb::Trunk) };
    if leg > 0.0 && trunk > 0.0 {
        // What the foot is too long for, the skull above its joint makes up: within a fifth on bodies of many makers.
        leg + trunk
    } else {
        HEIGHT_OF_CHAIN * longest(&|_| true)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A body of 16 units with fingers and long hair was told to be of 23.
    #[test]
    fn fingers_and_hair_are_no_height() {
        // 1.7 m tall: name, parent, length of the bone to it, tip.
        let body = [
            ("hips", 0, 0.0, 0.0),
            ("spine", 0, 0.12, 0.0),
            ("chest", 1, 0.2, 0.0),
            ("head", 2, 0.26, 0.2),
            ("hair", 3, 0.9, 0.0),
            ("shoulder.L", 2, 0.2, 0.0),
            ("upper_arm.L", 5, 0.16, 0.0),
            ("forearm.L", 6, 0.3, 0.0),
            ("hand.L", 7, 0.27, 0.0),
            ("middle.L", 8, 0.2, 0.05),
            ("thigh.L", 0, 0.12, 0.0),
            ("shin.L", 10, 0.42, 0.0),
            ("foot.L", 11, 0.41, 0.15),
        ];
        let height = |named: bool| {
            let joint = |(i, &(name, parent, _, tip)): (usize, &(&str, usize, f64, f64))| Joint {
                name: if named { name.to_owned() } else { format!("j{i}") },
                parent: (i > 0).then_some(parent),
                offset: Vector3::zeros(),
                tips: vec![Vector3::y() * tip],
                moves: [false; 3],
                degrees: 3,
                still: false,
            };
            let all: Vec<Joint> = body.iter().enumerate().map(joint).collect();
            let means: Vec<_> = body.iter().map(|bone| Vector3::y() * bone.2).collect();
            let joints: Vec<usize> = (0..all.len()).collect();
            let place: Vec<_> = joints.iter().map(|&j| Some(j)).collect();
            estimate(&all, &joints, &place, &means)
        };
        let named = height(true);
        assert!((named / 1.7).ln().abs() < 0.15, "{named}");
        // Without names the longest chain is all that there is.
        assert!((height(false) - HEIGHT_OF_CHAIN * 1.5).abs() < 1e-9, "{}", height(false));
    }
}
