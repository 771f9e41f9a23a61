//! The file's JSON, reduced to its motion and checked.

use std::collections::HashMap;

use gltf::{Document, animation::Animation, json::Root};
use serde_json::Value;

use crate::formats::gltf::error::GltfErrorKind;

/// Extensions that pack the numbers of animations.
const PACKED: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];

/// Parses and checks a file: the document and its binary part.
pub fn document(bytes: &[u8]) -> Result<(Document, Option<Vec<u8>>), GltfErrorKind> {
    let wrong = |e: &dyn std::fmt::Display| GltfErrorKind::NotGltf(e.to_string());
    let (json, blob) = if bytes.starts_with(b"glTF") {
        // The length includes the header; the parser does not check that.
        let length = bytes.get(8..12).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        if length.is_none_or(|length| length < 12) {
            return Err(wrong(&"its header is cut"));
        }
        let glb = gltf::Glb::from_slice(bytes).map_err(|e| wrong(&e))?;
        (glb.json, glb.bin.map(|b| b.into_owned()))
    } else {
        (bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes).into(), None)
    };
    let mut json: Value = serde_json::from_slice(&json).map_err(|e| wrong(&e))?;
    let required = json["extensionsRequired"].as_array().into_iter().flatten().filter_map(Value::as_str);
    if let Some(packer) = required.clone().find(|e| PACKED.contains(e)) {
        return Err(GltfErrorKind::Packed(packer.to_owned()));
    }
    keep_motion(&mut json);
    let root: Root = gltf::json::deserialize::from_value(json).map_err(|e| wrong(&e))?;
    // Not checked by `from_json`.
    for (a, animation) in root.animations.iter().enumerate() {
        if let Some(c) = animation.channels.iter().position(|c| c.target.node.value() >= root.nodes.len()) {
            return Err(wrong(&format!("animations[{a}].channels[{c}].target.node: Index out of bounds")));
        }
    }
    Ok((Document::from_json(root).map_err(|e| wrong(&e))?, blob))
}

/// Removes meshes, materials and extensions, so that errors in them do not prevent reading the motion.
fn keep_motion(json: &mut Value) {
    let keep = |value: &mut Value, keys: &[&str]| {
        if let Some(object) = value.as_object_mut() {
            object.retain(|key, _| keys.contains(&key.as_str()));
        }
    };
    keep(json, &["asset", "nodes", "skins", "animations", "accessors", "bufferViews", "buffers"]);
    for (list, keys) in [
        ("nodes", &["name", "children", "matrix", "translation", "rotation", "scale"][..]),
        ("skins", &["name", "joints"]),
        ("animations", &["name", "channels", "samplers"]),
    ] {
        json.get_mut(list).and_then(Value::as_array_mut).into_iter().flatten().for_each(|v| keep(v, keys));
    }
    for animation in json.get_mut("animations").and_then(Value::as_array_mut).into_iter().flatten() {
        if let Some(channels) = animation.get_mut("channels").and_then(Value::as_array_mut) {
            let moves = |path: &Value| ["translation", "rotation", "scale"].iter().any(|p| path == p);
            channels.retain(|c| !c["target"]["node"].is_null() && moves(&c["target"]["path"]));
        }
    }
}

/// Unique names of the animations; those without one are numbered.
pub fn names(document: &Document) -> Vec<String> {
    let own = |animation: Animation<'_>| {
        let name = animation.name().map(str::trim).filter(|n| !n.is_empty());
        name.map_or_else(|| format!("animation{}", animation.index()), str::to_owned)
    };
    unique(document.animations().map(own))
}

/// Makes names unique: the second `leg` becomes `leg_2`.
pub fn unique(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut taken: HashMap<String, usize> = HashMap::new();
    names
        .map(|own| {
            let mut name = own.clone();
            while taken.contains_key(&name) {
                let count = taken.entry(own.clone()).or_insert(1);
                *count += 1;
                name = format!("{own}_{count}");
            }
            taken.insert(name.clone(), 1);
            name
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::unique;

    #[test]
    fn names_that_come_again_are_numbered_past_those_that_are_there() {
        let names = ["leg_2", "leg", "leg", "leg", "arm"].map(String::from);
        assert_eq!(unique(names.into_iter()), ["leg_2", "leg", "leg_3", "leg_4", "arm"]);
    }
}
