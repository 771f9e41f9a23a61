//! Local autoregressive models: one a dof, fitted to the neighbors of a class, used once.
//!
//! `y[t] = a x[t-1] + b y[t-1] + c x[t] + d` (Xia 2015, section 5.1, eq. 2), with `λ |β|²` added to the squares.
//! Neighbors are added one at a time; only sums of products are kept, 13 a dof.
//!
//! **Precision.** The sums are taken about the first neighbor's values, which makes them small (about the query they are
//! not: it may lie far away), and in whole numbers. Each dof has a unit of its own: it begins at a small part of the dof's
//! standard deviation, and grows by powers of two when a neighbor does not fit 15 bits; the sums so far are shifted with
//! it. So no sum overflows, and the largest difference has 14 bits or more. The equations are solved in f32. The penalty
//! on `d` is carried over exactly: about `r` the constant is `e = d + a r0 + b r1 + c r2 - r3`, so
//! `λ d² = λ (e - a r0 - b r1 - c r2 + r3)²`, four more terms of the normal equations.
//!
//! **Units.** All four variables of a dof have the same unit `h`: the sums are taken in units, where radians need `λ / h²`
//! for `a, b, c` and `λ` for the constant. Dividing each dof by its scale `s` instead, **normalised**, needs `λ s² / h²`;
//! the two modes differ in one number.
//!
//! **Feedback.** Neighbors lie close together, a tenth of a dof's spread, so that a λ that keeps `b` from following its
//! own last output pulls `a` and `c` to zero too, which leaves the neighbors' mean. `b` alone may therefore be penalised
//! more: by `λ` times the feedback's penalty, which is 1 in Xia 2015.
//!
//! **Bias** (section 5.3, eqs. 6 and 7). Where `x[t]` lies outside `μ ± κ σ` of the neighbors, by `Δx`, the model
//! is evaluated at `x - Δx` and `y[t-1] - ρ Δx`, and `ρ Δx` is added to its result: content that is not in the data
//! is carried past the model.
//!
//! **Corrections** (ours) are added to a prediction on the way out. They are not fed back: the stream of predictions
//! follows the equations of Xia 2015 alone.
//!
//! *Far predictions.* After a change of class, or in motion unlike the data, the last prediction may lie far from all
//! neighbors, where the model has learnt nothing. The output, less `ρ Δx`, is therefore held within `μ ± κy s` of the
//! neighbors' mean `y[t]`, with the dof's standard deviation `s` over the database. Neighbors lie a tenth of that apart,
//! so the interval holds back only predictions that are far off.
//!
//! *Standing still.* Walking neighbors would move a standing body, since only ρ of its stillness is kept. Where the
//! root's ground velocity `x[t]` lies outside the interval and nearer to 0 than its end `e = x - Δx`, the output moves from
//! the neighbors' mean to the input's own velocity: by `(1 - p) (x - mean y[t] - ρ Δx)`, with `p = |x / e|`, up to 1. So a
//! body that stops comes to rest.

use crate::{
    blob::layout::dof,
    config::Ridge,
    math::{abs, clamp, sqrt},
    methods::mixture::{
        ridge::System,
        variables::{Example, FRACTION},
    },
    search::query::ALIGNED,
};

/// The parameters of a regression.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Parameters {
    /// λ.
    pub lambda: f32,
    /// Raw or normalised variables.
    pub ridge: Ridge,
    /// How many times λ the coefficient of `y[t-1]` is penalised with.
    pub feedback: f32,
    /// κ: half width of the interval of trust, in standard deviations.
    pub kappa: f32,
    /// κy: how far from the neighbors' mean an output may lie, in the dof's standard deviations.
    pub output_kappa: f32,
    /// ρ: how much of what lies outside is kept in the output, 0 to 1.
    pub rho: f32,
}

/// A class's prediction of one dof, in its unit.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Prediction {
    /// `y[t]`.
    pub y: f32,
    /// Added to it in the output, and not fed back.
    pub correction: f32,
}

/// Sums over the neighbors: `p`, `q`, `x`, `y` stand for `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` less the first
/// neighbor's. Of the variables in fine units, of their products in square units, which are 64 square fine ones.
#[derive(Debug, Clone, Copy)]
struct Sums {
    p: i32,
    q: i32,
    x: i32,
    y: i32,
    pp: i32,
    qp: i32,
    qq: i32,
    xp: i32,
    xq: i32,
    xx: i32,
    py: i32,
    qy: i32,
    xy: i32,
}

impl Sums {
    const ZERO: Self =
        Self { p: 0, q: 0, x: 0, y: 0, pp: 0, qp: 0, qq: 0, xp: 0, xq: 0, xx: 0, py: 0, qy: 0, xy: 0 };

    /// Takes up units that are 2 to the power of `bits` larger.
    #[cold]
    fn coarsen(&mut self, bits: u32) {
        for sum in [&mut self.p, &mut self.q, &mut self.x, &mut self.y] {
            *sum >>= bits;
        }
        let Self { pp, qp, qq, xp, xq, xx, py, qy, xy, .. } = self;
        for sum in [pp, qp, qq, xp, xq, xx, py, qy, xy] {
            *sum >>= (2 * bits).min(31);
        }
    }

    /// Adds two neighbors, in fine units.
    #[inline]
    fn add(&mut self, [[p, q, x, y], [p2, q2, x2, y2]]: [[i32; 4]; BATCH]) {
        let product = |a: [i32; BATCH], b: [i32; BATCH]| {
            ((a[0] * b[0]) >> (2 * FINE_BITS)) + ((a[1] * b[1]) >> (2 * FINE_BITS))
        };
        let [p, q, x, y] = [[p, p2], [q, q2], [x, x2], [y, y2]];
        self.p += p[0] + p[1];
        self.q += q[0] + q[1];
        self.x += x[0] + x[1];
        self.y += y[0] + y[1];
        self.pp += product(p, p);
        self.qp += product(q, p);
        self.qq += product(q, q);
        self.xp += product(x, p);
        self.xq += product(x, q);
        self.xx += product(x, x);
        self.py += product(p, y);
        self.qy += product(q, y);
        self.xy += product(x, y);
    }
}

/// Examples that are taken in together: the sums are loaded and stored once for all of them.
const BATCH: usize = 2;

/// Memory that is used within a frame alone: for the aligned window while the query is made, then for examples that have
/// not yet been added to the sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scratch<const J: usize>([Example<J>; BATCH]);

impl<const J: usize> Scratch<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = Self([[[[0; 4]; 4]; J]; BATCH]);

    /// At least [`ALIGNED`] numbers a joint, for [`Window::feature`](crate::search::query::Window::feature).
    pub fn aligned(&mut self) -> &mut [i32] {
        const { assert!(16 * BATCH >= ALIGNED) };
        self.0.as_flattened_mut().as_flattened_mut().as_flattened_mut()
    }
}

/// Bits of a neighbor's difference from the first one, in fine units. So no sum of products overflows: one is
/// 2^30 at most, and the sum of 64 that are shifted too.
const BITS: u32 = 15;
/// Bits of a dof's standard deviation in the finest units.
const SCALE_BITS: i32 = 15;
/// Fine units in a unit, as a power of two.
const FINE_BITS: u32 = 3;

/// How many bits a dof's finest unit lies above the last one of an example's variables.
fn finest_bits(step: f32, scale: f32) -> u8 {
    // Of positive numbers the bits grow with the logarithm: this is the logarithm of their ratio, rounded down.
    let scale_bits = (scale.to_bits() as i32 - step.to_bits() as i32) >> 23;
    (FRACTION as i32 + scale_bits - SCALE_BITS).clamp(0, MOST_BITS) as u8
}

/// Enough for any two variables.
const MOST_BITS: i32 = 31 - BITS as i32;

/// The examples of one class, as sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Examples<const J: usize> {
    /// The first example: what the sums are taken about, and to which it therefore adds nothing.
    first: Example<J>,
    sums: [[Sums; 4]; J],
    /// Of every dof, how many bits of the variables its unit leaves out.
    fine_bits: [[u8; 4]; J],
    /// Examples in the scratch memory, not yet in the sums.
    held: u8,
    /// Examples in all.
    count: u16,
}

impl<const J: usize> Examples<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    const NEW: Self = Self {
        first: [[[0; 4]; 4]; J],
        sums: [[Sums::ZERO; 4]; J],
        fine_bits: [[0; 4]; J],
        held: 0,
        count: 0,
    };

    /// No examples.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Forgets the examples; `dofs` has the quantisation step and the standard deviation of every dof.
    pub fn clear(&mut self, dofs: impl Iterator<Item = [f32; 2]>) {
        self.sums.as_flattened_mut().fill(Sums::ZERO);
        (self.held, self.count) = (0, 0);
        for (bits, [step, scale]) in self.fine_bits.as_flattened_mut().iter_mut().zip(dofs) {
            *bits = finest_bits(step, scale);
        }
    }

    /// How many were taken in.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Where the next example is to be written before [`add`](Self::add) takes it.
    pub fn next_slot<'a>(&'a mut self, scratch: &'a mut Scratch<J>) -> &'a mut Example<J> {
        if self.count == 0 { &mut self.first } else { &mut scratch.0[usize::from(self.held) % BATCH] }
    }

    /// The example that [`next_slot`](Self::next_slot) gave has been written.
    pub fn add(&mut self, dofs: usize, scratch: &Scratch<J>) {
        self.held += u8::from(self.count > 0);
        self.count += 1;
        if usize::from(self.held) >= BATCH {
            self.accumulate(dofs, scratch);
        }
    }

    /// The last example was added: adds what is left in the scratch memory to the sums.
    pub fn finish(&mut self, dofs: usize, scratch: &Scratch<J>) {
        if self.held > 0 {
            self.accumulate(dofs, scratch);
        }
    }

    fn accumulate(&mut self, dofs: usize, scratch: &Scratch<J>) {
        let held = usize::from(core::mem::take(&mut self.held));
        let sums = self.sums.as_flattened_mut().get_mut(..dofs).unwrap_or(&mut []);
        // The first example once more adds nothing to any sum.
        let one = |i: usize| scratch.0.get(i).filter(|_| i < held).unwrap_or(&self.first).as_flattened();
        let bits = self.fine_bits.as_flattened_mut();
        accumulate(sums, bits, self.first.as_flattened(), [one(0), one(1)]);
    }

    /// What is known of a dof of its examples; `None` of no examples.
    fn fit(&self, dof: usize) -> Option<(&Sums, Origin)> {
        let (sums, first) = (self.sums.as_flattened().get(dof)?, self.first.as_flattened().get(dof)?);
        let bits = *self.fine_bits.as_flattened().get(dof)?;
        (self.count > 0).then_some((sums, Origin::new(first, sums, bits)))
    }

    /// Mean `x[t-1]`, `y[t-1]` and `x[t]` of a dof over the examples, in steps; zeros of none.
    pub fn means(&self, dof: usize) -> [f32; 3] {
        let Some((_, Origin { first: [p, q, x, _], sums: [sp, sq, sx, _], steps })) = self.fit(dof) else {
            return [0.0; 3];
        };
        let inverse = steps / f32::from(self.count);
        [p * steps + sp * inverse, q * steps + sq * inverse, x * steps + sx * inverse]
    }

    /// Predicts `y[t]` of one dof: fits the model to the examples and evaluates it once, biased where `x` lies outside.
    ///
    /// `input` is `x[t-1]`, `y[t-1]`, `x[t]`, in the dof's unit, as is the result; `step` is the dof's quantisation
    /// step, `scale` its standard deviation.
    pub fn predict(
        &self,
        dof: usize,
        input: [f32; 3],
        step: f32,
        scale: f32,
        parameters: &Parameters,
    ) -> Prediction {
        let Some((s, Origin { first: [rp, rq, rx, ry], sums: [sp, sq, sx, sy], steps })) = self.fit(dof)
        else {
            return Prediction { y: input[2], correction: 0.0 };
        };
        let n = f32::from(self.count);
        let unit = step * steps;
        let inverse_unit = 1.0 / unit;

        let constant = parameters.lambda;
        let slope = match parameters.ridge {
            Ridge::Raw => constant * (inverse_unit * inverse_unit),
            Ridge::Normalised => constant * ((scale * inverse_unit) * (scale * inverse_unit)),
        };
        let system = System {
            matrix: [
                s.pp as f32 + slope + constant * (rp * rp),
                s.qp as f32 + constant * (rq * rp),
                s.qq as f32 + slope * parameters.feedback + constant * (rq * rq),
                s.xp as f32 + constant * (rx * rp),
                s.xq as f32 + constant * (rx * rq),
                s.xx as f32 + slope + constant * (rx * rx),
                sp - constant * rp,
                sq - constant * rq,
                sx - constant * rx,
                n + constant,
            ],
            right: [
                s.py as f32 + constant * (rp * ry),
                s.qy as f32 + constant * (rq * ry),
                s.xy as f32 + constant * (rx * ry),
                sy - constant * ry,
            ],
        };
        let [a, b, c, e] = system.solve();

        let inverse = 1.0 / n;
        let x = input[2] * inverse_unit - rx;
        let outside = beyond(x, sx * inverse, s.xx as f32 * inverse, parameters.kappa);
        let kept = parameters.rho * outside;
        let p = input[0] * inverse_unit - outside - rp;
        let q = input[1] * inverse_unit - kept - rq;
        let own = a * p + b * q + c * (x - outside) + e;
        let mean = sy * inverse;
        let mut correction = -over(own - mean, parameters.output_kappa * (scale * inverse_unit));
        if (dof::FORWARD..=dof::LEFT).contains(&dof) && outside != 0.0 {
            let x = x + rx;
            let part = clamp(abs(x / (x - outside)), 0.0, 1.0);
            correction += (1.0 - part) * (x - (mean + ry) - kept);
        }
        Prediction { y: unit * (own + ry + kept), correction: unit * correction }
    }
}

/// The first example of a dof and the sums of differences from it, in units, and the unit in quantisation steps.
struct Origin {
    first: [f32; 4],
    sums: [f32; 4],
    steps: f32,
}

impl Origin {
    fn new(first: &[i32; 4], sums: &Sums, fine_bits: u8) -> Self {
        let power = |bits: i32| f32::from_bits(((127 + bits) << 23) as u32);
        let bits = i32::from(fine_bits & 31) + FINE_BITS as i32;
        let (to_units, of_fine) = (power(-bits), power(-(FINE_BITS as i32)));
        Self {
            first: first.map(|value| value as f32 * to_units),
            sums: [sums.p, sums.q, sums.x, sums.y].map(|sum| sum as f32 * of_fine),
            steps: power(bits - FRACTION as i32),
        }
    }
}

/// Adds a batch to the sums. A function of its own, so that what is around it leaves it its registers.
#[inline(never)]
fn accumulate(sums: &mut [Sums], fine_bits: &mut [u8], first: &[[i32; 4]], [one, two]: [&[[i32; 4]]; BATCH]) {
    for (((sums, bits), first), examples) in
        sums.iter_mut().zip(fine_bits).zip(first).zip(one.iter().zip(two))
    {
        // Rows are at most 98,302 steps apart, 1.62e9 parts.
        let less = |variables: &[i32; 4]| -> [i32; 4] { core::array::from_fn(|i| variables[i] - first[i]) };
        let batch = [less(examples.0), less(examples.1)];
        // The bits of the largest.
        let size = batch.as_flattened().iter().fold(0, |size, &d| size | (d ^ (d >> 31)));
        if size >> (*bits & 31) >= 1 << BITS {
            let needed = (32 - BITS as u8).saturating_sub(size.leading_zeros() as u8);
            sums.coarsen(u32::from(needed.saturating_sub(*bits)));
            *bits = needed;
        }
        let bits = u32::from(*bits & 31);
        // Half a fine unit more, for rounding to the nearest.
        let half = (1 << bits) >> 1;
        sums.add(batch.map(|differences| differences.map(|d| (d + half) >> bits)));
    }
}

impl<const J: usize> Default for Examples<J> {
    fn default() -> Self {
        Self::new()
    }
}

/// By how much `x` lies outside `μ ± κ σ`, with the mean and the mean square of the examples (eq. 6).
#[inline(never)]
fn beyond(x: f32, mean: f32, mean_square: f32, kappa: f32) -> f32 {
    let (apart, variance) = (x - mean, mean_square - mean * mean);
    // Most are inside: no root is needed for those.
    if apart * apart <= kappa * kappa * variance {
        return 0.0;
    }
    over(apart, kappa * sqrt(variance))
}

/// What of a distance is over half the width of an interval.
#[inline(never)]
fn over(apart: f32, half: f32) -> f32 {
    apart - clamp(apart, -half, half)
}

#[cfg(test)]
mod tests {
    use super::*;

    const PARAMETERS: Parameters =
        Parameters { lambda: 0.1, ridge: Ridge::Raw, feedback: 1.0, kappa: 1.0, output_kappa: 1.5, rho: 0.5 };

    /// Ridge regression about the neighbors' own zero, in f64, with the sums written out: `y[t]` at `input`.
    fn slow(examples: &[[f64; 4]], [p, q, x]: [f64; 3], lambda: f64) -> f64 {
        let mut a: [[f64; 5]; 4] =
            core::array::from_fn(|i| core::array::from_fn(|j| if i == j { lambda } else { 0.0 }));
        for &[p, q, x, y] in examples {
            let row = [p, q, x, 1.0, y];
            for (i, sums) in a.iter_mut().enumerate() {
                for (sum, value) in sums.iter_mut().zip(row) {
                    *sum += row[i] * value;
                }
            }
        }
        // Gauss and Jordan: a positive definite matrix needs no pivots.
        for i in 0..4 {
            let pivot = a[i].map(|v| v / a[i][i]);
            for (k, row) in a.iter_mut().enumerate() {
                let factor = row[i];
                for (v, p) in row.iter_mut().zip(pivot) {
                    *v = if k == i { p } else { *v - factor * p };
                }
            }
        }
        a[0][4] * p + a[1][4] * q + a[2][4] * x + a[3][4]
    }

    #[test]
    fn any_spread_keeps_its_precision_and_none_overflows() {
        let parameters = Parameters { kappa: 1e6, output_kappa: 1e6, ..PARAMETERS };
        for n in [16, 64] {
            for spread in [1e-2, 1.0, 30.0, 1e3, 3e4_f32] {
                let (mut examples, mut scratch) = (Examples::<1>::new(), Scratch::NEW);
                examples.clear([[1.0, DEVIATION]; 4].into_iter());
                let mut all = std::vec::Vec::new();
                for i in 0..n {
                    // Small differences first: the unit grows on the way. The last ones lie at both ends.
                    let wave = |k: f32| (k * i as f32).sin() * (i + 1) as f32 / n as f32;
                    let [p, q, x] = [wave(1.3), wave(2.1), wave(0.7)];
                    let y = 0.4 * p - 0.3 * q + 0.6 * x + 0.1 * wave(5.0);
                    let variables = [p, q, x, y].map(|v| stored(100.0 + spread * v));
                    all.push(variables.map(|v| f64::from(v) / f64::from(1 << FRACTION)));
                    examples.next_slot(&mut scratch)[0][1] = variables;
                    examples.add(4, &scratch);
                }
                examples.finish(4, &scratch);
                let input = [0.2, -0.1, 0.3].map(|v| 100.0 + spread * v);
                let found = examples.predict(1, input, 1.0, DEVIATION, &parameters).y;
                let truth = slow(&all, input.map(f64::from), f64::from(parameters.lambda));
                let off = (f64::from(found) - truth).abs();
                assert!(off < 2e-4 * f64::from(spread) + 1e-3, "{n} at {spread}: {found} not {truth}");
            }
        }
    }

    /// A variable of that many steps.
    fn stored(steps: f32) -> i32 {
        (steps * (1 << FRACTION) as f32) as i32
    }

    /// Standard deviation of the dof of [`doubled`], in steps.
    const DEVIATION: f32 = 16.0;

    /// Answer and output of neighbors whose outputs are twice their last ones, in steps.
    fn doubled(output_kappa: f32, y_prev: f32) -> (f32, f32) {
        let (mut examples, mut scratch) = (Examples::<1>::new(), Scratch::NEW);
        examples.clear([[1.0, DEVIATION]; 4].into_iter());
        for i in 0..20 {
            // Between -9.5 and 9.5 steps, and x of no help.
            let y_prev = i as f32 - 9.5;
            let variables = &mut examples.next_slot(&mut scratch)[0][3];
            *variables = [0.0, y_prev, 0.0, 2.0 * y_prev].map(stored);
            examples.add(4, &scratch);
        }
        examples.finish(4, &scratch);
        let parameters = Parameters { lambda: 1e-3, output_kappa, ..PARAMETERS };
        let answer = examples.predict(3, [0.0, y_prev, 0.0], 1.0, DEVIATION, &parameters);
        (answer.y, answer.y + answer.correction)
    }

    #[test]
    fn far_off_answers_are_put_out_where_the_neighbors_are() {
        for y_prev in [-400.0, -30.0, 0.0, 4.0, 30.0, 5e5] {
            let (answer, output) = doubled(10.0 / DEVIATION, y_prev);
            assert!((answer - 2.0 * y_prev).abs() <= 1e-3 * y_prev.abs() + 1e-3, "{y_prev}: {answer}");
            // 10 steps about a mean of 0.
            let held = answer.clamp(-10.0, 10.0);
            assert!((output - held).abs() <= 1e-6 * answer.abs() + 1e-4, "{y_prev}: {output} not {held}");
            let free = doubled(1e6, y_prev);
            assert_eq!(free.0.to_bits(), answer.to_bits());
            assert_eq!(free.1.to_bits(), answer.to_bits(), "{y_prev}");
        }
    }

    #[test]
    fn a_body_that_stands_is_moved_as_it_moves() {
        let (mut examples, mut scratch) = (Examples::<2>::new(), Scratch::NEW);
        examples.clear([[0.001, 1.0]; 8].into_iter());
        for i in 0..20 {
            // Neighbors walk at 1.0 m/s, deviation 0.058, and their outputs at 0.6, in steps of a millimetre.
            let x = 1000.0 + 10.0 * (i as f32 - 9.5);
            examples.next_slot(&mut scratch)[1][0] = [x, 600.0, x, 600.0].map(stored);
            examples.add(8, &scratch);
        }
        examples.finish(8, &scratch);
        let end = 1.0 - 0.0577;
        let standing =
            |x: f32| examples.predict(dof::FORWARD, [x, 0.6, x], 0.001, 1.0, &PARAMETERS).correction;
        for x in [0.0, 0.01, 0.3, 0.9] {
            let (part, outside) = (x / end, x - end);
            let wanted = (1.0 - part) * (x - 0.6 - 0.5 * outside);
            assert!((standing(x) - wanted).abs() < 1e-3, "{x}: {} not {wanted}", standing(x));
        }
        // At rest all of the outputs' mean goes, beside what the bias takes.
        assert!((standing(0.0) - (-0.6 + 0.5 * end)).abs() < 1e-3);
        for x in [0.95, 1.0, 1.05, 2.0] {
            assert_eq!(standing(x), 0.0, "{x}");
        }
        // Not by an answer that is far off: 5 m/s fed back, of which 1.5 above the mean are put out.
        let parameters = Parameters { lambda: 1e-9, ..PARAMETERS };
        for x in [0.0, 0.5, 2.0] {
            let held = examples.predict(dof::FORWARD, [x, 0.6, x], 0.001, 0.01, &parameters);
            let free = examples.predict(dof::FORWARD, [x, 5.0, x], 0.001, 0.01, &parameters);
            assert!(free.y - held.y > 0.5, "{x}: the answer follows what is fed back, {} {}", free.y, held.y);
            let [held, free] = [held, free].map(|a| a.y + a.correction);
            assert!((held - free).abs() < 0.031, "{x}: {free} is put out, {held} without it");
        }
    }
}
