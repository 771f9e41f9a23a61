//! Local autoregressive models: one a dof, fitted to the neighbors of a class, used once.
//!
//! `y[t] = a x[t-1] + b y[t-1] + c x[t] + d` (paper 000, section 5.1, eq. 2), with `λ |β|²` added to the squares.
//! Neighbors are taken in one at a time; what is kept of them are sums of products, 13 a dof.
//!
//! **Precision.** The sums are taken about the first neighbor's values, which makes them small and exact enough
//! for f32; the penalty on `d` is carried over exactly: about `r` the constant is `e = d + a r0 + b r1 + c r2 - r3`,
//! so `λ d² = λ (e - a r0 - b r1 - c r2 + r3)²`, four more terms of the normal equations.
//!
//! **Normalised.** Dividing each dof by its scale `s` and penalising with `λ` is the same as penalising `a, b, c`
//! with `λ s²` and `d` with `λ`; so the two modes differ in two numbers and in nothing else.
//!
//! **Bias** (section 5.3, eqs. 6 and 7). Where `x[t]` lies outside `μ ± κ σ` of the neighbors, by `Δx`, the model
//! is asked at `x - Δx` and `y[t-1] - ρ Δx`, and `ρ Δx` is added to its answer: content that the data has never
//! seen is carried past the model.

use crate::{math::sqrt, pose::Dofs, ridge::System};

/// Whether the ridge sees radians and metres, or dofs divided by their standard deviation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Ridge {
    /// Radians and metres as they are.
    #[default]
    Raw,
    /// Each dof divided by its standard deviation over the database.
    Normalised,
}

/// What a regression is told besides its data.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// λ.
    pub lambda: f32,
    /// Raw or normalised variables.
    pub ridge: Ridge,
    /// κ: half width of the interval of trust, in standard deviations.
    pub kappa: f32,
    /// ρ: how much of what lies outside is kept in the output, 0 to 1.
    pub rho: f32,
}

/// The variables of a frame: `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]`.
#[derive(Debug, Clone)]
pub struct Variables<const J: usize> {
    /// `x[t-1]`.
    pub x_prev: Dofs<J>,
    /// `y[t-1]`.
    pub y_prev: Dofs<J>,
    /// `x[t]`.
    pub x: Dofs<J>,
    /// `y[t]`.
    pub y: Dofs<J>,
}

impl<const J: usize> Variables<J> {
    /// All zero.
    pub const ZERO: Self =
        Self { x_prev: [[0.0; 4]; J], y_prev: [[0.0; 4]; J], x: [[0.0; 4]; J], y: [[0.0; 4]; J] };
}

// The sums, by what is added up.
const P: usize = 0;
const Q: usize = 1;
const X: usize = 2;
const Y: usize = 3;
const PP: usize = 4;
const QP: usize = 5;
const QQ: usize = 6;
const XP: usize = 7;
const XQ: usize = 8;
const XX: usize = 9;
const PY: usize = 10;
const QY: usize = 11;
const XY: usize = 12;
const SUMS: usize = 13;

/// Sums over the neighbors of one class: `p`, `q`, `x`, `y` stand for `x[t-1]`, `y[t-1]`, `x[t]`, `y[t]` less the
/// first neighbor's. Four dofs lie side by side, for vector units.
#[derive(Debug, Clone)]
pub struct Examples<const J: usize> {
    first: Variables<J>,
    sums: [[[f32; 4]; SUMS]; J],
    count: u16,
}

impl<const J: usize> Examples<J> {
    /// No examples.
    #[inline(never)]
    pub const fn new() -> Self {
        Self { first: Variables::ZERO, sums: [[[0.0; 4]; SUMS]; J], count: 0 }
    }

    /// Forgets the examples.
    pub fn clear(&mut self) {
        self.sums = [[[0.0; 4]; SUMS]; J];
        self.count = 0;
    }

    /// How many were taken in.
    pub fn count(&self) -> u16 {
        self.count
    }

    /// Takes in one example of `dofs` dofs.
    pub fn add(&mut self, example: &Variables<J>, dofs: usize) {
        if self.count == 0 {
            self.first = example.clone();
        }
        self.count += 1;
        let first =
            self.first.x_prev.iter().zip(&self.first.y_prev).zip(self.first.x.iter().zip(&self.first.y));
        let values = example.x_prev.iter().zip(&example.y_prev).zip(example.x.iter().zip(&example.y));
        let quads = self.sums.iter_mut().zip(values.zip(first)).take(dofs.div_ceil(4));
        for (sums, (((ps, qs), (xs, ys)), ((rp, rq), (rx, ry)))) in quads {
            for i in 0..4 {
                let (p, q) = (ps[i] - rp[i], qs[i] - rq[i]);
                let (x, y) = (xs[i] - rx[i], ys[i] - ry[i]);
                sums[P][i] += p;
                sums[Q][i] += q;
                sums[X][i] += x;
                sums[Y][i] += y;
                sums[PP][i] += p * p;
                sums[QP][i] += q * p;
                sums[QQ][i] += q * q;
                sums[XP][i] += x * p;
                sums[XQ][i] += x * q;
                sums[XX][i] += x * x;
                sums[PY][i] += p * y;
                sums[QY][i] += q * y;
                sums[XY][i] += x * y;
            }
        }
    }

    /// Mean `x[t-1]`, `y[t-1]` and `x[t]` of a dof over the examples; zeros of none.
    pub fn means(&self, dof: usize) -> [f32; 3] {
        let (quad, lane) = (dof / 4, dof % 4);
        let Some(sums) = self.sums.get(quad) else { return [0.0; 3] };
        let inverse = 1.0 / f32::from(self.count.max(1));
        let first = &self.first;
        [(P, &first.x_prev), (Q, &first.y_prev), (X, &first.x)]
            .map(|(sum, first)| first.get(quad).map_or(0.0, |f| f[lane]) + sums[sum][lane] * inverse)
    }

    /// Predicts `y[t]` of one dof: fits the model to the examples, asks it once, biased where `x` lies outside.
    ///
    /// `input` is `x[t-1]`, `y[t-1]`, `x[t]`; `scale` is the dof's standard deviation.
    pub fn predict(&self, dof: usize, input: [f32; 3], scale: f32, parameters: &Parameters) -> f32 {
        let (quad, lane) = (dof / 4, dof % 4);
        let (Some(quads), first) = (self.sums.get(quad), &self.first) else { return input[2] };
        let s: [f32; SUMS] = core::array::from_fn(|i| quads[i][lane]);
        let reference = |values: &Dofs<J>| values.get(quad).map_or(0.0, |v| v[lane]);
        let (rp, rq, rx, ry) =
            (reference(&first.x_prev), reference(&first.y_prev), reference(&first.x), reference(&first.y));
        let n = f32::from(self.count);

        let constant = parameters.lambda;
        let slope = match parameters.ridge {
            Ridge::Raw => constant,
            Ridge::Normalised => constant * (scale * scale),
        };
        let system = System {
            matrix: [
                s[PP] + slope + constant * (rp * rp),
                s[QP] + constant * (rq * rp),
                s[QQ] + slope + constant * (rq * rq),
                s[XP] + constant * (rx * rp),
                s[XQ] + constant * (rx * rq),
                s[XX] + slope + constant * (rx * rx),
                s[P] - constant * rp,
                s[Q] - constant * rq,
                s[X] - constant * rx,
                n + constant,
            ],
            right: [
                s[PY] + constant * (rp * ry),
                s[QY] + constant * (rq * ry),
                s[XY] + constant * (rx * ry),
                s[Y] - constant * ry,
            ],
        };
        let [a, b, c, e] = system.solve();

        let inverse = 1.0 / if n > 0.0 { n } else { 1.0 };
        let x = input[2] - rx;
        let outside = beyond(x, s[X] * inverse, s[XX] * inverse, parameters.kappa);
        let kept = parameters.rho * outside;
        let p = input[0] - outside - rp;
        let q = input[1] - kept - rq;
        a * p + b * q + c * (x - outside) + e + ry + kept
    }
}

impl<const J: usize> Default for Examples<J> {
    fn default() -> Self {
        Self::new()
    }
}

/// By how much `x` lies outside `μ ± κ σ`, with the mean and the mean square of the examples (eq. 6).
fn beyond(x: f32, mean: f32, mean_square: f32, kappa: f32) -> f32 {
    let half = kappa * sqrt(mean_square - mean * mean);
    if x > mean + half {
        x - (mean + half)
    } else if x < mean - half {
        x - (mean - half)
    } else {
        0.0
    }
}
