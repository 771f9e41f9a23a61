//! Clips far from their file's origin.
//!
//! The core's poses are single-precision numbers: ten kilometres from the origin a body moves in steps of a millimetre, and
//! is like no database any more. So a clip is mapped and streamed relative to a place near its body, a multiple of
//! `STEP_M`, and the output is moved back. For a body nearer than half a step that place is zero.
//!
//! A file can itself be too coarse, as glTF is, whose numbers are single-precision too. Its grain is the least second
//! difference of the root's path along an axis: all are multiples of it, and a path of finer numbers has a smaller one.

use gestus_motion::clip::{Clip, Frame};
use nalgebra::{UnitQuaternion, Vector3};

use crate::retarget::{MapFile, up};

/// Steps of the place, metres: at half of it a single-precision number holds four thousandths of a millimetre.
const STEP_M: f64 = 100.0;
/// Grain of a file that is worth a warning, metres.
const COARSE_M: f64 = 0.001;
/// Second differences that show a grain, and how near each is to a multiple of the least, in it.
const MIN_BENDS: usize = 2;
const MULTIPLE: f64 = 0.02;
/// Differences that are rounding, relative to the distance from the origin.
const ROUNDING: f64 = 1e-14;

/// The place about which a clip is mapped and streamed, metres in its world.
pub fn origin_of(clip: &Clip) -> Vector3<f64> {
    // The middle: some clips begin with a rest pose at the file's origin.
    let middle = clip.frames.get(clip.frames.len() / 2);
    middle.map_or_else(Vector3::zeros, |frame| frame.root.map(|x| (x / STEP_M).round() * STEP_M))
}

/// Where a clip is in its file: the place near its body, and up.
#[derive(Debug, Clone, Copy)]
pub struct Place {
    origin: Vector3<f64>,
    world: UnitQuaternion<f64>,
}

impl Place {
    /// That of a clip of which the map file says up.
    pub fn of(clip: &Clip, file: &MapFile) -> Self {
        Self { origin: origin_of(clip), world: up::upright(clip, file) }
    }

    /// The clip near the origin, with Y up.
    pub fn near(&self, clip: &Clip) -> Clip {
        let mut near = moved(clip, &-self.origin);
        near.frames.iter_mut().for_each(|frame| *frame = up::lifted(frame, &self.world));
        near
    }

    /// A clip of [`near`](Self::near) in the file's world.
    pub fn back(&self, clip: &Clip) -> Clip {
        let down = self.world.inverse();
        let frames = clip.frames.iter().map(|frame| up::lifted(frame, &down)).collect();
        moved(&Clip { frames, ..clip.clone() }, &self.origin)
    }

    /// Height of the place, metres along up.
    pub fn height_m(&self) -> f64 {
        (self.world * self.origin).y
    }
}

/// A clip moved by that vector.
pub fn moved(clip: &Clip, by: &Vector3<f64>) -> Clip {
    let frames = clip.frames.iter().map(|frame| moved_frame(frame, by)).collect();
    Clip { frames, ..clip.clone() }
}

/// A frame moved by that vector.
pub fn moved_frame(frame: &Frame, by: &Vector3<f64>) -> Frame {
    Frame { root: frame.root + by, rotations: frame.rotations.clone() }
}

/// A warning about a clip that is far from its file's origin, and in steps too coarse for motion.
pub fn warning(clip: &Clip) -> Option<String> {
    if origin_of(clip) == Vector3::zeros() {
        return None;
    }
    let (axis, grain_m) = (0..3).map(|axis| (axis, grain(clip, axis))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    let far_km = clip.frames.iter().map(|frame| frame.root.norm()).fold(0.0, f64::max) / 1000.0;
    (grain_m > COARSE_M).then(|| {
        format!(
            "{far_km:.1} km from its origin, the file holds the place of the body in steps of {:.1} cm along {} only, and no \
             more can be known of it: export the clip near the origin",
            100.0 * grain_m,
            ["x", "y", "z"][axis]
        )
    })
}

/// Steps of the root's path along an axis, metres; zero if it shows none.
fn grain(clip: &Clip, axis: usize) -> f64 {
    let path = || clip.frames.iter().map(|frame| frame.root[axis]);
    let rounding = ROUNDING * path().map(f64::abs).fold(0.0, f64::max);
    let path: Vec<f64> = path().collect();
    let bends = path.windows(3).map(|p| (p[2] - p[1] - (p[1] - p[0])).abs());
    let bends: Vec<f64> = bends.filter(|&bend| bend > rounding).collect();
    let least = bends.iter().copied().fold(f64::INFINITY, f64::min);
    // A path of straight lines has few bends too, of any size.
    let is_multiple = |bend: &f64| (bend / least - (bend / least).round()).abs() < MULTIPLE;
    if bends.len() < MIN_BENDS || !bends.iter().all(is_multiple) { 0.0 } else { least }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use gestus_motion::clip::Skeleton;
    use nalgebra::UnitQuaternion;

    use super::*;

    /// A root that sways, so far away, in numbers rounded by `round`.
    fn clip(far_m: f64, round: impl Fn(f64) -> f64) -> Clip {
        let skeleton =
            Skeleton { names: vec!["hips".into()], parents: vec![None], offsets: vec![Vector3::zeros()] };
        let root = |t: usize| {
            let t = t as f64 / 30.0;
            Vector3::new(
                far_m + 1.2 * t + 0.03 * (6.0 * t).sin(),
                0.9 + 0.02 * (12.0 * t).sin(),
                0.01 * (6.0 * t).cos(),
            )
        };
        let frames = (0..90)
            .map(|t| Frame { root: root(t).map(&round), rotations: vec![UnitQuaternion::identity()] })
            .collect();
        Clip { name: "far".into(), skeleton: Arc::new(skeleton), rate_hz: 30.0, frames }
    }

    #[test]
    fn places_are_whole_steps_and_zero_near_the_origin() {
        assert_eq!(origin_of(&clip(10.0, |x| x)), Vector3::zeros());
        assert_eq!(origin_of(&clip(36_000.0, |x| x)), Vector3::new(36_000.0, 0.0, 0.0));
        let far = clip(36_000.0, |x| x);
        assert!(moved(&far, &-origin_of(&far)).frames.iter().all(|frame| frame.root.norm() < STEP_M));
    }

    #[test]
    fn coarse_files_are_told_and_fine_ones_are_not() {
        let single = |x: f64| f64::from(x as f32);
        let text = |x: f64| (x * 1e6).round() / 1e6;
        for (far_m, round, coarse) in [
            (36_000.0, &single as &dyn Fn(f64) -> f64, true),
            (1_000_000.0, &single, true),
            (1_000_000.0, &text, false),
            (1_000_000.0, &|x| x, false),
            (500.0, &single, false),
            // Near the origin nothing is lost by distance.
            (0.0, &|x: f64| (x * 100.0).round() / 100.0, false),
        ] {
            assert_eq!(warning(&clip(far_m, round)).is_some(), coarse, "{far_m} m");
        }
        assert!(warning(&clip(36_000.0, single)).unwrap().contains("0.4 cm along x"));
        // Hardly a step in the whole clip; and straight lines between keys, which are none.
        let mut still = clip(1e6, |x| x);
        for (t, frame) in still.frames.iter_mut().enumerate() {
            frame.root.x = f64::from((1e6 + 0.04 * (0.2 * t as f64).sin()) as f32);
        }
        assert!(warning(&still).is_some());
        for (t, frame) in still.frames.iter_mut().enumerate() {
            let key = (t / 20) as f64;
            frame.root = Vector3::new(
                1e6 + [0.0, 0.31, 0.44, 0.9, 1.7][t / 20] + 0.017 * key.cos() * (t % 20) as f64,
                0.9,
                0.0,
            );
        }
        assert_eq!(warning(&still), None);
    }
}
