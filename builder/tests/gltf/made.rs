//! glTF files that tests make: a body, its motion, and whatever wraps them.

use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};
use serde_json::{Value, json};

use meshoptimizer_rs::{
    Workspace,
    codec::{ExpMode, VertexEncoding, encode_filter_exp, encode_filter_quat, encode_vertex_buffer},
};

use crate::common;

/// A file under construction: its JSON, and the numbers behind it.
#[derive(Clone)]
pub struct Made {
    pub json: Value,
    pub data: Vec<u8>,
}

impl Made {
    pub fn new() -> Self {
        let json = json!({
            "asset": {"version": "2.0"}, "nodes": [], "skins": [], "animations": [],
            "accessors": [], "bufferViews": [], "buffers": [],
        });
        Self { json, data: Vec::new() }
    }

    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    /// Single-precision numbers, `kind` of them an element.
    pub fn floats(&mut self, kind: &str, values: &[f64]) -> usize {
        let per = match kind {
            "SCALAR" => 1,
            "VEC3" => 3,
            _ => 4,
        };
        let bytes: Vec<u8> = values.iter().flat_map(|v| (*v as f32).to_le_bytes()).collect();
        let view = self.view(&bytes);
        let mut accessor = json!({
            "bufferView": view, "componentType": 5126, "type": kind, "count": values.len() / per,
        });
        if kind == "SCALAR" {
            let (min, max) =
                (values.iter().copied().fold(f64::MAX, f64::min), values.iter().copied().fold(0.0, f64::max));
            (accessor["min"], accessor["max"]) = (json!([min]), json!([max]));
        }
        self.push("accessors", accessor)
    }

    pub fn view(&mut self, bytes: &[u8]) -> usize {
        let start = self.data.len();
        self.data.extend(bytes);
        self.push("bufferViews", json!({"buffer": 0, "byteOffset": start, "byteLength": bytes.len()}))
    }

    /// An animation of channels: node, path, input and output accessors, interpolation.
    pub fn animate(&mut self, name: &str, channels: &[(usize, &str, usize, usize, &str)]) {
        let samplers: Vec<Value> = channels
            .iter()
            .map(|(_, _, input, output, how)| json!({"input": input, "output": output, "interpolation": how}))
            .collect();
        let channels: Vec<Value> = channels
            .iter()
            .enumerate()
            .map(|(i, (node, path, ..))| json!({"sampler": i, "target": {"node": node, "path": path}}))
            .collect();
        self.push("animations", json!({"name": name, "samplers": samplers, "channels": channels}));
    }

    /// The file as meshoptimizer packs it: rotations as short integers, places with 15 bits; version 0 or 1 of the codec.
    pub fn packed(mut self, extension: &str, version: u8) -> Self {
        let (data, work) = (std::mem::take(&mut self.data), &mut Workspace::default());
        let encoding = VertexEncoding::new(version, 2).unwrap();
        let mut virtual_bytes = 0;
        let mut accessors = self.json["accessors"].take();
        for accessor in accessors.as_array_mut().unwrap() {
            let view = &mut self.json["bufferViews"][accessor["bufferView"].as_u64().unwrap() as usize];
            let [start, length] =
                ["byteOffset", "byteLength"].map(|key| view[key].as_u64().unwrap() as usize);
            let count = accessor["count"].as_u64().unwrap() as usize;
            let bytes = &data[start..start + length];
            let floats: Vec<f32> =
                bytes.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().unwrap())).collect();
            let (stride, filter, bytes) = match accessor["type"].as_str().unwrap() {
                "VEC4" => {
                    (accessor["componentType"], accessor["normalized"]) = (json!(5122), json!(true));
                    (8, "QUATERNION", encode_filter_quat(count, 8, 16, &floats, work).unwrap())
                }
                "VEC3" => {
                    let mode = ExpMode::SharedComponent;
                    (12, "EXPONENTIAL", encode_filter_exp(count, 12, 20, &floats, mode, work).unwrap())
                }
                _ => (4, "NONE", bytes.to_vec()),
            };
            let stream = encode_vertex_buffer(&bytes, count, stride, encoding, work).unwrap();
            let packing = json!({
                "buffer": 0, "byteOffset": self.data.len(), "byteLength": stream.len(), "byteStride": stride,
                "count": count, "mode": "ATTRIBUTES", "filter": filter,
            });
            *view = json!({
                "buffer": 1, "byteOffset": virtual_bytes, "byteLength": count * stride,
                "extensions": {extension: packing},
            });
            virtual_bytes += count * stride;
            self.data.extend(stream);
            self.data.resize(self.data.len().next_multiple_of(4), 0);
        }
        self.json["accessors"] = accessors;
        let stand_in = json!({"byteLength": virtual_bytes, "extensions": {extension: {"fallback": true}}});
        self.push("buffers", stand_in);
        let required = self.json["extensionsRequired"].as_array().cloned().unwrap_or_default();
        let required = [&required[..], &[json!(extension), json!("KHR_mesh_quantization")]].concat();
        self.json["extensionsRequired"] = json!(required);
        self.json["extensionsUsed"] = self.json["extensionsRequired"].clone();
        self
    }

    /// As `.glb`.
    pub fn glb(mut self) -> Vec<u8> {
        let buffers = self.json["buffers"].as_array_mut().unwrap();
        buffers.insert(0, json!({"byteLength": self.data.len()}));
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        self.data.resize(self.data.len().next_multiple_of(4), 0);
        let mut bytes = b"glTF".to_vec();
        bytes.extend(2u32.to_le_bytes());
        bytes.extend((28 + json.len() as u32 + self.data.len() as u32).to_le_bytes());
        for (kind, chunk) in [(b"JSON", json), (b"BIN\0", self.data)] {
            bytes.extend((chunk.len() as u32).to_le_bytes());
            bytes.extend(kind);
            bytes.extend(chunk);
        }
        bytes
    }

    /// As `.gltf`, its numbers at that URI.
    pub fn text(mut self, uri: &str) -> (Vec<u8>, Vec<u8>) {
        self.json["buffers"] = json!([{"byteLength": self.data.len(), "uri": uri}]);
        (self.json.to_string().into_bytes(), self.data)
    }
}

pub fn numbers(q: &UnitQuaternion<f64>) -> [f64; 4] {
    [q.i, q.j, q.k, q.w]
}

/// What lies above the hips as modelling programs leave it: centimetres, Z up.
pub fn armature() -> (UnitQuaternion<f64>, Vector3<f64>, f64) {
    (UnitQuaternion::from_euler_angles(-1.2, 0.3, 0.1), Vector3::new(0.4, 0.1, -0.2), 0.01)
}

/// Nodes of a skeleton below an armature; returns the node of each joint.
pub fn rig(made: &mut Made, skeleton: &Skeleton) -> Vec<usize> {
    let (turn, place, scale) = armature();
    // A mesh and a camera come first, so that joints are not numbered from 0.
    made.push("nodes", json!({"name": "Body"}));
    let armature = made.push(
        "nodes",
        json!({"name": "Armature", "translation": place.as_slice(), "rotation": numbers(&turn), "scale": [scale, scale, scale]}),
    );
    let nodes: Vec<usize> = (0..skeleton.joints())
        .map(|j| {
            let offset = skeleton.offsets[j] / scale;
            // The rest pose is somewhere else.
            let rest = UnitQuaternion::from_euler_angles(0.1 * j as f64, 0.2, 0.0);
            made.push(
                "nodes",
                json!({"name": skeleton.names[j], "translation": offset.as_slice(), "rotation": numbers(&rest)}),
            )
        })
        .collect();
    for (j, &node) in nodes.iter().enumerate() {
        let parent = skeleton.parents[j].map_or(armature, |p| nodes[p]);
        let list = &mut made.json["nodes"][parent]["children"];
        match list.as_array_mut() {
            Some(list) => list.push(json!(node)),
            None => *list = json!([node]),
        }
    }
    made.push("skins", json!({"joints": nodes}));
    // What is drawn is nothing to motion, however it is told.
    made.json["materials"] = json!([{"extensions": {"KHR_unheard_of": {}}, "alphaMode": "SHINY"}]);
    made.json["extensionsRequired"] = json!(["KHR_unheard_of", "KHR_animation_pointer"]);
    nodes
}

/// A clip's motion on a rig, as an animation of that name.
pub fn act(made: &mut Made, nodes: &[usize], clip: &Clip, name: &str) {
    let (turn, place, scale) = armature();
    let times: Vec<f64> = (0..clip.frames.len()).map(|f| f as f64 / clip.rate_hz).collect();
    let input = made.floats("SCALAR", &times);
    let mut channels = Vec::new();
    for (j, &node) in nodes.iter().enumerate() {
        let rotation = |f: &Frame| if j == 0 { turn.inverse() * f.rotations[0] } else { f.rotations[j] };
        let values: Vec<f64> = clip.frames.iter().flat_map(|f| numbers(&rotation(f))).collect();
        channels.push((node, "rotation", input, made.floats("VEC4", &values), "LINEAR"));
    }
    let root = |f: &Frame| turn.inverse() * (f.root - place) / scale;
    let values: Vec<f64> = clip.frames.iter().flat_map(|f| <[f64; 3]>::from(root(f))).collect();
    channels.push((nodes[0], "translation", input, made.floats("VEC3", &values), "LINEAR"));
    made.animate(name, &channels);
    let animation = made.json["animations"].as_array_mut().unwrap().last_mut().unwrap();
    let pointer = json!({"KHR_animation_pointer": {"pointer": "/materials/0/roughness"}});
    let channel = json!({"sampler": 0, "target": {"path": "pointer", "extensions": pointer}});
    animation["channels"].as_array_mut().unwrap().push(channel);
}

pub fn walk() -> Made {
    let mut made = Made::new();
    let nodes = rig(&mut made, &common::walk().skeleton);
    act(&mut made, &nodes, common::walk(), "Walk");
    made
}
