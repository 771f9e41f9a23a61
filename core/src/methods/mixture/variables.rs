//! The variables of an example: dofs in fixed point, in units of their quantisation steps.

/// Fractional bits of a variable. A *part* is the last of them: 2^-14 of a quantisation step.
pub const FRACTION: u32 = 14;

/// The variables of an example, dof by dof: `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` at the places [`X_PREV`], [`Y_PREV`],
/// [`X`] and [`Y`], in quantisation steps with [`FRACTION`] fractional bits. The first D of the 4 J dofs are in use.
pub type Example<const J: usize> = [[[i32; 4]; 4]; J];

/// Place of `x[t-1]` among a dof's variables.
pub const X_PREV: usize = 0;
/// Place of `y[t-1]`.
pub const Y_PREV: usize = 1;
/// Place of `x[t]`.
pub const X: usize = 2;
/// Place of `y[t]`.
pub const Y: usize = 3;

/// Number of parts in one unit (m, rad, m/s or rad/s) of a dof with quantisation step `step`.
#[inline]
pub(super) fn parts_per_unit(step: f32) -> f32 {
    (1 << FRACTION) as f32 / step
}

/// Fractional bits of a [`Factor`].
const FACTOR_BITS: u32 = 24;
/// Greatest weighted difference. The sum of 64 squares is then less than 2^63.
const MAX_UNITS: i64 = 1 << 28;

/// The weight of a dof in a distance between variables.
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub(super) struct Factor(i32);

impl Factor {
    /// A weight of 0.
    pub const ZERO: Self = Self(0);

    /// The weight of a dof with quantisation step `step` for which a difference of one unit counts as `units`.
    pub fn new(step: f32, units: f32) -> Self {
        Self((step * units * (1 << (FACTOR_BITS - FRACTION)) as f32) as i32)
    }

    /// The square of a difference in parts, clamped to [`MAX_UNITS`] units before it is squared.
    #[inline]
    pub fn squared(self, difference: i32) -> u64 {
        let units = (i64::from(difference) * i64::from(self.0)) >> FACTOR_BITS;
        let clamped = units.clamp(-MAX_UNITS, MAX_UNITS) as i32;
        (i64::from(clamped) * i64::from(clamped)) as u64
    }
}
