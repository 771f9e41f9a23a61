//! Properties of BVH reading and writing, on random trees and on damaged text.

use gestus_motion::{
    binding::{Options, to_clip},
    formats::bvh::Bvh,
    unit::Unit,
};
use proptest::prelude::*;

/// A random document's text: joints hang on any earlier open joint, channels in any order, 3 or 6 a joint.
fn document() -> impl Strategy<Value = String> {
    let channels = Just(vec!["Xrotation", "Yrotation", "Zrotation"]).prop_shuffle();
    let joint = (any::<u8>(), channels, any::<bool>(), prop::array::uniform3(-50.0..50.0f64), any::<bool>());
    let joints = prop::collection::vec(joint, 1..12);
    let values = prop::collection::vec(-400.0..400.0f64, 12 * 6 * 3);
    (joints, 1..4usize, values).prop_map(|(joints, frames, values)| {
        let mut text = String::from("HIERARCHY\n");
        let (mut depth, mut total) = (0usize, 0);
        for (i, (pops, turns, six, offset, site)) in joints.into_iter().enumerate() {
            for _ in 0..(pops as usize).min(depth.saturating_sub(1)) % 4 {
                text += "}\n";
                depth -= 1;
            }
            let mut list = turns;
            if six || i == 0 {
                list.extend(["Zposition", "Xposition", "Yposition"]);
            }
            total += list.len();
            let word = if i == 0 { "ROOT" } else { "JOINT" };
            let [x, y, z] = offset;
            text +=
                &format!("{word} j {i} {{ OFFSET {x} {y} {z}\nCHANNELS {} {}\n", list.len(), list.join(" "));
            if site {
                text += "End Site { OFFSET 0 1 0 }\n";
            }
            depth += 1;
        }
        text += &"}\n".repeat(depth);
        text += &format!("MOTION\nFrames: {frames}\nFrame Time: 0.0333333\n");
        for f in 0..frames {
            let row: Vec<String> = values[f * 72..f * 72 + total].iter().map(f64::to_string).collect();
            text += &(row.join(" ") + "\n");
        }
        text
    })
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_is_written_is_what_was_read(text in document()) {
        let document = Bvh::parse(text.as_bytes(), "random.bvh").unwrap();
        prop_assert_eq!(Bvh::parse(document.to_text().as_bytes(), "random.bvh").unwrap(), document);
    }

    #[test]
    fn a_written_clip_is_the_same_motion(text in document()) {
        let document = Bvh::parse(text.as_bytes(), "random.bvh").unwrap();
        let options = Options { unit: Some(Unit::Centimetres), root: None };
        let (clip, binding) = to_clip(&document, &options).unwrap();
        let written = binding.write(&document, &clip).unwrap().to_text();
        let plain = Bvh::from_clip(&clip, Unit::Centimetres).unwrap().to_text();
        for text in [written, plain] {
            let read = Bvh::parse(text.as_bytes(), "random.bvh").unwrap();
            // The joint that was found to be the hips, found again by name.
            let options = Options { root: Some(clip.skeleton.names[0].clone()), ..options.clone() };
            let (back, _) = to_clip(&read, &options).unwrap();
            prop_assert_eq!(&back.skeleton.names, &clip.skeleton.names);
            for (a, b) in clip.frames.iter().zip(&back.frames) {
                prop_assert!((a.root - b.root).norm() < 1e-6);
                for (p, q) in a.rotations.iter().zip(&b.rotations) {
                    prop_assert!(p.angle_to(q).to_degrees() < 1e-4);
                }
            }
        }
    }

    #[test]
    fn damaged_text_never_panics(
        text in document(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 0..4usize, any::<u8>()), 1..8),
    ) {
        let words: [&[u8]; 8] = [b"{", b"}", b" 1e999 ", b"JOINT", b" 1e300 ", b"\r", b"\xff", b":"];
        let mut bytes = text.into_bytes();
        for (at, how, what) in damage {
            let at = at.index(bytes.len());
            match how {
                0 => bytes.truncate(at.max(1)),
                1 => if let Some(byte) = bytes.get_mut(at) { *byte = what; },
                2 => { bytes.splice(at..at, words[what as usize % 8].iter().copied()); }
                _ => { bytes.drain(at..(at + what as usize % 9).min(bytes.len() - 1).max(at)); }
            }
        }
        if let Ok(document) = Bvh::parse(&bytes, "damaged.bvh")
            && let Ok((clip, binding)) = to_clip(&document, &Options::default())
        {
            prop_assert!(binding.write(&document, &clip).is_ok());
        }
    }
}
