//! A map from an incoming skeleton to the database's, made of two identified bodies.

use gestus_core::{
    Database, Pose,
    blob::layout::MAX_JOINTS,
    retarget::{Map, layout::MAX_SOURCES},
};
use gestus_motion::clip::{Clip, Frame};
use nalgebra::{UnitQuaternion, Vector3};

use crate::{
    retarget::{
        body::{Body, MapError},
        encode::encode,
        file::MapFile,
        kept::Kept,
    },
    stream::{
        self,
        far::{moved_frame, origin_of},
    },
};

/// A map from an incoming skeleton to a database's, with what it was made from.
#[derive(Debug, Clone)]
pub struct Retarget {
    /// The incoming body.
    pub source: Body,
    /// The database's.
    pub target: Body,
    /// Rotation of the incoming world to Y up.
    pub world: UnitQuaternion<f64>,
    /// Leg length of the database over the incoming body's.
    pub scale: f64,
    /// The place of the incoming world about which poses are mapped ([`origin_of`]), metres.
    pub origin: Vector3<f64>,
    /// The joints of the incoming skeleton that the map takes.
    pub kept: Kept,
    bytes: Vec<u8>,
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
        let (source, world) = Body::of_clip(clip, file)?;
        Self::of(database.skeleton_fingerprint(), source, target, world, origin_of(clip))
    }

    /// The map between two bodies, for the database of that fingerprint.
    fn of(
        database: u32,
        source: Body,
        target: Body,
        world: UnitQuaternion<f64>,
        origin: Vector3<f64>,
    ) -> Result<Self, MapError> {
        let scale = target.anatomy.leg_m / source.anatomy.leg_m;
        let kept = Kept::of(&source, MAX_SOURCES);
        let mut near = kept.body(&source);
        let have = near.skeleton.joints();
        if !(2..=MAX_SOURCES).contains(&have) {
            return Err(MapError::Joints { have, most: MAX_SOURCES });
        }
        near.anatomy.ankle_m -= (world * origin).y;
        let bytes = encode(database, &near, &target, &world, scale);
        Map::open(&bytes)?;
        Ok(Self { source, target, world, scale, origin, kept, bytes })
    }

    /// The map between two bodies with Y up, of poses about `origin`, for use without a database.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_bodies(source: Body, target: Body, origin: Vector3<f64>) -> Result<Self, MapError> {
        Self::of(0, source, target, UnitQuaternion::identity(), origin)
    }

    /// A clip on the skeleton of another one, both with Y up, without a database; and the doubts about the map.
    ///
    /// # Errors
    /// [`MapError`] says what could not be found or does not fit.
    pub fn between(clip: &Clip, like: &Clip) -> Result<(Clip, Vec<String>), MapError> {
        let file = MapFile::default();
        let whole = Body::of_upright(like, &file)?;
        let kept = Kept::of(&whole, MAX_JOINTS);
        let target = kept.body(&whole);
        let have = target.skeleton.joints();
        if !(2..=MAX_JOINTS).contains(&have) {
            return Err(MapError::Joints { have, most: MAX_JOINTS });
        }
        let map = Self::of_bodies(Body::of_upright(clip, &file)?, target, origin_of(clip))?;
        let mut mapped = map.to_target(clip);
        mapped.skeleton = like.skeleton.clone();
        let rest = Frame { root: Vector3::zeros(), rotations: whole.rest };
        for frame in &mut mapped.frames {
            *frame = kept.put(frame.clone(), &rest);
        }
        Ok((mapped, map.doubts()))
    }

    /// The map for the core (`docs/FORMAT.md`, "Retargeting map"), of poses about the [`origin`](Self::origin).
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    fn map(&self) -> Map<'_> {
        Map::open(&self.bytes).expect("it was opened when it was made")
    }

    /// A clip of the incoming skeleton on the database's, about the [`origin`](Self::origin).
    pub fn to_target(&self, clip: &Clip) -> Clip {
        let map = self.map();
        let mut pose = Pose::<MAX_JOINTS>::IDENTITY;
        let frames = clip.frames.iter().map(|f| {
            let near = moved_frame(&self.kept.pick(f), &-self.origin);
            map.to_target(&stream::to_pose::<MAX_SOURCES>(&near), &mut pose);
            stream::from_pose(&pose, map.targets())
        });
        Clip { frames: frames.collect(), skeleton: self.target.skeleton.clone(), ..clip.clone() }
    }

    /// Poses on the database's skeleton on the incoming one. Joints without a counterpart are as in `like`, frame by
    /// frame (its last, where it is shorter; at rest, where it is empty).
    pub fn to_source(&self, frames: &[Frame], like: &[Frame]) -> Vec<Frame> {
        let map = self.map();
        let mut pose = Pose::<MAX_SOURCES>::IDENTITY;
        let rest = Frame { root: Vector3::zeros(), rotations: self.source.rest.clone() };
        let last = like.last().unwrap_or(&rest);
        let back = frames.iter().enumerate().map(|(i, f)| {
            let whole = like.get(i).unwrap_or(last);
            let near = moved_frame(&self.kept.pick(whole), &-self.origin);
            let like = stream::to_pose::<MAX_SOURCES>(&near);
            map.to_source(&stream::to_pose::<MAX_JOINTS>(f), &like, &mut pose);
            let back = moved_frame(&stream::from_pose(&pose, map.sources()), &self.origin);
            self.kept.put(back, whole)
        });
        back.collect()
    }

    /// Doubts for the user to check.
    pub fn doubts(&self) -> Vec<String> {
        let mut doubts: Vec<String> = self.source.doubts().cloned().collect();
        if !(0.7..=1.4).contains(&self.scale) {
            doubts.push(format!("the database's legs are {:.2} times as long: check the unit", self.scale));
        }
        doubts
    }
}
