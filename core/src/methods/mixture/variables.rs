//! The variables of an example: dofs in whole parts of their quantisation steps.

/// Bits behind the point: parts of a quantisation step.
pub const FRACTION: u32 = 14;

/// The variables of an example, dof by dof: `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` at the places [`X_PREV`], [`Y_PREV`],
/// [`X`] and [`Y`], in quantisation steps with [`FRACTION`] bits behind the point. The first D of the 4 J dofs are in use.
pub type Example<const J: usize> = [[[i32; 4]; 4]; J];

/// Place of `x[t-1]` among a dof's variables.
pub const X_PREV: usize = 0;
/// Place of `y[t-1]`.
pub const Y_PREV: usize = 1;
/// Place of `x[t]`.
pub const X: usize = 2;
/// Place of `y[t]`.
pub const Y: usize = 3;

/// Parts in one unit of a dof with that step.
#[inline]
pub(super) fn parts_per_unit(step: f32) -> f32 {
    (1 << FRACTION) as f32 / step
}

/// Bits behind the point of a factor for parts.
const FACTOR_BITS: u32 = 24;
/// No difference counts as more units: 64 squares sum up to less than 2^63.
const MOST: i64 = 1 << 28;

/// A difference from the variables of an example, by a metric of its own.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Factor(i32);

impl Factor {
    /// Nothing differs.
    pub const ZERO: Self = Self(0);

    /// For a dof with that quantisation step, of which one unit counts as `units`.
    pub fn new(step: f32, units: f32) -> Self {
        Self((step * units * (1 << (FACTOR_BITS - FRACTION)) as f32) as i32)
    }

    /// The square of a difference in parts, which counts as [`MOST`] units at most.
    #[inline]
    pub fn squared(self, difference: i32) -> u64 {
        let units = (i64::from(difference) * i64::from(self.0)) >> FACTOR_BITS;
        let held = units.clamp(-MOST, MOST) as i32;
        (i64::from(held) * i64::from(held)) as u64
    }
}
