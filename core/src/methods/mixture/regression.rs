//! Local autoregressive models: one a dof, fitted to the neighbors of a class, used once.
//!
//! `y[t] = a x[t-1] + b y[t-1] + c x[t] + d` (Xia 2015, section 5.1, eq. 2), with `λ |β|²` added to the squares.
//! Neighbors are added one at a time; only sums of products are kept, 13 a dof.
//!
//! **Precision.** The sums are taken about the first neighbor's values, which makes them small and exact enough
//! for f32 (about the query they are not: it may lie far away). The penalty on `d` is carried over exactly: about
//! `r` the constant is `e = d + a r0 + b r1 + c r2 - r3`, so
//! `λ d² = λ (e - a r0 - b r1 - c r2 + r3)²`, four more terms of the normal equations.
//!
//! **Units.** Rows are stored in quantisation steps, and all four variables of a dof have the same step `h`: the
//! sums are taken in steps, where radians need `λ / h²` for `a, b, c` and `λ` for the constant. Dividing each dof by
//! its scale `s` instead, **normalised**, needs `λ s² / h²`; the two modes differ in one number.
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
    methods::mixture::ridge::System,
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

/// The variables of an example in quantisation steps, dof by dof: `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` at the places [`X_PREV`],
/// [`Y_PREV`], [`X`] and [`Y`]. The first D of the 4 J dofs are in use.
pub type Example<const J: usize> = [[[f32; 4]; 4]; J];

/// Place of `x[t-1]` among a dof's variables.
pub const X_PREV: usize = 0;
/// Place of `y[t-1]`.
pub const Y_PREV: usize = 1;
/// Place of `x[t]`.
pub const X: usize = 2;
/// Place of `y[t]`.
pub const Y: usize = 3;

/// Sums over the neighbors: `p`, `q`, `x`, `y` stand for `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` less the first
/// neighbor's.
#[derive(Debug, Clone, Copy)]
struct Sums {
    p: f32,
    q: f32,
    x: f32,
    y: f32,
    pp: f32,
    qp: f32,
    qq: f32,
    xp: f32,
    xq: f32,
    xx: f32,
    py: f32,
    qy: f32,
    xy: f32,
}

impl Sums {
    const ZERO: Self = Self {
        p: 0.0,
        q: 0.0,
        x: 0.0,
        y: 0.0,
        pp: 0.0,
        qp: 0.0,
        qq: 0.0,
        xp: 0.0,
        xq: 0.0,
        xx: 0.0,
        py: 0.0,
        qy: 0.0,
        xy: 0.0,
    };

    #[inline]
    fn add(&mut self, [p, q, x, y]: [f32; 4]) {
        self.p += p;
        self.q += q;
        self.x += x;
        self.y += y;
        self.pp += p * p;
        self.qp += q * p;
        self.qq += q * q;
        self.xp += x * p;
        self.xq += x * q;
        self.xx += x * x;
        self.py += p * y;
        self.qy += q * y;
        self.xy += x * y;
    }
}

/// Examples that are taken in together: the sums are loaded and stored once for all of them.
const BATCH: usize = 3;

/// Memory that is used within a frame alone: for the aligned window while the query is made, then for examples that have
/// not yet been added to the sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Scratch<const J: usize>([Example<J>; BATCH]);

impl<const J: usize> Scratch<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    pub const NEW: Self = Self([[[[0.0; 4]; 4]; J]; BATCH]);

    /// At least [`ALIGNED`] numbers a joint, for [`Window::feature`](crate::search::query::Window::feature).
    pub fn aligned(&mut self) -> &mut [f32] {
        const { assert!(16 * BATCH >= ALIGNED) };
        self.0.as_flattened_mut().as_flattened_mut().as_flattened_mut()
    }
}

/// The examples of one class, as sums.
#[derive(Debug, Clone)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Examples<const J: usize> {
    /// The first example: what the sums are taken about, and to which it therefore adds nothing.
    first: Example<J>,
    sums: [[Sums; 4]; J],
    /// Examples in the scratch memory, not yet in the sums.
    held: u8,
    /// Examples in all.
    count: u16,
}

impl<const J: usize> Examples<J> {
    /// As a constant that is all zeros it is written where it goes, whatever the level of optimisation.
    const NEW: Self = Self { first: [[[0.0; 4]; 4]; J], sums: [[Sums::ZERO; 4]; J], held: 0, count: 0 };

    /// No examples.
    #[inline(never)]
    pub const fn new() -> Self {
        Self::NEW
    }

    /// Forgets the examples.
    pub fn clear(&mut self) {
        self.sums.as_flattened_mut().fill(Sums::ZERO);
        (self.held, self.count) = (0, 0);
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
        accumulate(sums, self.first.as_flattened(), [one(0), one(1), one(2)]);
    }

    /// Mean `x[t-1]`, `y[t-1]` and `x[t]` of a dof over the examples, in steps; zeros of none.
    pub fn means(&self, dof: usize) -> [f32; 3] {
        let (sums, first) = (self.sums.as_flattened().get(dof), self.first.as_flattened().get(dof));
        let (Some(sums), Some(first), true) = (sums, first, self.count > 0) else { return [0.0; 3] };
        let inverse = 1.0 / f32::from(self.count);
        [first[X_PREV] + sums.p * inverse, first[Y_PREV] + sums.q * inverse, first[X] + sums.x * inverse]
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
        let (sums, first) = (self.sums.as_flattened().get(dof), self.first.as_flattened().get(dof));
        let (Some(s), Some(&[rp, rq, rx, ry])) = (sums, first) else {
            return Prediction { y: input[2], correction: 0.0 };
        };
        let n = f32::from(self.count);
        let inverse_step = 1.0 / step;

        let constant = parameters.lambda;
        let slope = match parameters.ridge {
            Ridge::Raw => constant * (inverse_step * inverse_step),
            Ridge::Normalised => constant * ((scale * inverse_step) * (scale * inverse_step)),
        };
        let system = System {
            matrix: [
                s.pp + slope + constant * (rp * rp),
                s.qp + constant * (rq * rp),
                s.qq + slope * parameters.feedback + constant * (rq * rq),
                s.xp + constant * (rx * rp),
                s.xq + constant * (rx * rq),
                s.xx + slope + constant * (rx * rx),
                s.p - constant * rp,
                s.q - constant * rq,
                s.x - constant * rx,
                n + constant,
            ],
            right: [
                s.py + constant * (rp * ry),
                s.qy + constant * (rq * ry),
                s.xy + constant * (rx * ry),
                s.y - constant * ry,
            ],
        };
        let [a, b, c, e] = system.solve();

        let inverse = 1.0 / if n > 0.0 { n } else { 1.0 };
        let x = input[2] * inverse_step - rx;
        let outside = beyond(x, s.x * inverse, s.xx * inverse, parameters.kappa);
        let kept = parameters.rho * outside;
        let p = input[0] * inverse_step - outside - rp;
        let q = input[1] * inverse_step - kept - rq;
        let own = a * p + b * q + c * (x - outside) + e;
        let mean = s.y * inverse;
        let mut correction = -over(own - mean, parameters.output_kappa * (scale * inverse_step));
        if (dof::FORWARD..=dof::LEFT).contains(&dof) && outside != 0.0 {
            let x = x + rx;
            let part = clamp(abs(x / (x - outside)), 0.0, 1.0);
            correction += (1.0 - part) * (x - (mean + ry) - kept);
        }
        Prediction { y: step * (own + ry + kept), correction: step * correction }
    }
}

/// Adds a batch to the sums. A function of its own, so that what is around it leaves it its registers.
#[inline(never)]
fn accumulate(sums: &mut [Sums], first: &[[f32; 4]], [one, two, three]: [&[[f32; 4]]; BATCH]) {
    let examples = one.iter().zip(two).zip(three);
    for ((sums, first), ((one, two), three)) in sums.iter_mut().zip(first).zip(examples) {
        let mut all = *sums;
        all.add(less(one, first));
        all.add(less(two, first));
        all.add(less(three, first));
        *sums = all;
    }
}

#[inline]
fn less(variables: &[f32; 4], first: &[f32; 4]) -> [f32; 4] {
    core::array::from_fn(|i| variables[i] - first[i])
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

    /// Answer and output of neighbors whose outputs are twice their last ones, in steps.
    fn doubled(output_kappa: f32, y_prev: f32) -> (f32, f32) {
        let (mut examples, mut scratch) = (Examples::<1>::new(), Scratch::NEW);
        for i in 0..20 {
            // Between -9.5 and 9.5 steps, and x of no help.
            let y_prev = i as f32 - 9.5;
            let variables = &mut examples.next_slot(&mut scratch)[0][3];
            *variables = [0.0, y_prev, 0.0, 2.0 * y_prev];
            examples.add(4, &scratch);
        }
        examples.finish(4, &scratch);
        let parameters = Parameters { lambda: 1e-3, output_kappa, ..PARAMETERS };
        let answer = examples.predict(3, [0.0, y_prev, 0.0], 1.0, 1.0, &parameters);
        (answer.y, answer.y + answer.correction)
    }

    #[test]
    fn far_off_answers_are_put_out_where_the_neighbors_are() {
        for y_prev in [-400.0, -30.0, 0.0, 4.0, 30.0, 5e5] {
            let (answer, output) = doubled(10.0, y_prev);
            assert!((answer - 2.0 * y_prev).abs() <= 1e-3 * y_prev.abs() + 1e-3, "{y_prev}: {answer}");
            // 10 deviations of one step about a mean of 0.
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
        for i in 0..20 {
            // Neighbors walk at 1.0 m/s, deviation 0.058, and their outputs at 0.6, in steps of a millimetre.
            let x = 1000.0 + 10.0 * (i as f32 - 9.5);
            examples.next_slot(&mut scratch)[1][0] = [x, 600.0, x, 600.0];
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
