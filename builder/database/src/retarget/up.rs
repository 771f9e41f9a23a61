//! Which way is up in a clip's world: BVH files do not say it.

use gestus_motion::clip::{Clip, Frame, Skeleton};
use nalgebra::{UnitQuaternion, Vector3};

use crate::retarget::{
    file::MapFile,
    identify::Parts,
    parts::{Part, Side},
    shape,
};

/// Most poses that a body is measured by.
pub(crate) const SAMPLE: usize = 600;
/// Least length of the mean way from the feet to the hips, in their mean distance, of a body that shows where up is.
const UPRIGHT: f64 = 0.7;
/// Height of a body whose limbs are not found, in its depth, from which it stands along Z.
const TALL: f64 = 1.3;

/// Poses of a clip, evenly spaced.
pub(super) fn sample(clip: &Clip) -> Vec<Frame> {
    clip.frames.iter().step_by(clip.frames.len().div_ceil(SAMPLE).max(1)).cloned().collect()
}

/// The rotation of the clip's up axis to Y: that of the map file, or that which the clip shows. A body that rolls shows
/// none; Y is then up.
pub fn upright(clip: &Clip, file: &MapFile) -> UnitQuaternion<f64> {
    file.up.or_else(|| shown(clip, file)).map_or_else(UnitQuaternion::identity, to_y)
}

/// What to tell about a body that shows another up than is stated: it lies throughout, or its file is wrong.
pub fn doubt(clip: &Clip, file: &MapFile) -> Option<String> {
    let stated = file.up?;
    let shown = shown(clip, file).filter(|shown| *shown != stated)?;
    let (shown, stated) = (name(shown), name(stated));
    Some(format!(
        "its feet are off the hips along {shown} throughout, and up is {stated}: if it does not lie, say in a map file \
         that up = \"{shown}\""
    ))
}

/// The axis along which the feet are below the hips throughout, and its sign.
pub fn shown(clip: &Clip, file: &MapFile) -> Option<(usize, f64)> {
    let (skeleton, frames) = (&clip.skeleton, sample(clip));
    // From the hip joints: a root that carries the body may lie on the floor.
    let legs: Vec<[usize; 2]> = Parts::find(skeleton, &[], &MapFile { up: None, ..file.clone() })
        .ok()
        .map(|p| {
            let leg = |&s: &Side| Some([p.get(Part::UpperLeg(s))?, p.get(Part::Foot(s))?]);
            Side::BOTH.iter().filter_map(leg).collect()
        })
        .unwrap_or_default();
    let (mut up, mut distance) = (Vector3::zeros(), 0.0);
    let mut extent = Vector3::zeros();
    for frame in &frames {
        let p = frame.positions(skeleton);
        for way in legs.iter().map(|&[hip, foot]| p[hip] - p[foot]) {
            up += way;
            distance += way.norm();
        }
        let (low, high) = p.iter().fold((p[0], p[0]), |(l, h), q| (l.inf(q), h.sup(q)));
        extent += high - low;
    }
    if legs.is_empty() {
        return by_shape(skeleton, &frames).or((extent.z > TALL * extent.y).then_some((2, 1.0)));
    }
    let axis = up.iamax();
    let is_shown = up.norm() > UPRIGHT * distance && up[axis].abs() > 1.2 * up.norm() / 2f64.sqrt();
    is_shown.then(|| (axis, up[axis].signum()))
}

/// The axis along which the legs that shape shows are below the hips, where names show none.
fn by_shape(skeleton: &Skeleton, frames: &[Frame]) -> Option<(usize, f64)> {
    [(1, 1.0), (2, 1.0), (2, -1.0), (0, 1.0), (0, -1.0), (1, -1.0)].into_iter().find(|&up| {
        let turned: Vec<Frame> = frames.iter().map(|frame| lifted(frame, &to_y(up))).collect();
        shape::find(skeleton, &turned).is_ok_and(|shape| shape.down > UPRIGHT)
    })
}

/// An axis and its sign, as a map file names them.
pub fn name((axis, sign): (usize, f64)) -> String {
    format!("{}{}", if sign < 0.0 { "-" } else { "" }, ["x", "y", "z"][axis])
}

/// The rotation of an axis to Y.
pub fn to_y((axis, sign): (usize, f64)) -> UnitQuaternion<f64> {
    let from = Vector3::from_fn(|i, _| if i == axis { sign } else { 0.0 });
    UnitQuaternion::rotation_between(&from, &Vector3::y())
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI))
}

/// A frame in a world that is turned.
pub fn lifted(frame: &Frame, world: &UnitQuaternion<f64>) -> Frame {
    let mut frame = frame.clone();
    frame.root = world * frame.root;
    frame.rotations[0] = world * frame.rotations[0];
    frame
}
