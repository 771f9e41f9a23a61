//! Body parts by shape, where names say nothing: which joints are legs, arms and head, by how they branch, how long their
//! bones are, and where they are in the clip's own poses.
//!
//! 1. A limb is two bones that follow each other, neither more than `UNEVEN` times as long as the other. A body has its
//!    limbs in pairs: one joint carries both, equally many joints below it, and they are alike in both bones. A thing
//!    in one hand, or things of unlike length in both, are no limbs.
//! 2. Legs: the pair whose ends are lowest on average. Arms: of the pairs that share no joint with them, the longest.
//! 3. Head: the highest of the ends that are left.
//! 4. Left is what names say, if they name both legs. Otherwise forward is where feet and knees point, and left follows from
//!    it. Where they do not show it, a single name does, or else the direction in which the body moves. If nothing does, the sides are not guessed: exchanged, they would turn the body around.
//!
//! Averages over the clip suffice: a body that walks stands on its legs, whatever its rest pose is.

use nalgebra::Vector3;
use thiserror::Error;

use crate::retarget::{
    facing::{self, Limb},
    parts::{Part, Side},
    tree::next,
};
use gestus_motion::{
    clip::{Frame, Skeleton},
    landmarks::on_hand,
    names,
};

/// Least sureness of feet and knees about which side is left.
const UNSURE: f64 = 0.3;
/// Joints of the legs whose names have to say a side, those that contradict subtracted, before their motion is asked.
const NAMED: i32 = 4;
/// Most that one bone of a limb is longer than the other, as a factor.
const UNEVEN: f64 = 2.2;
/// Least likeness of the two limbs of a pair: of a bone, and of the whole.
const ALIKE: [f64; 2] = [0.7, 0.8];
/// Shortest upper bone, relative to the lower one, of a limb that is one: a collarbone is shorter.
const SHORT: f64 = 0.8;
/// Longest bone that follows a limb, relative to the shorter bone of it: hands and feet are shorter.
const FOLLOWS: f64 = 0.7;
/// How much less a limb counts that exceeds one of these.
const LESS: f64 = 0.85;
/// Least length of arms and legs, relative to the longest pair: fingers and toes are shorter.
const LONG: f64 = 0.35;
/// Least distance of the middles of two limbs, relative to their length: helpers of a bone lie beside it.
const APART: f64 = 0.05;
/// Most joints of a skeleton whose shape is looked at: time grows with their square.
const MAX_JOINTS: usize = 1024;
/// Least way of a body that goes somewhere, relative to its legs.
const GOES: f64 = 0.5;

/// What shape says: parts, and how sure it is, 0 to 1.
#[derive(Debug, Clone, Default)]
pub struct Shape {
    /// Joint of each part that was found.
    pub parts: Vec<(Part, usize)>,
    /// How well the two sides agree in length: 1 is a mirror image.
    pub symmetry: f64,
    /// How much the legs point down, -1 to 1.
    pub down: f64,
}

/// A shape that is not known as a body's.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what they are")]
pub enum ShapeError {
    #[error("there is no pose to look at")]
    NoPose,
    #[error("it has more than {MAX_JOINTS} joints, too many to look at")]
    Joints,
    #[error(
        "no joint carries two similar limbs of two bones each, as hips carry legs: legs of one bone have no knees to bend, and fingers are \
         no legs"
    )]
    NoLegs,
    #[error(
        "besides the legs, no joint carries two similar limbs of two bones each, as a chest carries arms: arms of one bone have \
         no elbows to bend"
    )]
    NoArms,
    #[error(
        "nothing shows which side is left: it has no toes, its knees and elbows hardly bend, and it goes nowhere"
    )]
    NoSides,
}

/// Two limbs, one of either side.
#[derive(Debug, Clone)]
struct Pair {
    /// The joint that carries them.
    on: usize,
    /// Upper joint, middle, end of each.
    limbs: [[usize; 3]; 2],
    /// Length of the shorter one, metres, and likeness, 0 to 1.
    length: f64,
    alike: f64,
    /// How much they look like limbs, of those of two branches.
    likely: f64,
}

/// Finds the parts of a skeleton from some of its poses, Y up.
///
/// # Errors
/// [`ShapeError`] names the part that the skeleton lacks, or that its poses do not show.
pub fn find(skeleton: &Skeleton, frames: &[Frame]) -> Result<Shape, ShapeError> {
    if frames.is_empty() {
        return Err(ShapeError::NoPose);
    }
    if skeleton.joints() > MAX_JOINTS {
        return Err(ShapeError::Joints);
    }
    let next = next(skeleton);
    let positions: Vec<Vec<Vector3<f64>>> = frames.iter().map(|f| f.positions(skeleton)).collect();
    let mean = |of: &dyn Fn(&[Vector3<f64>]) -> f64| {
        positions.iter().map(|p| of(p)).sum::<f64>() / positions.len() as f64
    };
    let height = |j: usize| mean(&|p| p[j].y - p[0].y);
    let mut pairs = pairs(skeleton, &next);
    let longest = pairs.iter().map(|pair| pair.length).fold(0.0, f64::max);
    pairs.retain(|pair| {
        let [a, b] = pair.limbs;
        let is_finger = pair.limbs.iter().any(|limb| on_hand(skeleton, limb[0]));
        !is_finger
            && pair.length > LONG * longest
            && mean(&|p| (p[a[1]] - p[b[1]]).norm()) > APART * pair.length
    });
    let low = |pair: &&Pair| height(pair.limbs[0][2]) + height(pair.limbs[1][2]);
    let Some(mut legs) = pairs.iter().min_by(|a, b| low(a).total_cmp(&low(b))).cloned() else {
        return Err(ShapeError::NoLegs);
    };
    let inside = |pair: &Pair, joint: usize| {
        let way = skeleton.path(joint);
        pair.limbs.iter().any(|limb| way.contains(&limb[0]))
    };
    let apart = |pair: &&Pair| {
        pair.limbs.iter().flatten().all(|&j| !inside(&legs, j))
            && legs.limbs.iter().flatten().all(|&j| !inside(pair, j))
    };
    let longer = |a: &&Pair, b: &&Pair| a.length.total_cmp(&b.length);
    let Some(mut arms) = pairs.iter().filter(apart).max_by(longer).cloned() else {
        return Err(ShapeError::NoArms);
    };

    let [leg, arm] =
        [&legs, &arms].map(|pair| pair.limbs.map(|[a, b, c]| [Some(a), Some(b), Some(c), next[c]]));
    let elbows = arm.map(|[a, b, c, _]| [a, b, c, None]);
    let Some(first_is_left) = first_is_left(skeleton, &positions, leg, &elbows) else {
        return Err(ShapeError::NoSides);
    };
    if !first_is_left {
        legs.limbs.reverse();
    }
    let across = |p: &[Vector3<f64>], pair: &Pair, i: usize| p[pair.limbs[0][i]] - p[pair.limbs[1][i]];
    if mean(&|p| across(p, &legs, 0).dot(&across(p, &arms, 0))) < 0.0 {
        arms.limbs.reverse();
    }

    let mut parts = vec![(Part::Hips, 0)];
    for side in Side::BOTH {
        let [a, b, c] = legs.limbs[side.index()];
        parts.extend([(Part::UpperLeg(side), a), (Part::LowerLeg(side), b), (Part::Foot(side), c)]);
        parts.extend(next[c].map(|toes| (Part::Toes(side), toes)));
        let [a, b, c] = arms.limbs[side.index()];
        if without_hands(skeleton, &arms) {
            parts.extend([(Part::Clavicle(side), a), (Part::UpperArm(side), b), (Part::LowerArm(side), c)]);
            continue;
        }
        parts.extend([(Part::UpperArm(side), a), (Part::LowerArm(side), b), (Part::Hand(side), c)]);
        let clavicle = skeleton.parents[a].filter(|&above| above != arms.on);
        parts.extend(clavicle.map(|above| (Part::Clavicle(side), above)));
    }
    parts.extend(head(skeleton, &[&legs, &arms], &height).map(|joint| (Part::Head, joint)));
    let down = |p: &[Vector3<f64>]| {
        let ways = legs.limbs.map(|limb| p[limb[0]] - p[limb[2]]);
        ways.iter().map(|way| way.y / way.norm().max(1e-9)).sum::<f64>() / 2.0
    };
    Ok(Shape { parts, symmetry: legs.alike.min(arms.alike), down: mean(&down) })
}

/// Whether arms end with their lower arms: what looks like their two bones is a short collarbone and an upper arm.
fn without_hands(skeleton: &Skeleton, arms: &Pair) -> bool {
    let [upper, lower] =
        [1, 2].map(|i| arms.limbs.iter().map(|limb| skeleton.offsets[limb[i]].norm()).sum::<f64>());
    upper < SHORT * lower && arms.limbs.iter().all(|limb| !skeleton.parents.contains(&Some(limb[2])))
}

/// Every pair of limbs that one joint carries, the best of each two of its branches.
fn pairs(skeleton: &Skeleton, next: &[Option<usize>]) -> Vec<Pair> {
    let bone = |j: usize| skeleton.offsets[j].norm();
    // By the child of the joint that carries them: each limb, and how many joints below that child it begins.
    let mut limbs: Vec<Vec<([usize; 3], usize)>> = vec![Vec::new(); skeleton.joints()];
    for end in 0..skeleton.joints() {
        let Some(middle) = skeleton.parents[end] else { continue };
        let Some(upper) = skeleton.parents[middle].filter(|&upper| upper > 0) else { continue };
        let (long, short) = (bone(middle).max(bone(end)), bone(middle).min(bone(end)));
        if short < 1e-6 || long > UNEVEN * short {
            continue;
        }
        let mut branch = Some(upper);
        let mut depth = 0;
        while let Some(child) = branch.filter(|&child| child > 0) {
            limbs[child].push(([upper, middle, end], depth));
            branch = skeleton.parents[child];
            depth += 1;
        }
    }
    let mut pairs = Vec::new();
    for a in 1..skeleton.joints() {
        for b in a + 1..skeleton.joints() {
            let Some(on) = skeleton.parents[a].filter(|_| skeleton.parents[a] == skeleton.parents[b]) else {
                continue;
            };
            let both = limbs[a].iter().flat_map(|x| limbs[b].iter().map(move |y| (x, y)));
            let alike =
                both.filter(|(x, y)| x.1 == y.1).filter_map(|(x, y)| pair(skeleton, next, on, x.0, y.0));
            pairs.extend(alike.max_by(|x, y| x.likely.total_cmp(&y.likely)));
        }
    }
    pairs
}

/// Two limbs as a pair, if they are alike.
fn pair(
    skeleton: &Skeleton,
    next: &[Option<usize>],
    on: usize,
    a: [usize; 3],
    b: [usize; 3],
) -> Option<Pair> {
    let bone = |j: usize| skeleton.offsets[j].norm();
    let ratio = |x: f64, y: f64| x.min(y) / x.max(y);
    let bones = ratio(bone(a[1]), bone(b[1])).min(ratio(bone(a[2]), bone(b[2])));
    let [x, y] = [a, b].map(|limb| bone(limb[1]) + bone(limb[2]));
    let whole = ratio(x, y);
    if bones < ALIKE[0] || whole < ALIKE[1] {
        return None;
    }
    let less = |odd: bool| if odd { LESS } else { 1.0 };
    let short = bone(a[1]) + bone(b[1]) < SHORT * (bone(a[2]) + bone(b[2]));
    let follows = [a, b]
        .iter()
        .all(|&limb| next[limb[2]].map_or(0.0, bone) > FOLLOWS * bone(limb[1]).min(bone(limb[2])));
    let length = x.min(y);
    Some(Pair {
        on,
        limbs: [a, b],
        length,
        alike: whole,
        likely: length * whole * less(short) * less(follows),
    })
}

/// Whether the first leg is the left one; `None` where nothing tells.
fn first_is_left(
    skeleton: &Skeleton,
    positions: &[Vec<Vector3<f64>>],
    legs: [Limb; 2],
    elbows: &[Limb; 2],
) -> Option<bool> {
    let says = |limb: &Limb, side| {
        limb.iter().flatten().filter(|&&j| names::side(&skeleton.names[j]) == Some(side)).count() as i32
    };
    let named = |first, second| says(&legs[0], first) + says(&legs[1], second);
    let by_name = named(Side::Left, Side::Right) - named(Side::Right, Side::Left);
    if by_name.abs() >= NAMED {
        return Some(by_name > 0);
    }
    let vote = facing::first_is_left(positions, legs, elbows);
    if vote.abs() >= UNSURE {
        return Some(vote > 0.0);
    }
    if by_name != 0 {
        return Some(by_name > 0);
    }
    let [Some(a), Some(b)] = legs.map(|leg| leg[0]) else { return None };
    let leg_m = legs[0].windows(2).take(2).filter_map(|w| Some(skeleton.offsets[w[1]?].norm())).sum::<f64>();
    // Over the ground, across the body: the way goes ahead.
    let ahead = |p: &[Vector3<f64>]| (p[a] - p[b]).cross(&Vector3::y()).try_normalize(1e-9);
    let steps = positions.windows(2).filter_map(|w| Some(ahead(&w[0])?.dot(&(w[1][0] - w[0][0]))));
    let way: f64 = steps.sum();
    (way.abs() > GOES * leg_m).then_some(way > 0.0)
}

/// The head: on the way from the joint that carries the arms to the highest end.
fn head(skeleton: &Skeleton, limbs: &[&Pair; 2], height: &dyn Fn(usize) -> f64) -> Option<usize> {
    let branches: Vec<usize> = limbs
        .iter()
        .flat_map(|pair| pair.limbs.map(|limb| (pair.on, limb[0])))
        .filter_map(|(on, upper)| skeleton.path(upper).into_iter().skip_while(|&j| j != on).nth(1))
        .collect();
    let outside = |&j: &usize| j > 0 && skeleton.path(j).iter().all(|at| !branches.contains(at));
    let carriers = skeleton.path(limbs[1].on);
    let end = (0..skeleton.joints())
        .filter(|j| !carriers.contains(j))
        .filter(outside)
        .max_by(|&a, &b| height(a).total_cmp(&height(b)))?;
    let way: Vec<usize> = skeleton.path(end).into_iter().filter(|j| !carriers.contains(j)).collect();
    // The head carries eyes, jaw and hair: the first joint above the neck's that holds several, or else the last.
    let holds = |j: &usize| skeleton.parents.iter().filter(|parent| **parent == Some(*j)).count();
    way.iter().skip(1).find(|&j| holds(j) > 1).or(way.last()).copied()
}
