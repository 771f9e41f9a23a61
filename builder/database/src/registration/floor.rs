//! The floor of a clip: the height at which its feet stand.
//!
//! A file's origin is not always on its floor: some tools put it at the hips. The floor is found in two steps:
//!
//! 1. The height of the lower sole is computed in each frame, from ankles and toes minus their heights in a standing foot.
//!    Frames count in which it is nearly constant. Speed on the ground does not matter, so feet that slide backwards in
//!    a walk in place count too.
//! 2. The floor is the median of those heights near their low quantile: the lowest step of a flight of stairs, and not the
//!    swing of a foot or the height of a jump.
//!
//! A body that lies may have its feet in the air, so hips and knees are also required to be above the floor. Feet that
//! hardly ever stay at one height do not stand; the floor is then zero. A height near zero also counts as zero, because
//! the height of a foreign foot's ankle is known only roughly, and most files have their origin on the floor.
//!
//! Cost: forward kinematics of each frame.

use gestus_core::blob::Leg;
use gestus_motion::{
    clip::Clip,
    landmarks::Landmarks,
    statistics::{quantile, sorted},
};
use nalgebra::Vector3;

use crate::registration::contact::leg_m;

/// Leg length that the heights below are for, metres.
const LEG_M: f64 = 0.85;
/// Height of ankle and toe joint above the sole of an unknown foot, metres.
const SOLE_M: [f64; 2] = [0.08, 0.02];
/// Height of the floor that counts as zero for an unknown foot, metres.
const UNKNOWN_M: f64 = 0.1;
/// Height of the floor that counts as zero for a known foot, metres: calibrations differ.
const KNOWN_M: f64 = 0.03;
/// Vertical speed of a standing foot, m/s.
const STILL_M_S: f64 = 0.15;
/// Heights that belong to one level of the floor, metres.
pub const LEVEL_M: f64 = 0.04;
/// Share of the frames in which feet have to stand on a floor.
const MIN_SHARE: f64 = 0.12;
/// Height of hips and knees above the floor that they lie on, metres.
const LYING_M: f64 = 0.05;

/// How a floor is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    /// The caller has stated it.
    Stated,
    /// The feet stand at zero, or nothing says otherwise.
    Zero,
    /// The feet stand, or the body lies, at another height.
    Body,
}

impl Source {
    /// The word for reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stated => "told",
            Self::Zero => "zero",
            Self::Body => "found",
        }
    }
}

/// The height of the floor along the clip's up, metres, and how it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Floor {
    /// Metres.
    pub height_m: f64,
    /// How it is known.
    pub source: Source,
}

impl Floor {
    /// At zero.
    pub const ZERO: Self = Self { height_m: 0.0, source: Source::Zero };

    /// A height that the caller has stated, metres.
    pub fn stated(height_m: f64) -> Self {
        Self { height_m, source: Source::Stated }
    }
}

/// The joints that tell where the floor is.
#[derive(Debug, Clone)]
pub struct Supports {
    /// Ankles and toes, with the heights of each above the sole, metres.
    soles: Vec<(usize, f64)>,
    /// Joints that may lie on the floor.
    others: Vec<usize>,
    /// Length of a leg, metres.
    leg_m: f64,
    /// Heights that pass for zero, metres.
    near_m: f64,
}

impl Supports {
    /// Those of an unknown foot: ankles, toes, and other joints that may lie on the floor.
    pub fn unknown(ankles: [usize; 2], toes: [Option<usize>; 2], others: Vec<usize>, leg_m: f64) -> Self {
        let scale = leg_m / LEG_M;
        let of = |joint: usize, i: usize| (joint, SOLE_M[i] * scale);
        let soles = ankles.iter().map(|&j| of(j, 0)).chain(toes.iter().flatten().map(|&j| of(j, 1)));
        Self { soles: soles.collect(), others, leg_m, near_m: UNKNOWN_M * scale }
    }

    /// Those of a skeleton's landmarks.
    pub fn of_landmarks(clip: &Clip, marks: &Landmarks) -> Self {
        let toes = [0, 1].map(|side| Some(marks.toes[side]).filter(|&toe| toe != marks.feet[side]));
        Self::unknown(marks.feet, toes, [[0, 0], marks.knees].concat(), leg_m(&clip.skeleton, marks))
    }

    /// Those of a database's body, whose standing feet were measured.
    pub fn of_legs(legs: &[Leg; 2], leg_m: f64) -> Self {
        let soles = legs.iter().flat_map(|leg| {
            let toe = leg.toe.map(|toe| (toe, f64::from(leg.heights[1])));
            [Some((leg.ankle, f64::from(leg.heights[0]))), toe]
        });
        let others = legs.iter().map(|leg| leg.knee).chain([0]).collect();
        Self { soles: soles.flatten().collect(), others, leg_m, near_m: KNOWN_M }
    }

    /// Heights that pass for zero, metres.
    pub fn near_m(&self) -> f64 {
        self.near_m
    }

    /// Size of the body relative to the one that the constants of this module are for.
    pub fn scale(&self) -> f64 {
        self.leg_m / LEG_M
    }
}

/// The floor of a clip with Y up.
pub fn find(clip: &Clip, supports: &Supports) -> Floor {
    let height_m = match heights(clip, supports) {
        Heights { stands: Some(level), lies, .. } => level.min(lies),
        // The feet do not stand: a positive height is in the air, and no part is below the floor.
        Heights { stands: None, lies, lowest } => lowest.min(lies).min(0.0),
    };
    if height_m.abs() <= supports.near_m { Floor::ZERO } else { Floor { height_m, source: Source::Body } }
}

/// The height at which a clip with Y up stands or lies, metres, without rounding to zero; `None` if its feet do not stand.
pub fn standing(clip: &Clip, supports: &Supports) -> Option<f64> {
    let heights = heights(clip, supports);
    heights.stands.map(|level| level.min(heights.lies))
}

/// Heights in a clip, metres.
struct Heights {
    /// At which its feet stand.
    stands: Option<f64>,
    /// Of a floor that its other joints would lie on.
    lies: f64,
    /// Of its lowest soles.
    lowest: f64,
}

fn heights(clip: &Clip, supports: &Supports) -> Heights {
    let scale = supports.scale();
    let least = |p: &[Vector3<f64>], joints: &mut dyn Iterator<Item = (usize, f64)>| {
        joints.map(|(j, sole)| p[j].y - sole).fold(f64::INFINITY, f64::min)
    };
    let heights: Vec<[f64; 2]> = clip
        .frames
        .iter()
        .map(|frame| {
            let p = frame.positions(&clip.skeleton);
            let sole = least(&p, &mut supports.soles.iter().copied());
            let lying = LYING_M * scale;
            [sole, least(&p, &mut supports.others.iter().map(|&j| (j, lying)))]
        })
        .collect();
    if heights.is_empty() {
        return Heights { stands: None, lies: 0.0, lowest: 0.0 };
    }
    let soles: Vec<f64> = heights.iter().map(|h| h[0]).collect();
    let still = still(&soles, clip.rate_hz, STILL_M_S * scale);
    let low = |values: Vec<f64>| quantile(&sorted(values), 0.1);
    let near = |level: f64| still.iter().copied().filter(move |h| (h - level).abs() <= LEVEL_M * scale);
    // A single pose stands.
    let enough = (MIN_SHARE * soles.len() as f64).ceil() as usize;
    let stands = low(still.clone()).filter(|&level| near(level).count() >= enough).and_then(|level| {
        let level = sorted(near(level));
        quantile(&level, 0.5)
    });
    let lies = low(heights.iter().map(|h| h[1]).collect()).unwrap_or(0.0);
    Heights { stands, lies, lowest: low(soles).unwrap_or(0.0) }
}

/// Heights in the frames in which they hardly change.
fn still(heights: &[f64], rate_hz: f64, most_m_s: f64) -> Vec<f64> {
    let reach = ((0.03 * rate_hz).round() as usize).max(1);
    let last = heights.len() - 1;
    let speed = |t: usize| {
        let (from, to) = (t.saturating_sub(reach), (t + reach).min(last));
        (heights[to] - heights[from]).abs() * rate_hz / (to - from).max(1) as f64
    };
    (0..heights.len()).filter(|&t| speed(t) < most_m_s).map(|t| heights[t]).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use gestus_motion::clip::Frame;

    use super::*;
    use crate::synth;

    fn walk() -> Clip {
        let corpus = synth::corpus(&synth::Options::of(&["walk"], &["neutral", "old"], 1, 4.0));
        corpus.unwrap().examples[0].clip.clone()
    }

    fn floor_of(clip: &Clip) -> Floor {
        find(clip, &Supports::of_landmarks(clip, &Landmarks::find(&clip.skeleton).unwrap()))
    }

    fn moved(clip: &Clip, change: impl Fn(usize, &mut Frame)) -> Clip {
        let mut clip = clip.clone();
        clip.frames.iter_mut().enumerate().for_each(|(t, frame)| change(t, frame));
        clip
    }

    #[test]
    fn a_walk_at_any_height_stands_on_its_floor() {
        let clip = walk();
        assert_eq!(floor_of(&clip), Floor::ZERO);
        for height in [-0.72, -0.3, 0.4, 2.0] {
            let found = floor_of(&moved(&clip, |_, f| f.root.y += height));
            assert_eq!(found.source, Source::Body);
            assert!((found.height_m - height).abs() < 0.03, "{height}: {found:?}");
        }
        // In place, and of another size.
        let place = floor_of(&moved(&clip, |_, f| f.root = Vector3::new(0.0, f.root.y - 0.72, 0.0)));
        assert!((place.height_m + 0.72).abs() < 0.03, "{place:?}");
        let mut small = moved(&clip, |_, f| f.root = (f.root - Vector3::y() * 0.72) * 0.3);
        let mut skeleton = (*small.skeleton).clone();
        skeleton.offsets.iter_mut().for_each(|offset| *offset *= 0.3);
        small.skeleton = Arc::new(skeleton);
        assert!((floor_of(&small).height_m + 0.72 * 0.3).abs() < 0.015, "{:?}", floor_of(&small));
    }

    /// Jumps and stairs have a floor below what their feet mostly do; in the air there is none.
    #[test]
    fn the_lowest_level_is_the_floor() {
        let clip = walk();
        let hops = moved(&clip, |t, f| f.root.y += 0.5 * (t as f64 * 0.2).sin().max(0.0) - 0.72);
        assert!((floor_of(&hops).height_m + 0.72).abs() < 0.04, "{:?}", floor_of(&hops));
        let stairs = moved(&clip, |t, f| f.root.y += (t / 20) as f64 * 0.17 - 0.72);
        assert!((floor_of(&stairs).height_m + 0.72).abs() < 0.06, "{:?}", floor_of(&stairs));
        let falls = moved(&clip, |t, f| f.root.y += 3.0 - 0.7 * t as f64 / 30.0);
        assert_eq!(floor_of(&falls).height_m, 0.0);
    }
}
