//! Characters as files: the generated body with other names, axes, units and poses, without an animation.

use gestus_motion::clip::{Frame, Skeleton};
use nalgebra::{Isometry3, Matrix4, UnitQuaternion, Vector3};
use serde_json::{Value, json};

use crate::foreign::Foreign;

/// A character: a skeleton, the pose in which its mesh is bound, and that of its nodes.
#[derive(Clone)]
pub struct Character {
    pub skeleton: Skeleton,
    /// Pose in which the mesh is bound; none without a skin.
    pub bound: Option<Frame>,
    pub nodes: Frame,
    /// Units of the nodes, in metres: that of their armature.
    pub unit_m: f64,
    /// From the scene to the space of the mesh.
    pub mesh: UnitQuaternion<f64>,
}

impl Character {
    /// Of a clip whose last pose is that of rest.
    pub fn of(foreign: &Foreign) -> Self {
        let rest = foreign.0.frames.last().unwrap().clone();
        Self {
            skeleton: (*foreign.0.skeleton).clone(),
            bound: Some(rest.clone()),
            nodes: rest,
            unit_m: 1.0,
            mesh: UnitQuaternion::identity(),
        }
    }

    /// The file: a mesh, an armature, and the joints below it.
    pub fn glb(&self) -> Vec<u8> {
        let skeleton = &self.skeleton;
        let numbers = |v: &Vector3<f64>| [v.x, v.y, v.z];
        let turn = |q: &UnitQuaternion<f64>| [q.i, q.j, q.k, q.w];
        let children = |parent: Option<usize>| -> Vec<usize> {
            (0..skeleton.joints()).filter(|&c| skeleton.parents[c] == parent).map(|c| c + 2).collect()
        };
        let scale = self.unit_m;
        let mut nodes = vec![
            json!({"name": "Body", "mesh": 0}),
            json!({"name": "Armature", "scale": [scale, scale, scale], "children": children(None)}),
        ];
        for j in 0..skeleton.joints() {
            let place = if j == 0 { self.nodes.root } else { skeleton.offsets[j] } / scale;
            let mut node = json!({"name": skeleton.names[j], "translation": numbers(&place),
                "rotation": turn(&self.nodes.rotations[j])});
            if !children(Some(j)).is_empty() {
                node["children"] = json!(children(Some(j)));
            }
            nodes.push(node);
        }
        let mut file = json!({
            "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0, 1]}], "nodes": nodes,
            "meshes": [{"name": "Body", "primitives": []}],
        });
        let mut bytes = Vec::new();
        if let Some(bound) = &self.bound {
            bytes = self.bind_matrices(bound);
            let joints: Vec<usize> = (0..skeleton.joints()).map(|j| j + 2).collect();
            file["nodes"][0]["skin"] = json!(0);
            file["skins"] = json!([{"joints": joints, "inverseBindMatrices": 0}]);
            file["accessors"] =
                json!([{"bufferView": 0, "componentType": 5126, "count": skeleton.joints(), "type": "MAT4"}]);
            file["bufferViews"] = json!([{"buffer": 0, "byteLength": bytes.len()}]);
            file["buffers"] = json!([{"byteLength": bytes.len()}]);
        }
        container(&file, &bytes)
    }

    fn bind_matrices(&self, bound: &Frame) -> Vec<u8> {
        let mut world: Vec<Isometry3<f64>> = Vec::new();
        for j in 0..self.skeleton.joints() {
            let offset = if j == 0 { bound.root } else { self.skeleton.offsets[j] } / self.unit_m;
            let local = Isometry3::from_parts(offset.into(), bound.rotations[j]);
            world.push(match self.skeleton.parents[j] {
                Some(parent) => world[parent] * local,
                None => Isometry3::from_parts(Vector3::zeros().into(), self.mesh) * local,
            });
        }
        let matrices = world.iter().map(|pose| -> Matrix4<f64> { pose.inverse().to_homogeneous() });
        matrices.flat_map(|m| m.iter().flat_map(|x| (*x as f32).to_le_bytes()).collect::<Vec<_>>()).collect()
    }
}

/// A `.glb` file of a JSON part and a binary part.
pub fn container(json: &Value, binary: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut file = b"glTF".to_vec();
    let length = 20 + text.len() + if binary.is_empty() { 0 } else { 8 + binary.len() };
    for number in [2, length as u32, text.len() as u32] {
        file.extend(number.to_le_bytes());
    }
    file.extend(b"JSON");
    file.extend(text);
    if !binary.is_empty() {
        file.extend((binary.len() as u32).to_le_bytes());
        file.extend(b"BIN\0");
        file.extend(binary);
    }
    file
}
