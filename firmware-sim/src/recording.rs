//! Recordings: a stream of poses with its settings in one flat file, for programs in other languages.
//!
//! The example in C, the wasm module in node and the page in a browser read it, and compare their digest with the one
//! that it contains. Numbers are little-endian:
//!
//! ```text
//! 0    "GSTREAM1"
//! 8    frames u32, joints u32, digest u32, 0 u32
//! 24   for each frame:
//!      action i16 (-1: unknown), input style i16, two output styles u16, their two weights f32
//!      root position 3 f32 (metres), joint rotations [joints x 4] f32 (x, y, z, w)
//! ```
//!
//! The digest is the host's, of every output pose and time step, with the default parameters and the first method that
//! the database supports ([`Method::of`]). A frame's settings apply before the frame, if they differ from those of the
//! previous one: both labels are cleared first and then set, since a database need not have every action in every
//! style.

use anyhow::{Result, bail};
use gestus_core::{
    Config, Database, Digest, Method, Pose, Stylizer,
    blob::{
        Manifest,
        layout::{MAX_JOINTS, ROOT_DOFS, dof},
    },
    body::pose::{self, Anchor},
    math::wrap_angle,
};
use gestus_database::{stream::to_pose, synth, with_capacities};
use gestus_motion::clip::{Clip, Skeleton};

/// First bytes of a recording.
pub const MAGIC: [u8; 8] = *b"GSTREAM1";

/// The settings of a frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// The input's action, if it is known.
    pub action: Option<u16>,
    /// The input's style, if it is known.
    pub input_style: Option<u16>,
    /// Output styles and their weights.
    pub styles: [(u16, f32); 2],
}

impl Settings {
    /// One output style, and no labels of the input.
    pub const fn style(style: u16) -> Self {
        Self { action: None, input_style: None, styles: [(style, 1.0), (style, 0.0)] }
    }
}

/// Poses and settings, frame by frame.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Joints of every pose.
    pub joints: usize,
    /// The settings and the input pose of each frame.
    pub frames: Vec<(Settings, Pose<MAX_JOINTS>)>,
}

impl Recording {
    /// Records a clip, which is on the database's joints and at its rate, with the same settings for all frames.
    pub fn of_clip(clip: &Clip, settings: Settings) -> Self {
        let frames = clip.frames.iter().map(|frame| (settings, to_pose(frame))).collect();
        Self { joints: clip.skeleton.joints(), frames }
    }

    /// A long stream: the database's own clips, one after the other, with styles and labels that change every `change`
    /// frames, poses that are in no clip (waving arms), and a NaN now and then.
    pub fn long(database: &Database<'_>, frames: usize, change: usize) -> Self {
        let counts = database.counts();
        let mut random = Random(1);
        let mut settings = Settings::style(0);
        let mut poses = own_motion(database, |_| true).into_iter().cycle();
        let frames = (0..frames).map_while(|t| {
            if t % change.max(1) == 0 {
                settings = some_settings(database, &mut random);
            }
            let mut pose = poses.next()?;
            if t / 200 % 3 == 1 {
                let (s, c) = gestus_core::math::sin_cos(0.4 * gestus_core::math::sin_cos(t as f32 * 0.2).0);
                let joint = counts.joints / 2;
                pose.rotations[joint] =
                    gestus_core::math::quaternion::multiply(pose.rotations[joint], [0.0, 0.0, s, c]);
            }
            if t % 977 == 976 {
                pose.position[1] = f32::NAN;
            }
            Some((settings, pose))
        });
        Self { joints: counts.joints, frames: frames.collect() }
    }

    /// Motion to try a database with, `seconds` of each action, and its description. It is newly generated if the
    /// database has the generator's skeleton and actions; otherwise it is the database's own clips of the first style.
    ///
    /// # Errors
    /// A database with another skeleton that was cut to its models, and so has no clips.
    pub fn sample(database: &Database<'_>, settings: Settings, seconds: f64) -> Result<(Self, String)> {
        let manifest = database.manifest()?;
        let rate = f64::from(database.rate_hz());
        let (mut poses, mut what) = (Vec::new(), String::new());
        for action in manifest.actions.iter().filter(|a| synth::ACTIONS.contains(a)) {
            let seed = synth::content_seed(1, action, 1000);
            let Ok(example) = synth::performance(seed, action, synth::STYLES[0], rate, seconds) else {
                continue;
            };
            if !same_body(&example.clip.skeleton, database, &manifest) {
                break;
            }
            poses.extend(example.clip.frames.iter().map(to_pose));
            what = "newly generated motion in neutral style, which the database has not seen".into();
        }
        if poses.is_empty() {
            poses = own_motion(database, |class| class.style == 0);
            poses.truncate(60 * rate as usize);
            what =
                format!("the database's own motion in the style {}", manifest.styles.get(0).unwrap_or("?"));
        }
        if poses.is_empty() {
            poses = own_motion(database, |_| true);
        }
        if poses.is_empty() {
            bail!("the database has models but no motion: give a clip with --input");
        }
        let frames = poses.into_iter().map(|pose| (settings, pose)).collect();
        Ok((Self { joints: database.counts().joints, frames }, what))
    }

    /// Digest of the output, with the default parameters and the first method that the database supports.
    ///
    /// # Errors
    /// A database that exceeds every capacity, or lacks a style or label of the recording.
    pub fn digest(&self, database: &Database<'_>) -> Result<u32> {
        let counts = database.counts();
        if counts.joints != self.joints {
            bail!("the recording has {} joints, the database {}", self.joints, counts.joints);
        }
        let config = Config::new().method(Method::of(database));
        with_capacities!(counts, config.k, J, K, C => self.replay::<J, K, C>(database, config))
    }

    fn replay<const J: usize, const K: usize, const C: usize>(
        &self,
        database: &Database<'_>,
        config: Config,
    ) -> Result<u32> {
        let refused = |e: gestus_core::ConfigError| anyhow::anyhow!("{e}");
        let mut stylizer = Box::new(Stylizer::<J, K, C>::new(*database, config).map_err(refused)?);
        let (mut digest, mut output, mut before) = (Digest::new(), Pose::<J>::IDENTITY, None);
        for (settings, recorded) in &self.frames {
            if before.replace(*settings) != Some(*settings) {
                stylizer.set_style(&settings.styles).map_err(refused)?;
                stylizer.set_labels(settings.action, settings.input_style).map_err(refused)?;
            }
            let mut input = Pose::<J> { position: recorded.position, ..Pose::IDENTITY };
            for (slot, rotation) in input.rotations.iter_mut().zip(recorded.rotations) {
                *slot = rotation;
            }
            let report = stylizer.step(&input, &mut output);
            digest.add(&output, self.joints, report.step_s);
        }
        Ok(digest.value())
    }

    /// The bytes of the file, with that digest.
    pub fn to_bytes(&self, digest: u32) -> Vec<u8> {
        let mut bytes = MAGIC.to_vec();
        for number in [self.frames.len() as u32, self.joints as u32, digest, 0] {
            bytes.extend(number.to_le_bytes());
        }
        for (settings, pose) in &self.frames {
            for label in [settings.action, settings.input_style] {
                bytes.extend(label.and_then(|l| i16::try_from(l).ok()).unwrap_or(-1).to_le_bytes());
            }
            settings.styles.iter().for_each(|(style, _)| bytes.extend(style.to_le_bytes()));
            settings.styles.iter().for_each(|(_, weight)| bytes.extend(weight.to_le_bytes()));
            let rotations = pose.rotations.iter().take(self.joints).flatten();
            pose.position.iter().chain(rotations).for_each(|value| bytes.extend(value.to_le_bytes()));
        }
        bytes
    }
}

/// True if a skeleton matches the database's: the same joints, and bones that differ by less than a centimetre.
fn same_body(skeleton: &Skeleton, database: &Database<'_>, manifest: &Manifest<'_>) -> bool {
    let named = skeleton.names.iter().map(String::as_str).eq(manifest.joints.iter());
    // The root's offset is a start position and not a bone.
    let mut bones = skeleton.offsets.iter().enumerate().skip(1);
    let alike =
        |j: usize, k: usize, length: f64| (length - f64::from(database.joint(j).offset[k])).abs() < 0.01;
    named && bones.all(|(j, bone)| (0..3).all(|k| alike(j, k, bone[k])))
}

/// The captured frames of some classes as poses, clip after clip, each starting where the previous one ends.
fn own_motion(
    database: &Database<'_>,
    wanted: impl Fn(&gestus_core::blob::Class) -> bool,
) -> Vec<Pose<MAX_JOINTS>> {
    let counts = database.counts();
    let seconds = 1.0 / database.rate_hz();
    let mut anchor = Anchor::ORIGIN;
    let mut poses = Vec::new();
    for class in database.classes().filter(wanted) {
        for row in class.first_row..class.first_row + class.rows {
            let mut dofs = [0.0; 3 * MAX_JOINTS + ROOT_DOFS];
            database.decode(row, &mut dofs);
            anchor.ground = anchor.moved(dofs[dof::FORWARD], dofs[dof::LEFT], seconds);
            anchor.heading = wrap_angle(anchor.heading + dofs[dof::YAW] * seconds);
            let mut pose = Pose::IDENTITY;
            pose::to_pose(database, &dofs[..counts.dofs], anchor, &mut pose);
            poses.push(pose);
        }
    }
    poses
}

/// Random settings: both labels of a class, one or none; and two output styles.
fn some_settings(database: &Database<'_>, random: &mut Random) -> Settings {
    let counts = database.counts();
    let class = database.class(random.below(counts.classes));
    let known = random.below(4);
    let style = |random: &mut Random| random.below(counts.styles) as u16;
    let share = random.below(5) as f32 / 4.0;
    Settings {
        action: (known & 1 == 1).then_some(class.action),
        input_style: (known & 2 == 2).then_some(class.style),
        styles: [(style(random), 1.25 - share), (style(random), share)],
    }
}

/// A linear congruential generator (Knuth's constants), so that the stream does not depend on a crate's version.
struct Random(u64);

impl Random {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BLOB: &[u8] = include_bytes!("../../tests/golden/blob-v2-legs.gestus");

    #[test]
    fn a_long_stream_changes_its_settings_and_keeps_its_digest() {
        let database = Database::open(BLOB).unwrap();
        let recording = Recording::long(&database, 1200, 60);
        assert_eq!(recording.frames.len(), 1200);
        let distinct: std::collections::BTreeSet<String> =
            recording.frames.iter().map(|(s, _)| format!("{s:?}")).collect();
        assert!(distinct.len() > 15, "{} settings", distinct.len());
        assert!(recording.frames.iter().any(|(_, p)| p.position[1].is_nan()));
        let digest = recording.digest(&database).unwrap();
        assert_eq!(Recording::long(&database, 1200, 60).digest(&database).unwrap(), digest);
        assert_ne!(Recording::long(&database, 1200, 61).digest(&database).unwrap(), digest);
    }

    /// The digest was once computed with the mixture, which such a database does not support.
    #[test]
    fn a_database_that_was_cut_to_its_models_has_a_digest() {
        let whole = Database::open(BLOB).unwrap();
        let recording = Recording::long(&whole, 60, 20);
        let blob = gestus_database::blob::cut::models_only(&whole).unwrap();
        let cut = Database::open(&blob).unwrap();
        // It has no phase tables, which would come first.
        assert_eq!(Method::of(&cut), Method::Lti);
        let digest = recording.digest(&cut).unwrap();
        assert_ne!(digest, recording.digest(&whole).unwrap());
        // It has no clips to show: the words name the option that helps.
        let error = Recording::sample(&cut, Settings::style(1), 4.0).unwrap_err().to_string();
        assert!(error.contains("--input"), "{error}");
    }

    #[test]
    fn the_file_holds_what_it_says() {
        let database = Database::open(BLOB).unwrap();
        let recording = Recording::long(&database, 3, 2);
        let bytes = recording.to_bytes(0x1234_5678);
        let record = 16 + 4 * (3 + 4 * recording.joints);
        assert_eq!(bytes.len(), 24 + 3 * record);
        assert_eq!(&bytes[..8], b"GSTREAM1");
        assert_eq!(&bytes[16..20], [0x78, 0x56, 0x34, 0x12]);
        let (settings, pose) = &recording.frames[2];
        let third = &bytes[24 + 2 * record..];
        assert_eq!(third[..2], settings.action.map_or(-1, |a| a as i16).to_le_bytes());
        assert_eq!(third[16..20], pose.position[0].to_le_bytes());
        assert_eq!(third[28..32], pose.rotations[0][0].to_le_bytes());
    }

    #[test]
    fn a_sample_stays_on_the_floor_of_the_room() {
        let database = Database::open(BLOB).unwrap();
        let (sample, what) = Recording::sample(&database, Settings::style(1), 4.0).unwrap();
        assert!(sample.frames.len() > 100 && !what.is_empty());
        assert!(sample.frames.iter().all(|(_, p)| p.is_valid(sample.joints) && p.position[1] < 2.0));
    }
}
