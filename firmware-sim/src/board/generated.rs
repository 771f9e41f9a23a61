//! Databases of generated motion for boards: one of the reference's size, and one that fits a micro:bit. With them
//! boards can be tried, and budgets checked, without captured motion.

use std::{fs, path::PathBuf, time::SystemTime};

use anyhow::Result;
use gestus_database::{
    build::{BuildOptions, build},
    command_line::{blob, outputs::note},
    synth,
};
use gestus_motion::{
    clip::Clip,
    joints::{clip_on, kept, skeleton_of},
};

use super::image;

/// Frames a second.
const RATE_HZ: f64 = 30.0;
/// Frames between two leaps of a leaping stream.
const LEAP_FRAMES: usize = 2;
/// Number of a performance that is in none of these databases.
const UNSEEN: usize = 1000;

/// The contents of a generated database.
#[derive(Debug, Clone, Copy)]
pub struct Profile {
    /// Name of its file.
    name: &'static str,
    actions: &'static [&'static str],
    styles: usize,
    clips: usize,
    seconds: f64,
    /// Joints to keep; all if empty.
    joints: &'static [&'static str],
}

/// 28 classes (7 styles of 4 actions) on 21 joints, as in the reference database of captured motion.
pub const REFERENCE: Profile = Profile {
    name: "generated",
    actions: &["walk", "run", "walk-to-run", "run-to-walk"],
    styles: 7,
    clips: 4,
    seconds: 20.0,
    joints: &[],
};

/// Neighbors for which the micro:bit's image has room.
pub const SMALL_NEIGHBORS: u16 = 16;

/// Six classes on the 9 joints of trunk and legs: fits a Cortex-M0 with 16 KB of RAM.
pub const SMALL: Profile = Profile {
    name: "small",
    actions: &["walk", "run"],
    styles: 3,
    clips: 1,
    seconds: 6.0,
    joints: &[
        "Hips",
        "Spine",
        "Chest",
        "UpperLeg_L",
        "LowerLeg_L",
        "Foot_L",
        "UpperLeg_R",
        "LowerLeg_R",
        "Foot_R",
    ],
};

impl Profile {
    /// Path of the database's file, which is built if it is missing or older than this program.
    ///
    /// # Errors
    /// A file that can't be written.
    pub fn database(&self) -> Result<PathBuf> {
        let folder = image::target_folder();
        fs::create_dir_all(&folder)?;
        let path = folder.join(format!("{}.gestus", self.name));
        let written = |path: &PathBuf| fs::metadata(path).and_then(|m| m.modified());
        let program = std::env::current_exe().and_then(|p| written(&p)).unwrap_or(SystemTime::now());
        if !written(&path).is_ok_and(|file| file > program) {
            note(format_args!("building the database `{}` from generated motion", self.name));
            blob::write(&path, self.blob()?)?;
        }
        Ok(path)
    }

    /// Builds the database.
    ///
    /// # Errors
    /// A profile that can't be built, which is a bug.
    pub fn blob(&self) -> Result<Vec<u8>> {
        let own = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<String>>();
        let mut corpus = synth::corpus(&synth::Options {
            seed: 1,
            rate_hz: RATE_HZ,
            actions: own(self.actions),
            styles: own(&synth::STYLES[..self.styles]),
            clips: self.clips,
            seconds: self.seconds,
        })?;
        if !self.joints.is_empty() {
            corpus = corpus.on_joints(&own(self.joints))?;
        }
        Ok(build(&corpus, &BuildOptions::default())?.bytes)
    }

    /// A clip of the first action in the first style, which is not in the database.
    ///
    /// # Errors
    /// A profile that can't be built, which is a bug.
    pub fn clip(&self, seconds: f64) -> Result<Clip> {
        let seed = synth::content_seed(1, self.actions[0], UNSEEN);
        let clip = synth::performance(seed, self.actions[0], synth::STYLES[0], RATE_HZ, seconds)?.clip;
        if self.joints.is_empty() {
            return Ok(clip);
        }
        let names: Vec<String> = self.joints.iter().map(|n| (*n).to_owned()).collect();
        let kept = kept(&clip.skeleton, &names)?;
        Ok(clip_on(&clip, &kept, &skeleton_of(&clip.skeleton, &kept)))
    }

    /// A worst-case stream, which leaps between performances of every action and several styles every few frames. At
    /// each leap most classes lose the stream, and are searched again.
    ///
    /// # Errors
    /// A profile that can't be built, which is a bug.
    pub fn leaping(&self, seconds: f64) -> Result<Clip> {
        let mut parts = Vec::new();
        for (i, action) in self.actions.iter().enumerate() {
            for style in (0..self.styles).step_by(3) {
                let seed = synth::content_seed(1, action, UNSEEN + i);
                parts.push(synth::performance(seed, action, synth::STYLES[style], RATE_HZ, 6.0)?.clip);
            }
        }
        let mut clip = self.clip(seconds)?;
        for (t, frame) in clip.frames.iter_mut().enumerate() {
            // Consecutive parts are of different actions.
            let part = &parts[(t / LEAP_FRAMES * 5) % parts.len()];
            frame.clone_from(&part.frames[(t / LEAP_FRAMES * 37 + t % LEAP_FRAMES) % part.frames.len()]);
        }
        Ok(clip)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gestus_core::{Config, Database, Stylizer};

    #[test]
    fn the_small_profile_fits_the_micro_bit() {
        let blob = SMALL.blob().unwrap();
        // Half of its 256 KB of flash; the code takes some 80 KB.
        assert!(blob.len() < 128 * 1024, "{} bytes", blob.len());
        let database = Database::open(&blob).unwrap();
        let counts = database.counts();
        assert_eq!((counts.joints, counts.classes), (9, 6));
        assert!(Stylizer::<9, 16, 6>::new(database, Config::new()).is_ok());
        assert!(size_of::<Stylizer<'_, 9, 16, 6>>() < 11 * 1024);
        let clip = SMALL.clip(2.0).unwrap();
        assert_eq!(clip.skeleton.names, SMALL.joints);
    }
}
