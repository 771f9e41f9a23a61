//! Poses of a clip as raw f32, for the firmware to count instructions on: `dump DB CLIP.bvh OUT.bin`.

use gestus_builder::{stream::to_pose, translate::Input};
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let bytes = std::fs::read(&a[1]).unwrap();
    let db = gestus_core::Database::open(&bytes).unwrap();
    let input = Input::read(a[2].as_ref(), &db).unwrap();
    let mut out = (input.mapped.frames.len() as u32).to_le_bytes().to_vec();
    for f in &input.mapped.frames {
        let p = to_pose::<21>(f);
        for v in p.position.iter().chain(p.rotations.as_flattened()) {
            out.extend(v.to_le_bytes());
        }
    }
    std::fs::write(&a[3], out).unwrap();
}
