//! How the joints of a skeleton hang together.

use gestus_motion::{clip::Skeleton, names::words};

/// The joint that follows each, of several that of the longest bone.
pub fn next(skeleton: &Skeleton) -> Vec<Option<usize>> {
    let bone = |j: usize| skeleton.offsets[j].norm();
    let mut next: Vec<Option<usize>> = vec![None; skeleton.joints()];
    for joint in (1..skeleton.joints()).filter(|&joint| bone(joint) > 1e-6) {
        let Some(next) = skeleton.parents[joint].map(|parent| &mut next[parent]) else { continue };
        if next.is_none_or(|known| bone(joint) >= bone(known)) {
            *next = Some(joint);
        }
    }
    next
}

/// True for a control of inverse kinematics, as rigs call them: `IK_foot.L`, `FootIKTarget`, `knee_pole_r`.
fn is_control(name: &str) -> bool {
    let words = words(name);
    let is =
        |word: &String| ["ik", "pole", "target", "ctrl", "control", "controller"].contains(&word.as_str());
    words.iter().any(is)
}

/// What to do where limbs do not hang together.
pub fn advice(skeleton: &Skeleton) -> String {
    let controls: Vec<String> =
        skeleton.names.iter().filter(|name| is_control(name)).map(|name| format!("`{name}`")).collect();
    if controls.is_empty() {
        return "say in a map file which joint is which".into();
    }
    format!(
        "{} {} of inverse kinematics, by which another program bends the limbs: export the motion baked onto the bones that \
         carry the mesh, or say in a map file which joint is which",
        controls.join(", "),
        if controls.len() == 1 { "is a control" } else { "are controls" }
    )
}

/// True if `joint` is `above` or one of its descendants.
pub fn below(skeleton: &Skeleton, joint: usize, above: usize) -> bool {
    skeleton.path(joint).contains(&above)
}
