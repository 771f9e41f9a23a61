//! One skeleton for all clips of a folder: which skeletons can be merged, and how.

use std::sync::Arc;

use nalgebra::Vector3;

use gestus_motion::clip::{Clip, Skeleton};

/// Greatest ratio of sizes of bodies that share a skeleton: an adult and a child.
const LARGER: f64 = 2.0;
/// Least difference in size for which steps are scaled, as a fraction.
const SAME_SIZE: f64 = 0.01;
/// Greatest angle between corresponding bones of one skeleton at rest, degrees: actors' shoulders differ.
const TURNED_DEG: f64 = 30.0;
/// Length below which the direction of a bone is ignored, metres.
const SHORT_M: f64 = 0.03;

/// The skeletons by kinds, each with those that can be merged with its first: their places.
pub(super) fn kinds(skeletons: &[&Skeleton]) -> Vec<Vec<usize>> {
    let mut kinds: Vec<Vec<usize>> = Vec::new();
    for (i, skeleton) in skeletons.iter().enumerate() {
        match kinds.iter_mut().find(|kind| difference(skeletons[kind[0]], skeleton).is_none()) {
            Some(kind) => kind.push(i),
            None => kinds.push(vec![i]),
        }
    }
    kinds
}

/// The skeleton with which most others can be merged, of equally common ones the first: its place, and how many have it.
pub(super) fn most_common(skeletons: &[&Skeleton]) -> Option<(usize, usize)> {
    let kinds = kinds(skeletons);
    let most = kinds.iter().map(Vec::len).max();
    kinds.into_iter().find(|kind| Some(kind.len()) == most).map(|kind| (kind[0], kind.len()))
}

/// How `b` differs from `a` where that prevents the two from being merged.
pub(super) fn difference(a: &Skeleton, b: &Skeleton) -> Option<String> {
    if let Some(difference) = b.difference(a) {
        return Some(difference);
    }
    let times = size(b) / size(a);
    if !(1.0 / LARGER..=LARGER).contains(&times) {
        return Some(format!("its bones are {times:.2} times as long; is its unit another?"));
    }
    (1..a.joints()).find_map(|j| {
        let (one, other) = (a.offsets[j], b.offsets[j]);
        let degrees = one.angle(&other).to_degrees();
        (one.norm().min(other.norm()) > SHORT_M && degrees > TURNED_DEG).then(|| {
            let name = &a.names[j];
            format!("`{name}` lies {degrees:.0} degrees off at rest, so that rotations mean something else")
        })
    })
}

/// Length of all bones, metres.
pub(super) fn size(skeleton: &Skeleton) -> f64 {
    skeleton.offsets.iter().skip(1).map(Vector3::norm).sum::<f64>().max(f64::MIN_POSITIVE)
}

/// Gives all clips the mean skeleton and scales their translation to its size.
pub(super) fn unify(clips: &mut [&mut Clip]) {
    let Some(first) = clips.first() else { return };
    let mut skeleton = (*first.skeleton).clone();
    let count = clips.len() as f64;
    for (j, offset) in skeleton.offsets.iter_mut().enumerate() {
        *offset = clips.iter().map(|clip| clip.skeleton.offsets[j]).sum::<Vector3<f64>>() / count;
    }
    let skeleton = Arc::new(skeleton);
    for clip in clips {
        let scale = size(&skeleton) / size(&clip.skeleton);
        // Smaller differences are noise in one body's markers.
        if (scale - 1.0).abs() > SAME_SIZE {
            clip.frames.iter_mut().for_each(|frame| frame.root *= scale);
        }
        clip.skeleton = skeleton.clone();
    }
}
