//! Encodes a map: the source of each joint's rotation, and the limbs that both bodies have (`docs/FORMAT.md`, "Retargeting
//! map").

use gestus_core::{
    blob::crc::crc32c,
    retarget::layout::{self, header, joint, limb, record},
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    models::numbers::floats,
    retarget::{
        body::Body,
        parts::{Part, Side},
    },
};

/// Source of a joint's orientation.
enum Source {
    Stay(UnitQuaternion<f64>),
    Follow { from: [usize; 2], weight: f64, turns: [UnitQuaternion<f64>; 2] },
}

impl Source {
    fn follow(joint: usize, turn: UnitQuaternion<f64>) -> Self {
        Self::Follow { from: [joint; 2], weight: 0.0, turns: [turn; 2] }
    }
}

/// Sources in `from` of `to`'s joints.
fn sources(from: &Body, to: &Body) -> Vec<Source> {
    let frame = |body: &Body, j: usize| body.anatomy.frame(j);
    let turn = |a: usize, t: usize| -> Option<UnitQuaternion<f64>> {
        Some(frame(from, a)? * frame(to, t)?.inverse())
    };
    let mut sources: Vec<Source> = to.rest.iter().map(|q| Source::Stay(*q)).collect();
    for (theirs, ours) in from.chains().iter().zip(to.chains()) {
        for &(t, at) in &ours {
            // The last at or before this place, and the next.
            let next = theirs.iter().position(|&(_, u)| u >= at - 1e-9).unwrap_or(theirs.len() - 1);
            let (b, after) = theirs[next];
            let (a, before) = theirs[next.saturating_sub(1)];
            let span = after - before;
            let weight = if span > 1e-9 { ((at - before) / span).clamp(0.0, 1.0) } else { 1.0 };
            let (from, weight) = if weight >= 1.0 - 1e-9 { ([b, b], 0.0) } else { ([a, b], weight) };
            if let (Some(first), Some(second)) = (turn(from[0], t), turn(from[1], t)) {
                sources[t] = Source::Follow { from, weight, turns: [first, second] };
            }
        }
    }
    for (&part, &t) in &to.parts.joints {
        if matches!(part, Part::Hips | Part::Chest | Part::Head) {
            continue;
        }
        if let Some(a) = from.parts.get(part)
            && let Some(turn) = turn(a, t)
        {
            sources[t] = Source::follow(a, turn);
        }
    }
    sources
}

/// Sources of both directions: of the target's joints in `source`, and of the source's in `target`.
///
/// Joints inside spine and neck have counterparts, the nearest in order, as many as the body with fewer has. Such a joint
/// turns as its counterpart does, and lies, on average over the source's motion, as between its neighbors: a neck that
/// leans at rest leans on the way back, and the database's does not. Those of the source that are left over are as in the
/// input. So a pose comes back as it was.
fn both_ways(source: &Body, target: &Body) -> [Vec<Source>; 2] {
    let (mut inwards, mut outwards) = (sources(source, target), sources(target, source));
    for (theirs, ours) in source.chains().into_iter().zip(target.chains()) {
        let lost = if ours.len() > 1 { inner(&theirs) } else { &theirs[1..] };
        for &(joint, _) in lost {
            outwards[joint] = Source::Stay(source.rest[joint]);
        }
        for (joint, counterpart) in pairs(inner(&theirs), inner(&ours)) {
            let Source::Follow { from, weight, turns } = &inwards[counterpart] else { continue };
            let seen = |i: usize| {
                let from = from[i];
                let seen = if from == joint { None } else { source.anatomy.seen.get(&(joint, from)) };
                seen.copied().unwrap_or_default() * turns[i]
            };
            let turn = seen(0).try_slerp(&seen(1), *weight, 1e-9).unwrap_or_else(|| seen(0));
            inwards[counterpart] = Source::follow(joint, turn);
            outwards[joint] = Source::follow(counterpart, turn.inverse());
        }
    }
    [inwards, outwards]
}

/// A chain without its ends.
fn inner(chain: &[(usize, f64)]) -> &[(usize, f64)] {
    chain.get(1..chain.len() - 1).unwrap_or_default()
}

/// Joints of two chains that are nearest to each other, in order: each of the shorter one's has a counterpart.
fn pairs(a: &[(usize, f64)], b: &[(usize, f64)]) -> Vec<(usize, usize)> {
    if a.len() > b.len() {
        return pairs(b, a).into_iter().map(|(b, a)| (a, b)).collect();
    }
    let mut free = 0;
    let mut pairs = Vec::new();
    for (i, &(joint, at)) in a.iter().enumerate() {
        let off = |k: &usize| (b[*k].1 - at).abs();
        // The joints that follow need one each.
        let last = b.len() - (a.len() - i);
        let nearest = (free..=last).min_by(|x, y| off(x).total_cmp(&off(y))).unwrap_or(last);
        pairs.push((joint, b[nearest].0));
        free = nearest + 1;
    }
    pairs
}

/// The limbs that both bodies have.
fn limbs(source: &Body, target: &Body) -> Vec<([usize; 3], [usize; 3], u8)> {
    let mut limbs = Vec::new();
    for side in Side::BOTH {
        let chains = [
            ([Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side)], limb::LEG),
            ([Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)], limb::ARM),
        ];
        for (chain, kind) in chains {
            let of = |body: &Body| -> Option<[usize; 3]> {
                let [a, b, c] = chain.map(|p| body.parts.get(p));
                Some([a?, b?, c?])
            };
            if let (Some(a), Some(b)) = (of(source), of(target)) {
                limbs.push((a, b, kind));
            }
        }
    }
    limbs
}

/// Encodes the map of `source` to `target`, whose legs are `scale` times as long.
pub(super) fn encode(
    skeleton: u32,
    source: &Body,
    target: &Body,
    world: &UnitQuaternion<f64>,
    scale: f64,
) -> Vec<u8> {
    let limbs = limbs(source, target);
    let (n, j) = (source.skeleton.joints(), target.skeleton.joints());
    let total = layout::total(n, j, limbs.len());
    let mut bytes = vec![0; header::LENGTH];
    let mut put = |range: std::ops::Range<usize>, data: &[u8]| bytes[range].copy_from_slice(data);
    put(header::MAGIC, &layout::MAGIC);
    put(header::VERSION, &layout::VERSION.to_le_bytes());
    // Counts were checked against limits far below these widths.
    put(header::SOURCES, &(n as u16).to_le_bytes());
    put(header::TARGETS, &(j as u16).to_le_bytes());
    put(header::LIMBS, &(limbs.len() as u16).to_le_bytes());
    put(header::TOTAL, &(total as u32).to_le_bytes());
    put(header::SKELETON, &skeleton.to_le_bytes());
    put(header::SCALE, &(scale as f32).to_le_bytes());
    put(header::SOURCE_ANKLE, &(source.anatomy.ankle_m as f32).to_le_bytes());
    put(header::TARGET_ANKLE, &(target.anatomy.ankle_m as f32).to_le_bytes());
    put(header::WORLD, &floats(world.coords.iter().copied()));
    put(header::SOURCE_HIPS, &floats(source.anatomy.hips.iter().copied()));
    put(header::TARGET_HIPS, &floats(target.anatomy.hips.iter().copied()));
    let chains = [limbs.iter().map(|l| l.0).collect::<Vec<_>>(), limbs.iter().map(|l| l.1).collect()];
    for (body, chains) in [source, target].into_iter().zip(&chains) {
        let segment = |joint: usize| -> u8 {
            let of = |(l, chain): (usize, &[usize; 3])| {
                (0..2).find(|&i| chain[i] == joint).map(|i| (1 + 2 * l + i) as u8)
            };
            chains.iter().enumerate().find_map(of).unwrap_or(0)
        };
        for i in 0..body.skeleton.joints() {
            let at = grow(&mut bytes, joint::LENGTH);
            bytes[at + joint::PARENT] = body.skeleton.parents[i].map_or(u8::MAX, |p| p as u8);
            bytes[at + joint::SEGMENT] = segment(i);
            let offset = if i == 0 { Vector3::zeros() } else { body.skeleton.offsets[i] };
            set(&mut bytes, at, joint::OFFSET, offset.as_slice());
        }
    }
    for records in both_ways(source, target) {
        for from in &records {
            let at = grow(&mut bytes, record::LENGTH);
            let identity = UnitQuaternion::identity();
            let (kind, from, weight, turns) = match from {
                Source::Stay(rest) => (record::STAY, [0, 0], 0.0, [*rest, identity]),
                Source::Follow { from, weight, turns } => (record::FOLLOW, *from, *weight, *turns),
            };
            bytes[at + record::KIND] = kind;
            bytes[at + record::FROM.start] = from[0] as u8;
            bytes[at + record::FROM.start + 1] = from[1] as u8;
            set(&mut bytes, at, record::WEIGHT, &[weight]);
            set(&mut bytes, at, record::TURNS, turns.map(|turn| turn.coords.data.0[0]).as_flattened());
        }
    }
    for (a, b, kind) in &limbs {
        let [a, b] = [a, b].map(|c| c.map(|j| j as u8));
        bytes.extend([a[0], a[1], a[2], *kind, b[0], b[1], b[2], 0]);
    }
    let crc = crc32c(&[&bytes]);
    bytes[header::CRC].copy_from_slice(&crc.to_le_bytes());
    bytes
}

/// Appends a record of zeros; returns where it begins.
pub(crate) fn grow(bytes: &mut Vec<u8>, length: usize) -> usize {
    let at = bytes.len();
    bytes.resize(at + length, 0);
    at
}

/// Writes numbers as `f32` to a byte range of the record at `at`.
pub(crate) fn set(bytes: &mut [u8], at: usize, range: std::ops::Range<usize>, values: &[f64]) {
    bytes[at + range.start..at + range.end].copy_from_slice(&floats(values.iter().copied()));
}
