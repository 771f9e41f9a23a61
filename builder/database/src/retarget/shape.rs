//! Body parts by shape, where names say nothing: which chains are legs, arms and head, by how they branch, how
//! long their bones are, and where they are in the clip's own poses.
//!
//! 1. A chain runs from a joint with several branches to a leaf; joints of no length count for nothing.
//! 2. Legs: two chains of like lengths, of two long bones each, whose ends are lowest on average.
//! 3. Arms: two more such chains, that leave the trunk above the legs.
//! 4. Head: of what is left, the end that is highest.
//! 5. Forward is where feet and knees point, left follows from it; names decide where they tell nothing.
//!
//! Averages over the clip are pose enough: a body that walks stands on its legs, whatever its rest pose is.

use nalgebra::Vector3;

use crate::retarget::{
    facing,
    parts::{Part, Side},
};
use gestus_motion::{
    clip::{Frame, Skeleton},
    names,
};

/// Least sureness of feet and knees about which side is left.
const UNSURE: f64 = 0.3;

/// What shape says: parts, and how sure it is, 0 to 1.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    /// Joint of each part that was found.
    pub parts: Vec<(Part, usize)>,
    /// How well the two sides agree in length: 1 is a mirror image.
    pub symmetry: f64,
}

/// A limb: its joints of some length, from where it leaves the trunk to its end.
struct Chain {
    joints: Vec<usize>,
    length: f64,
    /// Mean height of its end over the root.
    height: f64,
}

/// Finds the parts of a skeleton from some of its poses, Y up. Empty where it has no legs and arms.
pub fn find(skeleton: &Skeleton, frames: &[Frame]) -> Shape {
    let positions: Vec<Vec<Vector3<f64>>> = frames.iter().map(|f| f.positions(skeleton)).collect();
    let Some(count) = Some(positions.len()).filter(|&n| n > 0) else { return Shape::default() };
    let height = |j: usize| positions.iter().map(|p| p[j].y - p[0].y).sum::<f64>() / count as f64;
    let chains = chains(skeleton, &height);
    let body = chains.iter().map(|c| c.length).fold(0.0, f64::max);
    if body <= 0.0 {
        return Shape::default();
    }
    // Pairs of like chains with at least two long bones: limbs.
    let mut pairs: Vec<(usize, usize, f64)> = Vec::new();
    for a in 0..chains.len() {
        for b in a + 1..chains.len() {
            let (x, y) = (&chains[a], &chains[b]);
            let alike = x.length.min(y.length) / x.length.max(y.length);
            let far = |c: &Chain| c.joints.len() >= 3 && c.length > 0.3 * body;
            let apart = positions.iter().map(|p| (p[x.joints[0]] - p[y.joints[0]]).norm()).sum::<f64>();
            if alike > 0.8 && far(x) && far(y) && apart / count as f64 > 0.02 * body {
                pairs.push((a, b, alike));
            }
        }
    }
    let low = |&(a, b, _): &(usize, usize, f64)| chains[a].height + chains[b].height;
    let Some(&legs) = pairs.iter().min_by(|x, y| low(x).total_cmp(&low(y))) else { return Shape::default() };
    let others = |c: usize| c != legs.0 && c != legs.1;
    let free: Vec<_> = pairs.iter().filter(|p| others(p.0) && others(p.1)).collect();
    let Some(&&arms) = free.iter().max_by(|x, y| {
        let long = |p: &(usize, usize, f64)| chains[p.0].length + chains[p.1].length;
        long(x).total_cmp(&long(y))
    }) else {
        return Shape::default();
    };
    let taken = [legs.0, legs.1, arms.0, arms.1];
    let head = (0..chains.len())
        .filter(|c| !taken.contains(c))
        .max_by(|&a, &b| chains[a].height.total_cmp(&chains[b].height));

    // Which is left: by where feet and knees point, or else by names.
    let limbs = [legs.0, legs.1].map(|c| limb(skeleton, &chains[c]));
    let elbows = [arms.0, arms.1].map(|c| {
        let [a, b, c, _] = limb(skeleton, &chains[c]);
        [a, b, c, None]
    });
    let mut vote = facing::first_is_left(&positions, limbs, &elbows);
    if vote.abs() < UNSURE {
        let says = |c: usize, side| {
            chains[c].joints.iter().filter(|&&j| names::side(&skeleton.names[j]) == Some(side)).count() as f64
        };
        let named = |first, second| says(legs.0, first) + says(legs.1, second);
        let by_name = named(Side::Left, Side::Right) - named(Side::Right, Side::Left);
        vote = if by_name == 0.0 { vote } else { by_name };
    }
    let legs = if vote >= 0.0 { (legs.0, legs.1, legs.2) } else { (legs.1, legs.0, legs.2) };
    let across: Vec<Vector3<f64>> =
        positions.iter().map(|p| p[chains[legs.0].joints[0]] - p[chains[legs.1].joints[0]]).collect();
    let side = |p: &[Vector3<f64>], c: usize| p[chains[c].joints[0]];
    let vote: f64 =
        positions.iter().zip(&across).map(|(p, l)| l.dot(&(side(p, arms.0) - side(p, arms.1)))).sum();
    let arms = if vote >= 0.0 { arms } else { (arms.1, arms.0, arms.2) };

    let mut parts = vec![(Part::Hips, 0)];
    for (pair, arm) in [(legs, false), (arms, true)] {
        for (side, chain) in [(Side::Left, pair.0), (Side::Right, pair.1)] {
            let [a, b, c, d] = limb(skeleton, &chains[chain]);
            let named = if arm {
                [Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side), Part::Clavicle(side)]
            } else {
                [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side), Part::Toes(side)]
            };
            // An arm's fourth joint is the one before the upper arm.
            let clavicle = a
                .and_then(|a| chains[chain].joints.iter().position(|&j| j == a))
                .and_then(|i| i.checked_sub(1))
                .map(|i| chains[chain].joints[i]);
            let last = if arm { clavicle } else { d };
            parts.extend([a, b, c, last].into_iter().zip(named).filter_map(|(j, part)| Some((part, j?))));
        }
    }
    if let Some(head) = head {
        // Eyes, jaw and hair hang on the head: the first joint above the neck's that holds several, or else the last.
        let holds = |j: &usize| (0..skeleton.joints()).filter(|&c| skeleton.parents[c] == Some(*j)).count();
        let joints = &chains[head].joints;
        let joint = joints.iter().skip(1).find(|j| holds(j) > 1).or(joints.last());
        parts.extend(joint.map(|&joint| (Part::Head, joint)));
    }
    Shape { parts, symmetry: legs.2.min(arms.2) }
}

/// Chains from the trunk to the leaves. A chain begins where it leaves a joint that other chains share.
fn chains(skeleton: &Skeleton, height: &dyn Fn(usize) -> f64) -> Vec<Chain> {
    let joints = skeleton.joints();
    let long = |j: usize| skeleton.offsets[j].norm() > 1e-3;
    // A real branch reaches somewhere: joints whose whole subtree has no length are decoration.
    let mut reach = vec![0.0f64; joints];
    for j in (1..joints).rev() {
        if let Some(p) = skeleton.parents[j] {
            reach[p] = reach[p].max(reach[j] + skeleton.offsets[j].norm());
        }
    }
    let whole = reach[0];
    let real = |j: usize| reach[j] + skeleton.offsets[j].norm() > 0.03 * whole;
    let branches: Vec<usize> = (0..joints)
        .map(|j| (j + 1..joints).filter(|&c| skeleton.parents[c] == Some(j) && real(c)).count())
        .collect();
    // Fingers branch too: only forks whose branches are long by the measure of the body make the trunk.
    let forks: Vec<bool> = (0..joints)
        .map(|j| {
            let big = |c: &usize| reach[*c] + skeleton.offsets[*c].norm() > 0.18 * whole;
            branches[j] > 1
                && (j + 1..joints).filter(|&c| skeleton.parents[c] == Some(j)).filter(big).count() > 1
        })
        .collect();
    let mut chains = Vec::new();
    let leaves = (1..joints).filter(|&j| branches[j] == 0 && (real(j) || long(j)));
    for leaf in leaves {
        let mut path = vec![leaf];
        let mut at = leaf;
        while let Some(p) = skeleton.parents[at] {
            if forks[p] || p == 0 {
                break;
            }
            path.push(p);
            at = p;
        }
        path.reverse();
        // Where the way forks below (fingers), one chain is enough: the longest.
        let length = path.iter().skip(1).map(|&j| skeleton.offsets[j].norm()).sum();
        chains.push(Chain { height: height(leaf), joints: path, length });
    }
    let mut best: Vec<Chain> = Vec::new();
    for chain in chains {
        match best.iter_mut().find(|c| c.joints[0] == chain.joints[0]) {
            Some(known) if known.length < chain.length => *known = chain,
            Some(_) => {}
            None => best.push(chain),
        }
    }
    best
}

/// The joints that begin the upper bone, the lower bone, the end (hand, foot) and what follows it: the two longest
/// bones of a chain that follow each other.
fn limb(skeleton: &Skeleton, chain: &Chain) -> [Option<usize>; 4] {
    let bone = |i: usize| chain.joints.get(i).map_or(0.0, |&j| skeleton.offsets[j].norm());
    let middle = (1..chain.joints.len().saturating_sub(1))
        .max_by(|&a, &b| (bone(a) * bone(a + 1)).total_cmp(&(bone(b) * bone(b + 1))));
    let Some(middle) = middle else { return [None; 4] };
    let at = |i: usize| chain.joints.get(i).copied();
    [at(middle - 1), at(middle), at(middle + 1), at(middle + 2)]
}
