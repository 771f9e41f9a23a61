//! An incoming skeleton with other names, proportions, rest pose and axes, taken to the database's, and back.
//!
//! What both skeletons share are body parts: an upper arm is an upper arm. The builder gives every part of either
//! skeleton an *anatomical frame* (bone direction, hinge axis, sole of the foot), constant in the joint's own frame:
//! the intermediate skeleton. A joint of one skeleton then has the orientation, in the world, of its counterpart
//! in the other,
//!
//! ```text
//! R_t = R_s A_s A_t⁻¹ = R_s C        C constant, from the map
//! ```
//!
//! and joints between counterparts (spines of different joint counts) share the turn between their neighbors:
//! `R_t = nlerp(R_a C_a, R_b C_b, w)`. The middle of the hip joints moves as the source's, scaled by leg length,
//! and stands as high over the ankles. Then each limb is bent by inverse kinematics ([`limb`]): ankles
//! go to where the source's are in the scaled room, so that a foot that stands, stands; hands to where they are
//! seen from the shoulder, scaled by arm length. Both steps are invertible: what goes in comes back.
//!
//! Source: Monzani, Baerlocher, Boulic and Thalmann 2000, "Using an intermediate skeleton and inverse kinematics
//! for motion retargeting", which paper 000 (section 4) names for input on another skeleton.
//!
//! Cost: two quaternion products a joint of either skeleton, four angles a limb; 31 joints to 21 take about 25,000
//! instructions, and the way back 29,000, on a Cortex-M4F (`docs/PERFORMANCE.md`).

pub mod layout;
pub mod limb;
mod validate;

use crate::{
    BlobError, ConfigError, Database,
    blob::{crc::crc32c, layout::section, read::Record},
    body::pose::Pose,
    math::{
        quaternion::{self, IDENTITY, Quaternion, Vector},
        vector::{add, subtract},
    },
};
use layout::{header, joint, limb as limb_bytes, record};

/// A checked map between an incoming skeleton of N joints and a database's of J. Cheap to copy.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Map<'m> {
    bytes: &'m [u8],
    source: Side<'m>,
    target: Side<'m>,
    limbs: &'m [u8],
    scale: f32,
    world: Quaternion,
}

/// One of the two skeletons.
#[derive(Debug, Clone, Copy)]
struct Side<'m> {
    joints: usize,
    skeleton: &'m [u8],
    /// What it takes to bring the other skeleton's orientations here.
    records: &'m [u8],
    hips: Vector,
    ankle: f32,
}

/// World orientations and positions of a skeleton's joints.
struct World<const J: usize> {
    turns: [Quaternion; J],
    places: [Vector; J],
}

impl<'m> Map<'m> {
    /// Checks a map: magic, version, lengths, checksum, every index, every number.
    ///
    /// # Errors
    /// [`BlobError`], with [`section::RETARGET`] as its section.
    pub fn open(bytes: &'m [u8]) -> Result<Self, BlobError> {
        let map = validate::split(bytes)?;
        validate::contents(&map)?;
        Ok(map)
    }

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

    /// Checks that the map was made for a database, and that poses of `capacity` joints hold the incoming skeleton.
    ///
    /// # Errors
    /// [`ConfigError::Joints`] where the capacity is too small, [`ConfigError::OtherDatabase`] where it was not.
    pub fn fits(&self, database: &Database<'_>, capacity: usize) -> Result<(), ConfigError> {
        let short = |n: usize| u16::try_from(n).unwrap_or(u16::MAX);
        if self.sources() > capacity {
            return Err(ConfigError::Joints { need: short(self.sources()), have: short(capacity) });
        }
        let head = Record(self.bytes);
        if self.targets() != database.counts().joints || head.u32(header::SKELETON) != fingerprint(database) {
            return Err(ConfigError::OtherDatabase);
        }
        Ok(())
    }

    /// An incoming pose on the database's skeleton. What is no pose becomes none: its position is not a number, by which a
    /// stylizer knows it ([`Degraded::INPUT`](crate::Degraded::INPUT)).
    pub fn bring<const N: usize, const J: usize>(&self, input: &Pose<N>, output: &mut Pose<J>) {
        if !input.is_valid(self.sources()) {
            output.position = [f32::NAN; 3];
            return;
        }
        let mut lifted = *input;
        lifted.position = quaternion::rotate(self.world, input.position);
        if let Some(root) = lifted.rotations.first_mut() {
            *root = quaternion::multiply(self.world, *root);
        }
        carry(&self.source, &self.target, self.scale, &self.pairs(false), &lifted, output, None);
    }

    /// A pose of the database on the incoming skeleton. Joints without a counterpart move as in `like`, the incoming
    /// pose that it answers; where that is no pose they stay as they are in `output`.
    pub fn take_back<const J: usize, const N: usize>(
        &self,
        stylized: &Pose<J>,
        like: &Pose<N>,
        output: &mut Pose<N>,
    ) {
        let (source, target) = (&self.source, &self.target);
        let kept = if like.is_valid(self.sources()) { *like } else { *output };
        carry(target, source, 1.0 / self.scale, &self.pairs(true), stylized, output, Some(&kept));
        let down = quaternion::conjugate(self.world);
        output.position = quaternion::rotate(down, output.position);
        if let Some(root) = output.rotations.first_mut() {
            *root = quaternion::multiply(down, *root);
        }
    }

    /// The limbs, as seen from one skeleton to the other.
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
    /// Parent, segment and offset of a joint.
    fn joint(&self, index: usize) -> (Option<usize>, usize, Vector) {
        let bytes = Record::of(self.skeleton, index, joint::LENGTH);
        let parent = bytes.u8(joint::PARENT);
        let parent = (parent != u8::MAX).then_some(usize::from(parent));
        (parent, usize::from(bytes.u8(joint::SEGMENT)), bytes.floats(joint::OFFSET))
    }

    /// Forward kinematics.
    fn world<const J: usize>(&self, pose: &Pose<J>) -> World<J> {
        let mut world = World { turns: [IDENTITY; J], places: [pose.position; J] };
        for (j, &rotation) in pose.rotations.iter().enumerate().take(self.joints) {
            let (parent, _, offset) = self.joint(j);
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
        Some((*self.turns.get(joint)?, *self.places.get(joint)?))
    }

    fn place(&self, joint: usize) -> Vector {
        self.places.get(joint).copied().unwrap_or([0.0; 3])
    }

    fn turn(&self, joint: usize) -> Quaternion {
        self.turns.get(joint).copied().unwrap_or(IDENTITY)
    }

    fn set(&mut self, joint: usize, turn: Quaternion, place: Vector) {
        if let Some(slot) = self.turns.get_mut(joint) {
            *slot = turn;
        }
        if let Some(slot) = self.places.get_mut(joint) {
            *slot = place;
        }
    }
}

/// Takes a pose from one skeleton to the other.
fn carry<const A: usize, const B: usize>(
    from: &Side<'_>,
    to: &Side<'_>,
    scale: f32,
    limbs: &[Option<Pair>],
    input: &Pose<A>,
    output: &mut Pose<B>,
    like: Option<&Pose<B>>,
) {
    let source = from.world(input);
    // A place in the source's room, in the target's.
    let moved =
        |p: Vector| -> Vector { [scale * p[0], to.ankle + scale * (p[1] - from.ankle), scale * p[2]] };

    // 1. Orientations.
    let mut world = World { turns: [IDENTITY; B], places: [[0.0; 3]; B] };
    let mut stays = [None; B];
    for (j, stay) in stays.iter_mut().enumerate().take(to.joints) {
        let bytes = Record::of(to.records, j, record::LENGTH);
        let turns =
            |i: usize| -> Quaternion { bytes.floats(record::TURNS.start + 16 * i..record::TURNS.end) };
        let (parent, _, _) = to.joint(j);
        let turn = if bytes.u8(record::KIND) == record::FOLLOW {
            let follow = |i: usize| {
                let joint = usize::from(bytes.u8(record::FROM.start + i));
                quaternion::multiply(source.turn(joint), turns(i))
            };
            let weight = bytes.f32(record::WEIGHT);
            if weight > 0.0 { nlerp(follow(0), follow(1), weight) } else { follow(0) }
        } else {
            let local = like.and_then(|l| l.rotations.get(j).copied()).unwrap_or(turns(0));
            *stay = Some(local);
            quaternion::multiply(parent.map_or(IDENTITY, |p| world.turn(p)), local)
        };
        world.set(j, turn, [0.0; 3]);
    }

    // 2. The root: the middle of the hip joints moves as the source's does.
    let middle = moved(add(input.position, quaternion::rotate(source.turn(0), from.hips)));
    let position = subtract(middle, quaternion::rotate(world.turn(0), to.hips));
    place(to, &mut world, position);

    // 3. Limbs. Legs are listed from left to right; a straight knee bends about the line from one to the other.
    let mut hips = limbs.iter().flatten().filter(|pair| !pair.arm).map(|pair| world.place(pair.to[0]));
    let across = hips.next().zip(hips.next()).map(|(left, right)| subtract(left, right));
    let mut bends = [[IDENTITY; 2]; layout::MAX_LIMBS];
    for (bend, pair) in bends.iter_mut().zip(limbs.iter().flatten()) {
        let ends = |w: &dyn Fn(usize) -> Vector, [a, b, c]: [usize; 3]| [w(a), w(b), w(c)];
        let theirs = ends(&|j| source.place(j), pair.from);
        let ours = ends(&|j| world.place(j), pair.to);
        let goal =
            if pair.arm { limb::scaled_reach(theirs, ours) } else { subtract(moved(theirs[2]), ours[0]) };
        let side = if pair.arm { None } else { across };
        *bend = limb::bend(subtract(ours[1], ours[0]), subtract(ours[2], ours[1]), side, goal);
    }

    // 4. Local rotations.
    for (j, stay) in stays.iter().enumerate().take(to.joints) {
        let (parent, segment, _) = to.joint(j);
        let before = parent.map(|p| world.turn(p));
        if let Some(local) = *stay {
            let turn = quaternion::multiply(before.unwrap_or(IDENTITY), local);
            world.set(j, turn, [0.0; 3]);
        } else if let Some(number) = segment.checked_sub(1) {
            let bend = bends.get(number / 2).map_or(IDENTITY, |b| if number % 2 == 0 { b[0] } else { b[1] });
            world.set(j, quaternion::multiply(bend, world.turn(j)), [0.0; 3]);
        }
        let local = match (before, *stay) {
            (_, Some(local)) => local,
            (Some(before), None) => quaternion::multiply(quaternion::conjugate(before), world.turn(j)),
            (None, None) => world.turn(j),
        };
        if let Some(slot) = output.rotations.get_mut(j) {
            // Hundreds of products are not repeated: one correction a frame keeps the length.
            *slot = quaternion::normalize(local).unwrap_or(IDENTITY);
        }
    }
    output.position = position;
}

/// Positions from orientations.
fn place<const B: usize>(side: &Side<'_>, world: &mut World<B>, root: Vector) {
    for j in 0..side.joints.min(B) {
        let (parent, _, offset) = side.joint(j);
        let at = match parent.and_then(|p| world.at(p)) {
            Some((turn, from)) => add(from, quaternion::rotate(turn, offset)),
            None => root,
        };
        if let Some(slot) = world.places.get_mut(j) {
            *slot = at;
        }
    }
}

/// Interpolation along the short way; the two are neighbors of a spine, so that the chord will do for the arc.
fn nlerp(a: Quaternion, b: Quaternion, t: f32) -> Quaternion {
    let dot = a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
    let t_b = if dot < 0.0 { -t } else { t };
    let mixed: Quaternion = core::array::from_fn(|i| {
        let (a, b) = (a.get(i).copied().unwrap_or(0.0), b.get(i).copied().unwrap_or(0.0));
        (1.0 - t) * a + t_b * b
    });
    quaternion::normalize(mixed).unwrap_or(a)
}

/// What a map knows its database by: CRC-32C of the joints' parents and offsets.
pub fn fingerprint(database: &Database<'_>) -> u32 {
    // One checksum a joint, folded: no buffer of the skeleton's length.
    (0..database.counts().joints).fold(0u32, |sum, j| {
        let joint = database.joint(j);
        let [x, y, z] = joint.offset.map(f32::to_le_bytes);
        let parent = [joint.parent.and_then(|p| u8::try_from(p).ok()).unwrap_or(u8::MAX)];
        crc32c(&[&sum.to_le_bytes(), &parent, &x, &y, &z])
    })
}

const _: () = {
    assert!(section::RETARGET == 35);
    assert!(header::RESERVED.end == header::LENGTH);
    assert!(record::TURNS.end == record::LENGTH);
    assert!(limb_bytes::RESERVED.end == limb_bytes::LENGTH);
};
