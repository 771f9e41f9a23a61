//! Landmarks: hips, knees, feet and arms, found by name or, failing that, by the skeleton's shape.

use nalgebra::Vector3;
use thiserror::Error;

use crate::{
    clip::Skeleton,
    names::{self, Side, names},
};

/// Landmarks of a skeleton. Pairs are left, right.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Landmarks {
    /// Upper ends of the thighs.
    pub hip_joints: [usize; 2],
    /// Knees.
    pub knees: [usize; 2],
    /// Ankles.
    pub feet: [usize; 2],
    /// Toes, where the skeleton has them; the ankles otherwise.
    pub toes: [usize; 2],
    /// Part of each joint: 0 trunk, legs and head, 1 left arm, 2 right arm. Shape `[joints]`.
    pub groups: Vec<usize>,
}

/// A skeleton whose legs were not found.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "no legs found in the skeleton (joints: {joints}): it takes a body with two legs of hip, knee and foot; \
     name the joints like `LeftUpLeg`, `UpperLeg_L` or `lfemur`"
)]
pub struct LandmarkError {
    /// The skeleton's joints.
    joints: String,
}

impl Landmarks {
    /// Finds the landmarks of a skeleton.
    ///
    /// # Errors
    /// [`LandmarkError`] if two legs are not found.
    pub fn find(skeleton: &Skeleton) -> Result<Self, LandmarkError> {
        let rest = rest_positions(skeleton);
        let legs = [0, 1].map(|side| leg(skeleton, &rest, side));
        let [Some(left), Some(right)] = legs else {
            return Err(LandmarkError { joints: skeleton.names.join(", ") });
        };
        let both = |i: usize| [left[i], right[i]];
        let mut groups = vec![0; skeleton.joints()];
        for side in [0, 1] {
            for arm in arm(skeleton, &rest, side) {
                groups[arm] = 1 + side;
            }
        }
        Ok(Self { hip_joints: both(0), knees: both(1), feet: both(2), toes: both(3), groups })
    }
}

/// Positions with all rotations identity, hips at the origin.
pub fn rest_positions(skeleton: &Skeleton) -> Vec<Vector3<f64>> {
    let mut positions: Vec<Vector3<f64>> = Vec::with_capacity(skeleton.joints());
    for j in 0..skeleton.joints() {
        positions.push(skeleton.offsets[j] + skeleton.parents[j].map_or(Vector3::zeros(), |p| positions[p]));
    }
    positions
}

/// Whether a joint's name, or that of one above it, says that it is on a hand.
pub fn on_hand(skeleton: &Skeleton, joint: usize) -> bool {
    skeleton.path(joint).iter().any(|&j| names().is_hand(&skeleton.names[j]))
}

/// Side by name: 0 left, 1 right.
fn side_of(name: &str) -> Option<usize> {
    names::side(name).map(Side::index)
}

/// The chain of joints from the root to each leaf.
fn chains(skeleton: &Skeleton) -> Vec<Vec<usize>> {
    let leaf = |j: &usize| !skeleton.parents.contains(&Some(*j));
    (0..skeleton.joints()).filter(leaf).map(|j| skeleton.path(j)).collect()
}

fn on_side(skeleton: &Skeleton, rest: &[Vector3<f64>], chain: &[usize], side: usize) -> bool {
    let named = chain.iter().rev().find_map(|&j| side_of(&skeleton.names[j]));
    // Without names: left is +X of a body that faces +Z.
    let by_place = if rest[chain[chain.len() - 1]].x > 0.0 { 0 } else { 1 };
    named.unwrap_or(by_place) == side
}

/// Hip joint, knee, ankle, toes of a side: the chain that reaches lowest.
fn leg(skeleton: &Skeleton, rest: &[Vector3<f64>], side: usize) -> Option<[usize; 4]> {
    let chains: Vec<Vec<usize>> =
        chains(skeleton).into_iter().filter(|c| c.len() >= 4 && on_side(skeleton, rest, c, side)).collect();
    let named = chains
        .iter()
        .filter(|c| c.iter().any(|&j| names().is_leg(&skeleton.names[j])))
        .max_by_key(|c| c.len());
    let lowest = || {
        let depth = |c: &&Vec<usize>| rest[c[c.len() - 1]].y;
        let is_leg = |c: &&Vec<usize>| !on_hand(skeleton, c[c.len() - 1]);
        chains.iter().filter(is_leg).min_by(|a, b| depth(a).total_cmp(&depth(b)))
    };
    let chain = named.or_else(lowest)?;
    // Some skeletons put a joint of no length between hips and thigh (`LHipJoint`): the thigh and the shin are
    // the two longest bones of the chain, one after the other.
    let bones: Vec<f64> = chain.iter().map(|&j| skeleton.offsets[j].norm()).collect();
    let knee = (2..chain.len() - 1)
        .max_by(|&a, &b| (bones[a] + bones[a + 1]).total_cmp(&(bones[b] + bones[b + 1])))?;
    let toes = (knee + 2).min(chain.len() - 1);
    Some([chain[knee - 1], chain[knee], chain[knee + 1], chain[toes]])
}

/// Joints of an arm, from the collarbone on: side branches above the legs.
fn arm(skeleton: &Skeleton, rest: &[Vector3<f64>], side: usize) -> Vec<usize> {
    let named: Vec<usize> = (0..skeleton.joints())
        .filter(|&j| names().is_arm(&skeleton.names[j]) && side_of(&skeleton.names[j]) == Some(side))
        .collect();
    if !named.is_empty() {
        return named;
    }
    // By shape: the part of a side's widest chain that no other chain shares, above the hips.
    let chains = chains(skeleton);
    let widest = chains
        .iter()
        .filter(|c| on_side(skeleton, rest, c, side) && rest[c[c.len() - 1]].y > 0.0)
        .max_by(|a, b| rest[a[a.len() - 1]].x.abs().total_cmp(&rest[b[b.len() - 1]].x.abs()));
    let shared = |j: &usize| chains.iter().filter(|c| c.contains(j)).count() > 1;
    widest.map_or(Vec::new(), |c| c.iter().copied().filter(|j| !shared(j)).collect())
}
