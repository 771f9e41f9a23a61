//! A clip that is ready to be streamed through a database: read from a file, mapped to the database's body and floor, moved
//! over the ground if it walks in place, and cut to a loop if it is one. The output is converted back in the same steps.

use std::{path::Path, sync::Arc};

use anyhow::{Context, Result};
use gestus_core::Database;

use crate::{
    registration::floor::{Floor, Source},
    retarget::{
        MapFile, Retarget,
        file::{FloorError, check_floor},
        up::lifted,
    },
    stream::{
        Streamed, beginning,
        body_mapping::BodyMapping,
        course::{self, Course, Root, Unevenness},
        far,
        left_alone::leave_moments_alone,
        looped::Round,
        reading::bind,
        repair::Repaired,
        toe_tips::ToeTips,
        turn_limit::{FASTER, fastest, limited},
    },
};
use gestus_motion::{
    binding::Binding,
    body::{Body, database_skeleton},
    capture::{self, Document},
    clip::{Clip, Frame},
    corpus::Corpus,
    unit::Unit,
};
use nalgebra::Vector3;

/// What the caller states about a clip. Everything else is found in the clip.
#[derive(Debug, Clone, Default)]
pub struct InputOptions {
    /// Which joint is which body part, and the height of the floor.
    pub map: MapFile,
    /// The unit of lengths; guessed if `None`.
    pub unit: Option<Unit>,
    /// Whether the body walks in place; found by its feet if `None`.
    pub root: Option<Root>,
    /// Whether the clip is a loop.
    pub looped: bool,
}

impl InputOptions {
    /// Sets the height of the floor, metres along the clip's up, in place of the map's; `None` leaves the map's.
    ///
    /// # Errors
    /// A floor that is too far away.
    pub fn on_floor(mut self, metres: Option<f64>) -> Result<Self, FloorError> {
        metres.map(check_floor).transpose()?;
        self.map.floor_m = metres.or(self.map.floor_m);
        Ok(self)
    }
}

/// A clip that is ready to be streamed through a database.
#[derive(Debug)]
pub struct Input {
    /// The file.
    pub document: Document,
    /// The conversion between the file's joints and the clip's.
    pub binding: Binding,
    /// The clip at the database's rate, on the file's joints.
    pub clip: Clip,
    /// The clip on the database's joints, on a floor at zero, moving over the ground.
    pub mapped: Clip,
    mapping: BodyMapping,
    floor: Floor,
    course: Option<Course>,
    /// That of the course, in each frame of `mapped`.
    unevenness: Option<Unevenness>,
    round: Option<Round>,
    /// Mean place of the clip's hips.
    place: Vector3<f64>,
    /// The file's first pose, where it is no part of the motion.
    first: Option<Frame>,
    /// What was repaired in the file.
    repairs: Vec<String>,
    /// A warning about a clip whose file is too coarse.
    coarse: Option<String>,
}

impl Input {
    /// Reads a motion file for a database.
    ///
    /// # Errors
    /// A file that can't be read, or whose skeleton can't be mapped to the database's.
    pub fn read(path: &Path, database: &Database<'_>) -> Result<Self> {
        Self::read_with(path, database, &InputOptions::default())
    }

    /// Reads a motion file for a database, with what the caller states about the clip.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn read_with(path: &Path, database: &Database<'_>, options: &InputOptions) -> Result<Self> {
        Self::of_document(capture::read(path)?, path, database, options)
    }

    /// [`read_with`](Self::read_with) for a document that was read before from the file `path`.
    ///
    /// # Errors
    /// As [`read`](Self::read).
    pub fn of_document(
        document: Document,
        path: &Path,
        database: &Database<'_>,
        options: &InputOptions,
    ) -> Result<Self> {
        let hips = options.map.hips();
        let (document, binding, clip) = bind(document, path, database, options.unit, hips)?;
        Self::of(document, binding, Repaired::of(&clip), database, options)
            .with_context(|| path.display().to_string())
    }

    fn of(
        document: Document,
        binding: Binding,
        Repaired { clip: original, first, notes: repairs }: Repaired,
        database: &Database<'_>,
        options: &InputOptions,
    ) -> Result<Self> {
        let (rate_hz, original) = (f64::from(database.rate_hz()), &original);
        // The body is measured at the clip's own rate, which has more poses.
        let map = options.map.of_document(&document);
        let (mapping, floor) = BodyMapping::find(database, original, &map)?;
        let target = Arc::new(database_skeleton(database));
        let onto = |clip: &Clip| mapping.onto(&target, clip, floor.height_m);
        let body = Body::of(&Corpus::of_clip(&onto(&Clip {
            frames: original.frames.iter().take(1).cloned().collect(),
            ..original.clone()
        })))?;
        let move_in_place = |clip: &mut Clip| {
            let course = database.legs().and_then(|legs| Course::find(clip, &body, &legs, options.root));
            if let Some(course) = &course {
                course.apply(clip);
            }
            course
        };
        let (place, coarse) = (course::place(original, &mapping.hips()), far::warning(original));
        let mut clip = original.fitted(rate_hz)?;
        // A loop is found at the clip's own rate, and resampled to a whole number of frames.
        let mut mapped = onto(if options.looped { original } else { &clip });
        let course = move_in_place(&mut mapped);
        let round = options.looped.then(|| Round::find(&mapped, &body)).transpose()?;
        if let Some(round) = &round {
            clip = round.cut_rotations(original, rate_hz);
            mapped = round.cut(&mapped, &body, rate_hz);
        }
        let unevenness = course.as_ref().map(|course| match &round {
            Some(round) => course.unevenness_of(round, mapped.frames.len()),
            None => course.unevenness(rate_hz),
        });
        // A loop does not come back to it.
        let first = first.filter(|_| round.is_none());
        Ok(Self {
            document,
            binding,
            clip,
            mapped,
            mapping,
            floor,
            course,
            unevenness,
            round,
            place,
            first,
            repairs,
            coarse,
        })
    }

    /// The output on the database's skeleton, for driving a robot.
    pub fn body(&self, streamed: &Streamed, rate_hz: f64) -> Clip {
        self.carry(streamed, &self.mapped.frames, |frames, _| frames).clip(&self.mapped, rate_hz)
    }

    /// A stream whose poses are carried elsewhere, where the input's are `inputs`. `carry` takes poses, and gives the frame
    /// of the input of each. The stream begins in its style where the input
    /// begins at rest ([`beginning`]). A loop has no beginning, and a body that walks in place is not at rest.
    fn carry(
        &self,
        streamed: &Streamed,
        inputs: &[Frame],
        carry: impl Fn(Vec<Frame>, &dyn Fn(usize) -> f64) -> Vec<Frame>,
    ) -> Streamed {
        let carried = |frames: Vec<Frame>, source: &dyn Fn(usize) -> f64| {
            let mut frames = carry(frames, source);
            if self.round.is_none() && self.course.is_none() {
                beginning::in_style(&mut frames, inputs, self.clip.rate_hz);
            }
            frames
        };
        let mut whole = streamed.clone();
        let mut frames = whole.frames();
        if self.round.is_none() {
            let passed: Vec<f64> = whole.steps.iter().map(|step| f64::from(step.report.passed)).collect();
            leave_moments_alone(&mut frames, &self.mapped.frames, &passed, self.clip.rate_hz);
        }
        let frames = carried(frames, &|t| t as f64);
        whole.steps.iter_mut().zip(frames).for_each(|(step, frame)| step.frame = frame);
        if let Some(retimed) = &mut whole.retimed {
            let frames = std::mem::take(&mut retimed.frames);
            let source = |t: usize| {
                let shown_s = t as f64 * retimed.tick_s
                    - f64::from(retimed.ticks.get(t).map_or(0.0, |tick| tick.lag_s));
                shown_s * self.clip.rate_hz
            };
            retimed.frames = carried(frames, &source);
        }
        whole
    }

    /// Notes for the user about the reading: a guessed unit, averaged translations, and doubts about the map between the
    /// skeletons.
    pub fn notes(&self) -> impl Iterator<Item = String> {
        let doubts = self.retarget().map(Retarget::doubts).unwrap_or_default();
        let doubts = doubts.into_iter().map(|doubt| format!("retargeted; doubt: {doubt}"));
        let floor = (self.floor.source == Source::Body).then(|| {
            format!(
                "its floor is taken to be at {:.2} m, where the feet stand; --floor states another",
                self.floor.height_m
            )
        });
        let course = self.course.as_ref().filter(|course| !course.stated).map(|course| {
            format!(
                "walks in place, at {:.2} m/s by its feet: moved for the search, and put back; --root motion leaves it",
                course.speed_m_s
            )
        });
        self.binding
            .notes()
            .iter()
            .cloned()
            .chain(self.repairs.clone())
            .chain(doubts)
            .chain(floor)
            .chain(course)
            .chain(self.coarse.clone())
    }

    /// A warning about a clip whose file is too coarse for its distance from the origin.
    pub fn coarse(&self) -> Option<&str> {
        self.coarse.as_deref()
    }

    /// The clip's floor.
    pub fn floor(&self) -> Floor {
        self.floor
    }

    /// The course of a body that walks in place; `None` if its hips move.
    pub fn course(&self) -> Option<&Course> {
        self.course.as_ref()
    }

    /// The loop that was found in the clip, if the caller asked for one.
    pub fn round(&self) -> Option<&Round> {
        self.round.as_ref()
    }

    /// Up in the clip's world.
    pub fn up(&self) -> Vector3<f64> {
        self.mapping.up()
    }

    /// A clip of the file's joints for drawing: Y up, the floor at zero.
    pub fn shown(&self, clip: &Clip) -> Clip {
        let mut shown = self.upright(clip);
        shown.frames.iter_mut().for_each(|frame| frame.root.y -= self.floor.height_m);
        shown
    }

    /// A clip of the file's joints with Y up, on its own floor.
    pub fn upright(&self, clip: &Clip) -> Clip {
        let mut upright = clip.clone();
        if let BodyMapping::Map(map, _) = &self.mapping {
            upright.frames.iter_mut().for_each(|frame| *frame = lifted(frame, &map.world));
        }
        upright
    }

    /// Mean speed over the ground, m/s, of the body on the database's skeleton.
    pub fn speed_m_s(&self) -> f64 {
        self.mapped.ground_speed_m_s()
    }

    /// The floor, the root and the loop, as the commands' JSON has them.
    pub fn json(&self) -> serde_json::Value {
        serde_json::json!({
            "floor_m": self.floor.height_m,
            "floor_from": self.floor.source.name(),
            "root": if self.course.is_some() { "in-place" } else { "motion" },
            "root_from": if self.course.as_ref().is_some_and(|course| course.stated) { "told" } else { "found" },
            "speed_m_s": self.speed_m_s(),
            "loop": self.round.map(|round| serde_json::json!({
                "first_frame": round.start,
                "frames": round.period,
                "input_gap_cm": round.gap_cm,
            })),
        })
    }

    /// The map between the skeletons, if they differ.
    pub fn retarget(&self) -> Option<&Retarget> {
        match &self.mapping {
            BodyMapping::Same(..) => None,
            BodyMapping::Map(map, _) => Some(map),
        }
    }

    /// The output as a clip of the input's skeleton, at the database's rate. Joints that the database lacks move as
    /// in the input.
    pub fn output(&self, streamed: &Streamed) -> Clip {
        let inputs = &self.clip.frames;
        let back = |mut frames: Vec<Frame>, source: &dyn Fn(usize) -> f64| {
            self.even(&mut frames, source);
            self.mapping.back(&frames, inputs, self.floor.height_m)
        };
        let output =
            self.kept_in_place(self.carry(streamed, inputs, back).clip(&self.clip, self.clip.rate_hz));
        let held = FASTER * fastest(&self.clip.frames);
        // A quick style turns joints as fast as the core lets it. Another body's legs may exaggerate that, so it is held.
        let limit = match self.retarget() {
            Some(_) => held,
            None => held.max(fastest(&streamed.clip(&self.mapped, self.clip.rate_hz).frames)),
        };
        self.with_first(limited(self.with_toes_raised(output), limit, &self.up(), self.round.is_some()))
    }

    /// A clip of the file's joints whose toes are not in the floor, of another body than the database's.
    fn with_toes_raised(&self, mut clip: Clip) -> Clip {
        let tips = |map| ToeTips::of(&self.binding, map, &self.clip, self.up(), self.floor.height_m);
        self.retarget().iter().for_each(|map| tips(map).raise(&mut clip));
        clip
    }

    /// An output that begins with the file's first pose, where that is no part of the motion.
    fn with_first(&self, mut clip: Clip) -> Clip {
        if let (Some(first), Some(frame)) = (&self.first, clip.frames.first_mut()) {
            frame.clone_from(first);
        }
        clip
    }

    /// Poses of the database's joints as a clip of the input's skeleton, at the database's rate; other joints move as they
    /// do in the input at each pose's `sources`, in frames.
    pub fn carried(&self, frames: &[Frame], sources: &[f64]) -> Clip {
        let inputs: Vec<Frame> = sources.iter().map(|&source| self.clip.at(source)).collect();
        let mut frames = frames.to_vec();
        self.even(&mut frames, &|t| sources[t]);
        let back = self.mapping.back(&frames, &inputs, self.floor.height_m);
        let clip = self.kept_in_place(Clip { frames: back, ..self.clip.clone() });
        self.with_first(self.with_toes_raised(clip))
    }

    /// Takes out of poses what the course had beyond an even path, if the input walks in place. `source` is its frame of
    /// each pose.
    fn even(&self, frames: &mut [Frame], source: &dyn Fn(usize) -> f64) {
        if let Some(unevenness) = &self.unevenness {
            unevenness.remove(frames, source, self.clip.rate_hz);
        }
    }

    /// Puts an output back in place, if the input walks in place.
    fn kept_in_place(&self, mut clip: Clip) -> Clip {
        if self.course.is_some() {
            let (hips, looped) = (self.mapping.hips(), self.round.is_some());
            course::put_in_place(&mut clip, &hips, &self.up(), &self.place, looped);
        }
        clip
    }

    /// The output in the form of the input's file, for the file `to`; an animation of glTF under `name`, or in the place
    /// of the input's.
    ///
    /// # Errors
    /// A clip that is not on the input's skeleton, or that the format can't represent.
    pub fn written(&self, output: &Clip, to: &Path, name: Option<&str>) -> Result<Vec<u8>> {
        self.document.write(&self.binding, output, to, name).with_context(|| to.display().to_string())
    }
}

/// Maps a clip on any skeleton to the database's skeleton and floor, at the clip's own rate.
///
/// # Errors
/// A skeleton that can't be mapped.
pub fn onto(database: &Database<'_>, clip: &Clip) -> Result<Clip> {
    let (mapping, floor) = BodyMapping::find(database, clip, &MapFile::default())?;
    Ok(mapping.onto(&Arc::new(database_skeleton(database)), clip, floor.height_m))
}
