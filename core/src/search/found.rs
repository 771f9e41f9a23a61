//! The result of a search in a class.

use super::metric::BIAS;

/// A frame that the search has measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(crate) struct Neighbor {
    /// Squared distance to the query, in units of the [metric](super::metric), including its bias.
    pub distance2: u32,
    /// Row within the class.
    pub row: u16,
    /// Its edges were followed.
    pub expanded: bool,
    /// It is a successor of a neighbor of the last frame.
    pub followed: bool,
}

/// Counts and events of a search.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct SearchStats {
    /// Distances computed.
    pub visits: u32,
    /// Bytes of features and graph read.
    pub bytes: u32,
    /// The visits were used up before the pool was expanded.
    pub capped: bool,
    /// The search was restarted, because the last neighbors led nowhere.
    pub restarted: bool,
    /// The last neighbors led much further away: the input has jumped.
    pub jumped: bool,
}

/// The nearest frames of a class.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Found<'a> {
    neighbors: &'a [Neighbor],
    /// Weighted square metres in a unit of distance.
    unit2: f32,
    /// Mean squared distance of the neighbors, weighted square metres. A method without frames sets a distance of its own.
    pub mean_distance2: f32,
    /// Counts and events of the search.
    pub stats: SearchStats,
}

impl<'a> Found<'a> {
    pub(crate) fn new(neighbors: &'a [Neighbor], unit2: f32, stats: SearchStats) -> Self {
        Self { neighbors, unit2, mean_distance2: mean(neighbors) * unit2, stats }
    }

    /// A class without frames, at a distance from the input.
    pub(crate) fn no_frames(distance2: f32) -> Self {
        Self { neighbors: &[], unit2: 0.0, mean_distance2: distance2, stats: SearchStats::default() }
    }

    /// Rows within the class, nearest first.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = u16> + use<'a> {
        self.neighbors.iter().map(|neighbor| neighbor.row)
    }

    /// Rows within the class, nearest first, each with its squared distance to the query, weighted square metres.
    pub fn neighbors(&self) -> impl ExactSizeIterator<Item = (u16, f32)> + use<'a> {
        let unit2 = self.unit2;
        self.neighbors
            .iter()
            .map(move |neighbor| (neighbor.row, neighbor.distance2.saturating_sub(BIAS) as f32 * unit2))
    }
}

/// Mean squared distance, in units of the metric; 0 without neighbors.
pub(crate) fn mean(neighbors: &[Neighbor]) -> f32 {
    let sum: u64 = neighbors.iter().map(|n| u64::from(n.distance2.saturating_sub(BIAS))).sum();
    sum as f32 / neighbors.len().max(1) as f32
}
