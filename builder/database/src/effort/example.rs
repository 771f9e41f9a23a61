//! What blends are learned from: fragments with their Efforts, and labelled blends of pairs of them.

use crate::effort::Factors;

/// A labelled blend.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Example {
    /// The first fragment.
    pub first: usize,
    /// The second.
    pub second: usize,
    /// How far from the first to the second.
    pub alpha: f64,
    /// Its Effort.
    pub effort: Factors,
}

/// Components and Effort of every fragment.
#[derive(Debug, Clone, Default)]
pub struct Known {
    /// Its components, `[fragments][k]`.
    pub components: Vec<Vec<f64>>,
    /// Its Effort, `[fragments]`.
    pub efforts: Vec<Factors>,
}

impl Known {
    /// z of a pair and α.
    pub fn input(&self, first: usize, second: usize, alpha: f64) -> Vec<f64> {
        let (c, e) = (&self.components, &self.efforts);
        [&c[first][..], &c[second], &e[first], &e[second], &[alpha]].concat()
    }

    /// Components and Efforts of a fragment.
    pub(super) fn half(&self, fragment: usize) -> Vec<f64> {
        [&self.components[fragment][..], &self.efforts[fragment]].concat()
    }

    /// The blend of the Efforts.
    pub fn interpolated(&self, first: usize, second: usize, alpha: f64) -> Factors {
        std::array::from_fn(|k| (1.0 - alpha) * self.efforts[first][k] + alpha * self.efforts[second][k])
    }
}
