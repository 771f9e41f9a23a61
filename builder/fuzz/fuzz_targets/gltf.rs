//! Any bytes: what parses is a document that is written, read and converted like any other; nothing may panic, and
//! nothing is allocated on the file's word.
#![no_main]

use gestus_motion::binding::{Options, to_clip};
use gestus_motion::formats::{
    bvh::{AsBvh, Bvh},
    gltf::parse,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let beside = |_: &std::path::Path| Ok(bytes.to_vec());
    for (_, animation) in parse(bytes, "fuzz.glb", &beside).unwrap_or_default() {
        // A few keys may last for hours.
        if animation.poses.len() > 30_000 {
            continue;
        }
        let Ok(document) = animation.as_bvh() else { continue };
        let again =
            Bvh::parse(document.to_text().as_bytes(), "fuzz.glb").expect("what was written can be read");
        assert_eq!(document.values(), again.values());
        if let Ok((clip, binding)) = to_clip(&animation, &Options::default()) {
            binding.write(&animation, &clip).expect("a clip goes back onto its own document");
        }
    }
});
