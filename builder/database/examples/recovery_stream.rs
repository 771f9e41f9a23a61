//! Writes a database of a walk and a run in two styles, and a walk that is not in it: what the fuzzer of recovery streams
//! (`cargo xtask fuzz recovery`). The poses are little-endian `f32`: position, then the rotations of 22 joints.
//!
//! `cargo run -p gestus-database --example recovery_stream -- DATABASE POSES`

use gestus_core::Pose;
use gestus_database::{
    build::{BuildOptions, build},
    stream::to_pose,
    synth::{Options, corpus},
};

const JOINTS: usize = 22;

fn main() -> anyhow::Result<()> {
    let files: Vec<String> = std::env::args().skip(1).collect();
    let [database, poses] = &files[..] else { anyhow::bail!("name the files to write: DATABASE POSES") };
    let corpus = corpus(&Options::of(&["walk", "run"], &["neutral", "childlike"], 2, 8.0))?;
    let Some(walk) = corpus.examples.iter().position(|e| e.action == 0 && e.style == 0) else {
        anyhow::bail!("there is no walk")
    };
    std::fs::write(database, build(&corpus.without(&[walk]), &BuildOptions::default())?.bytes)?;
    let numbers = corpus.examples[walk].clip.frames.iter().flat_map(|frame| {
        let pose: Pose<JOINTS> = to_pose(frame);
        pose.position.into_iter().chain(pose.rotations.into_iter().flatten()).collect::<Vec<f32>>()
    });
    std::fs::write(poses, numbers.flat_map(f32::to_le_bytes).collect::<Vec<u8>>())?;
    Ok(())
}
