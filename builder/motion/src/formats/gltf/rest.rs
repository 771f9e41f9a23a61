//! The body at rest, of a character with or without an animation.
//!
//! A file has up to two poses of rest: that in which the mesh was bound to the skeleton (the inverse bind matrices of its
//! skin), and that of its nodes. Exporters often write a frame of some animation as the latter, so the former comes first.
//!
//! Bind matrices are in the space of the mesh, whose axes and unit may differ from the scene's. Its unit is found by the
//! lengths of the bones, its axes by the body's first joint, up to quarter turns: that joint may be turned otherwise in the
//! nodes' pose. Its origin is taken to be the scene's.

use std::{collections::HashMap, path::Path};

use gltf::{Document, Skin};
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};

use super::{
    data::{Buffers, Open},
    document::content,
    error::{GltfError, GltfErrorKind},
    file::beside,
    motion::{Curves, Rigging, check},
    tree::Tree,
};
use crate::{
    animation::{Animation as Motion, Joint},
    files::{self, MAX_MOTION_BYTES},
    formats::bvh::MAX_JOINTS,
    unit::Unit,
};

/// Greatest angle from quarter turns of axes that are taken to be quarter turns, radians.
const QUARTER_RAD: f64 = 0.6;
/// Shortest bone that tells a unit, metres.
const SHORT_M: f64 = 1e-6;
/// Greatest difference of poses that count as the same: radians and metres.
const SAME: f64 = 1e-4;

/// The poses of rest of a file, each as an animation of one frame: that of the bound mesh, if the file has it and it
/// differs, and that of the nodes. Every joint counts as one that can move.
///
/// # Errors
/// [`GltfError`] if the file can't be read, or holds no skeleton that can be used.
pub fn rest(path: &Path) -> Result<Vec<Motion>, GltfError> {
    let file = path.to_string_lossy();
    let folder = path.parent().unwrap_or(Path::new(""));
    let poses = files::read(path, MAX_MOTION_BYTES)
        .map_err(GltfErrorKind::File)
        .and_then(|bytes| poses(&bytes, &file, &|name| beside(folder, name)));
    poses.map_err(|kind| GltfError { file: file.into_owned(), kind })
}

fn poses(bytes: &[u8], file: &str, open: &Open<'_>) -> Result<Vec<Motion>, GltfErrorKind> {
    let content = content(bytes)?;
    let document = &content.document;
    let tree = Tree::new(document)?;
    let skinned: Vec<usize> = document.skins().flat_map(|s| s.joints().map(|j| j.index())).collect();
    // An armature without a mesh has no skin.
    let candidates = if skinned.is_empty() { (0..tree.nodes.len()).collect() } else { skinned };
    if candidates.is_empty() {
        return Err(GltfErrorKind::NoNodes);
    }
    if document.skins().len() == 0 && candidates.len() > MAX_JOINTS {
        return Err(GltfErrorKind::TooManyJoints { limit: MAX_JOINTS });
    }
    let rigging = Rigging::of(&tree, &candidates)?;
    let mut notes = Vec::new();
    if let Some(other) = tree.other_body(&candidates, &rigging.body) {
        let [other, taken] = [other, rigging.body[0]].map(|node| &tree.nodes[node].name);
        notes.push(format!(
            "the file holds several bodies: that of `{taken}` is taken, that of `{other}` is not"
        ));
    }
    let still = Curves::default();
    still.turn_all(&tree, rigging.above.iter().chain(&rigging.body))?;
    let pose = |node: usize| still.pose(&tree, &rigging, node, 0.0);
    let carrier = rigging.above.iter().fold(Isometry3::identity(), |sum, &n| sum * pose(n));
    let mut own: Vec<Isometry3<f64>> = rigging.body.iter().map(|&n| pose(n)).collect();
    own[0] = carrier * own[0];
    let body: HashMap<usize, usize> = rigging.body.iter().enumerate().map(|(j, &n)| (n, j)).collect();
    let parents: Vec<Option<usize>> =
        rigging.body.iter().map(|&n| tree.nodes[n].parent.and_then(|p| body.get(&p).copied())).collect();
    let buffers = Buffers::new(&content, open);
    // Whether the mesh was bound before or after a node was mirrored, the file does not say.
    let matrices = if rigging.is_mirrored() { None } else { bind_matrices(document, &body, &buffers)? };
    let bound = matrices.and_then(|known| bound(&own, &parents, &known));
    let differs = |bound: &Vec<Isometry3<f64>>| {
        bound.iter().zip(&own).any(|(a, b)| {
            a.rotation.angle_to(&b.rotation) > SAME
                || (a.translation.vector - b.translation.vector).amax() > SAME
        })
    };
    let motion = |poses: Vec<Isometry3<f64>>| {
        let joint = |(j, &node): (usize, &usize)| Joint {
            name: tree.nodes[node].name.clone(),
            parent: parents[j],
            offset: poses[j].translation.vector,
            tips: Vec::new(),
            moves: [true; 3],
            degrees: 6,
            still: true,
        };
        let joints: Vec<Joint> = rigging.body.iter().enumerate().map(joint).collect();
        check(file, &joints, &poses).map_err(GltfErrorKind::Convert)?;
        let (name, unit, notes) = (file.to_owned(), Some(Unit::Metres), notes.clone());
        Ok(Motion { name, unit, rate_hz: 60.0, notes, joints, poses })
    };
    let bound = bound.filter(differs);
    bound.into_iter().chain([own.clone()]).map(motion).collect()
}

/// The bind poses of the joints of a body, by the largest skin that has any.
fn bind_matrices(
    document: &Document,
    body: &HashMap<usize, usize>,
    buffers: &Buffers<'_>,
) -> Result<Option<HashMap<usize, Isometry3<f64>>>, GltfErrorKind> {
    let shared = |skin: &Skin<'_>| skin.joints().filter(|j| body.contains_key(&j.index())).count();
    let skins = document.skins().filter(|s| s.inverse_bind_matrices().is_some() && shared(s) > 1);
    let Some(skin) = skins.max_by_key(|s| shared(s)) else { return Ok(None) };
    let Some(accessor) = skin.inverse_bind_matrices() else { return Ok(None) };
    let matrices = buffers.floats::<16>(&accessor)?;
    let mut known = HashMap::new();
    for (k, node) in skin.joints().enumerate().take(matrices.len()) {
        let Some(&joint) = body.get(&node.index()) else { continue };
        let Some(pose) = pose_of(&matrices.at(k)) else { return Ok(None) };
        known.insert(joint, pose);
    }
    Ok(Some(known))
}

/// The pose whose inverse a matrix is, column by column; `None` for one that squeezes, mirrors or is none.
fn pose_of(columns: &[f64; 16]) -> Option<Isometry3<f64>> {
    let matrix = Matrix4::from_column_slice(columns).try_inverse()?;
    let turn: Matrix3<f64> = matrix.fixed_view::<3, 3>(0, 0).into_owned();
    let x = turn.column(0).try_normalize(1e-12)?;
    let z = x.cross(&turn.column(1)).try_normalize(1e-12)?;
    let right_handed = turn.determinant() > 0.0;
    let rotation = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[x, z.cross(&x), z]));
    let place: Vector3<f64> = matrix.fixed_view::<3, 1>(0, 3).into_owned();
    let is_finite = rotation.matrix().iter().chain(place.iter()).all(|v| v.is_finite());
    let pose =
        Isometry3::from_parts(Translation3::from(place), UnitQuaternion::from_rotation_matrix(&rotation));
    (right_handed && is_finite).then_some(pose)
}

/// The local poses of a body in its bind pose, of the nodes' own and of those joints that a skin binds; `None` if they do
/// not tell the mesh's unit.
fn bound(
    own: &[Isometry3<f64>],
    parents: &[Option<usize>],
    known: &HashMap<usize, Isometry3<f64>>,
) -> Option<Vec<Isometry3<f64>>> {
    let mut ratios: Vec<f64> = Vec::new();
    for (j, parent) in parents.iter().enumerate() {
        let Some((a, b)) = parent.and_then(|p| Some((known.get(&p)?, known.get(&j)?))) else { continue };
        let (length, there) =
            (own[j].translation.vector.norm(), (b.translation.vector - a.translation.vector).norm());
        if length > SHORT_M && there > 1e-9 {
            ratios.push(length / there);
        }
    }
    ratios.sort_by(f64::total_cmp);
    // Most bones keep their length, whatever else an animation moves.
    let unit = *ratios.get(ratios.len() / 2)?;
    let metres = |pose: &Isometry3<f64>| {
        Isometry3::from_parts(Translation3::from(pose.translation.vector * unit), pose.rotation)
    };
    let mut mesh: Vec<Isometry3<f64>> = Vec::with_capacity(own.len());
    for j in 0..own.len() {
        let pose = match (known.get(&j), parents[j]) {
            (Some(pose), _) => metres(pose),
            (None, Some(parent)) => mesh[parent] * own[j],
            // The first joint is often none of the skin's: from the first that is, on the way that the nodes go.
            (None, None) => {
                let first = *known.keys().min()?;
                let way = std::iter::successors(Some(first), |&at| parents[at]).take_while(|&at| at != j);
                way.fold(metres(&known[&first]), |pose, at| pose * own[at].inverse())
            }
        };
        mesh.push(pose);
    }
    let turn = own[0].rotation * mesh[0].rotation.inverse();
    let turn = quarter_turns()
        .min_by(|a, b| a.angle_to(&turn).total_cmp(&b.angle_to(&turn)))
        .filter(|quarter| quarter.angle_to(&turn) < QUARTER_RAD)
        .unwrap_or(turn);
    let local = |j: usize| match parents[j] {
        Some(parent) => mesh[parent].inv_mul(&mesh[j]),
        None => Isometry3::from_parts(Translation3::identity(), turn) * mesh[j],
    };
    Some((0..own.len()).map(local).collect())
}

/// The 24 rotations of a cube.
fn quarter_turns() -> impl Iterator<Item = UnitQuaternion<f64>> {
    let quarter =
        |axis, n: u8| UnitQuaternion::from_axis_angle(&axis, std::f64::consts::FRAC_PI_2 * f64::from(n));
    let faces = (0..4).map(move |n| quarter(Vector3::x_axis(), n));
    let sides = [1, 3].into_iter().map(move |n| quarter(Vector3::z_axis(), n));
    faces.chain(sides).flat_map(move |face| (0..4).map(move |n| face * quarter(Vector3::y_axis(), n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cube_has_24_rotations() {
        let all: Vec<_> = quarter_turns().collect();
        assert_eq!(all.len(), 24);
        for (i, a) in all.iter().enumerate() {
            assert!(all[i + 1..].iter().all(|b| a.angle_to(b) > 1.0), "{i}");
        }
    }
}
