//! A clip as an animation of the glTF file that its input came from.
//!
//! The JSON and the binary part are edited, not made anew: meshes, skins, materials, textures, extras and extensions stay
//! as they are, at the same indices. The animation is replaced, or added under a new name:
//!
//! * Each joint gets the clip's rotations, the hips a translation too, in the space of their parent node. A curve that
//!   stays constant gets one key; a joint that was not animated and stays at rest gets none.
//! * Nodes above the hips stay as in the animation's first frame, as on BVH: their motion is in the hips.
//! * Curves of other nodes, of morph targets and of extensions are copied, with their own times.
//!
//! New keys are appended to the binary part. Old ones stay, because extensions may refer to them.

use std::collections::{HashMap, HashSet};

use base64::Engine;
use nalgebra::{Isometry3, UnitQuaternion};
use serde_json::{Value, json};

use crate::{
    binding::Binding,
    clip::Clip,
    formats::gltf::{
        Gltf,
        container::{Container, FLOAT, aligned, single},
        data::{BASE64, Buffers, fetch},
        document::{content, names},
        error::GltfErrorKind,
        file::beside,
        motion::{Curves, Rigging},
        tree::Tree,
    },
};

/// Greatest difference of values that count as the same: components of quaternions, and the file's units.
const SAME: f32 = 1e-7;
/// Greatest difference from rest of a joint that gets no keys, radians.
const AT_REST: f64 = 1e-6;
/// Media types of images by their endings.
const IMAGES: [(&str, &str); 5] = [
    ("png", "image/png"),
    ("jpg", "image/jpeg"),
    ("jpeg", "image/jpeg"),
    ("webp", "image/webp"),
    ("ktx2", "image/ktx2"),
];

/// Keys of a node: one a frame, one for all, or none.
#[derive(Default)]
struct Keys {
    rotations: Vec<[f32; 4]>,
    translations: Vec<[f32; 3]>,
}

impl Gltf {
    /// The file with the clip as its animation: in the place of the one that was read, or under `name`, which is added if
    /// the file does not have it. `elsewhere`: the result goes to another folder, so the files that it needs are put into
    /// it.
    ///
    /// # Errors
    /// A clip on another skeleton, files that can't be read, and a result over 4 GB.
    pub fn write(
        &self,
        binding: &Binding,
        clip: &Clip,
        name: Option<&str>,
        elsewhere: bool,
    ) -> Result<Vec<u8>, GltfErrorKind> {
        binding.check(&self.animation.joints, &self.animation.name, clip).map_err(GltfErrorKind::Convert)?;
        let content = content(&self.bytes)?;
        let document = &content.document;
        let tree = Tree::new(document)?;
        let known = names(document);
        let index = known.iter().position(|n| *n == self.name).ok_or(GltfErrorKind::NoMotion)?;
        let source = document.animations().nth(index).ok_or(GltfErrorKind::NoMotion)?;
        let open = |name: &std::path::Path| beside(&self.folder, name);
        let buffers = Buffers::new(&content, &open);
        let curves = Curves::read(&source, &self.name, &tree, &buffers)?;
        let rigging = Rigging::of(&tree, &curves.moved)?;
        let carried: Vec<usize> = rigging.above.iter().chain(&rigging.body).copied().collect();
        let (start, _, _) = curves.timeline(&carried);
        let keys = Keyed::new(binding, clip, &tree, &curves, &rigging, start);

        let mut file = Container::of(&self.bytes)?;
        if elsewhere {
            file.embed(&self.folder)?;
        }
        let mut animation = file.json["animations"][index].clone();
        keep_others(&mut animation, &keys.nodes().collect());
        let mut data = Vec::new();
        let view = file.json["bufferViews"].as_array().map_or(0, Vec::len);
        let mut accessors = Accessors { json: &mut file.json, data: &mut data, view };
        let times: Vec<[f32; 1]> =
            (0..clip.frames.len()).map(|f| [(start + f as f64 / clip.rate_hz) as f32]).collect();
        let each = accessors.push("SCALAR", &times, true);
        let mut one = None;
        let mut turned = Vec::new();
        for (node, keys) in keys.all() {
            let mut add = |accessors: &mut Accessors<'_>, path: &str, output: usize, count: usize| {
                let input = match count {
                    1 if times.len() > 1 => {
                        *one.get_or_insert_with(|| accessors.push("SCALAR", &times[..1], true))
                    }
                    _ => each,
                };
                channel(&mut animation, node, path, input, output);
            };
            if !keys.rotations.is_empty() {
                let output = accessors.push("VEC4", &keys.rotations, false);
                add(&mut accessors, "rotation", output, keys.rotations.len());
            }
            if !keys.translations.is_empty() {
                let output = accessors.push("VEC3", &keys.translations, false);
                add(&mut accessors, "translation", output, keys.translations.len());
            }
            turned.extend((!keys.rotations.is_empty() || !keys.translations.is_empty()).then_some(node));
        }
        for node in turned {
            spell_out(&mut file.json["nodes"][node], document.nodes().nth(node));
        }
        let place = match name {
            Some(name) => known.iter().position(|n| n == name),
            None => Some(index),
        };
        if let Some(name) = name.filter(|n| *n != self.name) {
            animation["name"] = json!(name);
        }
        let animations = list(&mut file.json, "animations");
        match place.and_then(|place| animations.get_mut(place)) {
            Some(old) => *old = animation,
            None => animations.push(animation),
        }
        file.append(data)?;
        file.bytes()
    }
}

/// What the keys of each node are made of: those that the clip moves, and those that its hips hang on. Keys are made node
/// by node, since those of all would take as much memory as the file.
struct Keyed<'a> {
    binding: &'a Binding,
    clip: &'a Clip,
    tree: &'a Tree,
    curves: &'a Curves<'a>,
    rigging: &'a Rigging,
    /// Time of the first key.
    start: f64,
    /// Nodes that the hips hang on, from the top.
    above: Vec<usize>,
}

impl<'a> Keyed<'a> {
    fn new(
        binding: &'a Binding,
        clip: &'a Clip,
        tree: &'a Tree,
        curves: &'a Curves<'a>,
        rigging: &'a Rigging,
        start: f64,
    ) -> Self {
        let mut above: Vec<usize> = tree.up(rigging.body[binding.joints[0]]).skip(1).collect();
        above.reverse();
        Self { binding, clip, tree, curves, rigging, start, above }
    }

    /// The nodes, in the order of [`Self::all`].
    fn nodes(&self) -> impl Iterator<Item = usize> + '_ {
        let body = self.binding.joints.iter().map(|&joint| self.rigging.body[joint]);
        self.above.iter().copied().chain(body)
    }

    /// Each node with its keys.
    fn all(&self) -> impl Iterator<Item = (usize, Keys)> + '_ {
        let carrier = self.above.iter().fold(Isometry3::identity(), |sum, &n| sum * self.held(n)).inverse();
        let above = self.above.iter().map(|&node| (node, self.once(node)));
        let body = (0..self.binding.joints.len()).map(move |s| self.joint(s, &carrier));
        above.chain(body)
    }

    /// The pose of a node as the animation begins.
    fn held(&self, node: usize) -> Isometry3<f64> {
        self.curves.pose(self.tree, self.rigging, node, self.start)
    }

    /// One key for each curve of a node above the hips.
    fn once(&self, node: usize) -> Keys {
        let pose = self.held(node);
        let mut keys = Keys::default();
        if self.curves.rotations.contains_key(&node) {
            keys.rotations.push(numbers(&self.rigging.turn(self.tree, node, &pose.rotation)));
        }
        if self.curves.translations.contains_key(&node) {
            let unit = self.rigging.unit(self.tree, node);
            keys.translations.push(single(&pose.translation.vector.component_div(&unit)));
        }
        keys
    }

    /// The keys of joint number `s` of the clip; `carrier` takes the hips into the space of their parent.
    fn joint(&self, s: usize, carrier: &Isometry3<f64>) -> (usize, Keys) {
        let Self { binding, clip, tree, curves, rigging, .. } = self;
        let node = rigging.body[binding.joints[s]];
        let unit = rigging.unit(tree, node);
        let mut keys = Keys::default();
        for frame in &clip.frames {
            let place =
                if s == 0 { frame.root } else { binding.skeleton.offsets[s] } / binding.unit().metres();
            let pose = Isometry3::from_parts(place.into(), frame.rotations[s]);
            let pose = if s == 0 { carrier * pose } else { pose };
            keys.rotations.push(numbers(&rigging.turn(tree, node, &pose.rotation)));
            keys.translations.push(single(&pose.translation.vector.component_div(&unit)));
        }
        continuous(&mut keys.rotations);
        shorten(&mut keys.rotations);
        shorten(&mut keys.translations);
        let rest = rigging.turn(tree, node, &tree.nodes[node].rotation.unwrap_or_default());
        let off = clip.frames.iter().map(|f| f.rotations[s].angle_to(&rest)).fold(0.0, f64::max);
        if s > 0 && off <= AT_REST && !curves.rotations.contains_key(&node) {
            keys.rotations.clear();
        }
        if s > 0 && !curves.translations.contains_key(&node) {
            keys.translations.clear();
        }
        (node, keys)
    }
}

fn numbers(q: &UnitQuaternion<f64>) -> [f32; 4] {
    [q.i as f32, q.j as f32, q.k as f32, q.w as f32]
}

/// Chooses the sign of each quaternion that is nearer to the one before.
fn continuous(rotations: &mut [[f32; 4]]) {
    for i in 1..rotations.len() {
        let dot: f32 = rotations[i - 1].iter().zip(&rotations[i]).map(|(a, b)| a * b).sum();
        if dot < 0.0 {
            rotations[i] = rotations[i].map(|x| -x);
        }
    }
}

/// One key for values that stay the same.
fn shorten<const N: usize>(values: &mut Vec<[f32; N]>) {
    let near = |value: &[f32; N]| value.iter().zip(&values[0]).all(|(a, b)| (a - b).abs() <= SAME);
    if values.iter().all(near) {
        values.truncate(1);
    }
}

/// Removes the animation's curves of the pose of those nodes, and all samplers that are then unused.
fn keep_others(animation: &mut Value, replaced: &HashSet<usize>) {
    let old: Vec<Value> = animation["samplers"].as_array().cloned().unwrap_or_default();
    let mut samplers = Vec::new();
    let mut moved: HashMap<usize, usize> = HashMap::new();
    let is_pose = |path: &Value| ["translation", "rotation", "scale"].iter().any(|p| path == p);
    let number = |value: &Value| value.as_u64().and_then(|n| usize::try_from(n).ok());
    if let Some(channels) = animation["channels"].as_array_mut() {
        channels.retain_mut(|channel| {
            let node = number(&channel["target"]["node"]);
            if is_pose(&channel["target"]["path"]) && node.is_some_and(|n| replaced.contains(&n)) {
                return false;
            }
            let Some((index, sampler)) = number(&channel["sampler"]).and_then(|i| Some((i, old.get(i)?)))
            else {
                return false;
            };
            let place = *moved.entry(index).or_insert_with(|| {
                samplers.push(sampler.clone());
                samplers.len() - 1
            });
            channel["sampler"] = json!(place);
            true
        });
    }
    animation["samplers"] = Value::Array(samplers);
}

/// Adds a curve to an animation.
fn channel(animation: &mut Value, node: usize, path: &str, input: usize, output: usize) {
    let samplers = list(animation, "samplers");
    samplers.push(json!({"input": input, "output": output, "interpolation": "LINEAR"}));
    let sampler = samplers.len() - 1;
    list(animation, "channels").push(json!({"sampler": sampler, "target": {"node": node, "path": path}}));
}

/// Gives a node its translation, rotation and scale instead of a matrix, which an animated node may not have.
fn spell_out(json: &mut Value, node: Option<gltf::Node<'_>>) {
    let (Some(object), Some(node)) = (json.as_object_mut(), node) else { return };
    if object.shift_remove("matrix").is_none() {
        return;
    }
    let (translation, rotation, scale) = node.transform().decomposed();
    for (key, value) in
        [("translation", json!(translation)), ("rotation", json!(rotation)), ("scale", json!(scale))]
    {
        object.insert(key.into(), value);
    }
}

/// An array of an object, made where it is not there.
fn list<'a>(json: &'a mut Value, key: &str) -> &'a mut Vec<Value> {
    if !json[key].is_array() {
        json[key] = json!([]);
    }
    json[key].as_array_mut().expect("it was made")
}

/// New accessors, all into one new view of a buffer.
struct Accessors<'a> {
    json: &'a mut Value,
    data: &'a mut Vec<u8>,
    view: usize,
}

impl Accessors<'_> {
    /// Adds numbers; returns the accessor. Times state their bounds.
    fn push<const N: usize>(&mut self, kind: &str, rows: &[[f32; N]], bounds: bool) -> usize {
        let mut accessor = json!({
            "bufferView": self.view, "byteOffset": self.data.len(), "componentType": FLOAT,
            "count": rows.len(), "type": kind,
        });
        if let (true, [first, ..], [.., last]) = (bounds, rows, rows) {
            accessor["min"] = json!(first.as_slice());
            accessor["max"] = json!(last.as_slice());
        }
        self.data.extend(rows.iter().flatten().flat_map(|x| x.to_le_bytes()));
        let accessors = list(self.json, "accessors");
        accessors.push(accessor);
        accessors.len() - 1
    }
}

impl Container<'_> {
    /// Appends bytes as a new view: to the binary part, or else as a buffer of its own within the JSON.
    pub(super) fn append(&mut self, data: Vec<u8>) -> Result<(), GltfErrorKind> {
        let length = data.len();
        let own = &mut self.json["buffers"][0];
        let (buffer, offset) = match &mut self.bin {
            Some(bin) if own.is_object() && own["uri"].is_null() => {
                let used = own["byteLength"].as_u64().and_then(|n| usize::try_from(n).ok());
                bin.resize(aligned(used.unwrap_or(bin.len()).min(bin.len())), 0);
                let offset = bin.len();
                bin.reserve_exact(length);
                bin.extend(data);
                own["byteLength"] = json!(bin.len());
                (0, offset)
            }
            _ => {
                let uri = format!("data:application/octet-stream;base64,{}", BASE64.encode(data));
                let buffers = list(&mut self.json, "buffers");
                buffers.push(json!({"byteLength": length, "uri": uri}));
                (buffers.len() - 1, 0)
            }
        };
        let view = json!({"buffer": buffer, "byteOffset": offset, "byteLength": length});
        list(&mut self.json, "bufferViews").push(view);
        Ok(())
    }

    /// Puts the files that buffers and images refer to into the JSON.
    fn embed(&mut self, folder: &std::path::Path) -> Result<(), GltfErrorKind> {
        for key in ["buffers", "images"] {
            for item in self.json.get_mut(key).and_then(Value::as_array_mut).into_iter().flatten() {
                let Some(uri) = item["uri"].as_str().filter(|uri| !uri.starts_with("data:")) else {
                    continue;
                };
                let bytes = fetch(uri, &|name| beside(folder, name))
                    .map_err(|e| GltfErrorKind::NotCopied { uri: uri.to_owned(), reason: e.to_string() })?;
                let ending = uri.rsplit_once('.').map_or("", |(_, ending)| ending).to_ascii_lowercase();
                let image = IMAGES.iter().find(|(e, _)| *e == ending).map(|(_, media)| *media);
                let media = match key {
                    "buffers" => "application/octet-stream",
                    _ => item["mimeType"].as_str().or(image).unwrap_or("application/octet-stream"),
                };
                item["uri"] = json!(format!("data:{media};base64,{}", BASE64.encode(bytes)));
            }
        }
        Ok(())
    }
}
