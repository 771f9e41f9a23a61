//! From curves to poses at a fixed rate.

use std::collections::{HashMap, HashSet};

use gltf::animation::{Animation, Property};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion, Vector3};

use super::{
    curve::Curve,
    data::{Buffers, Open},
    document::{content, names},
    error::{GltfError, GltfErrorKind},
    tree::Tree,
};
use crate::{
    animation::{Animation as Motion, Joint, Recording},
    binding::ConvertError,
    clip::{FRAME_BYTES, MAX_FRAMES, ROTATION_BYTES},
    formats::bvh::{MAX_JOINTS, MAX_LENGTH},
    unit::Unit,
};

/// Rates at which keys are taken for captured or baked frames, Hz.
const RATES: std::ops::RangeInclusive<f64> = 20.0..=240.0;
/// The rate of curves with fewer keys, Hz.
const RESAMPLED: f64 = 60.0;
/// Least translation of an inner joint that counts as movement, metres.
const STILL_M: f64 = 1e-6;
/// Change of a scale that is noted, as a fraction.
const RESCALED: f64 = 0.01;

/// The animations in the bytes of a file. `open` reads a file beside it.
///
/// # Errors
/// As [`read`](super::read).
pub fn parse(bytes: &[u8], file: &str, open: &Open<'_>) -> Result<Vec<(String, Motion)>, GltfError> {
    animations(bytes, file, open, None).map_err(|kind| GltfError { file: file.to_owned(), kind })
}

/// The animations of a file, or with `only` that of the name in it, or the only one.
pub fn animations(
    bytes: &[u8],
    file: &str,
    open: &Open<'_>,
    only: Option<Option<&str>>,
) -> Result<Vec<(String, Motion)>, GltfErrorKind> {
    let content = content(bytes)?;
    let document = &content.document;
    let tree = Tree::new(document)?;
    let buffers = Buffers::new(&content, open);
    // Animations without rotations, as of cameras, doors and faces, have no skeleton.
    let turns = |a: &Animation<'_>| a.channels().any(|c| c.target().property() == Property::Rotation);
    let mut all: Vec<(Animation<'_>, String)> =
        document.animations().zip(names(document)).filter(|(animation, _)| turns(animation)).collect();
    let alone = all.len() == 1;
    if only.flatten().is_none() && are_one_by_one(&all) {
        return Err(GltfErrorKind::OneByOne { animations: all.len() });
    }
    // As the names in messages are.
    let only = only.map(|wanted| wanted.map(str::trim));
    if let Some(wanted) = only {
        let names = || all.iter().map(|(_, name)| name.clone()).collect();
        match wanted {
            Some(wanted) if !all.iter().any(|(_, name)| name == wanted) => {
                return Err(GltfErrorKind::NoSuch { wanted: wanted.to_owned(), names: names() });
            }
            None if all.len() > 1 => {
                return Err(GltfErrorKind::Several { file: file.to_owned(), names: names() });
            }
            _ => all.retain(|(_, name)| wanted.is_none_or(|wanted| name == wanted)),
        }
    }
    let mut found = Vec::new();
    for (animation, name) in all {
        let curves = Curves::read(&animation, &name, &tree, &buffers)?;
        let title = if alone { file.to_owned() } else { format!("{file}#{name}") };
        let motion = curves.document(&tree, &name, &title, buffers.room())?;
        buffers.take(memory_of(motion.frames(), motion.joints.len()));
        found.push((name, motion));
    }
    if found.is_empty() { Err(GltfErrorKind::NoMotion) } else { Ok(found) }
}

/// Whether several animations move one node each, all of them different ones.
fn are_one_by_one(all: &[(Animation<'_>, String)]) -> bool {
    let nodes = |animation: &Animation<'_>| -> HashSet<usize> {
        animation.channels().map(|channel| channel.target().node().index()).collect()
    };
    let mut seen = HashSet::new();
    all.len() > 1
        && all.iter().all(|(animation, _)| {
            let nodes = nodes(animation);
            nodes.len() == 1 && nodes.into_iter().all(|node| seen.insert(node))
        })
}

/// Memory of an animation and of the clip that is made of it, bytes.
fn memory_of(frames: usize, joints: usize) -> usize {
    let pose = size_of::<Isometry3<f64>>() + ROTATION_BYTES;
    frames.saturating_mul(FRAME_BYTES.saturating_add(joints.saturating_mul(pose)))
}

/// The curves of an animation, by node.
#[derive(Default)]
pub struct Curves<'b> {
    pub translations: HashMap<usize, Curve<'b, 3>>,
    pub rotations: HashMap<usize, Curve<'b, 4>>,
    notes: Vec<String>,
    /// Animated nodes, in the animation's order.
    pub moved: Vec<usize>,
}

impl<'b> Curves<'b> {
    pub fn read(
        animation: &Animation<'_>,
        name: &str,
        tree: &Tree,
        buffers: &'b Buffers<'_>,
    ) -> Result<Self, GltfErrorKind> {
        let mut curves = Self::default();
        let mut seen = HashSet::new();
        for channel in animation.channels() {
            let (target, sampler) = (channel.target(), channel.sampler());
            let (node, interpolation) = (target.node().index(), sampler.interpolation());
            let whose = || format!("animation `{name}`, node `{}`", tree.nodes[node].name);
            let place = |what| GltfErrorKind::Curve { place: whose(), what };
            let times = || buffers.times(&sampler.input())?.map_err(place);
            let vectors = || {
                Curve::new(times()?, buffers.floats::<3>(&sampler.output())?, interpolation).map_err(place)
            };
            match target.property() {
                Property::Translation => {
                    curves.translations.insert(node, vectors()?);
                }
                Property::Rotation => {
                    let curve = Curve::new(times()?, buffers.floats::<4>(&sampler.output())?, interpolation);
                    let curve = curve.map_err(place)?;
                    if !curve.turns() {
                        return Err(GltfErrorKind::NoRotation { place: whose() });
                    }
                    curves.rotations.insert(node, curve);
                }
                Property::Scale => {
                    curves.note_scale(&tree.nodes[node], &vectors()?);
                    continue;
                }
                // Removed before.
                Property::MorphTargetWeights => continue,
            }
            if seen.insert(node) {
                curves.moved.push(node);
            }
        }
        Ok(curves)
    }

    /// Notes a node whose scale is animated: bones have constant lengths.
    fn note_scale(&mut self, node: &super::tree::Node, curve: &Curve<'_, 3>) {
        let off =
            |t: &f64| (curve.vector(*t) - Vector3::from(node.scale)).amax() > RESCALED * node.scale[0].abs();
        if curve.times().iter().any(off) {
            self.notes.push(format!("the scale of {} is animated; the scale at rest is used", node.name));
        }
    }

    /// The times of all curves of those nodes.
    fn times<'a>(&'a self, nodes: &'a [usize]) -> impl Iterator<Item = &'a [f64]> {
        let translations = nodes.iter().filter_map(|n| self.translations.get(n).map(Curve::times));
        translations.chain(nodes.iter().filter_map(|n| self.rotations.get(n).map(Curve::times)))
    }

    /// First and last time over all curves of the body, and the rate.
    pub fn timeline(&self, nodes: &[usize]) -> (f64, f64, f64) {
        let all: Vec<&[f64]> = self.times(nodes).collect();
        let start = all.iter().map(|t| t[0]).fold(f64::INFINITY, f64::min);
        let end = all.iter().map(|t| t[t.len() - 1]).fold(0.0, f64::max);
        let rate = median_spacing(&all).map_or(RESAMPLED, |s| 1.0 / s);
        let whole = rate.round();
        // Times are written in single precision.
        let rate = if (rate - whole).abs() <= 1e-3 * rate { whole } else { rate };
        (start, end, if RATES.contains(&rate) { rate } else { RESAMPLED })
    }

    /// Checks that something says how each of those nodes is turned: a curve, or the node itself.
    pub fn turn_all<'n>(
        &self,
        tree: &Tree,
        mut nodes: impl Iterator<Item = &'n usize>,
    ) -> Result<(), GltfErrorKind> {
        match nodes.find(|n| tree.nodes[**n].rotation.is_none() && !self.rotations.contains_key(n)) {
            Some(&node) => {
                Err(GltfErrorKind::NoRotation { place: format!("node `{}`", tree.nodes[node].name) })
            }
            None => Ok(()),
        }
    }

    /// A node's pose in its parent, metres.
    pub fn pose(&self, tree: &Tree, rigging: &Rigging, node: usize, time: f64) -> Isometry3<f64> {
        let place = self.translations.get(&node).map_or(tree.nodes[node].translation, |c| c.vector(time));
        let rotation = self.rotations.get(&node).map(|c| c.rotation(time)).or(tree.nodes[node].rotation);
        let place = place.component_mul(&rigging.unit(tree, node));
        Isometry3::from_parts(
            Translation3::from(place),
            rigging.turn(tree, node, &rotation.unwrap_or_default()),
        )
    }

    /// The body's motion as a document.
    pub fn document(
        mut self,
        tree: &Tree,
        name: &str,
        title: &str,
        room: usize,
    ) -> Result<Motion, GltfErrorKind> {
        let rigging = Rigging::of(tree, &self.moved)?;
        let (above, body, top) = (&rigging.above, &rigging.body, rigging.body[0]);
        if let Some(other) = tree.other_body(&self.moved, body) {
            let [other, taken] = [other, top].map(|node| &tree.nodes[node].name);
            self.notes.push(format!(
                "the animation moves several bodies: that of `{taken}` is taken, others, as that of `{other}`, are not"
            ));
        }
        let nodes: Vec<usize> = above.iter().chain(body).copied().collect();
        self.turn_all(tree, nodes.iter())?;
        let (start, end, rate_hz) = self.timeline(&nodes);
        if !start.is_finite() {
            return Err(GltfErrorKind::NoMotion);
        }
        let seconds = end - start;
        let frames = (seconds * rate_hz + 1e-3).floor();
        // Times are untrusted: two keys may be a day apart.
        let most = self.times(&nodes).map(<[f64]>::len).fold(MAX_FRAMES, usize::max) as f64;
        if frames > most || memory_of(frames as usize + 1, body.len()) > room {
            let (animation, joints) = (name.to_owned(), body.len());
            return Err(GltfErrorKind::TooLong { animation, seconds, joints, rate_hz });
        }
        let frames = frames as usize + 1;

        let time = |frame: usize| (start + frame as f64 / rate_hz).min(end);
        let pose = |node: usize, frame: usize| self.pose(tree, &rigging, node, time(frame));
        let place = |node: usize, frame: usize| pose(node, frame).translation.vector;
        let moves = |node: usize| {
            let first = place(node, 0);
            self.translations.contains_key(&node)
                && (1..frames).any(|f| (place(node, f) - first).amax() > STILL_M)
        };
        let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(frames * body.len());
        for f in 0..frames {
            let carrier = above.iter().fold(Isometry3::identity(), |sum, &n| sum * pose(n, f));
            poses.push(carrier * pose(top, f));
            poses.extend(body[1..].iter().map(|&n| pose(n, f)));
        }
        let joint = |(j, &node): (usize, &usize)| {
            let moves = node == top || moves(node);
            Joint {
                name: tree.nodes[node].name.clone(),
                parent: tree.nodes[node].parent.and_then(|p| body.iter().position(|&n| n == p)),
                offset: place(node, 0),
                tips: Vec::new(),
                moves: [moves; 3],
                degrees: if moves { 6 } else { 3 },
                still: still(&poses, j, body.len()),
            }
        };
        let joints: Vec<Joint> = body.iter().enumerate().map(joint).collect();
        check(title, &joints, &poses).map_err(GltfErrorKind::Convert)?;
        let name = title.to_owned();
        Ok(Motion { name, unit: Some(Unit::Metres), rate_hz, notes: self.notes, joints, poses })
    }
}

/// The median time between keys, seconds: a stray key between two frames does not matter. Curves share times, of which there
/// is one copy.
fn median_spacing(curves: &[&[f64]]) -> Option<f64> {
    let mut shared: HashMap<*const f64, (&[f64], usize)> = HashMap::new();
    for &times in curves {
        shared.entry(times.as_ptr()).or_insert((times, 0)).1 += 1;
    }
    let spacings = |(times, curves): (&'_ [f64], usize)| -> Vec<(f64, usize)> {
        times.windows(2).map(|w| (w[1] - w[0], curves)).collect()
    };
    let mut all: Vec<(f64, usize)> = shared.into_values().flat_map(spacings).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = all.iter().map(|(_, curves)| curves).sum::<usize>() / 2;
    let mut before = 0;
    let middle = |(_, curves): &&(f64, usize)| {
        before += curves;
        before > half
    };
    all.iter().find(middle).map(|(spacing, _)| *spacing)
}

/// The nodes that carry a body.
///
/// Nodes below a mirrored one are taken as they look, in axes that are not mirrored: with `M` the signs of the scales above
/// a node, its pose `(t, R)` becomes `(M t, M R M)`, which keeps the place of every joint.
pub struct Rigging {
    /// The nodes above the body, from the top of the file.
    pub above: Vec<usize>,
    /// The body's joints, depth first.
    pub body: Vec<usize>,
    /// Metres per unit along the axes of each of those nodes that has children among them, negative where mirrored.
    scales: HashMap<usize, Vector3<f64>>,
}

impl Rigging {
    /// The nodes of the body that an animation of `moved` moves.
    pub fn of(tree: &Tree, moved: &[usize]) -> Result<Self, GltfErrorKind> {
        let body = tree.body(moved);
        let Some(&top) = body.first() else { return Err(GltfErrorKind::NoMotion) };
        if body.len() > MAX_JOINTS {
            return Err(GltfErrorKind::TooManyJoints { limit: MAX_JOINTS });
        }
        let mut above: Vec<usize> = tree.up(top).skip(1).collect();
        above.reverse();
        let nodes: Vec<usize> = above.iter().chain(&body).copied().collect();
        let mut rigging = Self { above, body, scales: HashMap::new() };
        let parents: HashSet<usize> = nodes.iter().filter_map(|&n| tree.nodes[n].parent).collect();
        for &node in nodes.iter().filter(|n| parents.contains(n)) {
            let scale = rigging.unit(tree, node).component_mul(&tree.scale(node)?);
            rigging.scales.insert(node, scale);
        }
        Ok(rigging)
    }

    /// Metres per unit of a node's translation along each axis, negative where a node above it is mirrored.
    pub fn unit(&self, tree: &Tree, node: usize) -> Vector3<f64> {
        tree.nodes[node].parent.map_or(Vector3::repeat(1.0), |p| self.scales[&p])
    }

    /// A node's rotation in the file as one in axes that are not mirrored, and back.
    pub fn turn(&self, tree: &Tree, node: usize, rotation: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
        let signs = self.unit(tree, node).map(f64::signum);
        // An axis of rotation is a pseudovector.
        let axis = rotation.imag().component_mul(&signs) * signs.product();
        UnitQuaternion::new_unchecked(Quaternion::from_parts(rotation.w, axis))
    }

    /// Whether nodes above one of the body's joints are mirrored.
    pub fn is_mirrored(&self) -> bool {
        self.scales.values().any(|scale| scale.min() < 0.0)
    }
}

/// True if a joint's pose stays within 1e-3 degrees and metres of its first.
fn still(poses: &[Isometry3<f64>], joint: usize, joints: usize) -> bool {
    let first = &poses[joint];
    let near = |pose: &Isometry3<f64>| {
        pose.rotation.angle_to(&first.rotation).to_degrees() <= 1e-3
            && (pose.translation.vector - first.translation.vector).amax() <= 1e-3
    };
    poses.iter().skip(joint).step_by(joints).all(near)
}

/// Refuses numbers that are not finite or too large.
pub fn check(clip: &str, joints: &[Joint], poses: &[Isometry3<f64>]) -> Result<(), ConvertError> {
    let fine = |v: &Vector3<f64>| v.iter().all(|x| x.abs() <= MAX_LENGTH);
    let bad = poses.iter().enumerate().find(|(i, pose)| {
        let joint = &joints[i % joints.len()];
        !fine(&joint.offset)
            || (joint.moves[0] && !fine(&pose.translation.vector))
            || !pose.rotation.coords.iter().all(|x| x.is_finite())
    });
    bad.map_or(Ok(()), |(i, _)| {
        let (frame, joint) = (i / joints.len() + 1, joints[i % joints.len()].name.clone());
        Err(ConvertError::NotFinite { clip: clip.to_owned(), frame, joint })
    })
}
