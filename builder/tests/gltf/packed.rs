//! Files that meshoptimizer packed: their motion is read, and what is kept of them stays as it was.

use std::{env, fs, path::Path};

use gestus_motion::{
    binding::{Binding, Options},
    formats::gltf::{Gltf, GltfErrorKind, unpacked},
};
use serde_json::{Value, json};

use crate::{apart, clip, common, hinge, made::walk, one};

const EXTENSIONS: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// JSON and binary part of a `.glb`.
fn parts(glb: &[u8]) -> (Value, &[u8]) {
    let number = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().unwrap()) as usize;
    let json = 20 + number(12);
    (serde_json::from_slice(&glb[20..json]).unwrap(), &glb[json + 8..json + 8 + number(json)])
}

#[test]
fn packed_motion_is_that_of_the_file_before() {
    for (extension, version) in EXTENSIONS.into_iter().flat_map(|e| [(e, 0), (e, 1)]) {
        let packed = walk().packed(extension, version).glb();
        assert!(packed.len() < walk().glb().len() * 3 / 4);
        let motion = one(&packed).unwrap();
        let off = apart(common::walk(), &clip(&motion));
        assert!(off < 1e-3, "{extension} {version}: {off} m");
        let plain = unpacked(&packed, "hero.glb").unwrap();
        let (json, _) = parts(&plain);
        assert!(!json.to_string().contains(extension), "{json}");
        assert!(one(&plain).unwrap() == motion, "{extension} {version}");
    }
    let plain = walk().glb();
    let again = unpacked(&plain, "hero.glb").unwrap();
    assert_eq!(parts(&again), parts(&plain));
}

#[test]
fn a_packed_file_keeps_its_views_when_it_is_written() {
    let packed = walk().packed(EXTENSIONS[0], 0).glb();
    let file = Gltf::of(packed.clone().into(), "hero.glb", Path::new("")).unwrap().remove(0);
    let binding = Binding::new(&file.animation, &Options::default()).unwrap();
    let mut turned = clip(&file.animation);
    turned.frames.reverse();
    let written = file.write(&binding, &turned, None, false).unwrap();
    let [(old, old_bin), (new, new_bin)] = [parts(&packed), parts(&written)];
    let views = |json: &Value| json["bufferViews"].as_array().unwrap().clone();
    assert!(views(&new).starts_with(&views(&old)) && new_bin.starts_with(old_bin));
    assert_eq!(new["buffers"][1], old["buffers"][1]);
    assert_eq!(new["extensionsRequired"], old["extensionsRequired"]);
    let off = apart(&turned, &clip(&one(&written).unwrap()));
    assert!(off < 2e-6, "{off} m");
}

/// A seed of the fuzz target `gltf`, and the clip that `cargo xtask wasm` drops on the page. `GESTUS_RECORD=1` writes both.
#[test]
fn stored_packed_files_are_as_packed_here() {
    let leg = hinge(&[0.0, 0.5, 1.0], &[0.0, 45.0, 90.0], "LINEAR");
    for (name, made) in [("fuzz/seeds/gltf/leg-packed.glb", leg), ("page/walk-packed.glb", walk())] {
        let packed = made.packed(EXTENSIONS[0], 0).glb();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        if env::var_os("GESTUS_RECORD").is_some() {
            fs::write(&path, &packed).unwrap();
        }
        assert!(one(&fs::read(&path).unwrap()).unwrap() == one(&packed).unwrap(), "{name}");
    }
}

#[test]
fn damaged_packing_is_refused_with_its_view() {
    let whole = hinge(&[0.0, 1.0], &[0.0, 90.0], "LINEAR").packed(EXTENSIONS[1], 1);
    assert!(one(&whole.clone().glb()).is_ok());
    for change in [
        |packing: &mut Value| packing["byteLength"] = json!(4),
        |packing: &mut Value| packing["byteOffset"] = json!(1),
        |packing: &mut Value| packing["byteLength"] = json!(u64::MAX),
        |packing: &mut Value| packing["buffer"] = json!(7),
        |packing: &mut Value| packing["filter"] = json!("OCTAHEDRAL"),
    ] {
        let mut made = whole.clone();
        change(&mut made.json["bufferViews"][1]["extensions"][EXTENSIONS[1]]);
        let error = one(&made.glb()).unwrap_err().kind;
        assert!(matches!(error, GltfErrorKind::Packed { view: 1, .. }), "{error}");
    }
    let mut made = whole.clone();
    made.json["bufferViews"][1]["extensions"][EXTENSIONS[1]]["count"] = json!(1u64 << 40);
    assert!(matches!(one(&made.glb()).unwrap_err().kind, GltfErrorKind::Inflates { view: 1, .. }));
    // What stands for packed bytes holds none.
    let mut made = whole.clone();
    made.json["bufferViews"][1].as_object_mut().unwrap().remove("extensions");
    assert_eq!(one(&made.glb()).unwrap_err().kind, GltfErrorKind::NoBinary { buffer: 1 });
    // Any byte may be wrong.
    for at in 0..whole.data.len() {
        for wrong in [0x00, 0x55, 0xff] {
            let mut made = whole.clone();
            made.data[at] = wrong;
            let _ = one(&made.glb());
        }
    }
}
