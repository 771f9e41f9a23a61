//! Mixing proportions: the weight of each class.
//!
//! `λ_j ∝ exp(-D_j / (δ min D))`, where `D_j` is the mean **squared** distance of the class's nearest neighbors (Xia 2015,
//! section 5.2, eq. 4). Most classes have almost no weight, and each class that is kept costs the unpacking of its neighbors
//! and a regression. The smallest are therefore dropped as long as their sum stays below a bound. A cap on their number
//! bounds the work where all classes are equally far (input far from the data).

use heapless::Vec;

use crate::{
    Config,
    config::parameters::{self, RANGES},
    math::{exp, maximum},
    search::top_k::insert,
};

/// Greatest number of classes in a mixture.
pub const MAX_KEPT: usize = 8;
const _: () = assert!(RANGES[parameters::CLASSES as usize].most == MAX_KEPT as f32);
/// Greatest number of classes in a frame in which all classes are searched afresh, which is the slowest kind.
pub const MAX_KEPT_FRESH: usize = 2;

/// Greatest number of classes that a frame keeps of `classes`.
pub fn most_kept(config: &Config, classes: u32) -> u32 {
    u32::from(config.classes).clamp(1, MAX_KEPT as u32).min(classes)
}

/// Distance beyond the nearest class, in kernel widths, at which a class has no weight: hundreds of `exp(-24)` are 1e-8.
const MAX_EXCESS: f32 = 24.0;

/// Greatest difference of the sum of all shares from 1 by rounding.
const ROUNDING: f32 = 1e-6;

/// A class and its proportion.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Share {
    /// Number of the class.
    pub class: u16,
    /// Its proportion; those of a frame sum to 1.
    pub proportion: f32,
}

/// The classes of a frame, largest proportion first.
pub type Shares = Vec<Share, MAX_KEPT>;

/// Width of the kernel that gives classes their proportions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Width {
    /// As a multiple of the frame's least distance: δ of Xia 2015, eq. 4.
    relative: f32,
    /// Least width, in units of the distance.
    least: f32,
}

impl Width {
    /// A multiple of the frame's least distance. At distance 0 the nearest class takes all.
    pub const fn relative(delta: f32) -> Self {
        // It keeps the quotient of a distance and the width finite.
        Self { relative: delta, least: 1e-12 }
    }

    /// The same, but not less than `least`, in units of the distance.
    pub const fn at_least(self, least: f32) -> Self {
        Self { least, ..self }
    }
}

/// Computes mixing proportions `exp(-D / width)` from the squared distances of the classes, `[classes]`. A negative distance
/// marks a class that was not searched.
///
/// Classes are kept in order of their proportion until the others have at most `prune` of the weight, or `most` are kept.
/// Returns true where `most` has cut off more than `prune`. `shares` is empty only where no class was searched.
#[inline(never)]
pub(crate) fn proportions(
    distances: &[f32],
    width: Width,
    prune: f32,
    most: usize,
    shares: &mut Shares,
) -> bool {
    shares.clear();
    let searched = || distances.iter().copied().enumerate().filter(|(_, d)| *d >= 0.0);
    // Floats that are not negative have the order of their bits.
    let bits = |d: f32| d.to_bits() as i32;
    let least = searched().fold(f32::INFINITY, |least, (_, d)| if bits(d) < bits(least) { d } else { least });
    let width = maximum(width.relative * least, width.least);
    // Weights are relative to the nearest class, whose weight is 1. Those beyond `MAX_EXCESS` are, all together, below a
    // quarter of its last bit.
    let weight = |d: f32| {
        let excess = (d - least) / width;
        if excess > MAX_EXCESS { 0.0 } else { exp(-excess) }
    };
    let total: f32 = searched().map(|(_, d)| weight(d)).sum();
    let most = most.clamp(1, MAX_KEPT);
    // Classes that are further away than the `most` nearest are never kept, so their weights are not computed again.
    let mut nearest: Vec<i32, MAX_KEPT> = Vec::new();
    for (_, d) in searched() {
        insert(&mut nearest, most, bits(d), |other| *other <= bits(d));
    }
    let farthest = nearest.last().copied().unwrap_or(0);
    for (class, d) in searched().filter(|(_, d)| bits(*d) <= farthest) {
        let share = Share { class: class as u16, proportion: weight(d) / total };
        insert(shares, MAX_KEPT, share, |other| other.proportion >= share.proportion);
    }
    let mut kept = 0.0;
    let mut count = 0;
    for share in shares.iter().take(most) {
        if kept >= 1.0 - prune {
            break;
        }
        kept += share.proportion;
        count += 1;
    }
    shares.truncate(count);
    for share in shares.iter_mut() {
        share.proportion /= kept;
    }
    kept < 1.0 - prune - ROUNDING
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn proportions_follow_equation_4() {
        let distances = [0.2, -1.0, 0.1, 0.4];
        let mut shares = Shares::new();
        assert!(!proportions(&distances, Width::relative(0.7), 0.0, 8, &mut shares));
        let exact = |d: f64| (-d / (0.7 * 0.1)).exp();
        let total = exact(0.2) + exact(0.1) + exact(0.4);
        let classes: std::vec::Vec<u16> = shares.iter().map(|s| s.class).collect();
        assert_eq!(classes, [2, 0, 3]);
        for (share, d) in shares.iter().zip([0.1, 0.2, 0.4]) {
            assert!((f64::from(share.proportion) - exact(d) / total).abs() < 1e-6);
        }
    }

    #[test]
    fn what_is_dropped_is_bounded_by_weight_and_by_number() {
        let distances = [0.1, 0.12, 0.2, 0.5];
        let mut shares = Shares::new();
        assert!(!proportions(&distances, Width::relative(0.35), 0.05, 8, &mut shares));
        assert_eq!(shares.len(), 2);
        assert!((shares.iter().map(|s| s.proportion).sum::<f32>() - 1.0).abs() < 1e-6);
        // 28 classes at the same distance: eight are kept, and it is said.
        assert!(proportions(&[3.0; 28], Width::relative(0.7), 0.01, 8, &mut shares));
        assert_eq!(shares.len(), 8);
        assert!(shares.iter().all(|s| s.proportion == 0.125));
    }

    #[test]
    fn where_all_is_kept_nothing_is_said_to_be_dropped() {
        let mut shares = Shares::new();
        let mut seed = 1u32;
        for _ in 0..2000 {
            let distances: [f32; 8] = core::array::from_fn(|_| {
                seed = seed.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                0.1 + (seed >> 8) as f32 * 2e-8
            });
            assert!(!proportions(&distances, Width::relative(0.7), 0.0, 8, &mut shares), "{distances:?}");
            assert_eq!(shares.len(), 8);
        }
    }

    #[test]
    fn the_kernel_is_as_wide_as_the_distance_beyond_its_least_width() {
        let width = Width::relative(0.1).at_least(12.0);
        for (distances, expected) in [([60.0, 72.0], 12.0_f64), ([600.0, 690.0], 60.0), ([0.0, 12.0], 12.0)] {
            let mut shares = Shares::new();
            assert!(!proportions(&distances, width, 0.0, 8, &mut shares));
            let nearest = 1.0 / (1.0 + (-f64::from(distances[1] - distances[0]) / expected).exp());
            assert!((f64::from(shares[0].proportion) - nearest).abs() < 1e-6, "{distances:?}: {shares:?}");
        }
    }

    #[test]
    fn a_class_at_distance_zero_takes_all() {
        let mut shares = Shares::new();
        assert!(!proportions(&[0.0, 0.1], Width::relative(0.7), 0.01, 8, &mut shares));
        assert_eq!(shares.as_slice(), [Share { class: 0, proportion: 1.0 }]);
        // Where no class was searched nothing is kept.
        let _ = proportions(&[-1.0, -1.0], Width::relative(0.7), 0.01, 8, &mut shares);
        assert!(shares.is_empty());
    }
}
