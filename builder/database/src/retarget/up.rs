//! Which way is up in a clip's world: BVH files do not say it, and some glTF files, in which it is Y, are exported otherwise.

use gestus_motion::{
    clip::{Clip, Frame, Skeleton},
    statistics::{quantile, sorted},
};
use nalgebra::{UnitQuaternion, Vector3};

use crate::retarget::{
    axis::{Y, name, to_y},
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

/// Range of the lower foot's height in a walk or a run, as a part of a leg: runs of games fly a quarter of it.
const LEVEL: f64 = 0.3;
/// Least height of a foot over the other where it is lifted, as a part of a leg.
const LIFTED: f64 = 0.04;
/// Least part of the frames of a walk in which each foot is lifted.
const STEPS: f64 = 0.12;
/// Greatest part of the way from ankles to toes along up, of feet that stand on their soles.
const FLAT: f64 = 0.8;

/// Of a body that lies, in its length: greatest height of its lowest joint over the floor, its greatest thickness, and least
/// distance of its feet from zero along the axis on which one that stands has its floor.
const NEAR: f64 = 0.15;
const THICK: f64 = 0.45;
const OFF: f64 = 0.1;

/// The rotation of the clip's up axis to Y: that of the map file, or that which the clip shows. A body that rolls shows
/// none; Y is then up.
pub fn upright(clip: &Clip, file: &MapFile) -> UnitQuaternion<f64> {
    let shown = if file.up.is_some() { None } else { shown(clip, file) };
    match axis(clip, file, shown) {
        Y => UnitQuaternion::identity(),
        axis => to_y(axis),
    }
}

/// Up in the clip's world, of a clip that shows an axis.
fn axis(clip: &Clip, file: &MapFile, shown: Option<(usize, f64)>) -> (usize, f64) {
    file.up.or_else(|| shown.filter(|shown| is_believed(clip, file, *shown))).unwrap_or(Y)
}

/// The axis that a clip shows, if it is believed.
pub fn believed(clip: &Clip, file: &MapFile) -> Option<(usize, f64)> {
    shown(clip, file).filter(|shown| is_believed(clip, file, *shown))
}

/// A body that does not walk may lie: where its format has Y up, or it is low over Y.
fn is_believed(clip: &Clip, file: &MapFile, shown: (usize, f64)) -> bool {
    !(file.has_y_up || (shown != Y && lies(clip, shown))) || walks(clip, file, shown)
}

/// What to tell about a body that shows another up than is taken: it lies throughout, or its file is wrong.
pub fn doubt(clip: &Clip, file: &MapFile) -> Option<String> {
    let shown = shown(clip, file)?;
    let up = axis(clip, file, Some(shown));
    let turned = file.up.is_none() && file.has_y_up && shown != Y;
    let (shown, up) = (name(shown), name(up));
    if shown != up {
        Some(format!(
            "its feet are off the hips along {shown} on average, and up is {up}: if it does not lie, say --up {shown}"
        ))
    } else {
        turned.then(|| {
            format!("it walks with {shown} up, where its format has y up: turned upright; --up y leaves it")
        })
    }
}

/// Whether a body that shows an axis lies on a floor at Y zero: it is flat and just over it, and its feet are at no floor
/// along that axis.
fn lies(clip: &Clip, (axis, sign): (usize, f64)) -> bool {
    let heights = sample(clip).into_iter().map(|frame| {
        let p = frame.positions(&clip.skeleton);
        let range = |along: &dyn Fn(&Vector3<f64>) -> f64| {
            p.iter().map(along).fold([f64::INFINITY, f64::NEG_INFINITY], |[l, h], x| [l.min(x), h.max(x)])
        };
        [range(&|p| p.y), range(&|p| sign * p[axis])]
    });
    let heights: Vec<[[f64; 2]; 2]> = heights.collect();
    let middle =
        |of: &dyn Fn(&[[f64; 2]; 2]) -> f64| quantile(&sorted(heights.iter().map(of)), 0.5).unwrap_or(0.0);
    let tall = middle(&|[_, [low, high]]| high - low);
    let (low, thick) = (middle(&|[[low, _], _]| *low), middle(&|[[low, high], _]| high - low));
    let feet = middle(&|[_, [low, _]]| *low);
    (0.0..NEAR * tall).contains(&low) && thick < THICK * tall && feet.abs() > OFF * tall
}

/// Whether a body walks along an axis as its up: its feet are flat, the lower one is always at about the same height, and
/// each is lifted in turn.
fn walks(clip: &Clip, file: &MapFile, (axis, sign): (usize, f64)) -> bool {
    let skeleton = &clip.skeleton;
    let Some(parts) = named(skeleton, file) else { return false };
    let both = |of: fn(Side) -> Part| Some([parts.get(of(Side::Left))?, parts.get(of(Side::Right))?]);
    let (Some(hips), Some(feet)) = (both(Part::UpperLeg), both(Part::Foot)) else { return false };
    let toes = both(Part::Toes);
    let (mut lower, mut lifted, mut flat, mut leg_m) = (Vec::new(), [0usize; 2], Vector3::zeros(), 0.0f64);
    for p in sample(clip).iter().map(|frame| frame.positions(skeleton)) {
        let heights = feet.map(|foot| sign * p[foot][axis]);
        leg_m = leg_m.max((p[hips[0]] - p[feet[0]]).norm());
        lower.push(heights[0].min(heights[1]));
        for (lifted, over) in lifted.iter_mut().zip([heights[0] - heights[1], heights[1] - heights[0]]) {
            *lifted += usize::from(over > LIFTED * leg_m);
        }
        for (ankle, toe) in toes.iter().flat_map(|toes| feet.into_iter().zip(*toes)) {
            flat += (p[toe] - p[ankle]).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        }
    }
    lower.sort_by(f64::total_cmp);
    let [low, high] = [1, 9].map(|tenth| lower[(lower.len() - 1) * tenth / 10]);
    let along = flat[axis].abs() / (2 * lower.len()) as f64;
    high - low < LEVEL * leg_m
        && along < FLAT
        && lifted.iter().all(|&frames| frames as f64 > STEPS * lower.len() as f64)
}

/// The parts that names show.
fn named(skeleton: &Skeleton, file: &MapFile) -> Option<Parts> {
    Parts::find(skeleton, &[], &MapFile { up: None, ..file.clone() }).ok()
}

/// The axis along which the feet are below the hips throughout, and its sign.
pub fn shown(clip: &Clip, file: &MapFile) -> Option<(usize, f64)> {
    let (skeleton, frames) = (&clip.skeleton, sample(clip));
    // From the hip joints: a root that carries the body may lie on the floor.
    let legs: Vec<[usize; 2]> = named(skeleton, file)
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

/// A frame in a world that is turned.
pub fn lifted(frame: &Frame, world: &UnitQuaternion<f64>) -> Frame {
    let mut frame = frame.clone();
    frame.root = world * frame.root;
    frame.rotations[0] = world * frame.rotations[0];
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::retarget::axis::AXES;
    use crate::synth::{self, Options};

    /// A generated walk that was exported with that axis up, the ankles turned by `pointed`, and frame `still` throughout
    /// if there is one.
    fn on_its_side(axis: (usize, f64), pointed: f64, still: Option<usize>) -> Clip {
        let options = Options { seed: 5, ..Options::of(&["walk"], &["neutral"], 1, 4.0) };
        let clip = synth::corpus(&options).unwrap().examples.swap_remove(0).clip;
        let parts = named(&clip.skeleton, &MapFile::default()).unwrap();
        let feet = Side::BOTH.map(|side| parts.get(Part::Foot(side)).unwrap());
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), pointed);
        let back = to_y(axis).inverse();
        let frames = (0..clip.frames.len()).map(|f| {
            let mut frame = lifted(&clip.frames[still.unwrap_or(f)], &back);
            feet.iter().for_each(|&foot| frame.rotations[foot] *= turn);
            frame
        });
        Clip { frames: frames.collect(), ..clip.clone() }
    }

    #[test]
    fn a_body_that_walks_along_another_axis_is_believed() {
        let gltf = MapFile { has_y_up: true, ..MapFile::default() };
        for (word, axis) in AXES {
            let clip = on_its_side(axis, 0.0, None);
            assert_eq!(super::axis(&clip, &gltf, shown(&clip, &gltf)), axis, "{word}");
            assert_eq!(doubt(&clip, &gltf).is_some(), axis != Y, "{word}");
            assert!((upright(&clip, &gltf) * back_up(axis) - Vector3::y()).norm() < 1e-9, "{word}");
            // What is stated wins.
            let stated = MapFile { up: Some(Y), ..gltf.clone() };
            assert_eq!(upright(&clip, &stated), UnitQuaternion::identity(), "{word}");
        }
        // A body that lies still, and one that swims with pointed feet.
        let feet_back = 1.2;
        for clip in [on_its_side((2, 1.0), 0.0, Some(9)), on_its_side((2, 1.0), feet_back, None)] {
            assert_eq!(shown(&clip, &gltf), Some((2, 1.0)));
            assert_eq!(upright(&clip, &gltf), UnitQuaternion::identity());
            assert!(doubt(&clip, &gltf).is_some());
            // Of a BVH file it is all that tells up.
            assert_eq!(upright(&clip, &MapFile::default()), to_y((2, 1.0)));
            assert_eq!(doubt(&clip, &MapFile::default()), None);
            // But for one that is low over Y, and whose feet are at no floor along Z.
            let mut lies = clip.clone();
            for frame in &mut lies.frames {
                frame.root = Vector3::new(0.3, 0.0, 0.0);
                let places = frame.positions(&lies.skeleton);
                frame.root.y = 0.05 - places.iter().map(|p| p.y).fold(f64::INFINITY, f64::min);
            }
            assert_eq!(upright(&lies, &MapFile::default()), UnitQuaternion::identity());
            assert!(doubt(&lies, &MapFile::default()).is_some_and(|doubt| doubt.contains("up is y")));
        }
    }

    fn back_up((axis, sign): (usize, f64)) -> Vector3<f64> {
        Vector3::from_fn(|i, _| if i == axis { sign } else { 0.0 })
    }
}
