//! The distance between query and stored features: Xia 2015, eq. 1, in principal components and in integers.
//!
//! c are stored codes, s metres a code, q the query in metres, and U a unit of square metres, the same for every frame:
//!
//! ```text
//! a = s² / U,  p = q / s              rounded: a to integers that sum up to some 29,000, p to 1/4096 of a code
//! d = Σ a (p - c)² = Σ a p² - Σ 2 a p c + Σ a c²
//! ```
//!
//! The first sum depends on the query alone. The last depends on the frame alone and is stored in the blob. A distance
//! is thus one dot product. A query within twice the range of the codes has distances below 2^32: 29,096 · (256 + 128)²
//! < 4.2904e9. `2 a p` is then below 2^24, and the sum of its products with codes below 2^31. A query that is further
//! away uses units of 2^n U, with the same bounds, and is clamped to 128 times the range.
//!
//! Cost: one byte read and one product a component; under a mask two more products for the last sum.

use super::{dot::Products, query::Feature};
use crate::{
    blob::{Class, Database, layout::MAX_FEATURES},
    math::{abs, clamp},
};

/// Sum of the squared scales, in units. Rounding adds up to half a unit a component; no component is 0.
pub const TOTAL: u16 = 29_000;
/// The largest sum `Σ a c²`.
pub const MAX_NORM2: u32 = (TOTAL as u32 + 3 * MAX_FEATURES as u32) * 128 * 128;
/// Added to every distance, so that none is negative: rounding subtracts at most 2.5 units.
pub(super) const BIAS: u32 = 3;
/// Fractional bits of the query, in codes.
const FINE: u32 = 12;
/// The query is clamped to this many codes.
const MAX_QUERY_CODES: f32 = 16_384.0;
/// Upper bound of a distance in units: 2^32, less a margin for rounding.
const MAX_DISTANCE_UNITS: f32 = 4.2905e9;
/// Greatest shift of the unit, enough for the farthest query.
const MAX_UNIT_SHIFT: u32 = 11;

/// Squared scales of the components in units, and the size of a unit.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Weights {
    /// a of each component; 0 for unused components.
    units: [u16; MAX_FEATURES],
    /// U: weighted square metres in a unit.
    unit2: f32,
}

impl Weights {
    /// The weights of components with the given scales, metres a code.
    pub fn new(scales: impl Iterator<Item = f32> + Clone) -> Self {
        let sum: f32 = scales.clone().map(|s| s * s).sum();
        let unit2 = sum / f32::from(TOTAL);
        let mut units = [0; MAX_FEATURES];
        for (unit, scale) in units.iter_mut().zip(scales) {
            let rounded = (scale * scale / unit2 + 0.5) as u16;
            *unit = rounded.max(1);
        }
        Self { units, unit2 }
    }

    /// `Σ a c²` of stored codes, in units.
    #[inline]
    pub fn norm2(&self, stored: &[u8]) -> u32 {
        let squares = stored.iter().map(|&code| u32::from((code as i8).unsigned_abs()).pow(2));
        squares.zip(&self.units).map(|(square, &unit)| square * u32::from(unit)).sum()
    }
}

/// The query, prepared for comparison with stored features.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Metric {
    /// 0 for components that a mask leaves out.
    weights: Weights,
    /// `2 a p` of every component.
    products: Products,
    /// `Σ a p²`, and the bias.
    query_norm2: u32,
    features: usize,
    /// No component is left out, so that stored norms are valid.
    is_whole: bool,
    /// n: the unit is 2^n U. Above 0 for a far query.
    shift: u32,
}

impl Metric {
    /// The metric of a query, metres. `mask` has one bit a joint group: whether the search compares it. `feature` is
    /// replaced by the query that distances are measured from: rounded, and clamped to 128 times the range of stored
    /// features.
    #[inline(never)]
    pub fn new(database: &Database<'_>, feature: &mut Feature, mask: u8) -> Self {
        let scales = (0..database.counts().features).map(|f| database.feature_scale(f));
        let groups = database.feature_groups();
        Self::of(scales, feature, |f| groups.get(f).is_some_and(|&group| mask >> (group & 7) & 1 == 1))
    }

    fn of(
        scales: impl ExactSizeIterator<Item = f32> + Clone,
        feature: &mut Feature,
        is_searched: impl Fn(usize) -> bool,
    ) -> Self {
        let mut metric = Self {
            weights: Weights::new(scales.clone()),
            products: Products::NEW,
            query_norm2: 0,
            features: scales.len(),
            is_whole: true,
            shift: 0,
        };
        // The largest possible distance to a code, in units: it determines the shift.
        let mut farthest = 0.0;
        let of = feature.iter_mut().zip(scales.clone()).zip(&metric.weights.units);
        for (f, ((query, scale), &unit)) in of.enumerate() {
            // From here on in codes.
            *query = clamp(*query / scale, -MAX_QUERY_CODES, MAX_QUERY_CODES);
            if is_searched(f) {
                let codes = abs(*query) + 128.0;
                farthest += f32::from(unit) * codes * codes;
            }
        }
        metric.shift = (0..MAX_UNIT_SHIFT)
            .find(|&k| farthest < MAX_DISTANCE_UNITS * (1 << k) as f32)
            .unwrap_or(MAX_UNIT_SHIFT);
        let half = (1i64 << metric.shift) >> 1;
        // In units of 2^-24.
        let mut norm2 = 0i64;
        let slots = feature.iter_mut().zip(&mut metric.weights.units).zip(scales);
        for (f, ((query, unit), scale)) in slots.enumerate() {
            let code = *query * (1 << FINE) as f32;
            // To the nearest: the cast truncates. At most 2^26.
            let code = i64::from((code + if code < 0.0 { -0.5 } else { 0.5 }) as i32);
            let weight = i64::from(*unit);
            // 2 a p, and the query that it is exact for.
            let product = (weight * code + (1 << (FINE - 2))) >> (FINE - 1);
            *query = scale * product as f32 / (2 * weight) as f32;
            if !is_searched(f) {
                (*unit, metric.is_whole) = (0, false);
                continue;
            }
            // Below 2^24.
            let product = (product + half) >> metric.shift;
            metric.products.set(f, product as i32);
            // By the rounded product, so that the distance to the query itself is 0.
            norm2 += ((product * code) << FINE) - ((weight * code) >> metric.shift) * code;
        }
        metric.query_norm2 = ((norm2 + (1 << (2 * FINE - 1))) >> (2 * FINE)) as u32 + BIAS;
        metric
    }

    /// Squared distance to a captured frame, units, with the bias.
    // Not inlined: searches measure nearly all frames by `distance2_in`.
    #[inline(never)]
    pub(crate) fn distance2(&self, database: &Database<'_>, row: usize) -> u32 {
        self.distance2_to(database.feature(row), database.feature_norm2(row))
    }

    /// The frames of a class for fast comparison, if they have 16 or 32 components and no mask is set.
    pub(super) fn frames<'db>(&self, database: &Database<'db>, class: &Class) -> Option<Frames<'db>> {
        let rows = class.first_row..class.first_row + class.rows;
        let length = self.features;
        let codes = database.features().get(rows.start * length..rows.end * length)?;
        let norms = database.feature_norms2().get(rows).filter(|_| self.is_whole)?;
        match length {
            16 => Some(Frames::Of16(codes.as_chunks().0, norms)),
            32 => Some(Frames::Of32(codes.as_chunks().0, norms)),
            _ => None,
        }
    }

    /// Squared distance to a frame of a class, in units, with the bias.
    #[inline]
    pub(super) fn distance2_in(&self, frames: &Frames<'_>, row: usize) -> Option<u32> {
        let (dot, norm2) = match frames {
            Frames::Of16(codes, norms) => (self.products.dot_of(codes.get(row)?), norms.get(row)?),
            Frames::Of32(codes, norms) => (self.products.dot_of(codes.get(row)?), norms.get(row)?),
        };
        Some(self.distance2_by(u32::from_le_bytes(*norm2), dot))
    }

    /// Squared distance to stored codes, in units, with the bias. Uses the stored norm if no component is left out.
    #[inline]
    fn distance2_to(&self, stored: &[u8], norm2: Option<u32>) -> u32 {
        let norm2 = match norm2 {
            Some(norm2) if self.is_whole => norm2,
            _ => self.weights.norm2(stored),
        };
        self.distance2_by(norm2, self.products.dot(stored))
    }

    #[inline]
    fn distance2_by(&self, norm2: u32, dot: i32) -> u32 {
        // Wraps only in a blob whose norms are wrong.
        self.query_norm2.wrapping_add(norm2 >> (self.shift & 31)).wrapping_sub(dot as u32)
    }

    /// True if no mask leaves a component out.
    pub(crate) fn is_whole(&self) -> bool {
        self.is_whole
    }

    /// Weighted square metres in a unit.
    #[inline]
    pub(crate) fn unit2(&self) -> f32 {
        self.weights.unit2 * (1u32 << self.shift) as f32
    }

    /// Squared distance to a captured frame, weighted square metres.
    pub fn metres2(&self, database: &Database<'_>, row: usize) -> f32 {
        self.distance2(database, row).saturating_sub(BIAS) as f32 * self.unit2()
    }

    /// Bytes read for one distance.
    pub fn bytes(&self) -> usize {
        self.features + if self.is_whole { 4 } else { 0 }
    }
}

/// The frames of a class for fast comparison: codes and norms by row, with 16 or 32 components.
#[derive(Debug, Clone, Copy)]
pub(super) enum Frames<'db> {
    Of16(&'db [[u8; 16]], &'db [[u8; 4]]),
    Of32(&'db [[u8; 32]], &'db [[u8; 4]]),
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Distances of a metric to codes, by its integers and by its meaning, both in units.
    fn compare(scales: &[f32], query: &[f32], searched: &[bool], codes: &[i8]) -> (f64, f64) {
        let mut query: Feature = core::array::from_fn(|f| query.get(f).copied().unwrap_or(0.0));
        let metric = Metric::of(scales.iter().copied(), &mut query, |f| searched[f]);
        let stored: std::vec::Vec<u8> = codes.iter().map(|&code| code as u8).collect();
        let norm2 = Weights::new(scales.iter().copied()).norm2(&stored);
        let units = f64::from(metric.distance2_to(&stored, Some(norm2)) - BIAS);
        assert_eq!(
            metric.distance2_to(&stored, None),
            metric.distance2_to(&stored, Some(norm2)),
            "norms agree"
        );
        let terms = scales.iter().zip(codes).enumerate().filter(|(f, _)| searched[*f]);
        let exact: f64 =
            terms.map(|(f, (&s, &c))| (f64::from(query[f]) - f64::from(s) * f64::from(c)).powi(2)).sum();
        (units, exact / f64::from(metric.unit2()))
    }

    #[test]
    fn integers_are_the_distance_from_the_rounded_query() {
        for features in [1usize, 7, 8, 16, 24, 31, 32] {
            // As the builder stores them: squares that are multiples of one unit, of which there are `TOTAL`.
            let mut units: std::vec::Vec<u16> =
                (0..features).map(|f| 1 + 600 / (1 + f as u16).pow(2)).collect();
            units[0] += TOTAL - units.iter().sum::<u16>();
            let scales: std::vec::Vec<f32> =
                units.iter().map(|&units| (f64::from(units) * 3e-9).sqrt() as f32).collect();
            let codes: std::vec::Vec<i8> =
                (0..features).map(|f| ((f as f32 * 1.3).cos() * 120.0) as i8).collect();
            for (size, masked) in
                [(0.3, 99), (1.0, 99), (1.0, 2), (0.0, 99), (1.9, 99), (2.5, 99), (100.0, 1)]
            {
                let query: std::vec::Vec<f32> =
                    (0..features).map(|f| (f as f32 * 2.7).sin() * size * 127.0 * scales[f]).collect();
                let searched: std::vec::Vec<bool> = (0..features).map(|f| f % 3 != masked).collect();
                let (units, exact) = compare(&scales, &query, &searched, &codes);
                // The unit follows from sums of f32 squares.
                let tolerance = 4.0 + 1e-4 * exact;
                assert!((units - exact).abs() < tolerance, "{features}, {size}: {units} against {exact}");
            }
        }
    }

    #[test]
    fn the_farthest_query_and_codes_do_not_overflow() {
        for features in [1usize, 2, 31, 32] {
            for scale in [1e-9f32, 0.01, 1e6] {
                let scales = std::vec![scale; features];
                for side in [-1.0f32, 1.0] {
                    let query = std::vec![side * f32::MAX; features];
                    let codes = std::vec![if side > 0.0 { -128i8 } else { 127 }; features];
                    let (units, exact) = compare(&scales, &query, &std::vec![true; features], &codes);
                    assert!(
                        (units / exact - 1.0).abs() < 1e-3,
                        "{features}, {scale}: {units} against {exact}"
                    );
                }
            }
        }
    }
}
