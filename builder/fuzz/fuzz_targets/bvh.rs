//! Any bytes: parse, write, convert, write back. What parses must come back the same; nothing may panic.
#![no_main]

use gestus_motion::{
    binding::{Options, to_clip},
    formats::bvh::Bvh,
};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let Ok(document) = Bvh::parse(bytes, "fuzz.bvh") else { return };
    let again = Bvh::parse(document.to_text().as_bytes(), "fuzz.bvh").expect("what was written can be read");
    assert_eq!(document, again);
    if let Ok((clip, binding)) = to_clip(&document, &Options::default()) {
        binding.write(&document, &clip).expect("a clip goes back onto its own document");
    }
});
