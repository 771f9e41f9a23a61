//! Anatomical frames: how each body part lies in its joint's own axes.
//!
//! The intermediate skeleton of Monzani et al. 2000, as one constant rotation per joint. Frames are derived from properties
//! that all bodies share, and from a rest pose only if there is nothing better:
//!
//! | part | frame, in the joint's axes |
//! |---|---|
//! | upper and lower arms and legs | Y along the bone; X is the axis about which elbow or knee bend in the motion |
//! | feet | Y is the floor's normal during contact, the shin if the body lies throughout; Z towards the toes |
//! | hands, collarbones | the average orientation relative to lower arm and chest |
//! | toes | as the foot during contact |
//! | trunk | Y along the bones of the spine; X left at rest if zero rotations give an upright body, else the lines of hips and shoulders |
//! | head | upright at rest; without an upright rest pose level on average, along the neck if the body lies throughout |
//!
//! Axes: X left, Y up, Z ahead for the trunk; Y along the bone and X across for limbs.

use std::{collections::BTreeMap, iter::Sum, ops::Div};

use nalgebra::{UnitQuaternion, Vector3};

use crate::retarget::{
    axis::{any_across, axes},
    identify::Parts,
    parts::{Part, Side},
    world::{World, mean_in, seen_in},
};
use gestus_motion::{
    body::mean_rotation,
    clip::{Frame, Skeleton},
    landmarks::rest_positions,
    statistics::{mean_or_zero, quantile, sorted},
};

/// Anatomical frames and lengths of a skeleton.
#[derive(Debug, Clone)]
pub struct Anatomy {
    /// Frame of each joint that has one: from anatomical to the joint's axes.
    pub frames: BTreeMap<usize, UnitQuaternion<f64>>,
    /// Mean orientation of the second joint as the first one sees it, of joints of the spine and of the neck.
    pub seen: BTreeMap<(usize, usize), UnitQuaternion<f64>>,
    /// Length of a leg, mean of both, metres.
    pub leg_m: f64,
    /// Length of an arm, mean of both, metres.
    pub arm_m: f64,
    /// Height of the ankles over the ground's zero when they stand, metres.
    pub ankle_m: f64,
    /// Middle of the hip joints in the root's frame, metres.
    pub hips: Vector3<f64>,
    /// Whether zero rotations are an upright body.
    pub upright: bool,
    /// What a person should look at.
    pub doubts: Vec<String>,
}

/// Least mean bend of an elbow or knee that determines its axis: sine of 4 degrees.
const MIN_BEND: f64 = 0.07;

/// Least cosine of the angle between the trunk and the way to the joint that a joint of the spine points to: 60 degrees.
const UPWARDS: f64 = 0.5;

/// Height of a foot over the other's, in legs, from which on it stands nowhere in a sample of less than a stride. In a whole
/// walk of cmu the two differ by 0.022. Ankles whose heights vary by less take no stride.
const LIFTED: f64 = 0.04;

/// Which feet stand somewhere in a sample of poses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Standing {
    /// Both: it shows whole strides, or a body at rest.
    BothFeet,
    /// Perhaps only one: it is shorter than a stride.
    OneFootAtLeast,
}

/// Arms or legs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Limb {
    Arm,
    Leg,
}

impl Anatomy {
    /// Measures a body. `sample` are some of its poses, Y up; `upright` says whether zero rotations are an upright body,
    /// where the user has said so.
    pub fn of(
        skeleton: &Skeleton,
        parts: &Parts,
        sample: &[Frame],
        upright: Option<bool>,
        standing: Standing,
    ) -> Self {
        let worlds: Vec<World> = sample.iter().map(|f| World::of(skeleton, f)).collect();
        let zero = zero_axes(skeleton, parts);
        let upright_axes = match upright {
            Some(true) => zero.or(Some(UnitQuaternion::identity())),
            Some(false) => None,
            None => zero,
        };
        let mut this = Self {
            frames: BTreeMap::new(),
            seen: BTreeMap::new(),
            leg_m: mean_length(skeleton, parts, Part::UpperLeg, Part::Foot),
            arm_m: mean_length(skeleton, parts, Part::UpperArm, Part::Hand),
            ankle_m: 0.0,
            hips: Vector3::zeros(),
            upright: upright_axes.is_some(),
            doubts: Vec::new(),
        };
        let up: Vec<&World> = worlds.iter().filter(|w| w.is_up(parts, this.leg_m)).collect();
        let lies = up.len() * 50 < worlds.len();
        let up = if lies { worlds.iter().collect() } else { up };
        let mut measure = Measure { parts, worlds: &worlds, up, lies, zero: upright_axes, body: &mut this };
        measure.hips();
        measure.trunk();
        measure.bends();
        let stands = measure.ankles(standing);
        for side in Side::BOTH {
            measure.limb(Limb::Leg, side);
            measure.limb(Limb::Arm, side);
            measure.like(Part::Clavicle(side), Part::Chest);
            measure.like(Part::Hand(side), Part::LowerArm(side));
            measure.foot(side, stands[side.index()]);
        }
        this
    }

    /// Frame of a joint, where it has one.
    pub fn frame(&self, joint: usize) -> Option<UnitQuaternion<f64>> {
        self.frames.get(&joint).copied()
    }
}

struct Measure<'a> {
    parts: &'a Parts,
    worlds: &'a [World],
    /// Those in which the body does not lie; all of them, if it lies throughout.
    up: Vec<&'a World>,
    /// Whether it lies throughout.
    lies: bool,
    zero: Option<UnitQuaternion<f64>>,
    body: &'a mut Anatomy,
}

impl Measure<'_> {
    /// Mean over the sample.
    fn mean<T: Sum + Div<f64, Output = T>>(&self, of: impl Fn(&World) -> T) -> T {
        mean_in(self.worlds, of)
    }

    /// Mean of a vector of the world, as a joint sees it.
    fn seen(&self, joint: usize, of: impl Fn(&World) -> Vector3<f64>) -> Vector3<f64> {
        seen_in(self.worlds, joint, of)
    }

    fn hips(&mut self) {
        let hip = |s: Side| self.parts.get(Part::UpperLeg(s)).unwrap_or(0);
        let middle = |w: &World| (w.places[hip(Side::Left)] + w.places[hip(Side::Right)]) / 2.0 - w.places[0];
        self.body.hips = self.seen(0, middle);
    }

    /// Left of the body, in the world, from a pair of parts.
    fn left(&self, w: &World, of: fn(Side) -> Part) -> Vector3<f64> {
        let place = |s: Side| self.parts.get(of(s)).map_or(w.places[0], |j| w.places[j]);
        (place(Side::Left) - place(Side::Right)).try_normalize(1e-9).unwrap_or_else(Vector3::zeros)
    }

    /// Hips, spine, chest, neck, head.
    fn trunk(&mut self) {
        let mut chain = vec![0];
        chain.extend(&self.parts.spine);
        let chest = *chain.last().unwrap_or(&0);
        chain.extend(&self.parts.neck);
        let end = *chain.last().unwrap_or(&0);
        let ankles = Side::BOTH.map(|side| self.parts.get(Part::Foot(side)).unwrap_or(0));
        let tall = |w: &World| w.places[end] - (w.places[ankles[0]] + w.places[ankles[1]]) / 2.0;
        let straight = self.worlds.iter().max_by(|a, b| tall(a).norm().total_cmp(&tall(b).norm()));
        for (i, &j) in chain.iter().enumerate() {
            let share = if chest == 0 { 1.0 } else { (i as f64 / self.parts.spine.len() as f64).min(1.0) };
            let left = match self.zero {
                Some(axes) if i > 0 => axes * Vector3::x(),
                _ => self.seen(j, |w| {
                    self.left(w, Part::UpperLeg) * (1.0 - share) + self.left(w, Part::UpperArm) * share
                }),
            };
            // Along the bone to the next joint that is elsewhere, as it lies in the motion: a pelvis may be tilted and
            // a joint of no length above it tilt back, and then its own axes say nothing about the spine. And towards
            // the head where the body is straight: the root of some rigs lies above the first joint of the spine, or
            // before it.
            let next = chain[i + 1..].iter().copied().find(|&n| {
                let to = |w: &World| w.places[n] - w.places[j];
                self.mean(|w| to(w).norm()) > 0.02 * self.body.leg_m
                    && straight.is_none_or(|w| to(w).dot(&tall(w)) >= UPWARDS * to(w).norm() * tall(w).norm())
            });
            let up = match (next, self.zero) {
                (Some(n), _) => self.seen(j, |w| w.places[n] - w.places[j]),
                (None, Some(axes)) => axes * Vector3::y(),
                (None, None) if self.lies && j != chest => self.seen(j, |w| w.places[j] - w.places[chest]),
                // Heads are held level, on average.
                (None, None) => seen_in(self.up.iter().copied(), j, |_| Vector3::y()),
            };
            self.body.frames.insert(j, axes(up, left, i == 0));
        }
    }

    /// How joints of the spine and of the neck lie to each other.
    fn bends(&mut self) {
        let (spine, neck) = (&self.parts.spine, &self.parts.neck);
        let chest = spine.last().copied().unwrap_or(0);
        for (first, chain) in [(0, spine), (chest, neck)] {
            for &joint in chain {
                for &other in chain.iter().chain([&first]) {
                    let seen = self.worlds.iter().map(|w| w.turns[joint].inverse() * w.turns[other]);
                    self.body.seen.insert((joint, other), mean_rotation(seen));
                }
            }
        }
    }

    /// Upper and lower bone of a limb.
    fn limb(&mut self, limb: Limb, side: Side) {
        let chain = match limb {
            Limb::Arm => [Part::UpperArm(side), Part::LowerArm(side), Part::Hand(side)],
            Limb::Leg => [Part::UpperLeg(side), Part::LowerLeg(side), Part::Foot(side)],
        };
        let [Some(upper), Some(lower), end] = chain.map(|part| self.parts.get(part)) else { return };
        let bone = |from: usize, to: usize| move |w: &World| w.places[to] - w.places[from];
        let upper_bone = self.seen(upper, bone(upper, lower));
        let lower_bone = match end {
            Some(end) => self.seen(lower, bone(lower, end)),
            // Without a wrist: on along the upper arm's bone.
            None => upper_bone,
        };
        let bend = |w: &World| match end {
            Some(end) => {
                let (a, b) = (bone(upper, lower)(w), bone(lower, end)(w));
                a.cross(&b) / (a.norm() * b.norm()).max(1e-9)
            }
            None => Vector3::zeros(),
        };
        let hinges = [upper, lower].map(|j| self.seen(j, bend));
        // One pose bends its limbs sideways as well, and a known rest pose tells more.
        let alone = self.worlds.len() == 1 && self.zero.is_some();
        let weak = alone || hinges.iter().any(|hinge| hinge.norm() < MIN_BEND);
        for (joint, bone, hinge) in [(upper, upper_bone, hinges[0]), (lower, lower_bone, hinges[1])] {
            let hinge = if weak { self.rest_hinge(bone, limb) } else { Some(hinge) };
            let across = hinge.unwrap_or_else(|| any_across(&bone));
            self.body.frames.insert(joint, axes(bone, across, false));
        }
        if weak {
            let joint = if limb == Limb::Arm { "elbow" } else { "knee" };
            let which = if side == Side::Left { "left" } else { "right" };
            let witness = if self.zero.is_some() { "the rest pose" } else { "nothing but its axes" };
            self.body.doubts.push(format!(
                "the {which} {joint} hardly bends in this clip: its axis is taken from {witness}"
            ));
        }
    }

    /// The axis of elbow or knee at rest, where zero rotations are an upright body: knees bend about the left axis,
    /// elbows of hanging arms about the right one; raised arms take it with them.
    fn rest_hinge(&self, bone: Vector3<f64>, limb: Limb) -> Option<Vector3<f64>> {
        let axes = self.zero?;
        if limb == Limb::Leg {
            return Some(axes * Vector3::x());
        }
        let down = axes * -Vector3::y();
        let raise = UnitQuaternion::rotation_between(&down, &bone)?;
        Some(raise * (axes * -Vector3::x()))
    }

    /// A part that lies, on average, as the one that it hangs on.
    fn like(&mut self, part: Part, on: Part) {
        let (Some(joint), Some(on)) = (self.parts.get(part), self.parts.get(on)) else { return };
        let Some(frame) = self.body.frame(on) else { return };
        let relative = self.worlds.iter().map(|w| w.turns[joint].inverse() * w.turns[on]);
        self.body.frames.insert(joint, mean_rotation(relative) * frame);
    }

    /// Lengths that are small for the body, metres: a part of the leg.
    fn small(&self, part: f64) -> f64 {
        part * self.body.leg_m.max(0.1)
    }

    /// Quantile of a joint's height, where the body does not lie.
    fn height(&self, joint: usize, share: f64) -> f64 {
        quantile(&sorted(self.up.iter().map(|w| w.places[joint].y)), share).unwrap_or(0.0)
    }

    /// Height of a joint where it is low.
    fn low(&self, joint: usize) -> f64 {
        self.height(joint, 0.1)
    }

    /// Finds the height of the ankles where they stand; returns which foot stands anywhere.
    fn ankles(&mut self, standing: Standing) -> [bool; 2] {
        let ankles = Side::BOTH.map(|side| self.parts.get(Part::Foot(side)));
        let [Some(left), Some(right)] = ankles else { return [true; 2] };
        let lifted = self.small(LIFTED);
        // A pose that is held may be one of a stride.
        let holds = [left, right].iter().all(|&ankle| self.height(ankle, 0.9) - self.low(ankle) < lifted);
        let [left, right] = [left, right].map(|ankle| self.low(ankle));
        if standing == Standing::BothFeet && !holds {
            self.body.ankle_m = 0.5 * (left + right);
            return [true; 2];
        }
        self.body.ankle_m = left.min(right);
        [left - right < lifted, right - left < lifted]
    }

    /// Foot and toes: level while they stand, at rest if it stands nowhere, else as if the shin stood on it.
    fn foot(&mut self, side: Side, stands: bool) {
        let both = [Part::LowerLeg(side), Part::Foot(side)].map(|part| self.parts.get(part));
        let [Some(knee), Some(ankle)] = both else { return };
        let toes = self.parts.get(Part::Toes(side));
        if self.worlds.is_empty() {
            return;
        }
        let slack = self.small(0.02);
        let (ankle_low, toes_low) = (self.low(ankle), toes.map(|t| self.low(t)));
        if let Some(rest) = self.zero.filter(|_| self.lies || !stands) {
            let frame = axes(rest * Vector3::y(), rest * Vector3::x(), false);
            self.body.frames.extend(toes.into_iter().chain([ankle]).map(|joint| (joint, frame)));
            return;
        }
        let stands = |w: &&World| {
            w.places[ankle].y < ankle_low + slack
                && toes.zip(toes_low).is_none_or(|(t, l)| w.places[t].y < l + slack)
        };
        let standing: Vec<&World> = self.up.iter().copied().filter(stands).collect();
        let sample = if standing.len() * 50 < self.up.len() { &self.up } else { &standing };
        let shin = |w: &World| w.places[knee] - w.places[ankle];
        let up = seen_in(sample.iter().copied(), ankle, |w| if self.lies { shin(w) } else { Vector3::y() });
        let ahead = |w: &World| match toes {
            Some(t) => w.places[t] - w.places[ankle],
            None => self.left(w, Part::UpperLeg).cross(&if self.lies { shin(w) } else { Vector3::y() }),
        };
        let frame = axes(up, up.cross(&seen_in(sample.iter().copied(), ankle, ahead)), false);
        self.body.frames.insert(ankle, frame);
        if let Some(toes) = toes {
            let relative = sample.iter().map(|w| w.turns[toes].inverse() * w.turns[ankle]);
            self.body.frames.insert(toes, mean_rotation(relative) * frame);
        }
    }
}

fn mean_length(skeleton: &Skeleton, parts: &Parts, upper: fn(Side) -> Part, lower: fn(Side) -> Part) -> f64 {
    let length = |s: Side| -> Option<f64> {
        let from = parts.get(upper(s))?;
        let way = skeleton.path(parts.get(lower(s))?);
        Some(way.iter().skip_while(|&&j| j != from).skip(1).map(|&j| skeleton.offsets[j].norm()).sum())
    };
    mean_or_zero(Side::BOTH.into_iter().filter_map(length))
}

/// The body's axes with all rotations zero, if that is an upright pose: head above hips, feet below, straight legs and
/// arms.
fn zero_axes(skeleton: &Skeleton, parts: &Parts) -> Option<UnitQuaternion<f64>> {
    let rest = rest_positions(skeleton);
    let place = |p: Part| parts.get(p).map(|j| rest[j]);
    let shoulders = || {
        let [left, right] = Side::BOTH.map(|side| place(Part::UpperArm(side)));
        Some((left? + right?) / 2.0)
    };
    let top = place(Part::Head).or(place(Part::Chest)).or_else(shoulders)?;
    let legs = Side::BOTH
        .map(|s| Some((place(Part::UpperLeg(s))?, place(Part::LowerLeg(s))?, place(Part::Foot(s))?)));
    let [Some(left), Some(right)] = legs else { return None };
    let hips = (left.0 + right.0) / 2.0;
    let trunk = (top - hips).try_normalize(1e-6)?;
    // Up is the axis of the world nearest to the trunk; the trunk of a body at rest is within 20 degrees of it.
    let axis = trunk.iamax();
    let up = Vector3::from_fn(|i, _| if i == axis { trunk[axis].signum() } else { 0.0 });
    if trunk.dot(&up) < 0.94 {
        return None;
    }
    for (hip, knee, ankle) in [left, right] {
        let (thigh, shin) = ((knee - hip).try_normalize(1e-6)?, (ankle - knee).try_normalize(1e-6)?);
        if thigh.dot(&up) > -0.8 || shin.dot(&up) > -0.8 || thigh.dot(&shin) < 0.9 {
            return None;
        }
    }
    for s in Side::BOTH {
        if let (Some(a), Some(b), Some(c)) =
            (place(Part::UpperArm(s)), place(Part::LowerArm(s)), place(Part::Hand(s)))
        {
            let straight = (b - a).try_normalize(1e-6)?.dot(&(c - b).try_normalize(1e-6)?);
            if straight < 0.8 {
                return None;
            }
        }
    }
    let across = left.0 - right.0;
    Some(axes(up, across, false))
}
