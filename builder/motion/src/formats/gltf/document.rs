//! The file's JSON, reduced to its motion and checked.
//!
//! Only what is listed here is kept, so that errors in meshes and materials do not prevent reading the motion, and so that
//! these take no memory. An index of a list that is not there is an error before any code follows it.

use std::{collections::HashMap, fmt};

use gltf::{
    Document,
    animation::{Animation, Property},
    json::{
        self, Root,
        validation::{Checked, Error::Missing, Validate},
    },
};
use serde::{
    Deserialize, Deserializer,
    de::{Error, SeqAccess, Visitor},
};

use super::{container::Chunks, error::GltfErrorKind, packed::Packed};
use crate::files::memory;

/// Most nodes of a file; they are the largest objects.
const MAX_NODES: usize = 1 << 16;
/// Memory of an object of the JSON, bytes: an accessor.
const OBJECT_BYTES: usize = 256;
/// Memory of a number or text in a list, bytes.
const ITEM_BYTES: usize = 24;

/// What a file holds.
pub struct Content<'a> {
    /// Its motion.
    pub document: Document,
    /// Views whose bytes are packed, by their numbers.
    pub packed: HashMap<usize, Packed>,
    /// Its binary part.
    pub bin: Option<&'a [u8]>,
    /// Length of the file, bytes.
    pub size: usize,
}

/// Parses and checks a file.
pub fn content(bytes: &[u8]) -> Result<Content<'_>, GltfErrorKind> {
    let wrong = |e: &dyn std::fmt::Display| GltfErrorKind::NotGltf(e.to_string());
    let Chunks { json: text, bin, .. } = Chunks::of(bytes)?;
    let needed = weight(text);
    if needed > memory::max_bytes(bytes.len()) {
        return Err(GltfErrorKind::TooMuch { megabytes: needed >> 20 });
    }
    let mut motion: Motion = serde_json::from_slice(text).map_err(|e| match first_version(text) {
        true => GltfErrorKind::FirstVersion,
        false => wrong(&e),
    })?;
    let views = motion.buffer_views.iter_mut().enumerate();
    let packed = views.filter_map(|(v, view)| Some((v, view.extensions.packed()?))).collect();
    let root = motion.root().map_err(|place| wrong(&format!("{place}: Index out of bounds")))?;
    valid(&root).map_err(|e| wrong(&e))?;
    Ok(Content { document: Document::from_json_without_validation(root), packed, bin, size: bytes.len() })
}

/// Whether a JSON text says that it is glTF 1.0, whose lists are objects.
fn first_version(text: &[u8]) -> bool {
    #[derive(Deserialize)]
    struct Stated {
        asset: json::Asset,
    }
    serde_json::from_slice::<Stated>(text).is_ok_and(|stated| stated.asset.version.starts_with("1."))
}

/// Checks the JSON, but for accessors without data: these are zeros, or packed with a mesh as Draco's are.
fn valid(root: &Root) -> Result<(), gltf::Error> {
    let mut errors = Vec::new();
    root.validate(root, json::Path::new, &mut |path, error| errors.push((path(), error)));
    errors.retain(|(path, error)| !(*error == Missing && path.as_str().ends_with("].bufferView")));
    if errors.is_empty() { Ok(()) } else { Err(gltf::Error::Validation(errors)) }
}

/// Memory that a JSON text takes at most when it is read, bytes.
fn weight(text: &[u8]) -> usize {
    let (mut bytes, mut inside, mut escaped) = (0, false, false);
    for &c in text {
        match c {
            _ if escaped => escaped = false,
            b'\\' if inside => escaped = true,
            b'"' => inside = !inside,
            _ if inside => {}
            b'{' => bytes += OBJECT_BYTES,
            b',' | b'[' => bytes += ITEM_BYTES,
            _ => {}
        }
    }
    bytes
}

/// The parts of a file that are about motion.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Motion {
    asset: json::Asset,
    #[serde(default, deserialize_with = "nodes")]
    nodes: Vec<NodeJson>,
    #[serde(default)]
    skins: Vec<SkinJson>,
    #[serde(default)]
    animations: Vec<AnimationJson>,
    #[serde(default)]
    accessors: Vec<AccessorJson>,
    #[serde(default)]
    buffer_views: Vec<ViewJson>,
    #[serde(default)]
    buffers: Vec<json::Buffer>,
}

#[derive(Deserialize)]
struct NodeJson {
    name: Option<String>,
    children: Option<Vec<json::Index<json::Node>>>,
    matrix: Option<[f32; 16]>,
    translation: Option<[f32; 3]>,
    rotation: Option<json::scene::UnitQuaternion>,
    scale: Option<[f32; 3]>,
}

/// The nodes, of which more than [`MAX_NODES`] are an error before they take memory.
fn nodes<'d, D: Deserializer<'d>>(from: D) -> Result<Vec<NodeJson>, D::Error> {
    struct Nodes;
    impl<'d> Visitor<'d> for Nodes {
        type Value = Vec<NodeJson>;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "a list of at most {MAX_NODES} nodes")
        }
        fn visit_seq<A: SeqAccess<'d>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let mut nodes = Vec::new();
            while let Some(node) = list.next_element()? {
                nodes.push(node);
                if nodes.len() > MAX_NODES {
                    return Err(A::Error::invalid_length(nodes.len(), &self));
                }
            }
            Ok(nodes)
        }
    }
    from.deserialize_seq(Nodes)
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct SkinJson {
    name: Option<String>,
    #[serde(default)]
    joints: Vec<json::Index<json::Node>>,
    inverse_bind_matrices: Option<json::Index<json::Accessor>>,
}

#[derive(Deserialize)]
struct AnimationJson {
    name: Option<String>,
    channels: Vec<ChannelJson>,
    samplers: Vec<json::animation::Sampler>,
}

#[derive(Deserialize)]
struct ChannelJson {
    sampler: json::Index<json::animation::Sampler>,
    target: TargetJson,
}

#[derive(Deserialize)]
struct TargetJson {
    node: Option<json::Index<json::Node>>,
    #[serde(default)]
    path: PathJson,
}

/// What a channel moves. Morph targets and what extensions add do not move a body.
#[derive(Deserialize, Default, Clone, Copy)]
#[serde(rename_all = "camelCase")]
enum PathJson {
    Translation,
    Rotation,
    Scale,
    #[default]
    #[serde(other)]
    Other,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct AccessorJson {
    buffer_view: Option<json::Index<json::buffer::View>>,
    byte_offset: Option<json::validation::USize64>,
    count: json::validation::USize64,
    component_type: Checked<json::accessor::GenericComponentType>,
    #[serde(rename = "type")]
    kind: Checked<json::accessor::Type>,
    #[serde(default)]
    normalized: bool,
    sparse: Option<json::accessor::sparse::Sparse>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct ViewJson {
    buffer: json::Index<json::Buffer>,
    byte_length: json::validation::USize64,
    byte_offset: Option<json::validation::USize64>,
    byte_stride: Option<json::buffer::Stride>,
    #[serde(default)]
    extensions: ViewExtensions,
}

/// The extensions that pack views. The second is the first, with one more version of a codec.
#[derive(Deserialize, Default)]
struct ViewExtensions {
    #[serde(rename = "EXT_meshopt_compression")]
    ext: Option<Packed>,
    #[serde(rename = "KHR_meshopt_compression")]
    khr: Option<Packed>,
}

impl ViewExtensions {
    fn packed(&mut self) -> Option<Packed> {
        self.khr.take().or_else(|| self.ext.take())
    }
}

impl Motion {
    /// As the library's own structure; an index that points nowhere is named by its place.
    fn root(self) -> Result<Root, String> {
        let count = self.nodes.len();
        let all_there = |list: &[json::Index<json::Node>]| list.iter().all(|i| i.value() < count);
        for (n, node) in self.nodes.iter().enumerate() {
            if !node.children.as_deref().is_none_or(all_there) {
                return Err(format!("nodes[{n}].children"));
            }
        }
        if let Some(s) = self.skins.iter().position(|skin| !all_there(&skin.joints)) {
            return Err(format!("skins[{s}].joints"));
        }
        let animations = self.animations.into_iter().enumerate();
        let accessors = self.accessors.len();
        Ok(Root {
            asset: self.asset,
            nodes: self.nodes.into_iter().map(NodeJson::whole).collect(),
            skins: self.skins.into_iter().map(|skin| skin.whole(accessors)).collect(),
            animations: animations
                .map(|(a, animation)| animation.whole(a, count))
                .collect::<Result<_, _>>()?,
            accessors: self.accessors.into_iter().map(AccessorJson::whole).collect(),
            buffer_views: self.buffer_views.into_iter().map(ViewJson::whole).collect(),
            buffers: self.buffers,
            ..Root::default()
        })
    }
}

impl NodeJson {
    fn whole(self) -> json::Node {
        let Self { name, children, matrix, translation, rotation, scale } = self;
        json::Node { name, children, matrix, translation, rotation, scale, ..json::Node::default() }
    }
}

impl SkinJson {
    fn whole(self, accessors: usize) -> json::Skin {
        json::Skin {
            name: self.name,
            joints: self.joints,
            extensions: None,
            extras: json::Extras::default(),
            // A clip does without them, so that an index that points nowhere is no error.
            inverse_bind_matrices: self.inverse_bind_matrices.filter(|index| index.value() < accessors),
            skeleton: None,
        }
    }
}

impl AnimationJson {
    fn whole(self, animation: usize, nodes: usize) -> Result<json::Animation, String> {
        let mut channels = Vec::new();
        for (c, ChannelJson { sampler, target }) in self.channels.into_iter().enumerate() {
            let path = match target.path {
                PathJson::Translation => Property::Translation,
                PathJson::Rotation => Property::Rotation,
                PathJson::Scale => Property::Scale,
                PathJson::Other => continue,
            };
            let Some(node) = target.node else { continue };
            // Not checked by `from_json`.
            if node.value() >= nodes {
                return Err(format!("animations[{animation}].channels[{c}].target.node"));
            }
            let [extras, outer] = [json::Extras::default(), json::Extras::default()];
            let path = Checked::Valid(path);
            let target = json::animation::Target { node, path, extensions: None, extras };
            channels.push(json::animation::Channel { sampler, target, extensions: None, extras: outer });
        }
        let (name, samplers) = (self.name, self.samplers);
        Ok(json::Animation { name, channels, samplers, extensions: None, extras: json::Extras::default() })
    }
}

impl ViewJson {
    fn whole(self) -> json::buffer::View {
        json::buffer::View {
            buffer: self.buffer,
            byte_length: self.byte_length,
            byte_offset: self.byte_offset,
            byte_stride: self.byte_stride,
            name: None,
            target: None,
            extensions: None,
            extras: json::Extras::default(),
        }
    }
}

impl AccessorJson {
    fn whole(self) -> json::Accessor {
        json::Accessor {
            buffer_view: self.buffer_view,
            byte_offset: self.byte_offset,
            count: self.count,
            component_type: self.component_type,
            type_: self.kind,
            normalized: self.normalized,
            sparse: self.sparse,
            min: None,
            max: None,
            name: None,
            extensions: None,
            extras: json::Extras::default(),
        }
    }
}

/// Unique names of the animations; those without one are numbered.
pub fn names(document: &Document) -> Vec<String> {
    let own = |animation: Animation<'_>| {
        let name = animation.name().map(|n| n.trim().replace(char::is_control, "_"));
        name.filter(|n| !n.is_empty()).unwrap_or_else(|| format!("animation{}", animation.index()))
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
