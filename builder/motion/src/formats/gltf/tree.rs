//! The hierarchy of nodes, and the body that an animation moves.

use std::collections::{HashMap, HashSet};

use gltf::Document;
use nalgebra::{UnitQuaternion, Vector3};

use crate::formats::bvh::{MAX_DEPTH, NOT_IN_NAMES};
use crate::formats::gltf::{curve::unit, document::unique, error::GltfErrorKind};
use crate::names;

/// Greatest difference of the scales of three axes, as a fraction.
const UNEVEN: f64 = 0.01;

/// A node at rest.
#[derive(Debug, Clone)]
pub struct Node {
    /// Its name, unique in the file.
    pub name: String,
    /// Its parent.
    pub parent: Option<usize>,
    /// Translation in its parent's frame, the parent's units.
    pub translation: Vector3<f64>,
    /// Rotation in its parent's frame, unless it is written as zeros.
    pub rotation: Option<UnitQuaternion<f64>>,
    /// Scale along each axis.
    pub scale: [f64; 3],
    /// Whether it is drawn or looked through: a mesh, a camera.
    pub is_thing: bool,
}

/// All nodes of a file.
#[derive(Debug)]
pub struct Tree {
    /// In the order of the file.
    pub nodes: Vec<Node>,
    /// Children of each.
    children: Vec<Vec<usize>>,
    /// Joints of each skin.
    skins: Vec<Vec<usize>>,
}

impl Tree {
    /// # Errors
    /// Nodes with several parents, cycles, and a hierarchy that is too deep.
    pub fn new(document: &Document) -> Result<Self, GltfErrorKind> {
        let names = unique(document.nodes().map(|node| {
            let name = node.name().unwrap_or("").trim().replace(NOT_IN_NAMES, "_");
            if name.is_empty() { format!("node{}", node.index()) } else { name }
        }));
        let at_rest = |(node, name): (gltf::Node<'_>, String)| {
            let (t, r, s) = node.transform().decomposed();
            Node {
                name,
                parent: None,
                translation: t.map(f64::from).into(),
                rotation: unit(r.map(f64::from).into()),
                scale: s.map(f64::from),
                is_thing: node.mesh().is_some() || node.camera().is_some(),
            }
        };
        let mut nodes: Vec<Node> = document.nodes().zip(names).map(at_rest).collect();
        let mut children = vec![Vec::new(); nodes.len()];
        for node in document.nodes() {
            for child in node.children() {
                children[node.index()].push(child.index());
                if nodes[child.index()].parent.replace(node.index()).is_some() {
                    return Err(GltfErrorKind::NoTree { node: nodes[child.index()].name.clone() });
                }
            }
        }
        let skins = document.skins().map(|s| s.joints().map(|j| j.index()).collect()).collect();
        let tree = Self { nodes, children, skins };
        let all = 0..tree.nodes.len();
        if let Some(node) = all.clone().find(|&n| tree.up(n).skip(1).take(MAX_DEPTH).any(|above| above == n))
        {
            return Err(GltfErrorKind::NoTree { node: tree.nodes[node].name.clone() });
        }
        if all.into_iter().any(|n| tree.up(n).nth(MAX_DEPTH).is_some()) {
            return Err(GltfErrorKind::TooDeep { limit: MAX_DEPTH });
        }
        Ok(tree)
    }

    /// A node, its parent, and so on to the top.
    pub fn up(&self, node: usize) -> impl Iterator<Item = usize> + '_ {
        std::iter::successors(Some(node), |&n| self.nodes[n].parent)
    }

    fn is_below(&self, node: usize, top: usize) -> bool {
        self.up(node).any(|n| n == top)
    }

    /// The lowest common ancestor of the nodes, which may be one of them.
    fn common(&self, nodes: &[usize]) -> Option<usize> {
        self.up(*nodes.first()?).find(|&top| nodes.iter().all(|&n| self.is_below(n, top)))
    }

    /// The joints of the body that an animation of these nodes moves, depth first; the first is the ancestor of all. They
    /// are the joints of the largest skin that it moves and of skins below it, or without a skin the nodes themselves and
    /// those below them, which need not turn in this animation; of one that moves the upper body alone, with the rest of it;
    /// with all nodes between them.
    pub fn body(&self, moved: &[usize]) -> Vec<usize> {
        let moving: HashSet<usize> = moved.iter().copied().collect();
        let is_moved = |skin: &&Vec<usize>| skin.iter().any(|j| moving.contains(j));
        let largest = self.skins.iter().filter(is_moved).max_by_key(|skin| skin.len());
        let mut wanted: Vec<usize> = match largest {
            Some(skin) => match self.common(skin) {
                Some(top) => {
                    let below = |skin: &&Vec<usize>| self.common(skin).is_some_and(|n| self.is_below(n, top));
                    self.skins.iter().filter(is_moved).filter(below).flatten().copied().collect()
                }
                None => skin.clone(),
            },
            None => {
                let is_below = |n: usize| self.up(n).any(|n| moving.contains(&n));
                let is_of_body = |&n: &usize| moving.contains(&n) || !self.nodes[n].is_thing && is_below(n);
                let of_body: Vec<usize> = (0..self.nodes.len()).filter(is_of_body).collect();
                let with_legs = if self.have_legs(&of_body) { Vec::new() } else { self.around(&of_body) };
                if self.have_legs(&with_legs) { with_legs } else { of_body }
            }
        };
        if self.common(&wanted).is_none() {
            // Several trees: the one with most of the nodes.
            let root = |n: usize| self.up(n).last();
            let mut sizes: HashMap<Option<usize>, usize> = HashMap::new();
            for &node in &wanted {
                *sizes.entry(root(node)).or_default() += 1;
            }
            let in_tree_of = |n: usize| sizes[&root(n)];
            if let Some(most) = wanted.iter().copied().max_by_key(|&n| (in_tree_of(n), std::cmp::Reverse(n)))
            {
                let most = root(most);
                wanted.retain(|&n| root(n) == most);
            }
        }
        let Some(top) = self.common(&wanted) else { return Vec::new() };
        let mut members: HashSet<usize> = HashSet::from([top]);
        for node in wanted {
            members.extend(self.up(node).take_while(|&n| n != top));
        }
        let mut order = Vec::with_capacity(members.len());
        let mut open = vec![top];
        while let Some(node) = open.pop() {
            order.push(node);
            open.extend(self.children[node].iter().rev().filter(|n| members.contains(n)));
        }
        order
    }

    fn have_legs(&self, nodes: &[usize]) -> bool {
        nodes.iter().any(|&n| names::names().is_leg(&self.nodes[n].name))
    }

    /// The nodes of the trees that hold some of these, without things.
    fn around(&self, nodes: &[usize]) -> Vec<usize> {
        let root = |n: usize| self.up(n).last();
        let roots: HashSet<Option<usize>> = nodes.iter().map(|&n| root(n)).collect();
        (0..self.nodes.len()).filter(|&n| !self.nodes[n].is_thing && roots.contains(&root(n))).collect()
    }

    /// The topmost node of another body that an animation of those nodes moves besides `body`, if there is one: of a
    /// skin that shares no joint with it and has at least half as many.
    pub fn other_body(&self, moved: &[usize], body: &[usize]) -> Option<usize> {
        let (moving, taken): (HashSet<usize>, HashSet<usize>) =
            (moved.iter().copied().collect(), body.iter().copied().collect());
        let is_other = |skin: &&Vec<usize>| {
            2 * skin.len() >= body.len()
                && skin.iter().any(|j| moving.contains(j))
                && !skin.iter().any(|j| taken.contains(j))
        };
        self.skins.iter().filter(is_other).find_map(|skin| self.common(skin))
    }

    /// The scale of a node: as large along all axes, with a sign for each, since mirrored nodes have negative ones.
    ///
    /// # Errors
    /// A scale whose size differs between axes.
    pub fn scale(&self, node: usize) -> Result<Vector3<f64>, GltfErrorKind> {
        let scale = Vector3::from(self.nodes[node].scale);
        let size = scale.abs();
        let even = size.x > 1e-9 && size.iter().all(|s| (s / size.x - 1.0).abs() <= UNEVEN);
        if even && size.x.is_finite() {
            Ok(scale.map(|s| size.mean().copysign(s)))
        } else {
            Err(GltfErrorKind::Scale { node: self.nodes[node].name.clone(), scale: scale.into() })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Chains of three nodes, each a skin of its own.
    fn chains(count: usize) -> Tree {
        let node = |n: usize| Node {
            name: format!("N{n}"),
            parent: (!n.is_multiple_of(3)).then(|| n - 1),
            translation: Vector3::zeros(),
            rotation: Some(UnitQuaternion::identity()),
            scale: [1.0; 3],
            is_thing: false,
        };
        let children = |n: usize| if n % 3 < 2 { vec![n + 1] } else { Vec::new() };
        Tree {
            nodes: (0..3 * count).map(node).collect(),
            children: (0..3 * count).map(children).collect(),
            skins: (0..count).map(|c| vec![3 * c, 3 * c + 1, 3 * c + 2]).collect(),
        }
    }

    /// Arms alone were the body, of which no legs were found.
    #[test]
    fn an_upper_body_that_moves_alone_has_legs() {
        let mut tree = chains(2);
        tree.skins.clear();
        // A root above an arm and a leg, and a camera.
        tree.nodes[3].parent = Some(0);
        tree.children[0].push(3);
        for (node, name) in
            [(1, "LeftArm"), (2, "LeftForeArm"), (3, "LeftUpLeg"), (4, "LeftLeg"), (5, "Camera")]
        {
            tree.nodes[node].name = name.to_owned();
        }
        tree.nodes[5].is_thing = true;
        assert_eq!(tree.body(&[1, 2]), [0, 1, 2, 3, 4]);
        assert_eq!(tree.body(&[3]), [3, 4]);
        tree.nodes[3].name = "Tail".to_owned();
        tree.nodes[4].name = "Tail2".to_owned();
        assert_eq!(tree.body(&[1, 2]), [1, 2]);
    }

    #[test]
    fn another_body_that_moves_is_found() {
        let tree = chains(3);
        let moved = [0, 1, 4];
        let body = tree.body(&moved);
        let other = if body[0] == 0 { 3 } else { 0 };
        assert_eq!(body, [3 - other, 4 - other, 5 - other]);
        // The third body does not move.
        assert_eq!(tree.other_body(&moved, &body), Some(other));
        assert_eq!(tree.other_body(&body, &body), None);
    }
}
