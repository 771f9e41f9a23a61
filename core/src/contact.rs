//! Which foot stands: a vote of the neighbors.
//!
//! Every captured frame is labelled; the neighbors vote with the inverse of their distances, classes with their
//! proportions (paper 000, section 6). A foot stands where more than half of the weight says so.

use crate::{
    blob::{Database, layout::flag},
    math::sqrt,
};

/// Votes for the left and the right foot.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Votes {
    stands: [f32; 2],
    total: f32,
}

impl Votes {
    /// Counts a neighbor: its row, its squared distance and its class's proportion.
    pub fn add(&mut self, database: &Database<'_>, row: usize, distance2: f32, proportion: f32) {
        // A tenth of a millimetre: a neighbor at no distance wins the vote and does not divide by zero.
        let weight = proportion / (sqrt(distance2) + 1e-4);
        let flags = database.flags(row);
        for (stands, bit) in self.stands.iter_mut().zip([flag::LEFT_CONTACT, flag::RIGHT_CONTACT]) {
            if flags & bit != 0 {
                *stands += weight;
            }
        }
        self.total += weight;
    }

    /// Left and right: does the foot stand?
    pub fn result(&self) -> [bool; 2] {
        self.stands.map(|s| s > 0.5 * self.total)
    }
}
