//! Real BVH files, where they are at hand: `GESTUS_DATA`, or `shared/data` beside the repository.

use std::path::PathBuf;

use gestus_motion::{
    binding::{Options, to_clip},
    capture::{Document, read, read_folder},
    formats::bvh::Bvh,
};

/// Largest angle between the rotations that went in and those read back, degrees.
const ANGLE_DEG: f64 = 1e-4;
/// Largest distance between root positions, metres.
const PLACE_M: f64 = 1e-5;

fn data() -> Option<PathBuf> {
    let beside = concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data");
    let folder = std::env::var_os("GESTUS_DATA").map_or_else(|| PathBuf::from(beside), PathBuf::from);
    if !folder.is_dir() {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "real clips are missing");
        eprintln!("skipped: no folder of real motion at {} (set GESTUS_DATA to have one)", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn every_file_reads_and_comes_back() {
    let Some(data) = data() else { return };
    let folder = read_folder(&data).unwrap();
    assert!(folder.skipped.is_empty(), "{:?}", folder.skipped);
    let (mut angle, mut place, mut frames) = (0f64, 0f64, 0usize);
    let is_bvh = |document: &Document| matches!(document, Document::Bvh(_));
    assert!(
        folder.documents.iter().any(|(_, document)| is_bvh(document)),
        "no BVH file in {}",
        data.display()
    );
    for (path, document) in &folder.documents {
        let Document::Bvh(document) = document else { continue };
        let file = path.display();
        assert_eq!(&Bvh::parse(document.to_text().as_bytes(), document.name()).unwrap(), document, "{file}");
        let (clip, binding) = to_clip(document, &Options::default()).unwrap();
        assert_eq!(clip.skeleton.names[0], "Hips", "{file}");
        let highest = clip.frames[0].positions(&clip.skeleton).iter().fold(0f64, |h, p| h.max(p.y));
        assert!((1.0..2.2).contains(&highest), "{file}: {highest} m, {:?}", binding.notes());

        let written = binding.write(document, &clip).unwrap();
        let text = written.to_text();
        let read = Bvh::parse(text.as_bytes(), document.name()).unwrap();
        assert_eq!(read.joints(), document.joints(), "{file}");
        assert_eq!(read.frame_time_s(), document.frame_time_s(), "{file}");
        // The unit is the document's: a guess from averaged offsets could only be another by accident.
        let (back, _) = to_clip(&read, &Options { unit: Some(binding.unit()), root: None }).unwrap();
        assert_eq!(back.skeleton.names, clip.skeleton.names, "{file}");
        assert_eq!(back.skeleton.parents, clip.skeleton.parents, "{file}");
        assert_eq!(back.frames.len(), clip.frames.len(), "{file}");
        for (a, b) in clip.frames.iter().zip(&back.frames) {
            place = place.max((a.root - b.root).norm());
            for (p, q) in a.rotations.iter().zip(&b.rotations) {
                angle = angle.max(p.angle_to(q).to_degrees());
            }
        }
        frames += clip.frames.len();
    }
    eprintln!("{} files, {frames} frames: {angle:.2e} degrees, {place:.2e} m", folder.documents.len());
    assert!(angle <= ANGLE_DEG, "{angle} degrees");
    assert!(place <= PLACE_M, "{place} m");
}

#[test]
fn the_carrier_of_bandai_is_dropped_and_comes_back() {
    let Some(data) = data() else { return };
    let path = data.join("bandai-namco-2/dataset-2_walk_normal_001.bvh");
    if !path.is_file() {
        assert!(std::env::var("CI").as_deref() != Ok("true"), "real clips are missing");
        eprintln!("skipped: no {}", path.display());
        return;
    }
    let Document::Bvh(document) = read(&path).unwrap() else { panic!("{} is no BVH file", path.display()) };
    let (clip, binding) = to_clip(&document, &Options::default()).unwrap();
    assert_eq!(clip.skeleton.joints(), 21);
    assert_eq!(clip.rate_hz, 30.0);
    assert!(clip.skeleton.find("joint_Root").is_none());
    let written = binding.write(&document, &clip).unwrap();
    assert_eq!(written.joints()[0].name, "joint_Root");
    for frame in 0..written.frames() {
        assert_eq!(written.row(frame)[..6], document.row(frame)[..6]);
    }
}
