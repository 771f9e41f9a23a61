//! How near and how fast input of a class is, as [`trust`](crate::blob::layout::trust) lays it out.

use crate::blob::{Database, layout::trust, read::Record};

/// What input of a class is like.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct TrustLimits {
    /// Mean squared distance of the nearest frames of other clips, weighted square metres: 90% of the class's frames have
    /// less. 0 where the builder could not tell.
    pub far: f32,
    /// Least and greatest smoothed speed of the root over the ground, m/s; negative backwards.
    pub speeds: [f32; 2],
    /// Speed of the fastest joint, rad/s: 99% of the class's frames have less. 0 where the builder could not tell.
    pub turning: f32,
}

impl Database<'_> {
    /// What input of a class is like, where the blob stores it.
    #[inline(never)]
    pub fn trust_limits(&self, class: usize) -> Option<TrustLimits> {
        let section = self.optional.trust.filter(|_| class < self.counts.classes)?;
        let record = Record::of(section, class, trust::LENGTH);
        Some(TrustLimits {
            far: record.f32(trust::FAR),
            speeds: [record.f32(trust::SLOWEST), record.f32(trust::FASTEST)],
            turning: record.f32(trust::TURNING),
        })
    }
}
