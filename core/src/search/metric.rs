//! The distance between the query and stored features: Xia 2015, eq. 1, in principal components.
//!
//! Cost: one byte read and three operations a component; half of the components often tell that a frame is too far.

use super::query::Feature;
use crate::blob::{Database, layout::MAX_FEATURES};

/// The query, ready to be compared with stored features.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Metric {
    /// The query, metres; 0 for components that a mask leaves out.
    query: Feature,
    /// Metres for a step of the stored i8; 0 for components that a mask leaves out.
    scale: Feature,
    features: usize,
}

impl Metric {
    /// The metric of a query; `mask` says for each joint group whether the search looks at it.
    pub fn new(database: &Database<'_>, feature: &Feature, mask: u8) -> Self {
        let mut metric = Self { query: *feature, ..Self::NOTHING };
        metric.weigh(database, mask);
        metric
    }

    /// No query yet: it is written to [`query`](Self::query), and then [`weigh`](Self::weigh)ed.
    pub(crate) const NOTHING: Self =
        Self { query: [0.0; MAX_FEATURES], scale: [0.0; MAX_FEATURES], features: 0 };

    /// The query's place.
    pub(crate) fn query(&mut self) -> &mut Feature {
        &mut self.query
    }

    /// Takes the scales of the components that the search looks at, and the others out of the query.
    #[inline(never)]
    pub(crate) fn weigh(&mut self, database: &Database<'_>, mask: u8) {
        self.features = database.counts().features;
        for (f, (query, scale)) in self.query.iter_mut().zip(&mut self.scale).enumerate() {
            let looked_at = f < self.features && mask >> database.feature_group(f) & 1 == 1;
            if looked_at {
                *scale = database.feature_scale(f);
            } else {
                *query = 0.0;
            }
        }
    }

    /// Squared distance to a stored feature. Eight sums side by side, added in a fixed order, so that vector units
    /// and scalar ones agree bit for bit. The search takes `distance2_below`, which is faster.
    #[inline(never)]
    pub fn distance2(&self, stored: &[u8]) -> f32 {
        let mut sums = [0.0f32; LANES];
        for (i, ((&code, &query), &scale)) in stored.iter().zip(&self.query).zip(&self.scale).enumerate() {
            let difference = query - scale * f32::from(code as i8);
            sums[i % LANES] += difference * difference;
        }
        total(&sums)
    }

    /// The squared distance, if it is below a bound. Half of the components often tell that it is not: no term is
    /// negative, and rounding keeps the order of sums, so the answer is that of the whole sum.
    #[inline]
    pub(super) fn distance2_below(&self, stored: &[u8], bound: f32) -> Option<f32> {
        let (chunks, rest) = stored.as_chunks::<CHUNK>();
        if !rest.is_empty() {
            // The last chunk is not full.
            return Some(self.distance2(stored)).filter(|sum| *sum < bound);
        }
        let mut sums = [0.0f32; LANES];
        let queries = self.query.as_chunks::<CHUNK>().0.iter().zip(self.scale.as_chunks::<CHUNK>().0);
        for (codes, (query, scale)) in chunks.iter().zip(queries) {
            add(&mut sums, codes, query, scale);
            if total(&sums) >= bound {
                return None;
            }
        }
        let sum = total(&sums);
        if sum < bound { Some(sum) } else { None }
    }

    /// Bytes read for one distance.
    pub fn bytes(&self) -> usize {
        self.features
    }
}

/// Sums that a distance adds up side by side.
const LANES: usize = 8;
/// Components after which a distance may be seen to be too large.
const CHUNK: usize = 2 * LANES;

/// Adds the squares of a chunk's components to the sums.
// Vector units get it as a call: sums in memory are what tells the compiler to take as many at once as fit.
#[cfg_attr(not(any(target_arch = "arm", target_arch = "riscv32")), inline(never))]
#[cfg_attr(any(target_arch = "arm", target_arch = "riscv32"), inline)]
fn add(sums: &mut [f32; LANES], codes: &[u8; CHUNK], query: &[f32; CHUNK], scale: &[f32; CHUNK]) {
    let term = |i: usize| {
        let difference = query[i] - scale[i] * f32::from(codes[i] as i8);
        difference * difference
    };
    // Written out, so that it is straight code whatever the compiler is told of loops.
    *sums = [
        sums[0] + term(0) + term(8),
        sums[1] + term(1) + term(9),
        sums[2] + term(2) + term(10),
        sums[3] + term(3) + term(11),
        sums[4] + term(4) + term(12),
        sums[5] + term(5) + term(13),
        sums[6] + term(6) + term(14),
        sums[7] + term(7) + term(15),
    ];
}

#[inline]
fn total(sums: &[f32; LANES]) -> f32 {
    ((sums[0] + sums[4]) + (sums[2] + sums[6])) + ((sums[1] + sums[5]) + (sums[3] + sums[7]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn early_exit_tells_the_same_as_the_whole_sum() {
        for features in [7, 8, 16, 17, 24, 31, 32] {
            let mut metric = Metric { query: [0.0; MAX_FEATURES], scale: [0.0; MAX_FEATURES], features };
            let mut codes = [0u8; MAX_FEATURES];
            for f in 0..features {
                metric.query[f] = (f as f32 * 2.7).sin() * 100.0;
                metric.scale[f] = 1.0 / (1.0 + f as f32);
                codes[f] = ((f as f32 * 1.3).cos() * 120.0) as i8 as u8;
            }
            let stored = codes.get(..features).unwrap_or(&[]);
            let whole = metric.distance2(stored);
            let plain: f32 = (0..features)
                .map(|f| (metric.query[f] - metric.scale[f] * f32::from(codes[f] as i8)).powi(2))
                .sum();
            assert!((whole - plain).abs() <= 1e-5 * plain, "{features}: {whole} against {plain}");
            for bound in [0.0, whole * 0.3, whole * 0.9, whole, whole * 1.000_001, whole * 2.0] {
                let expected = (whole < bound).then_some(whole);
                assert_eq!(metric.distance2_below(stored, bound), expected, "{features} features, {bound}");
            }
        }
    }
}
