//! The map that the core reads: made of two identified bodies, written as bytes.

use std::sync::Arc;

use gestus_core::{
    BlobError, Database, Pose,
    blob::{crc::crc32c, layout::MAX_JOINTS},
    body::pose::{Anchor, to_pose},
    retarget::{
        Map, fingerprint,
        layout::{self, MAX_SOURCES, header, joint, limb, record},
    },
};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::retarget::{
    anatomy::Anatomy,
    file::MapFile,
    identify::{IdentifyError, Parts},
    parts::{Part, Side},
};
use crate::{blob::export::row, stream};
use gestus_motion::{
    body::database_skeleton,
    clip::{Clip, Frame, Skeleton},
};

/// Poses that a body is measured by, at most.
const SAMPLE: usize = 600;

/// A skeleton that can't be mapped.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MapError {
    #[error("{0}")]
    Source(IdentifyError),
    #[error("the database's skeleton: {0}")]
    Target(IdentifyError),
    #[error("the skeleton has {have} joints, a map takes 2 to {most}")]
    Joints { have: usize, most: usize },
    #[error("the legs of the {which} are {length_m} m long: check the unit (--unit)")]
    Legs { which: &'static str, length_m: f64 },
    #[error("the map that was made is not in order: {0}")]
    Blob(#[from] BlobError),
    #[error("the clip has no frames")]
    Empty,
}

/// A body: a skeleton, its parts and how they lie.
#[derive(Debug, Clone)]
pub struct Body {
    /// The skeleton.
    pub skeleton: Arc<Skeleton>,
    /// Which joint is which part.
    pub parts: Parts,
    /// How parts lie in their joints' axes.
    pub anatomy: Anatomy,
    /// What joints without a counterpart keep: their mean local rotations.
    rest: Vec<UnitQuaternion<f64>>,
}

/// A map from an incoming skeleton to a database's, with what it was made from.
#[derive(Debug, Clone)]
pub struct Retarget {
    /// The incoming body.
    pub source: Body,
    /// The database's.
    pub target: Body,
    /// From the incoming world to one with Y up.
    pub world: UnitQuaternion<f64>,
    /// Leg length of the database over the incoming body's.
    pub scale: f64,
    bytes: Vec<u8>,
}

impl Body {
    /// A database's body, measured on its own motion.
    ///
    /// # Errors
    /// [`MapError::Target`] where its skeleton has no arms or legs.
    pub fn of_database(database: &Database<'_>) -> Result<Self, MapError> {
        let skeleton = Arc::new(database_skeleton(database));
        let frames = sample_of(database);
        let parts = Parts::find(&skeleton, &frames, &MapFile::default()).map_err(MapError::Target)?;
        let anatomy = Anatomy::of(&skeleton, &parts, &frames, None);
        let rest = (0..skeleton.joints()).map(|j| quaternion(database.joint(j).mean)).collect();
        Self { skeleton, parts, anatomy, rest }.checked("database")
    }

    /// An incoming body, measured on a clip; and the rotation that stands its world upright.
    ///
    /// # Errors
    /// [`MapError`] where it can't be identified.
    pub fn of_clip(clip: &Clip, file: &MapFile) -> Result<(Self, UnitQuaternion<f64>), MapError> {
        if clip.frames.is_empty() {
            return Err(MapError::Empty);
        }
        let skeleton = clip.skeleton.clone();
        let step = clip.frames.len().div_ceil(SAMPLE).max(1);
        let raw: Vec<Frame> = clip.frames.iter().step_by(step).cloned().collect();
        let world = upright(&skeleton, &raw, file);
        let frames: Vec<Frame> = raw.iter().map(|f| lifted(f, &world)).collect();
        let parts = Parts::find(&skeleton, &frames, file).map_err(MapError::Source)?;
        let anatomy = Anatomy::of(&skeleton, &parts, &frames, file.upright);
        let rest = (0..skeleton.joints()).map(|j| frames[frames.len() / 2].rotations[j]).collect();
        Ok((Self { skeleton, parts, anatomy, rest }.checked("clip")?, world))
    }

    fn checked(self, which: &'static str) -> Result<Self, MapError> {
        let length_m = self.anatomy.leg_m;
        if (0.05..=20.0).contains(&length_m) { Ok(self) } else { Err(MapError::Legs { which, length_m }) }
    }

    /// Joints of a chain with their places along it, 0 to 1: ends first and last, those between at the middle of the
    /// segment that they turn.
    fn chain(&self, from: usize, rest: &[usize]) -> Vec<(usize, f64)> {
        let Some((&last, between)) = rest.split_last() else { return vec![(from, 0.0)] };
        let length = |j: usize| self.skeleton.offsets[j].norm();
        let whole: f64 = rest.iter().map(|&j| length(j)).sum::<f64>().max(1e-9);
        let mut at = 0.0;
        let mut chain = vec![(from, 0.0)];
        for (i, &j) in between.iter().enumerate() {
            at += length(j);
            chain.push((j, (at + 0.5 * length(rest[i + 1])) / whole));
        }
        chain.push((last, 1.0));
        chain
    }

    /// Spine and neck as chains.
    fn chains(&self) -> [Vec<(usize, f64)>; 2] {
        let chest = self.parts.spine.last().copied().unwrap_or(0);
        [self.chain(0, &self.parts.spine), self.chain(chest, &self.parts.neck)]
    }
}

/// Where a joint's orientation comes from.
enum Source {
    Stay(UnitQuaternion<f64>),
    Follow { from: [usize; 2], weight: f64, turns: [UnitQuaternion<f64>; 2] },
}

impl Retarget {
    /// The map of a clip's skeleton to a database's.
    ///
    /// # Errors
    /// [`MapError`] says what could not be found or does not fit.
    pub fn new(database: &Database<'_>, clip: &Clip, file: &MapFile) -> Result<Self, MapError> {
        let target = Body::of_database(database)?;
        Self::onto(database, target, clip, file)
    }

    /// The same, to a body that was measured before.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn onto(
        database: &Database<'_>,
        target: Body,
        clip: &Clip,
        file: &MapFile,
    ) -> Result<Self, MapError> {
        let have = clip.skeleton.joints();
        if !(2..=MAX_SOURCES).contains(&have) {
            return Err(MapError::Joints { have, most: MAX_SOURCES });
        }
        let (source, world) = Body::of_clip(clip, file)?;
        let scale = target.anatomy.leg_m / source.anatomy.leg_m;
        let bytes = write(database, &source, &target, &world, scale);
        Map::open(&bytes)?;
        Ok(Self { source, target, world, scale, bytes })
    }

    /// The map for the core (`docs/FORMAT.md`, "Retargeting map").
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn map(&self) -> Map<'_> {
        Map::open(&self.bytes).expect("it was opened when it was made")
    }

    /// A clip of the incoming skeleton on the database's.
    pub fn bring(&self, clip: &Clip) -> Clip {
        let map = self.map();
        let mut pose = Pose::<MAX_JOINTS>::IDENTITY;
        let frames = clip.frames.iter().map(|f| {
            map.bring(&stream::to_pose::<MAX_SOURCES>(f), &mut pose);
            stream::from_pose(&pose, map.targets())
        });
        Clip { frames: frames.collect(), skeleton: self.target.skeleton.clone(), ..clip.clone() }
    }

    /// Poses on the database's skeleton on the incoming one. Joints without a counterpart are as in `like`, frame by
    /// frame (its last, where it is shorter; at rest, where it is empty).
    pub fn take_back(&self, frames: &[Frame], like: &[Frame]) -> Vec<Frame> {
        let map = self.map();
        let mut pose = Pose::<MAX_SOURCES>::IDENTITY;
        let rest = Frame { root: Vector3::zeros(), rotations: self.source.rest.clone() };
        let last = like.last().unwrap_or(&rest);
        let back = frames.iter().enumerate().map(|(i, f)| {
            let like = stream::to_pose::<MAX_SOURCES>(like.get(i).unwrap_or(last));
            map.take_back(&stream::to_pose::<MAX_JOINTS>(f), &like, &mut pose);
            stream::from_pose(&pose, map.sources())
        });
        back.collect()
    }

    /// Everything that a person should look at.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts = self.source.parts.doubts.clone();
        doubts.extend(self.source.anatomy.doubts.iter().cloned());
        if !self.source.anatomy.upright {
            doubts.push(
                "zero rotations are no upright body here: the trunk's axes are taken from its bones".into(),
            );
        }
        if !(0.7..=1.4).contains(&self.scale) {
            doubts.push(format!(
                "the database's legs are {:.2} times as long: check the unit (--unit)",
                self.scale
            ));
        }
        doubts
    }
}

/// Frames of a database, evenly over all its clips.
fn sample_of(database: &Database<'_>) -> Vec<Frame> {
    let counts = database.counts();
    let step = counts.frames.div_ceil(SAMPLE).max(1);
    let mut pose = Pose::<MAX_JOINTS>::IDENTITY;
    (0..counts.frames)
        .step_by(step)
        .map(|r| {
            to_pose(database, &row(database, r), Anchor::ORIGIN, &mut pose);
            stream::from_pose(&pose, counts.joints)
        })
        .collect()
}

fn quaternion([x, y, z, w]: [f32; 4]) -> UnitQuaternion<f64> {
    let [x, y, z, w] = [x, y, z, w].map(f64::from);
    UnitQuaternion::new_normalize(nalgebra::Quaternion::new(w, x, y, z))
}

/// The rotation that takes the clip's up to Y: the file's word, or the axis along which feet are below the hips.
fn upright(skeleton: &Skeleton, frames: &[Frame], file: &MapFile) -> UnitQuaternion<f64> {
    let up = file.up.unwrap_or_else(|| {
        let feet: Vec<usize> = Parts::find(skeleton, &[], &MapFile { up: None, ..file.clone() })
            .ok()
            .map(|p| Side::BOTH.iter().filter_map(|&s| p.get(Part::Foot(s))).collect())
            .unwrap_or_default();
        let mut up = Vector3::zeros();
        let mut extent = Vector3::zeros();
        for frame in frames {
            let p = frame.positions(skeleton);
            up += feet.iter().map(|&f| p[0] - p[f]).sum::<Vector3<f64>>();
            let (low, high) = p.iter().fold((p[0], p[0]), |(l, h), q| (l.inf(q), h.sup(q)));
            extent += high - low;
        }
        let axis = up.iamax();
        if !feet.is_empty() && up[axis].abs() > 1.2 * up.norm() / 2f64.sqrt() {
            (axis, up[axis].signum())
        } else if extent.z > 1.3 * extent.y {
            (2, 1.0)
        } else {
            (1, 1.0)
        }
    });
    let (axis, sign) = up;
    let from = Vector3::from_fn(|i, _| if i == axis { sign } else { 0.0 });
    UnitQuaternion::rotation_between(&from, &Vector3::y())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

fn lifted(frame: &Frame, world: &UnitQuaternion<f64>) -> Frame {
    let mut frame = frame.clone();
    frame.root = world * frame.root;
    frame.rotations[0] = world * frame.rotations[0];
    frame
}

/// What `to`'s joints follow in `from`.
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
            sources[t] = Source::Follow { from: [a, a], weight: 0.0, turns: [turn, turn] };
        }
    }
    sources
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

fn write(
    database: &Database<'_>,
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
    put(header::SKELETON, &fingerprint(database).to_le_bytes());
    put(header::SCALE, &(scale as f32).to_le_bytes());
    put(header::SOURCE_ANKLE, &(source.anatomy.ankle_m as f32).to_le_bytes());
    put(header::TARGET_ANKLE, &(target.anatomy.ankle_m as f32).to_le_bytes());
    put(header::WORLD, &floats(world.coords.as_slice()));
    put(header::SOURCE_HIPS, &floats(source.anatomy.hips.as_slice()));
    put(header::TARGET_HIPS, &floats(target.anatomy.hips.as_slice()));
    let chains = [limbs.iter().map(|l| l.0).collect::<Vec<_>>(), limbs.iter().map(|l| l.1).collect()];
    for (body, chains) in [source, target].into_iter().zip(&chains) {
        let segment = |joint: usize| -> u8 {
            let of = |(l, chain): (usize, &[usize; 3])| {
                (0..2).find(|&i| chain[i] == joint).map(|i| (1 + 2 * l + i) as u8)
            };
            chains.iter().enumerate().find_map(of).unwrap_or(0)
        };
        for i in 0..body.skeleton.joints() {
            let at = bytes.len();
            bytes.resize(at + joint::LENGTH, 0);
            bytes[at + joint::PARENT] = body.skeleton.parents[i].map_or(u8::MAX, |p| p as u8);
            bytes[at + joint::SEGMENT] = segment(i);
            let offset = if i == 0 { Vector3::zeros() } else { body.skeleton.offsets[i] };
            bytes[at + joint::OFFSET.start..at + joint::OFFSET.end]
                .copy_from_slice(&floats(offset.as_slice()));
        }
    }
    for records in [sources(source, target), sources(target, source)] {
        for from in &records {
            let at = bytes.len();
            bytes.resize(at + record::LENGTH, 0);
            let identity = UnitQuaternion::identity();
            let (kind, from, weight, turns) = match from {
                Source::Stay(rest) => (record::STAY, [0, 0], 0.0, [*rest, identity]),
                Source::Follow { from, weight, turns } => (record::FOLLOW, *from, *weight, *turns),
            };
            bytes[at + record::KIND] = kind;
            bytes[at + record::FROM.start] = from[0] as u8;
            bytes[at + record::FROM.start + 1] = from[1] as u8;
            bytes[at + record::WEIGHT.start..at + record::WEIGHT.end]
                .copy_from_slice(&(weight as f32).to_le_bytes());
            for (i, turn) in turns.iter().enumerate() {
                let start = at + record::TURNS.start + 16 * i;
                bytes[start..start + 16].copy_from_slice(&floats(turn.coords.as_slice()));
            }
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

fn floats(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|&v| (v as f32).to_le_bytes()).collect()
}
