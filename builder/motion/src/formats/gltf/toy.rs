//! A character of boxes on a clip's skeleton, as a `.glb` file: for tests, and to try things out without a model.

use nalgebra::{Rotation3, Vector3};
use serde_json::{Value, json};

use crate::{
    clip::{Clip, Skeleton},
    formats::gltf::container::{Container, FLOAT, single},
    landmarks::rest_positions,
};

/// Thickness of a bone's box, metres.
const THICK_M: f64 = 0.07;
/// Component types of accessors.
const BYTE: u32 = 5121;
const SHORT: u32 = 5123;

/// A skinned body whose animations are those clips, all on the skeleton of the first. Zero rotations are its bind pose.
///
/// # Panics
/// Without a clip, or with more than 255 joints.
pub fn toy(clips: &[(&str, &Clip)]) -> Vec<u8> {
    let skeleton = &clips[0].1.skeleton;
    assert!(skeleton.joints() <= usize::from(u8::MAX), "joints of vertices are bytes");
    let mut file = File::default();
    let skin = file.skin(skeleton);
    let mesh = file.mesh(skeleton);
    let animations: Vec<Value> = clips.iter().map(|(name, clip)| file.animation(name, clip)).collect();
    // The mesh comes first, so that joints are not numbered from 0.
    let mut nodes = vec![json!({"name": "Body", "mesh": 0, "skin": 0})];
    for j in 0..skeleton.joints() {
        let children: Vec<usize> =
            (0..skeleton.joints()).filter(|&c| skeleton.parents[c] == Some(j)).map(|c| c + 1).collect();
        let place = if j == 0 { clips[0].1.frames[0].root } else { skeleton.offsets[j] };
        let mut node = json!({"name": skeleton.names[j], "translation": single(&place)});
        if !children.is_empty() {
            node["children"] = json!(children);
        }
        nodes.push(node);
    }
    let joints: Vec<usize> = (1..=skeleton.joints()).collect();
    let json = json!({
        "asset": {"version": "2.0", "generator": "Gestus"},
        "scene": 0,
        "scenes": [{"nodes": [0, 1]}],
        "nodes": nodes,
        "skins": [{"name": "Body", "joints": joints, "skeleton": 1, "inverseBindMatrices": skin}],
        "meshes": [{"name": "Body", "primitives": [mesh]}],
        "materials": [{"name": "Clay", "pbrMetallicRoughness":
            {"baseColorFactor": [0.82, 0.55, 0.35, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.8}}],
        "animations": animations,
        "accessors": file.accessors,
        "bufferViews": file.views,
        "buffers": [{"byteLength": file.bytes.len()}],
    });
    Container::glb(json, file.bytes).bytes().expect("a toy is small")
}

/// The numbers of a file under construction.
#[derive(Default)]
struct File {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl File {
    /// Adds numbers of a type as an accessor with a view of its own.
    fn push(
        &mut self,
        kind: &str,
        component: u32,
        count: usize,
        bytes: impl IntoIterator<Item = u8>,
    ) -> usize {
        let start = self.bytes.len();
        self.bytes.extend(bytes);
        let length = self.bytes.len() - start;
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        self.views.push(json!({"buffer": 0, "byteOffset": start, "byteLength": length}));
        self.accessors.push(json!({
            "bufferView": self.views.len() - 1, "componentType": component, "count": count, "type": kind,
        }));
        self.accessors.len() - 1
    }

    /// Vectors with their bounds.
    fn floats<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]]) -> usize {
        let bytes = rows.iter().flatten().flat_map(|x| x.to_le_bytes());
        let accessor = self.push(kind, FLOAT, rows.len(), bytes);
        let bound = |pick: fn(f32, f32) -> f32| {
            let fold = |k: usize| rows.iter().map(|row| row[k]).reduce(pick);
            (0..N).map(fold).collect::<Vec<_>>()
        };
        self.accessors[accessor]["min"] = json!(bound(f32::min));
        self.accessors[accessor]["max"] = json!(bound(f32::max));
        accessor
    }

    /// Inverse bind matrices, column by column.
    fn skin(&mut self, skeleton: &Skeleton) -> usize {
        let matrices: Vec<[f32; 16]> = rest_positions(skeleton)
            .iter()
            .map(|p| {
                let [x, y, z] = single(&-p);
                [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, x, y, z, 1.0]
            })
            .collect();
        self.floats("MAT4", &matrices)
    }

    /// A box for each bone, which follows the joint at its upper end.
    fn mesh(&mut self, skeleton: &Skeleton) -> Value {
        let rest = rest_positions(skeleton);
        let (mut places, mut normals, mut joints, mut indices) = (vec![], vec![], vec![], vec![]);
        for j in 0..skeleton.joints() {
            let is_leaf = !skeleton.parents.contains(&Some(j));
            let bone = skeleton.parents[j].map(|p| (p, rest[p], rest[j]));
            let tip = is_leaf.then(|| (j, rest[j], rest[j] + skeleton.offsets[j] * 0.6));
            for (joint, from, to) in bone.into_iter().chain(tip) {
                for (place, normal) in cuboid(from, to) {
                    // Two triangles a face, whose four corners come one after the other.
                    if places.len() % 4 == 0 {
                        let first = places.len() as u16;
                        indices.extend([0, 1, 2, 2, 1, 3].map(|i| first + i));
                    }
                    places.push(single(&place));
                    normals.push(single(&normal));
                    joints.push([joint as u8, 0, 0, 0]);
                }
            }
        }
        let weights = vec![[1.0f32, 0.0, 0.0, 0.0]; places.len()];
        let faces = self.push("SCALAR", SHORT, indices.len(), indices.iter().flat_map(|i| i.to_le_bytes()));
        json!({
            "attributes": {
                "POSITION": self.floats("VEC3", &places),
                "NORMAL": self.floats("VEC3", &normals),
                "JOINTS_0": self.push("VEC4", BYTE, joints.len(), joints.iter().flatten().copied()),
                "WEIGHTS_0": self.floats("VEC4", &weights),
            },
            "indices": faces,
            "material": 0,
        })
    }

    fn animation(&mut self, name: &str, clip: &Clip) -> Value {
        let times: Vec<[f32; 1]> =
            (0..clip.frames.len()).map(|f| [(f as f64 / clip.rate_hz) as f32]).collect();
        let input = self.floats("SCALAR", &times);
        let root: Vec<[f32; 3]> = clip.frames.iter().map(|f| single(&f.root)).collect();
        let mut curves = vec![(1, "translation", self.floats("VEC3", &root))];
        for j in 0..clip.skeleton.joints() {
            let turns: Vec<[f32; 4]> =
                clip.frames.iter().map(|f| f.rotations[j].coords.map(|x| x as f32).into()).collect();
            curves.push((j + 1, "rotation", self.floats("VEC4", &turns)));
        }
        let samplers: Vec<Value> = curves.iter().map(|c| json!({"input": input, "output": c.2})).collect();
        let channel = |(i, c): (usize, &(usize, &str, usize))| json!({"sampler": i, "target": {"node": c.0, "path": c.1}});
        let channels: Vec<Value> = curves.iter().enumerate().map(channel).collect();
        json!({"name": name, "samplers": samplers, "channels": channels})
    }
}

/// The corners of a box along a bone, four a face, with the face's normal. Triangles 0-1-2 and 2-1-3 of each face turn
/// counterclockwise from outside.
fn cuboid(from: Vector3<f64>, to: Vector3<f64>) -> Vec<(Vector3<f64>, Vector3<f64>)> {
    let along = to - from;
    let length = along.norm().max(THICK_M / 2.0);
    // Of opposite directions, none is between.
    let upside_down = || Rotation3::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
    let turn = Rotation3::rotation_between(&Vector3::y(), &along).unwrap_or_else(upside_down);
    let mut corners = Vec::new();
    for axis in 0..3 {
        for sign in [-1.0, 1.0] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut normal = Vector3::zeros();
            normal[axis] = sign;
            for (a, b) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
                let mut corner = normal;
                (corner[u], corner[v]) = (a * sign, b);
                let place = Vector3::new(
                    corner.x * THICK_M / 2.0,
                    (corner.y + 1.0) * length / 2.0,
                    corner.z * THICK_M / 2.0,
                );
                corners.push((from + turn * place, turn * normal));
            }
        }
    }
    corners
}
