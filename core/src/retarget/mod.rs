//! Retargeting: poses of a skeleton with other names, proportions, rest pose and axes to the database's, and back.
//!
//! Both skeletons have the same body parts. The builder gives every part of either skeleton an *anatomical frame*
//! (bone direction, hinge axis, sole of the foot) that is constant in the joint's own frame: the intermediate skeleton.
//! The world orientation of a joint then follows from that of its counterpart in the other skeleton,
//!
//! ```text
//! R_t = R_s A_s A_t⁻¹ = R_s C        C constant, from the map
//! ```
//!
//! and joints between counterparts (spines with different numbers of joints) interpolate between their neighbors:
//! `R_t = nlerp(R_a C_a, R_b C_b, w)`. The midpoint of the hip joints moves as the source's does, scaled by leg length
//! and with its height measured from the ankles. Inverse kinematics then bends each limb ([`limb`]). Ankles go to the
//! source's position in the scaled space, so that a planted foot stays planted; hands keep the source's direction from
//! the shoulder, scaled by arm length. Every step is invertible, so that a pose survives the way there and back.
//!
//! Source: Monzani, Baerlocher, Boulic and Thalmann 2000, "Using an intermediate skeleton and inverse kinematics
//! for motion retargeting", which Xia 2015 (section 5.1) cites for input on another skeleton.
//!
//! Cost: two quaternion products for each joint of either skeleton and four angles for each limb. On a Cortex-M4F 31
//! joints to 21 take about 33,000 instructions, and back 40,000 (`budgets.toml`).

pub mod layout;
pub mod limb;
mod validate;

use crate::{
    ConfigError, Database,
    blob::read::Record,
    body::pose::Pose,
    error::saturating_u16,
    math::{
        quaternion::{self, IDENTITY, Quaternion, Vector},
        vector::{add, subtract},
    },
};
use layout::{header, joint, limb as limb_bytes, record};

/// A checked map between an incoming skeleton of N joints and a database's of J. Cheap to copy.
#[derive(Clone, Copy)]
pub struct Map<'m> {
    bytes: &'m [u8],
    source: Side<'m>,
    target: Side<'m>,
    limbs: &'m [u8],
    scale: f32,
    world: Quaternion,
}

/// What it maps, not the bytes.
impl core::fmt::Debug for Map<'_> {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Map")
            .field("sources", &self.sources())
            .field("targets", &self.targets())
            .field("scale", &self.scale)
            .finish_non_exhaustive()
    }
}

/// What it maps, not the bytes.
#[cfg(feature = "defmt")]
impl defmt::Format for Map<'_> {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(f, "Map of {} joints to {}", self.sources(), self.targets());
    }
}

/// One of the two skeletons.
#[derive(Debug, Clone, Copy)]
struct Side<'m> {
    joints: usize,
    skeleton: &'m [u8],
    /// Where each joint's orientation comes from: joints of the other skeleton and constant rotations.
    records: &'m [u8],
    hips: Vector,
    ankle: f32,
}

/// A joint of one of them.
struct SideJoint {
    parent: Option<usize>,
    /// Its place in a limb, as [`joint::SEGMENT`] has it.
    segment: usize,
    /// Position in the parent's frame, metres.
    offset: Vector,
}

/// World orientations and positions of a skeleton's joints.
struct World<const J: usize> {
    orientations: [Quaternion; J],
    positions: [Vector; J],
}

impl<'m> Map<'m> {
    /// Joints of the incoming skeleton.
    pub fn sources(&self) -> usize {
        self.source.joints
    }

    /// Joints of the database's skeleton.
    pub fn targets(&self) -> usize {
        self.target.joints
    }

    /// Leg length of the database over that of the incoming body.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    /// Checks that the map was made for this database, and that a pose of `capacity` joints can hold the incoming
    /// skeleton.
    ///
    /// # Errors
    /// [`ConfigError::Joints`] if the capacity is too small, [`ConfigError::OtherDatabase`] if the map was made for another
    /// database.
    pub fn fits(&self, database: &Database<'_>, capacity: usize) -> Result<(), ConfigError> {
        if self.sources() > capacity {
            return Err(ConfigError::Joints {
                need: saturating_u16(self.sources()),
                have: saturating_u16(capacity),
            });
        }
        let head = Record(self.bytes);
        if self.targets() != database.counts().joints
            || head.u32(header::SKELETON) != database.skeleton_fingerprint()
        {
            return Err(ConfigError::OtherDatabase);
        }
        Ok(())
    }

    /// Converts an incoming pose to the database's skeleton. An invalid pose gives an output whose position is NaN, which
    /// a stylizer reports as [`Degraded::INPUT`](crate::Degraded::INPUT).
    pub fn to_target<const N: usize, const J: usize>(&self, input: &Pose<N>, output: &mut Pose<J>) {
        if !input.is_valid(self.sources()) {
            output.position = [f32::NAN; 3];
            return;
        }
        let mut lifted = *input;
        lifted.position = quaternion::rotate(self.world, input.position);
        if let Some(root) = lifted.rotations.first_mut() {
            *root = quaternion::multiply(self.world, *root);
        }
        convert(&self.source, &self.target, self.scale, &self.pairs(false), &lifted, output, None);
    }

    /// Converts a pose of the database to the incoming skeleton. Joints without a counterpart take their rotations from
    /// `like`, the incoming pose of the same frame; if `like` is invalid they keep those of `output`.
    pub fn to_source<const J: usize, const N: usize>(
        &self,
        stylized: &Pose<J>,
        like: &Pose<N>,
        output: &mut Pose<N>,
    ) {
        let (source, target) = (&self.source, &self.target);
        let kept = if like.is_valid(self.sources()) { *like } else { *output };
        convert(target, source, 1.0 / self.scale, &self.pairs(true), stylized, output, Some(&kept));
        let down = quaternion::conjugate(self.world);
        output.position = quaternion::rotate(down, output.position);
        if let Some(root) = output.rotations.first_mut() {
            *root = quaternion::multiply(down, *root);
        }
    }

    /// The limbs from the source to the target, or `back` from the target to the source.
    fn pairs(&self, back: bool) -> [Option<Pair>; layout::MAX_LIMBS] {
        let mut pairs = [None; layout::MAX_LIMBS];
        for (slot, bytes) in pairs.iter_mut().zip(self.limbs.chunks_exact(limb_bytes::LENGTH)) {
            let bytes = Record(bytes);
            let of = |at: usize| [0, 1, 2].map(|i| usize::from(bytes.u8(at + i)));
            let (source, target) = (of(limb_bytes::SOURCE.start), of(limb_bytes::TARGET.start));
            let (from, to) = if back { (target, source) } else { (source, target) };
            *slot = Some(Pair { from, to, arm: bytes.u8(limb_bytes::KIND) == limb_bytes::ARM });
        }
        pairs
    }
}

/// A limb on both skeletons.
#[derive(Clone, Copy)]
struct Pair {
    from: [usize; 3],
    to: [usize; 3],
    arm: bool,
}

impl Side<'_> {
    /// Joint `index`.
    fn joint(&self, index: usize) -> SideJoint {
        let bytes = Record::of(self.skeleton, index, joint::LENGTH);
        let parent = bytes.u8(joint::PARENT);
        let parent = (parent != u8::MAX).then_some(usize::from(parent));
        let segment = usize::from(bytes.u8(joint::SEGMENT));
        SideJoint { parent, segment, offset: bytes.floats(joint::OFFSET) }
    }

    /// Forward kinematics.
    fn world<const J: usize>(&self, pose: &Pose<J>) -> World<J> {
        let mut world = World { orientations: [IDENTITY; J], positions: [pose.position; J] };
        for (j, &rotation) in pose.rotations.iter().enumerate().take(self.joints) {
            let SideJoint { parent, offset, .. } = self.joint(j);
            let (turn, place) = match parent.and_then(|p| world.at(p)) {
                Some((turn, place)) => {
                    (quaternion::multiply(turn, rotation), add(place, quaternion::rotate(turn, offset)))
                }
                None => (rotation, pose.position),
            };
            world.set(j, turn, place);
        }
        world
    }
}

impl<const J: usize> World<J> {
    fn at(&self, joint: usize) -> Option<(Quaternion, Vector)> {
        Some((*self.orientations.get(joint)?, *self.positions.get(joint)?))
    }

    fn position(&self, joint: usize) -> Vector {
        self.positions.get(joint).copied().unwrap_or([0.0; 3])
    }

    fn orientation(&self, joint: usize) -> Quaternion {
        self.orientations.get(joint).copied().unwrap_or(IDENTITY)
    }

    fn set(&mut self, joint: usize, orientation: Quaternion, position: Vector) {
        if let Some(slot) = self.orientations.get_mut(joint) {
            *slot = orientation;
        }
        if let Some(slot) = self.positions.get_mut(joint) {
            *slot = position;
        }
    }
}

/// Converts a pose from one skeleton to the other.
fn convert<const A: usize, const B: usize>(
    from: &Side<'_>,
    to: &Side<'_>,
    scale: f32,
    limbs: &[Option<Pair>],
    input: &Pose<A>,
    output: &mut Pose<B>,
    like: Option<&Pose<B>>,
) {
    let source = from.world(input);
    // A position in the source's space, scaled to the target's.
    let scaled =
        |p: Vector| -> Vector { [scale * p[0], to.ankle + scale * (p[1] - from.ankle), scale * p[2]] };

    // 1. Orientations.
    let mut world = World { orientations: [IDENTITY; B], positions: [[0.0; 3]; B] };
    let mut stays = [None; B];
    for (j, stay) in stays.iter_mut().enumerate().take(to.joints) {
        let bytes = Record::of(to.records, j, record::LENGTH);
        let turns =
            |i: usize| -> Quaternion { bytes.floats(record::TURNS.start + 16 * i..record::TURNS.end) };
        let parent = to.joint(j).parent;
        let turn = if bytes.u8(record::KIND) == record::FOLLOW {
            let follow = |i: usize| {
                let joint = usize::from(bytes.u8(record::FROM.start + i));
                quaternion::multiply(source.orientation(joint), turns(i))
            };
            let weight = bytes.f32(record::WEIGHT);
            if weight > 0.0 { nlerp(follow(0), follow(1), weight) } else { follow(0) }
        } else {
            let local = like.and_then(|l| l.rotations.get(j).copied()).unwrap_or(turns(0));
            *stay = Some(local);
            quaternion::multiply(parent.map_or(IDENTITY, |p| world.orientation(p)), local)
        };
        world.set(j, turn, [0.0; 3]);
    }

    // 2. The root: the midpoint of the hip joints moves as the source's does.
    let middle = scaled(add(input.position, quaternion::rotate(source.orientation(0), from.hips)));
    let position = subtract(middle, quaternion::rotate(world.orientation(0), to.hips));
    set_positions(to, &mut world, position);

    // 3. Limbs. Legs are listed from left to right; a straight knee bends about the line from one to the other.
    let mut hips = limbs.iter().flatten().filter(|pair| !pair.arm).map(|pair| world.position(pair.to[0]));
    let across = hips.next().zip(hips.next()).map(|(left, right)| subtract(left, right));
    let mut bends = [[IDENTITY; 2]; layout::MAX_LIMBS];
    for (bend, pair) in bends.iter_mut().zip(limbs.iter().flatten()) {
        // One copy of it for both, or retargeting takes 2% more instructions.
        let ends = |w: &dyn Fn(usize) -> Vector, [a, b, c]: [usize; 3]| [w(a), w(b), w(c)];
        let source_limb = ends(&|j| source.position(j), pair.from);
        let target_limb = ends(&|j| world.position(j), pair.to);
        let goal = if pair.arm {
            limb::scaled_reach(source_limb, target_limb)
        } else {
            subtract(scaled(source_limb[2]), target_limb[0])
        };
        let side = if pair.arm { None } else { across };
        *bend = limb::bend(
            subtract(target_limb[1], target_limb[0]),
            subtract(target_limb[2], target_limb[1]),
            side,
            goal,
        );
    }

    // 4. Local rotations.
    for (j, stay) in stays.iter().enumerate().take(to.joints) {
        let SideJoint { parent, segment, .. } = to.joint(j);
        let before = parent.map(|p| world.orientation(p));
        if let Some(local) = *stay {
            let turn = quaternion::multiply(before.unwrap_or(IDENTITY), local);
            world.set(j, turn, [0.0; 3]);
        } else if let Some(number) = segment.checked_sub(1) {
            let bend = bends.get(number / 2).map_or(IDENTITY, |b| if number % 2 == 0 { b[0] } else { b[1] });
            world.set(j, quaternion::multiply(bend, world.orientation(j)), [0.0; 3]);
        }
        let local = match (before, *stay) {
            (_, Some(local)) => local,
            (Some(before), None) => quaternion::multiply(quaternion::conjugate(before), world.orientation(j)),
            (None, None) => world.orientation(j),
        };
        if let Some(slot) = output.rotations.get_mut(j) {
            // Rounding adds up over a chain of products: one normalisation a frame keeps unit length.
            *slot = quaternion::normalize(local).unwrap_or(IDENTITY);
        }
    }
    output.position = position;
}

/// Computes the joints' positions from their orientations.
fn set_positions<const B: usize>(side: &Side<'_>, world: &mut World<B>, root: Vector) {
    for j in 0..side.joints.min(B) {
        let SideJoint { parent, offset, .. } = side.joint(j);
        let at = match parent.and_then(|p| world.at(p)) {
            Some((turn, from)) => add(from, quaternion::rotate(turn, offset)),
            None => root,
        };
        if let Some(slot) = world.positions.get_mut(j) {
            *slot = at;
        }
    }
}

/// Normalised linear interpolation along the shorter arc. The two are neighbors in a spine, near enough for the chord.
fn nlerp(a: Quaternion, b: Quaternion, t: f32) -> Quaternion {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let t_b = if dot < 0.0 { -t } else { t };
    let mixed: Quaternion = core::array::from_fn(|i| {
        let (a, b) = (a.get(i).copied().unwrap_or(0.0), b.get(i).copied().unwrap_or(0.0));
        (1.0 - t) * a + t_b * b
    });
    quaternion::normalize(mixed).unwrap_or(a)
}

const _: () = {
    assert!(header::RESERVED.end == header::LENGTH);
    assert!(record::TURNS.end == record::LENGTH);
    assert!(limb_bytes::RESERVED.end == limb_bytes::LENGTH);
};
