//! What the search reads: the stored features with their scales and groups, and each frame's graph edges and flags.

use crate::blob::{
    Database,
    layout::{DEGREE, distances, query},
    read::{Record, f32_at},
};

impl<'db> Database<'db> {
    /// The stored feature of a captured frame: i8, one a byte.
    #[inline]
    pub fn feature(&self, row: usize) -> &'db [u8] {
        let length = self.counts.features;
        self.required
            .features
            .get(row.wrapping_mul(length)..)
            .and_then(|rest| rest.get(..length))
            .unwrap_or(&[])
    }

    /// The stored features of all captured frames, frame after frame.
    #[inline]
    pub(crate) fn features(&self) -> &'db [u8] {
        self.required.features
    }

    /// Weighted squared lengths of all captured frames' features; none where the blob does not store them.
    #[inline]
    pub(crate) fn feature_norms2(&self) -> &'db [[u8; 4]] {
        let numbers = self.optional.distances.map_or(&[][..], |numbers| numbers.as_chunks::<4>().0);
        numbers.get(distances::FALLS..).unwrap_or(&[])
    }

    /// Weighted squared length of a captured frame's feature ([`Weights::norm2`](crate::search::metric::Weights::norm2)),
    /// where the blob stores it.
    #[inline]
    pub fn feature_norm2(&self, row: usize) -> Option<u32> {
        self.feature_norms2().get(row).map(|norm| u32::from_le_bytes(*norm))
    }

    /// Least part of the mean squared distance of a far class that is left after that many frames; 0 for no frames, for more
    /// than the blob stores, and for blobs that store none.
    #[inline]
    pub fn fall(&self, frames: usize) -> f32 {
        let numbers = self.optional.distances.unwrap_or(&[]).as_chunks::<4>().0;
        let falls = numbers.get(..distances::FALLS).unwrap_or(&[]);
        frames.checked_sub(1).and_then(|i| falls.get(i)).map_or(0.0, |fall| f32::from_le_bytes(*fall))
    }

    /// Scale of a stored feature: metres of one step.
    #[inline(never)]
    pub fn feature_scale(&self, feature: usize) -> f32 {
        f32_at(self.required.query, query::SCALES + 4 * feature)
    }

    /// Joint group of each feature.
    #[inline(never)]
    pub fn feature_groups(&self) -> &'db [u8] {
        let counts = &self.counts;
        let at = query::groups(counts.window, counts.joints, counts.features);
        self.required.query.get(at..).and_then(|rest| rest.get(..counts.features)).unwrap_or(&[])
    }

    /// Joint group of a feature.
    #[inline]
    pub fn feature_group(&self, feature: usize) -> usize {
        self.feature_groups().get(feature).copied().map_or(0, usize::from)
    }

    /// Metres for one unit of length of the query section.
    #[inline]
    pub fn length_unit(&self) -> f32 {
        f32_at(self.required.query, query::UNIT)
    }

    /// Metres for one step of a component's sum of products.
    #[inline]
    pub fn component_step(&self, feature: usize) -> f32 {
        f32_at(self.required.query, query::steps(self.counts.features) + 4 * feature)
    }

    /// The query section, as [`query`] divides it.
    #[inline]
    pub fn query_section(&self) -> &'db [u8] {
        self.required.query
    }

    /// Whether the captured frames have edges. A blob may leave the graph out.
    #[inline]
    pub fn has_graph(&self) -> bool {
        !self.required.graph.is_empty()
    }

    /// Graph edges of a captured frame: rows of its class, [`NONE`](crate::blob::layout::NONE) where there is none. Only
    /// for blobs that [have a graph](Self::has_graph).
    #[inline]
    pub fn edges(&self, row: usize) -> [u16; DEGREE] {
        let record = Record::of(self.required.graph, row, 2 * DEGREE);
        core::array::from_fn(|i| record.u16(2 * i..2 * i + 2))
    }

    /// Flags of a captured frame ([`flag`](crate::blob::layout::flag)); 0 for any other row.
    #[inline]
    pub fn flags(&self, row: usize) -> u8 {
        self.required.flags.get(row).copied().unwrap_or(0)
    }
}
