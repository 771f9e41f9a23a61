//! Local autoregressive models: one a dof, fitted to the neighbors of a class, used once.
//!
//! `y[t] = a x[t-1] + b y[t-1] + c x[t] + d` (Xia 2015, section 5.1, eq. 2), with `λ |β|²` added to the squares.
//! Neighbors are added one at a time; only sums of products are kept ([`super::sums`]).
//!
//! **The constant** is eliminated. About the neighbors' means `m` of the predictors and `k` of `y` (absolute ones: `d` is
//! penalised at the dof's own zero) the best `d` is `g' (k - β·m)` with `g' = n / (n + λ)`, which leaves three unknowns:
//!
//! ```text
//! (S + w m mᵀ + ridge) β = s + w k m        w = n λ / (n + λ), S and s sums of products about the means
//! y = k + β·(input - m) - g (k - β·m)       g = λ / (n + λ)
//! ```
//!
//! All of this is computed in integers ([`super::ridge`]), which take a tenth of the time of floats on processors
//! without an FPU.
//!
//! **Units.** All four variables of a dof have the same unit `h`: the sums are taken in units, where radians need `λ / h²`
//! for `a, b, c` and `λ` for the constant. Dividing each dof by its scale `s` instead, **normalised**, needs `λ s² / h²`;
//! the two modes differ in one number.
//!
//! **Feedback.** Neighbors lie close together, within a tenth of a dof's spread. A λ that is large enough to keep `b` from
//! following its own last output therefore pulls `a` and `c` to zero too, which leaves only the neighbors' mean. For this
//! reason `b` has a penalty of its own: `λ` times `feedback`, which is 1 in Xia 2015.
//!
//! **Bias** (section 5.3, eqs. 6 and 7). Where `x[t]` lies outside `μ ± κ σ` of the neighbors, by `Δx`, the model
//! is evaluated at `x - Δx` and `y[t-1] - ρ Δx`, and `ρ Δx` is added to its result: content that is not in the data
//! is carried past the model.
//!
//! **Corrections** (ours) are added to the output and not fed back: the predictions follow the equations of Xia 2015 alone.
//!
//! *Far predictions.* After a change of class, or in motion unlike the data, the last prediction may lie far from all
//! neighbors, where the model has learnt nothing. The output, less `ρ Δx`, is therefore clamped to `μ ± κy s` about the
//! neighbors' mean `y[t]`, where `s` is the dof's standard deviation over the database. Neighbors differ by a tenth of
//! `s`, so the interval only affects predictions that are far off.
//!
//! *Standing still.* Walking neighbors would move a standing body, since only ρ of its stillness is kept. Where the root's
//! ground velocity `x[t]` lies outside the interval and nearer to 0 than the interval's end `e = x - Δx`, the output
//! moves from the neighbors' mean towards the input's velocity, by `(1 - p) (x - mean y[t] - ρ Δx)`. There
//! `p = r² (3 - 2 r)` and `r = |x / e|`, at most 1: a body that stops comes to rest, and one that sways on the spot,
//! whose `r` is small to either side, stays. The output is led in the same parts, by its neighbors and by the input.

use crate::{
    blob::layout::dof,
    config::Ridge,
    math::{
        abs, clamp,
        fixed::{
            Fraction, Multiplier, PowerOfTwo, bit_length, magnitude_bits, power_of_two, product, shift,
            sqrt_wide,
        },
        maximum, smoothstep, sqrt,
    },
    methods::mixture::{
        ridge::{ANSWER_BITS, ENTRY_BITS, System},
        sums::{Examples, FINER_BITS, Scatter, max_rounding_error},
        variables::{FRACTION, parts_per_unit},
    },
};

/// The parameters of a regression.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// λ.
    pub lambda: f32,
    /// Whether variables are raw or normalised.
    pub ridge: Ridge,
    /// Penalty of the coefficient of `y[t-1]`, as a multiple of λ.
    pub feedback: f32,
    /// κ: half width of the interval of trust, in standard deviations.
    pub kappa: f32,
    /// κy: greatest distance of an output from the neighbors' mean, in the dof's standard deviations.
    pub output_kappa: f32,
    /// ρ: the part of `Δx` that the prediction keeps, 0 to 1.
    pub rho: f32,
    /// The part of `Δx` that the output keeps, 0 to 1.
    pub output_rho: f32,
}

/// A class's prediction of one dof, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Prediction {
    /// `y[t]`.
    pub y: f32,
    /// Added to `y` in the output, and not fed back.
    pub correction: f32,
    /// Mean change of the neighbors' outputs in this step, plus ρ of the difference between the input's change and the
    /// neighbors'. In standing still it is blended to the input's own.
    pub change: f32,
}

/// The parameters of a regression, prepared for the examples of one class.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Regression {
    parameters: Parameters,
    /// Least λ in square units: twice the rounding error of the sums, so that the matrix is positive definite.
    least_slope: f32,
    /// √w: the weight of the means in the normal equations.
    means_weight: Multiplier,
    /// g: the part of the mean at input zero that is left out.
    left_out: Fraction,
    /// From the root of a sum of squares, as [`sqrt_wide`] gives it, to κ σ in sixteenths of units.
    kappa: Multiplier,
    rho: Fraction,
    output_rho: Fraction,
    /// κy rounded down to a power of two.
    output_kappa_power: i32,
}

/// Bits of the largest mean in the normal equations.
const MEAN_BITS: i32 = 24;
/// Number of low bits that are dropped from a product of two means.
const DROPPED_BITS: u32 = 2 * MEAN_BITS as u32 - 30;

/// Greatest difference from the first example, in sixteenths of units. Larger ones are clamped.
const MAX_DIFFERENCE: i32 = 1 << 29;

impl Regression {
    /// Prepares a regression over `count` examples.
    pub fn new(parameters: &Parameters, count: u16) -> Self {
        let (lambda, n) = (parameters.lambda, f32::from(count.max(1)));
        let inverse = 1.0 / (n + lambda);
        // The root of the mean square in units, from 2^14.5 times the root of the sum.
        let to_fine = (1 << FINER_BITS) as f32 / (16_384.0 * core::f32::consts::SQRT_2);
        Self {
            parameters: *parameters,
            least_slope: 2.0 * max_rounding_error(count.max(1)),
            means_weight: Multiplier::new(sqrt(n * lambda * inverse)),
            left_out: Fraction::new(lambda * inverse),
            kappa: Multiplier::new(parameters.kappa * to_fine / sqrt(n)),
            rho: Fraction::new(parameters.rho),
            output_rho: Fraction::new(parameters.output_rho),
            output_kappa_power: (parameters.output_kappa.to_bits() >> 23) as i32 - 127,
        }
    }

    /// Predicts `y[t]` of one dof: fits the model to the examples and evaluates it once, with the bias of section 5.3.
    ///
    /// `input` is `[x[t-1], y[t-1], x[t]]`. Input and result have the dof's unit (m, rad, m/s or rad/s), as do `step`, its
    /// quantisation step, and `scale`, its standard deviation. Inputs are clamped to 131,072 steps, results to 2,048
    /// standard deviations from the neighbors' mean.
    // Not inlined, so that it is compiled with the core, optimised for speed.
    #[inline(never)]
    pub fn predict<const J: usize>(
        &self,
        examples: &Examples<J>,
        dof: usize,
        input: [f32; 3],
        step: f32,
        scale: f32,
    ) -> Prediction {
        match examples.scatter(dof) {
            Some(scatter) => self.evaluate(&scatter, dof, input, [step, scale]),
            None => Prediction { y: input[2], correction: 0.0, change: input[2] - input[0] },
        }
    }

    #[inline(never)]
    fn evaluate(&self, s: &Scatter, dof: usize, input: [f32; 3], [step, scale]: [f32; 2]) -> Prediction {
        let parts_per_unit = parts_per_unit(step);
        let system = self.system(s, parts_per_unit * power_of_two(-(s.bits as i32)), scale);
        // From here on in sixteenths of units.
        let bits = s.bits as i32 - FINER_BITS as i32;
        let (finer, held) = (PowerOfTwo::new(-bits), MAX_DIFFERENCE >> (-bits).clamp(0, 31));
        let held = if bits < 0 { held } else { i32::MAX };
        let [p, q, x]: [i32; 3] = core::array::from_fn(|i| {
            let parts = ((input[i] * parts_per_unit) as i32).saturating_sub(s.first[i]);
            finer.of(parts.max(-held).min(held)).clamp(-MAX_DIFFERENCE, MAX_DIFFERENCE) - s.offsets[i]
        });
        let most = (1 << SQUARE_ROOT_BITS) - 1;
        let half = self.kappa.of(sqrt_wide(s.matrix[5].clamp(0, most)));
        let outside = x - x.max(-half).min(half);
        let kept = self.rho.of(outside);
        let left_out = s.means.map(|mean| self.left_out.finely_of(mean, FINER_BITS));
        let deviation = system.evaluate([
            (p - outside).saturating_add(left_out[0]),
            (q - kept).saturating_add(left_out[1]),
            (x - outside).saturating_add(left_out[2]),
        ]);
        let from_mean = (deviation >> ANSWER_BITS).saturating_sub(left_out[3]);

        let unit = step * power_of_two(bits - FRACTION as i32);
        let finely = deviation as f32 * (1.0 / (1 << ANSWER_BITS) as f32);
        let whole = s.offsets[3].saturating_sub(left_out[3]).saturating_add(kept);
        let first = s.first[3] as f32 * (step * (1.0 / (1 << FRACTION) as f32));
        let kept_in_output = self.output_rho.of(outside);
        let mut correction = (kept_in_output - kept) as f32 * unit;
        if !self.is_near(from_mean, bits, [step, scale]) {
            let most = self.parameters.output_kappa * scale;
            let deviation = (finely - left_out[3] as f32) * unit;
            correction += clamp(deviation, -most, most) - deviation;
        }
        let mean_difference = |a: usize, b: usize| {
            (s.first[a] - s.first[b]) as f32 * (step * (1.0 / (1 << FRACTION) as f32))
                + (s.offsets[a] - s.offsets[b]) as f32 * unit
        };
        let input_change = input[2] - input[0];
        let mut change =
            mean_difference(3, 1) + self.parameters.output_rho * (input_change - mean_difference(2, 0));
        if outside != 0 && (dof::FORWARD..=dof::LEFT).contains(&dof) {
            let [outside, kept_in_output] = [outside, kept_in_output].map(|units| units as f32 * unit);
            let x = input[2];
            let travel = smoothstep(clamp(abs(x / (x - outside)), 0.0, 1.0));
            let stands = 1.0 - travel;
            correction += stands * (x - (first + s.offsets[3] as f32 * unit) - kept_in_output);
            change = travel * change + stands * input_change;
        }
        Prediction { y: first + (whole as f32 + finely) * unit, correction, change }
    }

    /// Whether an output is certainly within κy standard deviations of its neighbors' mean, by powers of two alone.
    /// Most are; the others are compared exactly. `deviation` is in parts times 2 to the power of `bits`.
    fn is_near(&self, deviation: i32, bits: i32, [step, scale]: [f32; 2]) -> bool {
        // The logarithm of the ratio, rounded down: at most one too large.
        let scale_bits = ((scale.to_bits() as i32 - step.to_bits() as i32) >> 23) - 1;
        let near = scale_bits + self.output_kappa_power + FRACTION as i32 - bits;
        bit_length(deviation) <= near
    }

    /// The normal equations. `per_unit` is units in one unit of the dof.
    fn system(&self, s: &Scatter, per_unit: f32, scale: f32) -> System {
        let Parameters { lambda, ridge, feedback, .. } = self.parameters;
        let per_unit = match ridge {
            Ridge::Raw => per_unit,
            Ridge::Normalised => per_unit * scale,
        };
        let at_least = |slope: f32| maximum(slope, self.least_slope);
        let slope = lambda * (per_unit * per_unit);
        let (slope, fed_back) = (at_least(slope), at_least(slope * feedback));
        // √w times the means: the largest has 23 or 24 bits, and its square, less `DROPPED_BITS`, 30.
        let longest = magnitude_bits(s.means);
        let spare = PowerOfTwo::new(MEAN_BITS - bit_length(longest));
        let (weight, weight_power) = self.means_weight.parts();
        let means = s.means.map(|mean| product(spare.of(mean), weight, 31));
        let means_power = 2 * (31 + weight_power - MEAN_BITS + bit_length(longest)) + DROPPED_BITS as i32;
        let largest_mean = magnitude_bits(means);
        let largest = magnitude_bits([s.matrix[0], s.matrix[2], s.matrix[5]].into_iter().chain(s.right));

        // Three numbers are added to an entry: each has two bits less.
        let of_means = if largest_mean == 0 {
            0
        } else {
            2 * bit_length(largest_mean) - DROPPED_BITS as i32 + means_power
        };
        let of_slope = exponent(maximum(fed_back, slope));
        let up = ENTRY_BITS - 2 - bit_length(largest).max(of_means).max(of_slope);
        let (of_sum, of_product) = (PowerOfTwo::new(up), PowerOfTwo::new(means_power + up));
        let entry = |sum: i32, i: usize, j: usize| {
            of_sum.of(sum) + of_product.of(product(means[i], means[j], DROPPED_BITS))
        };
        let (slope, fed_back) = (scaled(slope, up), scaled(fed_back, up));
        let [pp, qp, qq, xp, xq, xx] = s.matrix;
        let [py, qy, xy] = s.right;
        System {
            matrix: [
                entry(pp, 0, 0) + slope,
                entry(qp, 1, 0),
                entry(qq, 1, 1) + fed_back,
                entry(xp, 2, 0),
                entry(xq, 2, 1),
                entry(xx, 2, 2) + slope,
            ],
            right: [entry(py, 0, 3), entry(qy, 1, 3), entry(xy, 2, 3)],
        }
    }
}

/// Bits of what [`sqrt_wide`] takes.
const SQUARE_ROOT_BITS: u32 = crate::math::fixed::BITS;

/// Number of bits of the whole part of a positive number; 0 or negative below 1.
fn exponent(value: f32) -> i32 {
    (value.to_bits() >> 23) as i32 - 126
}

/// `value · 2^up` of a positive number, rounded down.
fn scaled(value: f32, up: i32) -> i32 {
    let mantissa = (value.to_bits() & 0x7f_ffff | 0x80_0000) as i32;
    shift(mantissa, exponent(value) - 24 + up)
}

#[cfg(test)]
mod tests;
