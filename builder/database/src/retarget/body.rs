//! A skeleton with its parts, measured on its own motion.

use std::{ops::RangeInclusive, sync::Arc};

use gestus_core::{
    BlobError, Database, Pose,
    blob::layout::MAX_JOINTS,
    body::pose::{Anchor, to_pose},
};
use gestus_motion::{
    body::{database_skeleton, mean_hips_line},
    clip::{Clip, Frame, Skeleton, rotation},
    landmarks::Landmarks,
};
use nalgebra::{UnitQuaternion, Vector3};
use thiserror::Error;

use crate::{
    blob::export::row,
    registration::floor::{self, Floor, Supports},
    retarget::{
        anatomy::{Anatomy, Standing},
        axis::to_y,
        file::MapFile,
        identify::{IdentifyError, Parts},
        parts::{Part, Side},
        up::{self, SAMPLE, lifted, sample},
    },
    stream,
};

/// Height of an ankle above its sole, in lengths of the leg.
pub(crate) const ANKLE: f64 = 0.1;

/// Whether an ankle or the toes of a standing foot can be that high over the floor, metres, on a leg of that length.
pub(crate) fn is_over_sole(height_m: f64, leg_m: f64) -> bool {
    (-0.06 * leg_m..=0.25 * leg_m).contains(&height_m)
}

/// Lengths of the legs of bodies, metres: from toys to giants.
pub(crate) const LEGS_M: RangeInclusive<f64> = 0.05..=20.0;

/// Farthest that a body can be from a stated floor, metres: within what a map holds.
const FAR_FROM_FLOOR_M: f64 = 50.0;

/// A skeleton that can't be mapped.
#[derive(Debug, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MapError {
    #[error("{0}")]
    Source(IdentifyError),
    #[error("the database's skeleton: {0}")]
    Target(IdentifyError),
    #[error("the body has {have} joints, and 2 to {most} can be mapped")]
    Joints { have: usize, most: usize },
    #[error("the legs of the {which} are {length_m:.2} m long: give the unit, or export the file in metres")]
    Legs { which: &'static str, length_m: f64 },
    #[error("the encoded map is invalid; this is a bug of the builder, please report it")]
    Blob(#[from] BlobError),
    #[error("the clip has no frames")]
    Empty,
    #[error(
        "floor {floor_m}: the body is at {body_m:.2} m, and no body is {FAR_FROM_FLOOR_M} m from its floor"
    )]
    Floor { floor_m: f64, body_m: f64 },
}

/// A body: a skeleton, its parts and their anatomical frames.
#[derive(Debug, Clone)]
pub struct Body {
    /// The skeleton.
    pub skeleton: Arc<Skeleton>,
    /// Which joint is which part.
    pub parts: Parts,
    /// Anatomical frames in the joints' axes.
    pub anatomy: Anatomy,
    /// The floor that it stands on.
    pub floor: Floor,
    /// Local rotations of joints without a counterpart: their means.
    pub(crate) rest: Vec<UnitQuaternion<f64>>,
}

impl Anatomy {
    /// Feet that do not stand do not tell how high an ankle is above its sole: over a floor at that height it is then an
    /// adult's.
    pub(super) fn stand_on(&mut self, floor_m: f64) {
        if !is_over_sole(self.ankle_m - floor_m, self.leg_m) {
            self.ankle_m = floor_m + ANKLE * self.leg_m;
        }
    }
}

impl Body {
    /// What a person should check: doubts about its parts and about their frames.
    pub fn doubts(&self) -> impl Iterator<Item = &String> {
        self.parts.doubts.iter().chain(&self.anatomy.doubts)
    }

    /// A database's body, measured on its own motion.
    ///
    /// # Errors
    /// [`MapError::Target`] if no arms or legs are found.
    pub fn of_database(database: &Database<'_>) -> Result<Self, MapError> {
        let skeleton = Arc::new(database_skeleton(database));
        let frames = sample_of(database);
        let parts = Parts::find(&skeleton, &frames, &MapFile::default()).map_err(MapError::Target)?;
        let anatomy = Anatomy::of(&skeleton, &parts, &frames, None, Standing::BothFeet);
        let rest = (0..skeleton.joints()).map(|j| rotation(database.joint(j).mean)).collect();
        Self { skeleton, parts, anatomy, floor: Floor::ZERO, rest }.checked("database")
    }

    /// An incoming body, measured on a clip, and the rotation of its world to Y up.
    ///
    /// # Errors
    /// [`MapError`] if it can't be identified.
    pub fn of_clip(clip: &Clip, file: &MapFile) -> Result<(Self, UnitQuaternion<f64>), MapError> {
        let world = up::upright(clip, file);
        let mut body = Self::in_world(clip, &world, file)?;
        body.parts.doubts.extend(up::doubt(clip, file));
        Ok((body, world))
    }

    /// An incoming body, measured on a clip with Y up.
    ///
    /// # Errors
    /// As [`of_clip`](Self::of_clip).
    pub fn of_upright(clip: &Clip, file: &MapFile) -> Result<Self, MapError> {
        Self::in_world(clip, &UnitQuaternion::identity(), file)
    }

    /// An incoming body, measured on a clip whose world is turned to Y up by `world`.
    fn in_world(clip: &Clip, world: &UnitQuaternion<f64>, file: &MapFile) -> Result<Self, MapError> {
        if clip.frames.is_empty() {
            return Err(MapError::Empty);
        }
        let skeleton = clip.skeleton.clone();
        let poses = |world| sample(clip).iter().map(|f| lifted(f, world)).collect::<Vec<Frame>>();
        let frames = poses(world);
        // By shape, legs are what is low: one that lies is looked at as it would stand.
        let as_it_stands = up::shown(clip, file).map_or(*world, to_y);
        let parts = Parts::find(&skeleton, &poses(&as_it_stands), file).map_err(MapError::Source)?;
        let standing = if is_brief(clip) { Standing::OneFootAtLeast } else { Standing::BothFeet };
        let mut anatomy = Anatomy::of(&skeleton, &parts, &frames, file.upright, standing);
        let floor = floor_of(clip, world, &parts, anatomy.leg_m, file)?;
        anatomy.stand_on(floor.height_m);
        let rest = (0..skeleton.joints()).map(|j| frames[frames.len() / 2].rotations[j]).collect();
        Self { skeleton, parts, anatomy, floor, rest }.checked("clip")
    }

    pub(super) fn checked(self, which: &'static str) -> Result<Self, MapError> {
        let length_m = self.anatomy.leg_m;
        if LEGS_M.contains(&length_m) { Ok(self) } else { Err(MapError::Legs { which, length_m }) }
    }

    /// Its legs, for inverse kinematics: thigh and shin of one bone each. `None` where there are joints between.
    pub fn legs(&self) -> Option<Landmarks> {
        let parent = |joint: usize| self.skeleton.parents[joint];
        let mut marks = Landmarks {
            hip_joints: [0; 2],
            knees: [0; 2],
            feet: [0; 2],
            toes: [0; 2],
            groups: vec![0; self.skeleton.joints()],
        };
        for side in Side::BOTH {
            let [knee, foot] = [Part::LowerLeg(side), Part::Foot(side)].map(|part| self.parts.get(part));
            let (knee, foot) = (knee?, foot?);
            if parent(foot) != Some(knee) {
                return None;
            }
            let i = side.index();
            // Of a thigh of two bones, the one that the knee is on.
            (marks.hip_joints[i], marks.knees[i], marks.feet[i]) = (parent(knee)?, knee, foot);
            let toes = self.parts.get(Part::Toes(side)).filter(|&toes| parent(toes) == Some(foot));
            marks.toes[i] = toes.unwrap_or(foot);
        }
        Some(marks)
    }

    /// From the right to the left hip joint, as the root sees them in the mean of some poses; unit length.
    pub fn hips_line(&self, frames: &[Frame]) -> Vector3<f64> {
        let hip_joints = Side::BOTH.map(|side| self.parts.get(Part::UpperLeg(side)).unwrap_or(0));
        mean_hips_line(&self.skeleton, hip_joints, frames.iter()).unwrap_or_else(Vector3::x)
    }

    /// Joints of a chain with their positions along it, 0 to 1: the ends at 0 and 1, others at the middle of the segment
    /// that they rotate.
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
    pub(super) fn chains(&self) -> [Vec<(usize, f64)>; 2] {
        let chest = self.parts.spine.last().copied().unwrap_or(0);
        [self.chain(0, &self.parts.spine), self.chain(chest, &self.parts.neck)]
    }
}

/// Frames of a database, evenly spaced over all its clips.
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

/// Whether a clip is shorter than a stride, so that one foot may carry the body alone.
pub(crate) fn is_brief(clip: &Clip) -> bool {
    clip.duration_s() < 0.8
}

/// Refuses a stated floor that is not the body's: metres up, of a wrong sign or in another unit.
pub(crate) fn check_floor(floor_m: f64, body_m: f64) -> Result<(), MapError> {
    if (body_m - floor_m).abs() > FAR_FROM_FLOOR_M {
        return Err(MapError::Floor { floor_m, body_m });
    }
    Ok(())
}

/// The floor of a clip whose world is turned to Y up by `world`: as given, or else found.
pub(super) fn floor_of(
    clip: &Clip,
    world: &UnitQuaternion<f64>,
    parts: &Parts,
    leg_m: f64,
    file: &MapFile,
) -> Result<Floor, MapError> {
    if let Some(floor_m) = file.floor_m {
        let body_m = clip.frames.get(clip.frames.len() / 2).map_or(0.0, |frame| (world * frame.root).y);
        check_floor(floor_m, body_m)?;
        return Ok(Floor::stated(floor_m));
    }
    let both = |of: fn(Side) -> Part| Side::BOTH.map(|side| parts.get(of(side)));
    let [Some(left), Some(right)] = both(Part::Foot) else { return Ok(Floor::ZERO) };
    let others = both(Part::LowerLeg).into_iter().flatten().chain([0]).collect();
    let supports = Supports::unknown([left, right], both(Part::Toes), others, leg_m);
    let upright = Clip { frames: clip.frames.iter().map(|f| lifted(f, world)).collect(), ..clip.clone() };
    Ok(floor::find(&upright, &supports))
}
