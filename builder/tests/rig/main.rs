//! `build --rig`: databases on the skeleton of a character. The characters are made of the generated body, so that what its
//! clips look like on them is known.

mod character;
mod command;
#[allow(dead_code, reason = "other tests use more of it")]
#[path = "../common/mod.rs"]
mod common;
#[allow(dead_code, reason = "other tests use more of it")]
#[path = "../retarget/foreign.rs"]
mod foreign;
mod skeletons;

use std::{
    fs,
    path::{Path, PathBuf},
};

use gestus_motion::{clip::Clip, clip::Frame, formats::bvh::Bvh, unit::Unit};
use nalgebra::{UnitQuaternion, Vector3};

use crate::foreign::Foreign;

/// A new folder with a folder `data` of generated walks in two styles.
fn walks(name: &str) -> [PathBuf; 2] {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    let _ = fs::remove_dir_all(&folder);
    let data = folder.join("data");
    fs::create_dir_all(&data).unwrap();
    for clip in common::corpus().examples.iter().map(|e| &e.clip) {
        write(&data.join(format!("{}.bvh", clip.name)), clip);
    }
    [folder, data]
}

fn write(path: &Path, clip: &Clip) {
    fs::write(path, Bvh::from_clip(clip, Unit::Centimetres).unwrap().to_text()).unwrap();
}

/// A generated walk with a T-pose at its end, on a floor at zero: what is done to the body is done to both.
fn with_rest(clip: &Clip) -> Foreign {
    let mut foreign = Foreign(clip.clone());
    let zero = vec![UnitQuaternion::identity(); clip.skeleton.joints()];
    foreign.0.frames.push(Frame { root: Vector3::new(0.0, 0.95, 0.0), rotations: zero });
    foreign
}
