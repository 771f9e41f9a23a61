//! Subspace identification, N4SID (Van Overschee and De Moor 1996, chapter 4; Hsu 2005, section 4.3). Our own, since no
//! crate has it.
//!
//! From inputs `u` `[m]` and outputs `y` `[p]` of one or several stretches, the system `x' = A x + B u`,
//! `y = C x + D u`, in two steps:
//!
//! 1. Block Hankel matrices of past and future, `i` blocks each. The oblique projection `O = Y_f /_{U_f} W_p` of the
//!    future outputs along the future inputs onto the past has as many significant singular values as the system
//!    has states; its row space contains the states.
//! 2. The states at consecutive times give `A, B, C, D` by least squares.
//!
//! Only the product of the Hankel matrix with its transpose is needed, a square matrix of size 2i(m + p). It is summed
//! once; projections, singular values and least squares follow from it.
//!
//! The order is chosen as in MATLAB's `n4sid`: singular values above the middle of largest and smallest on a
//! logarithmic scale. Poles outside the unit circle are moved inside, or can't be there ([`Stability`]). Since the model is
//! simulated rather than used to predict one step from true outputs, B, C and D are estimated again by least squares on its
//! simulation (MATLAB's "focus on simulation").

use std::ops::Range;

use nalgebra::{Complex, DMatrix, DVector, Matrix2, Schur};

/// Inputs and outputs of one stretch.
#[derive(Debug, Clone)]
pub struct Signal {
    /// Inputs, shape `[m x frames]`.
    pub u: DMatrix<f64>,
    /// Outputs, shape `[p x frames]`.
    pub y: DMatrix<f64>,
}

/// How a system becomes stable.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stability {
    /// Poles of a larger magnitude get this one.
    Within(f64),
    /// A maps each block of the observability matrix to the next one, and the last to zero: no pole lies outside the unit
    /// circle (Maciejowski 1995, "Guaranteed stability with subspace methods").
    Guaranteed,
}

/// Options of the estimation.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Blocks i of past and of future.
    pub horizon: usize,
    /// The order; chosen by the singular values where left out.
    pub order: Option<usize>,
    /// Largest order that is chosen.
    pub most: usize,
    /// Variance that is added to the normalised inputs and outputs before solving: keeps the equations solvable
    /// where motion hardly varies.
    pub noise: f64,
    /// How the system is made stable.
    pub stability: Stability,
    /// Rounds of least squares over the simulation.
    pub rounds: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { horizon: 10, order: None, most: 6, noise: 3e-2, stability: Stability::Within(0.9), rounds: 1 }
    }
}

impl Options {
    /// As in Hsu 2005, section 4.3: the order by the singular values without a cap, and the stable A that a system
    /// identification routine provides. The paper names no routine but N4SID, and leaves the rest to its toolbox.
    pub fn paper() -> Self {
        Self { most: usize::MAX, stability: Stability::Guaranteed, ..Self::default() }
    }
}

/// A linear time-invariant system.
#[derive(Debug, Clone, PartialEq)]
pub struct System {
    /// `[n x n]`.
    pub a: DMatrix<f64>,
    /// `[n x m]`.
    pub b: DMatrix<f64>,
    /// `[p x n]`.
    pub c: DMatrix<f64>,
    /// `[p x m]`.
    pub d: DMatrix<f64>,
}

impl System {
    /// Number of states.
    pub fn order(&self) -> usize {
        self.a.nrows()
    }

    /// Eigenvalues of A.
    pub fn poles(&self) -> Vec<Complex<f64>> {
        if self.order() == 0 { Vec::new() } else { self.a.complex_eigenvalues().iter().copied().collect() }
    }

    /// The state that each frame leads to, from `x = 0`. Shape `[n x frames]`.
    pub fn states(&self, u: &DMatrix<f64>) -> DMatrix<f64> {
        let mut states = DMatrix::zeros(self.order(), u.ncols());
        let mut x = DVector::zeros(self.order());
        for t in 0..u.ncols() {
            x = &self.a * &x + &self.b * u.column(t);
            states.set_column(t, &x);
        }
        states
    }
}

/// Estimates a system. The first `settled` frames of each stretch are excluded from the last fit, since the simulation
/// starts at `x = 0`.
///
/// `None` if no stretch is as long as past and future together.
pub fn estimate(signals: &[Signal], settled: usize, options: &Options) -> Option<System> {
    let (m, p) = signals.first().map(|s| (s.u.nrows(), s.y.nrows()))?;
    // Short stretches: a shorter horizon, but one that the order still fits into.
    let longest = signals.iter().map(|s| s.u.ncols()).max()?;
    let horizon = options.horizon.min(longest / 3).max(2);
    let hankel = Hankel::of(signals, horizon, m, p)?;
    let (past, future) = (0..horizon, horizon..2 * horizon);
    let (projection, weights) = hankel.oblique(past, future, options.noise)?;
    // O O' = L S L': its singular values are those of L times a root of S.
    let root = regular(&weights, options.noise).cholesky()?.l();
    let svd = (&projection * root).svd(true, false);
    let u = svd.u?;
    let mut ranked: Vec<usize> = (0..svd.singular_values.len()).collect();
    ranked.sort_by(|&a, &b| svd.singular_values[b].total_cmp(&svd.singular_values[a]));
    let singular_values: Vec<f64> = ranked.iter().map(|&i| svd.singular_values[i]).collect();
    let most = options.most.min(p * (horizon - 1));
    let order = options.order.unwrap_or_else(|| order(&singular_values)).min(most);

    let gamma = DMatrix::from_fn(p * horizon, order, |r, k| u[(r, ranked[k])] * singular_values[k].sqrt());
    let mut system = hankel.system(&gamma, &projection, options.noise)?;
    match options.stability {
        Stability::Within(radius) => stabilise(&mut system.a, radius),
        Stability::Guaranteed => {
            let mut shifted = DMatrix::zeros(p * horizon, order);
            shifted.rows_mut(0, p * (horizon - 1)).copy_from(&gamma.rows(p, p * (horizon - 1)));
            system.a = gamma.pseudo_inverse(1e-12).ok()? * shifted;
        }
    }
    for _ in 0..options.rounds {
        refine_inputs(&mut system, signals, settled, options.noise);
        refine_outputs(&mut system, signals, settled, options.noise);
    }
    if options.rounds == 0 {
        refine_outputs(&mut system, signals, settled, options.noise);
    }
    Some(system)
}

/// Singular values above the middle of the largest and the smallest on a logarithmic scale; at least one.
fn order(descending: &[f64]) -> usize {
    let (Some(&largest), Some(&smallest)) = (descending.first(), descending.last()) else { return 0 };
    let middle = (largest.max(1e-300) * smallest.max(1e-300)).sqrt();
    descending.iter().filter(|&&s| s > middle).count().max(1)
}

/// Product of a block Hankel matrix `[2i blocks of u and y x columns]` with its transpose, divided by the columns.
struct Hankel {
    products: DMatrix<f64>,
    horizon: usize,
    m: usize,
    p: usize,
}

impl Hankel {
    fn of(signals: &[Signal], horizon: usize, m: usize, p: usize) -> Option<Self> {
        let block = m + p;
        let rows = 2 * horizon * block;
        let mut products = DMatrix::zeros(rows, rows);
        let mut count = 0;
        for signal in signals {
            let frames = signal.u.ncols();
            let columns = (frames + 1).saturating_sub(2 * horizon);
            let flat: Vec<f64> = (0..frames)
                .flat_map(|t| {
                    signal.u.column(t).iter().chain(signal.y.column(t).iter()).copied().collect::<Vec<_>>()
                })
                .collect();
            let hankel = DMatrix::from_fn(rows, columns, |r, t| flat[t * block + r]);
            products.gemm(1.0, &hankel, &hankel.transpose(), 1.0);
            count += columns;
        }
        (count > 0).then(|| Self { products: products / count as f64, horizon, m, p })
    }

    /// Rows of the inputs of some blocks.
    fn inputs(&self, blocks: Range<usize>) -> Vec<usize> {
        blocks.flat_map(|k| (0..self.m).map(move |i| k * (self.m + self.p) + i)).collect()
    }

    /// Rows of the outputs of some blocks.
    fn outputs(&self, blocks: Range<usize>) -> Vec<usize> {
        blocks.flat_map(|k| (self.m..self.m + self.p).map(move |i| k * (self.m + self.p) + i)).collect()
    }

    fn pick(&self, rows: &[usize], columns: &[usize]) -> DMatrix<f64> {
        DMatrix::from_fn(rows.len(), columns.len(), |i, j| self.products[(rows[i], columns[j])])
    }

    /// The past's rows: inputs, then outputs.
    fn past(&self, blocks: Range<usize>) -> Vec<usize> {
        [self.inputs(blocks.clone()), self.outputs(blocks)].concat()
    }

    /// The oblique projection as a matrix that takes the past's rows to the future outputs, and the past's products.
    fn oblique(
        &self,
        past: Range<usize>,
        future: Range<usize>,
        noise: f64,
    ) -> Option<(DMatrix<f64>, DMatrix<f64>)> {
        let (w, uf, yf) = (self.past(past), self.inputs(future.clone()), self.outputs(future));
        let known = [w.clone(), uf].concat();
        let factor = regular(&self.pick(&known, &known), noise).cholesky()?;
        let weights = factor.solve(&self.pick(&known, &yf)).transpose();
        Some((weights.columns(0, w.len()).into_owned(), self.pick(&w, &w)))
    }

    /// The system from states at two neighboring moments.
    fn system(&self, gamma: &DMatrix<f64>, projection: &DMatrix<f64>, noise: f64) -> Option<System> {
        let (i, p, m, n) = (self.horizon, self.p, self.m, gamma.ncols());
        let total = self.products.nrows();
        let next_projection = self.oblique(0..i + 1, i + 1..2 * i, noise)?.0;
        let inverse = |g: DMatrix<f64>| g.pseudo_inverse(1e-12).ok();
        let now = inverse(gamma.clone())? * projection;
        let next = inverse(gamma.rows(0, p * (i - 1)).into_owned())? * next_projection;
        // What the states and the signals of the moment are in rows of the Hankel matrix.
        let spread = |rows: &[usize], map: &DMatrix<f64>, target: &mut DMatrix<f64>, at: usize| {
            for (k, &row) in rows.iter().enumerate() {
                for r in 0..map.nrows() {
                    target[(at + r, row)] = map[(r, k)];
                }
            }
        };
        let (mut right, mut left) = (DMatrix::zeros(n + m, total), DMatrix::zeros(n + p, total));
        spread(&self.past(0..i), &now, &mut right, 0);
        spread(&self.inputs(i..i + 1), &DMatrix::identity(m, m), &mut right, n);
        spread(&self.past(0..i + 1), &next, &mut left, 0);
        spread(&self.outputs(i..i + 1), &DMatrix::identity(p, p), &mut left, n);
        let square = regular(&(&right * &self.products * right.transpose()), 1e-12);
        let cross = &right * &self.products * left.transpose();
        let theta = square.cholesky()?.solve(&cross).transpose();
        Some(System {
            a: theta.view((0, 0), (n, n)).into_owned(),
            b: theta.view((0, n), (n, m)).into_owned(),
            c: theta.view((n, 0), (p, n)).into_owned(),
            d: theta.view((n, n), (p, m)).into_owned(),
        })
    }
}

/// A symmetric matrix with a variance added to its diagonal.
fn regular(matrix: &DMatrix<f64>, noise: f64) -> DMatrix<f64> {
    let mut matrix = matrix.clone();
    for k in 0..matrix.nrows() {
        matrix[(k, k)] += noise + 1e-12 * matrix[(k, k)].abs();
    }
    matrix
}

/// Moves poles of a magnitude above `radius` to that magnitude.
pub fn stabilise(a: &mut DMatrix<f64>, radius: f64) {
    let n = a.nrows();
    let Some(schur) = (n > 0).then(|| Schur::try_new(a.clone(), 1e-13, 10_000)).flatten() else {
        return;
    };
    let (q, mut t) = schur.unpack();
    let mut k = 0;
    while k < n {
        let pair = k + 1 < n && t[(k + 1, k)].abs() > 1e-12;
        let magnitude = if pair {
            let block = Matrix2::new(t[(k, k)], t[(k, k + 1)], t[(k + 1, k)], t[(k + 1, k + 1)]);
            block.complex_eigenvalues().iter().map(|e| e.norm()).fold(0.0, f64::max)
        } else {
            t[(k, k)].abs()
        };
        let size = if pair { 2 } else { 1 };
        if magnitude > radius {
            let mut block = t.view_mut((k, k), (size, size));
            block *= radius / magnitude;
        }
        k += size;
    }
    *a = &q * t * q.transpose();
}

/// C and D by least squares of the outputs on the simulated states and the inputs.
fn refine_outputs(system: &mut System, signals: &[Signal], settled: usize, noise: f64) {
    let (n, m, p) = (system.order(), system.b.ncols(), system.d.nrows());
    let mut square = DMatrix::zeros(n + m, n + m);
    let mut cross = DMatrix::zeros(n + m, p);
    let mut count = 0;
    for signal in signals {
        let states = system.states(&signal.u);
        let first = settled.max(1);
        let Some(frames) = signal.u.ncols().checked_sub(first).filter(|f| *f > 0) else { continue };
        let known = DMatrix::from_fn(n + m, frames, |r, t| {
            if r < n { states[(r, first + t - 1)] } else { signal.u[(r - n, first + t)] }
        });
        square.gemm(1.0, &known, &known.transpose(), 1.0);
        cross.gemm(1.0, &known, &signal.y.columns(first, frames).transpose(), 1.0);
        count += frames;
    }
    // A fit to fewer frames than twice the numbers is no fit.
    if count < 2 * (n + m) {
        return;
    }
    let Some(factor) = regular(&square, noise * count as f64).cholesky() else { return };
    let theta = factor.solve(&cross).transpose();
    system.c = theta.columns(0, n).into_owned();
    system.d = theta.columns(n, m).into_owned();
}

/// B and D by least squares: given A and C, the outputs are linear in both.
fn refine_inputs(system: &mut System, signals: &[Signal], settled: usize, noise: f64) {
    let (n, m, p) = (system.order(), system.b.ncols(), system.d.nrows());
    if n == 0 {
        return;
    }
    // One column for each number of B (state by state), then of D (output by output).
    let numbers = n * m + p * m;
    let mut square = DMatrix::zeros(numbers, numbers);
    let mut cross = DVector::zeros(numbers);
    let mut count = 0;
    for signal in signals {
        let frames = signal.u.ncols();
        // Responses of the state to each number of B: x' = A x + e_k u_j.
        let mut responses = vec![DVector::<f64>::zeros(n); n * m];
        for t in 0..frames {
            if t >= settled.max(1) {
                let mut known = DMatrix::zeros(p, numbers);
                for (k, response) in responses.iter().enumerate() {
                    known.set_column(k, &(&system.c * response));
                }
                for r in 0..p {
                    for j in 0..m {
                        known[(r, n * m + r * m + j)] = signal.u[(j, t)];
                    }
                }
                square.gemm(1.0, &known.transpose(), &known, 1.0);
                cross.gemv_tr(1.0, &known, &signal.y.column(t), 1.0);
                count += p;
            }
            for k in 0..n {
                for j in 0..m {
                    let response = &mut responses[k * m + j];
                    *response = &system.a * &*response;
                    response[k] += signal.u[(j, t)];
                }
            }
        }
    }
    if count < 2 * numbers {
        return;
    }
    let Some(factor) = regular(&square, noise * count as f64).cholesky() else { return };
    let theta = factor.solve(&cross);
    system.b = DMatrix::from_fn(n, m, |k, j| theta[k * m + j]);
    system.d = DMatrix::from_fn(p, m, |r, j| theta[n * m + r * m + j]);
}

#[cfg(test)]
mod tests;
