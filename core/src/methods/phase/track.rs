//! The phase of the body in the cycle of each class: the query is projected on the closed polyline of the class's mean
//! features, and a filter tracks the phase from frame to frame.
//!
//! ```text
//! p = φ + ω,  e = φ^ - p       φ^ the projected phase, ω its change a frame, e wrapped to ±1/2
//! |e| > 0.15: φ = φ^           the body is elsewhere in its cycle
//! else:       φ = p + e / 2,  ω = ω + e / 20, clamped to 0 to 2.4 cycles a second
//! ```
//!
//! A whole clip, as a wave, may repeat a motion, and each repetition looks like the others. The phase of a whole clip is
//! therefore the nearest point within a few frames of `p`, unless the nearest of all is much nearer.
//!
//! Features are whitened by their covariance within classes, joint group by joint group, so that a mask can leave out
//! whole groups. Cost: P · F integer products a class to find the nearest knot, then 4 F for the two segments that meet
//! there; for a whole clip 17 more at most.

use core::ops::Range;

use crate::{
    blob::{Database, PhaseTables, layout::MAX_FEATURES},
    math::{abs, clamp, maximum},
    search::{
        dot::{dot, dot_of_codes},
        query::Feature,
    },
};

/// Fixed-point steps of the query in one step of a knot.
const FINE: i32 = 8;
/// The query is clamped to this many steps of a knot, so that no sum overflows.
const MAX_QUERY_STEPS: f32 = 255.0;
/// Error of the tracked phase beyond which the projected phase replaces it.
const MAX_PHASE_ERROR: f32 = 0.15;
/// Error beyond which the body counts as elsewhere in its cycle: its legs are exchanged rather than out of step.
const JUMP_ERROR: f32 = 0.25;
/// Frames, at the mean pace of a whole clip, by which its phase may be off from what is expected before the body counts as
/// elsewhere in the clip.
const NEAR_FRAMES: f32 = 3.0;
/// Least and greatest value of that distance, in knots.
const NEAR_KNOTS: [f32; 2] = [2.0, 8.0];
/// Greatest number of knots at which the body may be expected.
pub(super) const MAX_EXPECTED_KNOTS: usize = 2 * NEAR_KNOTS[1] as usize + 1;
/// How much nearer another part of a whole clip has to be to replace the one that is expected, whitened square units.
const MIN_JUMP: f32 = 48.0;
/// Greatest rate of a cycle, 1/s.
const MAX_RATE_HZ: f32 = 2.4;
/// Frame rate at which the gains of the filter were chosen.
const GAINS_HZ: f32 = 30.0;

/// The query, whitened, in steps of the stored knots.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct WhitenedQuery {
    /// In fine steps, at most 2,040; 0 for features that a mask leaves out.
    codes: [i16; MAX_FEATURES],
    /// 1 for features in use, 0 for those that a mask leaves out.
    used: [u8; MAX_FEATURES],
    /// Every feature is in use.
    is_whole: bool,
    /// Sum of the squares of `codes`.
    norm2: i32,
    /// Whitened units of a fine step, squared, over the part of the features that is in use.
    unit2: f32,
}

/// Where a query lies beside a class's polyline.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Projection {
    /// Phase of the nearest point, 0 to 1.
    pub phase: f32,
    /// Squared distance to it, whitened square units. Scaled up to all features where a mask leaves some out.
    pub distance2: f32,
    /// False if the nearest knot is none of those at which the body was expected.
    pub is_expected: bool,
}

impl WhitenedQuery {
    /// Whitens a query; `mask` says for each joint group whether the search looks at it.
    #[inline(never)]
    pub fn new(database: &Database<'_>, feature: &Feature, mask: u8) -> Self {
        let inverse = FINE as f32 / database.phase_step();
        let mut whitening = database.whitening();
        let mut query =
            Self { codes: [0; MAX_FEATURES], used: [0; MAX_FEATURES], is_whole: false, norm2: 0, unit2: 0.0 };
        let (mut first, mut in_use) = (0, 0);
        for (group, count) in database.features_by_group().into_iter().enumerate() {
            let range = first..first + count;
            first += count;
            let group_features = feature.get(range.clone()).unwrap_or(&[]);
            if mask >> group & 1 == 0 {
                whitening.take_first(count * count);
                continue;
            }
            in_use += count;
            query.used.get_mut(range.clone()).unwrap_or(&mut []).fill(1);
            for code in query.codes.get_mut(range).unwrap_or(&mut []) {
                let value = whitening.take_first(count).product(group_features) * inverse;
                let most = MAX_QUERY_STEPS * FINE as f32;
                let value = clamp(value, -most, most);
                // To the nearest: the cast truncates.
                *code = (value + if value < 0.0 { -0.5 } else { 0.5 }) as i16;
            }
        }
        let features = database.counts().features;
        query.is_whole = in_use == features;
        query.norm2 = query.codes.iter().map(|&code| i32::from(code) * i32::from(code)).sum();
        let share = in_use.max(1) as f32 / features.max(1) as f32;
        query.unit2 = 1.0 / (inverse * inverse * share);
        query
    }

    /// Squared length of a knot over the features in use, square steps.
    #[inline]
    fn knot_norm2(&self, codes: &[u8], stored: i32) -> i32 {
        if self.is_whole { stored } else { self.product(codes, codes) }
    }

    /// Product of two knots over the features in use, square steps: at most 32 · 128².
    #[inline]
    fn product(&self, a: &[u8], b: &[u8]) -> i32 {
        if self.is_whole {
            return dot_of_codes(a, b);
        }
        let codes = a.iter().zip(b).map(|(&a, &b)| i32::from(a as i8) * i32::from(b as i8));
        codes.zip(&self.used).map(|(product, &used)| product * i32::from(used)).sum()
    }

    /// Squared distance to a knot, in fine steps: at most 32 · (2,040 + 1,024)² < 2^29.
    #[inline]
    fn distance2(&self, codes: &[u8], norm2: i32) -> i32 {
        self.norm2 + FINE * FINE * norm2 - 2 * FINE * dot(&self.codes, codes)
    }

    /// The knot of a range that is nearest to the query, and its squared distance in fine steps.
    #[inline(never)]
    fn nearest(&self, tables: &PhaseTables<'_>, range: Range<usize>) -> (usize, i32) {
        let (mut nearest, mut least) = (range.start, i32::MAX);
        for (k, (codes, norm2)) in range.clone().zip(tables.knots().skip(range.start)) {
            let distance2 = self.distance2(codes, self.knot_norm2(codes, norm2));
            if distance2 < least {
                (nearest, least) = (k, distance2);
            }
        }
        (nearest, least)
    }

    /// The nearest point of the two segments at the nearest knot of a class. An `expected` knot counts as the nearest unless
    /// another is much nearer.
    // Not generic over capacities, so that it is compiled with the core, optimised for speed.
    #[inline(never)]
    pub fn project(&self, tables: &PhaseTables<'_>, expected: Option<Range<usize>>) -> Projection {
        let (mut nearest, mut least) = self.nearest(tables, 0..tables.feature_knots);
        let mut is_expected = true;
        if let Some(range) = expected {
            let near = self.nearest(tables, range);
            is_expected = (near.1 - least) as f32 * self.unit2 < MIN_JUMP;
            if is_expected {
                (nearest, least) = near;
            }
        }
        let last = tables.feature_knots.saturating_sub(1);
        let next = if nearest < last { Some(nearest + 1) } else { tables.is_cyclic.then_some(0) };
        let before = nearest.checked_sub(1).or(tables.is_cyclic.then_some(last));
        let (codes, norm2) = tables.knot(nearest);
        let norm2 = self.knot_norm2(codes, norm2);
        let (mut best, mut at) = (least as f32, nearest as f32);
        for (other, way) in [(next, 1.0), (before, -1.0)] {
            let Some((other_codes, other_norm2)) = other.map(|other| tables.knot(other)) else { continue };
            let other_norm2 = self.knot_norm2(other_codes, other_norm2);
            let length2 = FINE * FINE * (norm2 + other_norm2 - 2 * self.product(codes, other_codes));
            if length2 <= 0 {
                continue;
            }
            let beyond = self.distance2(other_codes, other_norm2);
            // The nearest knot is the nearer end: the foot of the perpendicular is in its half of the segment, or behind.
            let part = clamp((least + length2 - beyond) as f32 / (2 * length2) as f32, 0.0, 1.0);
            let distance2 = least as f32 - part * part * length2 as f32;
            if part > 0.0 && distance2 < best {
                (best, at) = (distance2, nearest as f32 + way * part);
            }
        }
        let knots = if tables.is_cyclic { last + 1 } else { last };
        let at = if at < 0.0 { at + knots as f32 } else { at };
        let phase = at / knots.max(1) as f32;
        let phase = if phase >= 1.0 && tables.is_cyclic { phase - 1.0 } else { phase };
        let best = maximum(best, 0.0);
        Projection { phase, distance2: best * self.unit2, is_expected }
    }
}

/// The phase of the body in the cycle of one class.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Track {
    /// Phase, 0 to 1.
    pub phase: f32,
    /// Change of the phase a frame.
    pub rate: f32,
}

impl Track {
    /// Before the first frame.
    pub const NEW: Self = Self { phase: 0.0, rate: 0.0 };

    /// A track that begins at a phase, at the class's mean pace.
    pub fn begin(tables: &PhaseTables<'_>, phase: f32, rate_hz: f32) -> Self {
        let seconds = tables.seconds[0] + tables.seconds[1];
        Self { phase, rate: clamp(1.0 / (seconds * rate_hz), 0.0, MAX_RATE_HZ / rate_hz) }
    }

    /// The knots of a whole clip at which the body is expected in the next frame; `None` for a cycle, which has no repetitions.
    pub fn expected_knots(self, tables: &PhaseTables<'_>, rate_hz: f32) -> Option<Range<usize>> {
        if tables.is_cyclic {
            return None;
        }
        let last = tables.feature_knots.saturating_sub(1);
        let [least, most] = NEAR_KNOTS;
        let frames = (tables.seconds[0] + tables.seconds[1]) * rate_hz;
        let near = clamp(NEAR_FRAMES * last as f32 / frames, least, most) as usize;
        let middle = (clamp(self.phase + self.rate, 0.0, 1.0) * last as f32 + 0.5) as usize;
        Some(middle.saturating_sub(near)..(middle + near).min(last) + 1)
    }

    /// Updates the track with the phase projected in a frame. Returns whether the body is elsewhere in its cycle.
    pub fn follow(&mut self, tables: &PhaseTables<'_>, phase: f32, rate_hz: f32) -> bool {
        let frames = clamp(GAINS_HZ / rate_hz, 0.0, 2.0);
        let wrap = |p: f32| {
            if !tables.is_cyclic {
                clamp(p, 0.0, 1.0)
            } else if p >= 1.0 {
                p - 1.0
            } else if p < 0.0 {
                p + 1.0
            } else {
                p
            }
        };
        let expected = self.phase + self.rate;
        let mut error = phase - expected;
        if tables.is_cyclic {
            error += if error > 0.5 {
                -1.0
            } else if error < -0.5 {
                1.0
            } else {
                0.0
            };
        }
        if abs(error) > MAX_PHASE_ERROR {
            self.phase = phase;
        } else {
            self.phase = wrap(expected + 0.5 * frames * error);
            self.rate = clamp(self.rate + 0.05 * frames * error, 0.0, MAX_RATE_HZ / rate_hz);
        }
        tables.is_cyclic && abs(error) > JUMP_ERROR
    }
}
